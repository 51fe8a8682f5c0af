"""Authentication and authorisation of requests."""

from __future__ import annotations

from urllib.parse import quote

from app.access.caller import Caller, caller, name_of_address
from app.access.keys import KeyCache, KeysRequired, digest_of
from app.access.scopes import Scope, granted, needed
from app.access.sessions import Session, Sessions, session, token_of
from app.edge.asgi import Application, Receive, Send, header, refuse
from app.edge.asgi import Scope as AsgiScope
from app.errors import Problem, store_problem
from app.store.faults import StoreFault
from app.store.keys import KeyRecord
from app.store.viewer import Viewer, viewer

_BEARER = b"bearer "
NO_RUNS = Viewer("nobody", everything=False)
_ALL_SCOPES = frozenset(Scope)


class Authentication:
    """Middleware that identifies the caller by key or session where keys are required, else by address, and checks the
    scope.

    It sets the context variables of caller, session and viewer.
    """

    def __init__(self, app: Application, ring: KeyCache, sessions: Sessions, keys_required: KeysRequired) -> None:
        self._app, self._ring, self._sessions, self._keys_required = app, ring, sessions, keys_required

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        address = scope["client"][0] if scope.get("client") else ""
        required = needed(scope["method"], scope["path"])
        try:
            keys_required = required is not None and await self._keys_required()
            key, found = await self._key(scope) if keys_required else (None, None)
        except StoreFault as fault:
            await refuse(scope, receive, send, store_problem(fault))
            return
        if keys_required and key is None:
            await self._refuse(scope, receive, send)
            return
        if key is not None:
            scopes = granted(key.scopes)
            who, sees = Caller(key.id, address, scopes), Viewer(key.id, Scope.ADMIN in scopes)
        else:
            # Without keys, every run is visible; public paths see none.
            who = Caller(name_of_address(address), address, _ALL_SCOPES)
            sees = Viewer() if required is not None else NO_RUNS
        tokens = caller.set(who), viewer.set(sees), session.set(found)
        try:
            if required is not None and required not in who.scopes:
                detail = f"a key with the scope {required} is required"
                await refuse(scope, receive, send, Problem(403, "Beyond the key's scope", detail))
            else:
                await self._app(scope, receive, send)
        finally:
            caller.reset(tokens[0])
            viewer.reset(tokens[1])
            session.reset(tokens[2])

    async def _key(self, scope: AsgiScope) -> tuple[KeyRecord | None, Session | None]:
        """The request's valid key, and its session if it came by one."""
        given = header(scope, b"authorization")
        if given is not None:
            if not given.lower().startswith(_BEARER):
                return None, None
            return await self._ring.find(digest_of(given[len(_BEARER) :].strip().decode("latin-1"))), None
        found = self._sessions.find(token_of(header(scope, b"cookie")))
        return (None, None) if found is None else (await self._ring.find(found.key_digest), found)

    async def _refuse(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        wants_page = b"text/html" in (header(scope, b"accept") or b"") and not scope["path"].startswith("/api/")
        if wants_page:
            # An address that a form is sent to leads to the form's page, too, when it is opened.
            asked = scope["path"] + (f"?{scope['query_string'].decode('latin-1')}" if scope["query_string"] else "")
            location = f"/login?next={quote(asked, safe='/')}".encode()
            await send({"type": "http.response.start", "status": 303, "headers": [(b"location", location)]})
            await send({"type": "http.response.body", "body": b""})
            return
        detail = "send a valid key: Authorization: Bearer cw_…"
        await refuse(scope, receive, send, Problem(401, "No valid key", detail, headers={"WWW-Authenticate": "Bearer"}))
