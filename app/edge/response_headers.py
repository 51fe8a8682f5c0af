"""Security headers of responses."""

from __future__ import annotations

from app.edge.asgi import Application, Message, Receive, Scope, Send

NOTHING = "default-src 'none'; form-action 'none'; frame-ancestors 'none'; base-uri 'none'"
PICTURE = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
"""Drawings contain inline styles; scripts in them are blocked."""

_ALWAYS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
_OF_PICTURES = (*_ALWAYS, (b"content-security-policy", PICTURE.encode()))
_OF_OTHERS = (*_ALWAYS, (b"content-security-policy", NOTHING.encode()))


class SecurityHeaders:
    """Adds security headers to every response; by default its content may load nothing."""

    def __init__(self, app: Application) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = dict(message.get("headers", ()))  # their names are in lower case, by ASGI
                picture = given.get(b"content-type", b"").startswith(b"image/svg+xml")
                wanted = _OF_PICTURES if picture else _OF_OTHERS
                message["headers"] = [*message.get("headers", ()), *[each for each in wanted if each[0] not in given]]
            await send(message)

        await self._app(scope, receive, secured)
