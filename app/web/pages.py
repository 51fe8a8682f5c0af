"""Start page, and selection of language and units."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from app.designs.registry import KINDS
from app.errors import Problem
from app.jobs.warming import format_status
from app.store.record import RunFilter
from app.submission import Service
from app.web.languages import COOKIE, UNITS_COOKIE, keep
from app.web.rendering import page
from app.words.drawings import drawn
from app.words.languages import LANGUAGES
from app.words.units import SYSTEMS

router = APIRouter(include_in_schema=False)


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """Start page: the kinds and the latest runs."""
    service: Service = request.app.state.service
    latest = await service.store.list_runs(RunFilter(), None, 20)
    warming = [
        (KINDS[status.kind], format_status(status))
        for status in service.executor.warmup_status
        if status.state != "warm"
    ]
    drawings = {slug: drawn(kind, kind.example(list(kind.jobs)[-1]))[0] for slug, kind in KINDS.items()}
    return page(request, "start.html", runs=latest.items, warming=warming, drawings=drawings)


@router.get("/favicon.ico")
async def icon() -> Response:
    """Default icon path, requested by clients that do not read the page's link."""
    return RedirectResponse("/static/favicon.svg", status_code=308)


@router.get("/language/{code}")
async def choose_language(code: str, back: Annotated[str, Query(max_length=2000)] = "/") -> Response:
    """Set the language cookie and redirect back."""
    if code not in LANGUAGES:
        raise Problem(404, "No such page", "there is no such language")
    return _redirect_with_cookie(COOKIE, code, back)


@router.get("/units/{code}")
async def choose_units(code: str, back: Annotated[str, Query(max_length=2000)] = "/") -> Response:
    """Set the unit system cookie and redirect back."""
    if code not in SYSTEMS:
        raise Problem(404, "No such page", "there are no such units")
    return _redirect_with_cookie(UNITS_COOKIE, code, back)


def _redirect_with_cookie(cookie: str, value: str, back: str) -> Response:
    # No open redirect: a second slash would name another host.
    inside = back.startswith("/") and not back.startswith(("//", "/\\")) and back.isprintable()
    answer = RedirectResponse(back if inside else "/", status_code=303)
    keep(answer, cookie, value)
    return answer
