"""The start page, and the choice of a language."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from app.designs.registry import KINDS
from app.errors import Problem
from app.jobs.warming import in_words
from app.store.record import RunFilter
from app.submission import Service
from app.web.languages import COOKIE
from app.web.rendering import page
from app.words.drawings import drawn
from app.words.languages import LANGUAGES

router = APIRouter(include_in_schema=False)
_A_YEAR_S = 365 * 24 * 3600


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """What there is to design, and what was designed last."""
    service: Service = request.app.state.service
    latest = await service.store.list_runs(RunFilter(), None, 20)
    warming = [in_words(warmth) for warmth in service.executor.warmths if warmth.state != "warm"]
    drawings = {slug: drawn(kind, kind.example(list(kind.jobs)[-1]))[0] for slug, kind in KINDS.items()}
    return page(request, "start.html", runs=latest.items, warming=warming, drawings=drawings)


@router.get("/favicon.ico")
async def icon() -> Response:
    """Where programs look for the icon that do not read pages."""
    return RedirectResponse("/static/favicon.svg", status_code=308)


@router.get("/language/{code}")
async def choose_language(code: str, back: Annotated[str, Query(max_length=2000)] = "/") -> Response:
    """Speak a language from now on, and go back to the page that it was chosen on."""
    if code not in LANGUAGES:
        raise Problem(404, "No such page", "there is no such language")
    # Back within this service only: a second slash would name another host.
    inside = back.startswith("/") and not back.startswith(("//", "/\\")) and back.isprintable()
    answer = RedirectResponse(back if inside else "/", status_code=303)
    answer.set_cookie(COOKIE, code, max_age=_A_YEAR_S, httponly=True, samesite="lax")
    return answer
