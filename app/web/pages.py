"""HTML for people: the start page, the runs, a page per run. Nothing needs JavaScript; the forms are in form_pages."""

from __future__ import annotations

import json

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from app.api.bodies import parse
from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of, modes_of, plots_for
from app.errors import Problem
from app.jobs.warming import in_words
from app.store.errors import UnknownRun
from app.store.record import RunFilter, RunStatus
from app.submission import Service
from app.web.rendering import page

router = APIRouter(include_in_schema=False)


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """What there is to design, and what was designed last."""
    service: Service = request.app.state.service
    found = await service.store.list_runs(RunFilter(), None, 20)
    warming = [in_words(warmth) for warmth in service.executor.warmths if warmth.state != "warm"]
    return page(request, "start.html", runs=found.items, warming=warming)


@router.get("/runs")
async def listing(request: Request, cursor: str | None = None) -> HTMLResponse:
    """All runs, page by page."""
    service: Service = request.app.state.service
    found = await service.store.list_runs(RunFilter(), cursor, 50)
    return page(request, "runs.html", runs=found.items, next_cursor=found.next_cursor)


@router.get("/runs/{run_id}")
async def run_page(request: Request, run_id: str) -> HTMLResponse:
    """One run: its numbers, what shaped them, and its plots."""
    service: Service = request.app.state.service
    try:
        run = json.loads(await service.shown(run_id))
    except UnknownRun:
        return page(request, "missing.html", 404)
    result = run["result"] or {}
    numbers = {n: v for n, v in result.items() if isinstance(v, (int, float, str)) and not isinstance(v, bool)}
    succeeded = run["status"] == RunStatus.SUCCEEDED
    plots = list(plots_for(KINDS[run["kind"]], run)) if succeeded else []
    studied = run["mode"] != Mode.ACCURACY and Mode.ACCURACY in modes_of(KINDS[run["kind"]])
    return page(request, "run.html", run=run, result=result, numbers=numbers, plots=plots, studied=studied)


@router.post("/runs/{run_id}/accuracy")
async def study_accuracy(request: Request, run_id: str) -> Response:
    """Begin to study what accuracy costs for the case of a stored run, and go to the page where it shows."""
    service: Service = request.app.state.service
    try:
        run = await service.store.get(run_id)
    except UnknownRun:
        return page(request, "missing.html", 404)
    kind = KINDS[run.kind]
    if run.mode not in kind.jobs or Mode.ACCURACY not in modes_of(kind):
        raise Problem(409, "Nothing to study", "the accuracy of this run is no choice")
    body = b'{"spec":' + run.spec + b"}"
    asked = parse(job_of(kind, Mode.ACCURACY).request, body)
    stored = await service.submit_later(kind, Mode.ACCURACY, asked, None, "")
    return RedirectResponse(f"/runs/{stored.run_id}", status_code=303)
