"""HTML for people: the start page, a form per kind and mode, a page per run. Nothing needs JavaScript."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse
from fastapi.templating import Jinja2Templates

from app.api.bodies import parse
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS, job_of, modes_of, plots_for
from app.errors import Problem
from app.store.errors import UnknownRun
from app.store.record import RunFilter, RunStatus
from app.submission import Service
from app.web import verdicts
from app.web.fields import form_fields, request_from, split_unit

STATIC = Path(__file__).parent / "static"
_POLICY = (
    "default-src 'self'; style-src 'self'; img-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)

templates = Jinja2Templates(Path(__file__).parent / "templates")
templates.env.globals["KINDS"] = KINDS
router = APIRouter(include_in_schema=False)


def _figure(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _label(name: str) -> dict[str, str]:
    words, unit = split_unit(name)
    return {"words": words, "unit": unit}


templates.env.filters["figure"] = _figure
templates.env.filters["label"] = _label
for _filter in (verdicts.standing, verdicts.reached, verdicts.required, verdicts.margin, verdicts.used):
    templates.env.filters[_filter.__name__] = _filter


def _page(request: Request, name: str, status: int = 200, **context: Any) -> HTMLResponse:
    response = templates.TemplateResponse(request, name, context, status_code=status)
    response.headers["Content-Security-Policy"] = _POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"
    return response


def _kind_and_mode(slug: str, mode: str) -> tuple[Kind, Mode]:
    if slug not in KINDS or mode not in {str(m) for m in KINDS[slug].jobs}:
        raise Problem(404, "No such page", "there is no such kind or mode")
    return KINDS[slug], Mode(mode)


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """What there is to design, and what was designed last."""
    service: Service = request.app.state.service
    page = await service.store.list_runs(RunFilter(), None, 20)
    return _page(request, "start.html", runs=page.items)


@router.get("/designs/{slug}")
async def form(request: Request, slug: str, mode: str = "design") -> HTMLResponse:
    """The form of a kind, filled with its example."""
    kind, chosen = _kind_and_mode(slug, mode)
    return _page(request, "form.html", kind=kind, mode=chosen, fields=form_fields(kind.example(chosen)), problem=None)


@router.post("/designs/{slug}")
async def submit(request: Request, slug: str, mode: str = "design") -> Response:
    """Store the run and go to its page, or show the form again with the faults at their fields."""
    kind, chosen = _kind_and_mode(slug, mode)
    example = kind.example(chosen)
    async with request.form(max_fields=200, max_part_size=10_000) as sent:
        filled = {name: str(value) for name, value in sent.items()}
    service: Service = request.app.state.service
    try:
        body = json.dumps(request_from(example, filled)).encode()
        stored = await service.submit(kind, chosen, parse(kind.jobs[chosen].request, body), None, "")
    except Problem as problem:
        errors = {e["pointer"]: f"{e['detail']} (allowed: {e['allowed']})" for e in problem.body.get("errors", [])}
        fields = form_fields(example, filled, errors)
        shown = {field.pointer for field in fields}
        elsewhere = [text for pointer, text in errors.items() if pointer not in shown]
        return _page(
            request, "form.html", 422, kind=kind, mode=chosen, fields=fields, problem=problem.body, elsewhere=elsewhere
        )
    return RedirectResponse(f"/runs/{stored.run_id}", status_code=303)


@router.get("/runs")
async def listing(request: Request, cursor: str | None = None) -> HTMLResponse:
    """All runs, page by page."""
    service: Service = request.app.state.service
    page = await service.store.list_runs(RunFilter(), cursor, 50)
    return _page(request, "runs.html", runs=page.items, next_cursor=page.next_cursor)


@router.get("/runs/{run_id}")
async def run_page(request: Request, run_id: str) -> HTMLResponse:
    """One run: its numbers, what shaped them, and its plots."""
    service: Service = request.app.state.service
    try:
        run = json.loads(await service.shown(run_id))
    except UnknownRun:
        return _page(request, "missing.html", 404)
    result = run["result"] or {}
    numbers = {n: v for n, v in result.items() if isinstance(v, (int, float, str)) and not isinstance(v, bool)}
    succeeded = run["status"] == RunStatus.SUCCEEDED
    plots = list(plots_for(KINDS[run["kind"]], run)) if succeeded else []
    studied = run["mode"] != Mode.ACCURACY and Mode.ACCURACY in modes_of(KINDS[run["kind"]])
    return _page(request, "run.html", run=run, result=result, numbers=numbers, plots=plots, studied=studied)


@router.post("/runs/{run_id}/accuracy")
async def study_accuracy(request: Request, run_id: str) -> Response:
    """Begin to study what accuracy costs for the case of a stored run, and go to the page where it shows."""
    service: Service = request.app.state.service
    try:
        run = await service.store.get(run_id)
    except UnknownRun:
        return _page(request, "missing.html", 404)
    kind = KINDS[run.kind]
    if run.mode not in kind.jobs or Mode.ACCURACY not in modes_of(kind):
        raise Problem(409, "Nothing to study", "the accuracy of this run is no choice")
    body = b'{"spec":' + run.spec + b"}"
    asked = parse(job_of(kind, Mode.ACCURACY).request, body)
    stored = await service.submit_later(kind, Mode.ACCURACY, asked, None, "")
    return RedirectResponse(f"/runs/{stored.run_id}", status_code=303)
