"""Login and logout pages for users with an API key."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse

from app.access.caller import caller
from app.access.keys import KeyCache, digest_of
from app.access.sessions import COOKIE, Sessions, token_of
from app.store.keys import WriteAudit
from app.web.rendering import page

router = APIRouter(include_in_schema=False)


def _local(place: str) -> str:
    """The path if it is local to this service, else the start page (no open redirects)."""
    own = place.startswith("/") and not place.startswith("//") and place.isprintable() and "\\" not in place
    return place if own else "/"


@router.get("/login")
async def form(request: Request, next: str = "/") -> Response:
    """Login form."""
    return page(request, "login.html", refused=False, next=_local(next))


@router.post("/login")
async def log_in(
    request: Request,
    key: Annotated[str, Form(max_length=200)],
    next: Annotated[str, Form(max_length=2000)] = "/",
) -> Response:
    """Begin a session and redirect to ``next``."""
    ring: KeyCache = request.app.state.keys
    sessions: Sessions = request.app.state.sessions
    found = await ring.find(digest_of(key.strip()))
    store = request.app.state.service.store
    if found is None:
        return page(request, "login.html", 401, refused=True, next=_local(next))
    await store.write(WriteAudit(found.id, "login", caller.get().address))
    token, _ = sessions.begin(found.digest)
    response = RedirectResponse(_local(next), status_code=303)
    secure = request.url.scheme == "https"
    life_s = int(sessions.life_s)
    response.set_cookie(COOKIE, token, max_age=life_s, httponly=True, samesite="strict", secure=secure, path="/")
    return response


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """End the session."""
    sessions: Sessions = request.app.state.sessions
    sessions.end(token_of(request.headers.get("cookie", "").encode()))
    response = RedirectResponse("/login", status_code=303)
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")
    return response
