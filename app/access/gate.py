"""The gate: who asks, whether they may, and whose runs they see."""

from __future__ import annotations

from urllib.parse import quote

from app.access.caller import Caller, caller, name_of_address
from app.access.keys import InForce, KeyRing, digest_of
from app.access.scopes import Scope, granted, needed
from app.access.sessions import Session, Sessions, session, token_of
from app.edge.asgi import Application, Receive, Send, header, refuse
from app.edge.asgi import Scope as AsgiScope
from app.errors import Problem, store_problem
from app.store.faults import StoreFault
from app.store.keys import KeyRecord
from app.store.viewer import Viewer, viewer

_BEARER = b"bearer "
NOBODY = Viewer("nobody", everything=False)


class Gate:
    """Knows the caller, by key or session where keys are in force, else by address, and refuses what he may not.

    What lies behind finds the caller, the session and the viewer of runs in their context variables.
    """

    def __init__(self, app: Application, ring: KeyRing, sessions: Sessions, in_force: InForce) -> None:
        self._app, self._ring, self._sessions, self._in_force = app, ring, sessions, in_force

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        address = scope["client"][0] if scope.get("client") else ""
        lowest = needed(scope["method"], scope["path"])
        try:
            in_force = lowest is not None and await self._in_force()
            key, found = await self._key(scope) if in_force else (None, None)
        except StoreFault as fault:
            await refuse(scope, receive, send, store_problem(fault))
            return
        if in_force and key is None:
            await self._refuse(scope, receive, send)
            return
        if key is not None:
            scopes = granted(key.scopes)
            who, sees = Caller(key.id, address, scopes), Viewer(key.id, Scope.ADMIN in scopes)
        else:
            # Without keys everybody sees all; what needs none sees no run.
            who = Caller(name_of_address(address), address, frozenset(Scope))
            sees = Viewer() if lowest is not None else NOBODY
        tokens = caller.set(who), viewer.set(sees), session.set(found)
        try:
            if lowest is not None and lowest not in who.scopes:
                told = f"this needs a key with the scope {lowest}"
                await refuse(scope, receive, send, Problem(403, "Beyond the key's scope", told))
            else:
                await self._app(scope, receive, send)
        finally:
            caller.reset(tokens[0])
            viewer.reset(tokens[1])
            session.reset(tokens[2])

    async def _key(self, scope: AsgiScope) -> tuple[KeyRecord | None, Session | None]:
        """The valid key that comes with a request, and the session if it comes by one."""
        given = header(scope, b"authorization")
        if given is not None:
            if not given.lower().startswith(_BEARER):
                return None, None
            return await self._ring.find(digest_of(given[len(_BEARER) :].strip().decode("latin-1"))), None
        found = self._sessions.find(token_of(header(scope, b"cookie")))
        return (None, None) if found is None else (await self._ring.find(found.key_digest), found)

    async def _refuse(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        wants_page = b"text/html" in (header(scope, b"accept") or b"") and not scope["path"].startswith("/api/")
        if wants_page and scope["method"] == "GET":
            asked = scope["path"] + (f"?{scope['query_string'].decode('latin-1')}" if scope["query_string"] else "")
            place = f"/login?next={quote(asked, safe='/')}".encode()
            await send({"type": "http.response.start", "status": 303, "headers": [(b"location", place)]})
            await send({"type": "http.response.body", "body": b""})
            return
        told = "send a valid key: Authorization: Bearer cw_…"
        await refuse(scope, receive, send, Problem(401, "No valid key", told, headers={"WWW-Authenticate": "Bearer"}))
