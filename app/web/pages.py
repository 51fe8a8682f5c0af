"""The start page."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from app.jobs.warming import in_words
from app.store.record import RunFilter
from app.submission import Service
from app.web.rendering import page

router = APIRouter(include_in_schema=False)


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """What there is to design, and what was designed last."""
    service: Service = request.app.state.service
    latest = await service.store.list_runs(RunFilter(), None, 20)
    warming = [in_words(warmth) for warmth in service.executor.warmths if warmth.state != "warm"]
    return page(request, "start.html", runs=latest.items, warming=warming)
