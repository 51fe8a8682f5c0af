"""ASGI types and helpers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from app.errors import Problem, problem_response

Message = MutableMapping[str, Any]
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

ARRIVED = "crankwright.arrived"
"""Key of a scope: the size of the request's body [bytes], once all of it has arrived."""

CLOSE = {"Connection": "close"}
"""Close the connection after a refusal, so that the rest of the request is not read."""


def header(scope: Scope, name: bytes) -> bytes | None:
    """The value of a header, the first if repeated."""
    for key, value in scope["headers"]:
        if key == name:
            return value
    return None


async def refuse(scope: Scope, receive: Receive, send: Send, problem: Problem) -> None:
    """Respond with a problem, or with its page to whom wants one. Only once the host name is known to be the service's:
    a page has links."""
    from starlette.requests import Request

    page = getattr(getattr(scope.get("app"), "state", None), "problem_page", None)
    shown = None if page is None else page(Request(scope), problem)
    await (shown or problem_response(problem))(scope, receive, send)  # type: ignore[arg-type]
