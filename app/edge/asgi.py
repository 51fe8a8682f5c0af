"""The words of ASGI that the edge speaks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from app.errors import Problem, problem_response

Message = MutableMapping[str, Any]
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

CLOSE = {"Connection": "close"}
"""What is left of a refused request is not read: the connection ends with the answer."""


def header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header, the first where there are several."""
    return next((value for key, value in scope["headers"] if key == name), None)


async def refuse(scope: Scope, receive: Receive, send: Send, problem: Problem) -> None:
    """Answer with a problem."""
    await problem_response(problem)(scope, receive, send)  # type: ignore[arg-type]
