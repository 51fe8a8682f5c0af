"""Checks of host and origin.

Only known host names are accepted, because a foreign name can be made to resolve to this machine (DNS rebinding); IP
addresses cannot. Requests that change something are accepted only from the service's own pages (cross-site request
forgery).
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from app.addresses import LOOPBACK_NAMES, is_address
from app.edge.asgi import CLOSE, Application, Receive, Scope, Send, header
from app.errors import Problem, problem_response

_SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
_OWN_SITES = (b"same-origin", b"none")


class HostAndOriginCheck:
    """Middleware that refuses unknown host names (421) and unsafe requests from other origins (403).

    ``names`` are accepted in addition to localhost.
    """

    def __init__(self, app: Application, names: Collection[str] = ()) -> None:
        self._app = app
        self._names = {name.lower() for name in names} | LOOPBACK_NAMES

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        problem = None
        if scope["type"] == "http":
            problem = self._foreign_host(scope) or self._foreign_origin(scope)
        if problem is not None:
            await problem_response(problem)(scope, receive, send)  # type: ignore[arg-type]
        else:
            await self._app(scope, receive, send)

    def _foreign_host(self, scope: Scope) -> Problem | None:
        given = [value for name, value in scope["headers"] if name == b"host"]
        if len(given) != 1:
            return Problem(400, "Bad Request", "a request has one Host header", headers=CLOSE)
        name = host_name(given[0].decode("latin-1"))
        if name is not None and (name in self._names or is_address(name)):
            return None
        why = "the service does not answer under this host name; CRANKWRIGHT_ALLOWED_HOSTS lists those it does"
        return Problem(421, "Another host", why, headers=CLOSE)

    def _foreign_origin(self, scope: Scope) -> Problem | None:
        if scope["method"] in _SAFE_METHODS:
            return None
        site, origin = header(scope, b"sec-fetch-site"), header(scope, b"origin")
        own = origin is None or origin.partition(b"://")[2].lower() == (header(scope, b"host") or b"").lower()
        if own and (site is None or site in _OWN_SITES):
            return None
        return Problem(403, "Another site", "only pages of this service may send this", headers=CLOSE)


@lru_cache(1024)
def host_name(host: str) -> str | None:
    """The name or address in a Host header, without its port; None if it is malformed."""
    name, found, port = host.lower().rpartition(":") if not host.endswith("]") else (host.lower(), "", "")
    if not found:
        name = host.lower()
    elif not port.isdigit():
        return None
    return name.removeprefix("[").removesuffix("]").removesuffix(".") or None
