"""ASGI types and helpers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any

from app.errors import Problem, problem_response

Message = MutableMapping[str, Any]
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

CLOSE = {"Connection": "close"}
"""Close the connection after a refusal, so that the rest of the request is not read."""


def header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header, the first if repeated."""
    return next((value for key, value in scope["headers"] if key == name), None)


def watching(send: Send, watch: Callable[[Message], Iterable[tuple[bytes, bytes]]]) -> Send:
    """``send`` that first passes each message of a response to ``watch``, and adds the headers it returns to the
    start."""

    async def watched(message: Message) -> None:
        headers = watch(message)
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", ()), *headers]
        await send(message)

    return watched


async def refuse(scope: Scope, receive: Receive, send: Send, problem: Problem) -> None:
    """Respond with a problem."""
    await problem_response(problem)(scope, receive, send)  # type: ignore[arg-type]
