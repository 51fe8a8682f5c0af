"""A session's changes must come from the service's own pages: each form brings the session's token back."""

from __future__ import annotations

from fastapi import Request

from app.access.sessions import session
from app.errors import Problem

FIELD, HEADER = "csrf_token", "X-CSRF-Token"
MOST_FIELDS = 1000
_SAFE = ("GET", "HEAD", "OPTIONS")


async def check_forgery(request: Request) -> None:
    """Raises Problem where a session asks for a change without its token; keys in a header need none."""
    own = session.get()
    if own is None or request.method in _SAFE:
        return
    token = request.headers.get(HEADER)
    kind = request.headers.get("content-type", "")
    if token is None and kind.startswith(("application/x-www-form-urlencoded", "multipart/form-data")):
        most = request.app.state.settings.max_body_bytes
        found = (await request.form(max_fields=MOST_FIELDS, max_part_size=most)).get(FIELD)
        token = found if isinstance(found, str) else None
    if not own.is_own(token):
        raise Problem(403, "Not from a page of this session", "load the page again and send it from there")
