"""Limits on request heads."""

from __future__ import annotations

from itertools import chain

from app.designs.problems import INVALID
from app.edge.asgi import CLOSE, Application, Receive, Scope, Send
from app.errors import Problem, problem_response


class HeadLimiter:
    """Middleware that refuses heads beyond ``max_bytes`` or ``max_headers``, and NUL characters in the target.

    No database stores NUL in a text, so no resource has such a name.
    """

    def __init__(self, app: Application, max_bytes: int, max_headers: int) -> None:
        self._app, self._max_bytes, self._max_headers = app, max_bytes, max_headers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        problem = self._problem(scope) if scope["type"] == "http" else None
        if problem is not None:
            await problem_response(problem)(scope, receive, send)  # type: ignore[arg-type]
        else:
            await self._app(scope, receive, send)

    def _problem(self, scope: Scope) -> Problem | None:
        headers = scope["headers"]
        if len(headers) > self._max_headers:
            return Problem(431, "Too many headers", f"at most {self._max_headers} headers are accepted", headers=CLOSE)
        if head_bytes(scope) > self._max_bytes:
            return Problem(431, "The head is too long", f"at most {self._max_bytes} bytes are accepted", headers=CLOSE)
        if "\0" in scope["path"]:
            return Problem(404, "Not Found", "there is no such path")
        if b"%00" in scope["query_string"]:
            entry = {"pointer": "", "detail": "has a NUL character in the query", "allowed": "no NUL character"}
            return Problem(422, INVALID, entry["detail"], [entry])
        return None


def head_bytes(scope: Scope) -> int:
    """Size of the head on the wire: target and headers, each with its colon and line end."""
    target = len(scope.get("raw_path") or b"") + len(scope["query_string"])
    return target + sum(map(len, chain.from_iterable(scope["headers"]))) + 4 * len(scope["headers"])
