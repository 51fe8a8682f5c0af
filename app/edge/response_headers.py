"""Security headers of responses."""

from __future__ import annotations

from app.edge.asgi import Application, Message, Receive, Scope, Send, watching

NOTHING = "default-src 'none'; form-action 'none'; frame-ancestors 'none'; base-uri 'none'"
PICTURE = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
"""Drawings contain inline styles; scripts in them are blocked."""

_ALWAYS = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
}


class SecurityHeaders:
    """Adds security headers to every response; by default its content may load nothing."""

    def __init__(self, app: Application) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        await self._app(scope, receive, watching(send, _missing))


def _missing(message: Message) -> list[tuple[bytes, bytes]]:
    names = {name.lower(): value for name, value in message.get("headers", ())}
    policy = PICTURE if names.get(b"content-type", b"").startswith(b"image/svg+xml") else NOTHING
    wanted = _ALWAYS | {b"content-security-policy": policy.encode()}
    return [(name, value) for name, value in wanted.items() if name not in names]
