"""CSRF protection: requests of a session that change something must carry the session's token."""

from __future__ import annotations

from fastapi import Request

from app.access.sessions import session
from app.errors import Problem

FIELD, HEADER = "csrf_token", "X-CSRF-Token"
MAX_FIELDS = 1000
_SAFE = ("GET", "HEAD", "OPTIONS")


async def check_csrf(request: Request) -> None:
    """Raise Problem 403 if a session's request lacks its token; requests with a key in the header need none."""
    own = session.get()
    if own is None or request.method in _SAFE:
        return
    token = request.headers.get(HEADER)
    kind = request.headers.get("content-type", "")
    if token is None and kind.startswith(("application/x-www-form-urlencoded", "multipart/form-data")):
        max_bytes = request.app.state.settings.max_body_bytes
        found = (await request.form(max_fields=MAX_FIELDS, max_part_size=max_bytes)).get(FIELD)
        token = found if isinstance(found, str) else None
    if not own.is_own(token):
        raise Problem(403, "Not from a page of this session", "reload the page and submit it again")
