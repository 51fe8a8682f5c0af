"""The start page, and a form per kind and mode. Nothing needs JavaScript."""

from __future__ import annotations

import json

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from app.api.bodies import parse
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS
from app.errors import Problem
from app.jobs.errors import Busy
from app.jobs.warming import in_words
from app.store.record import RunFilter
from app.submission import Service
from app.web.fields import form_fields, request_from
from app.web.prefill import prefilled
from app.web.rendering import page

router = APIRouter(include_in_schema=False)


def _kind_and_mode(slug: str, mode: str) -> tuple[Kind, Mode]:
    if slug not in KINDS or mode not in {str(m) for m in KINDS[slug].jobs}:
        raise Problem(404, "No such page", "there is no such kind or mode")
    return KINDS[slug], Mode(mode)


@router.get("/")
async def start(request: Request) -> HTMLResponse:
    """What there is to design, and what was designed last."""
    service: Service = request.app.state.service
    latest = await service.store.list_runs(RunFilter(), None, 20)
    warming = [in_words(warmth) for warmth in service.executor.warmths if warmth.state != "warm"]
    return page(request, "start.html", runs=latest.items, warming=warming)


@router.get("/designs/{slug}")
async def form(request: Request, slug: str, mode: str = "design") -> HTMLResponse:
    """The form of a kind, filled with its example or with what a stored run was asked."""
    kind, chosen = _kind_and_mode(slug, mode)
    spec = await prefilled(request, kind, chosen)
    return page(request, "form.html", kind=kind, mode=chosen, fields=form_fields(spec), problem=None)


@router.post("/designs/{slug}")
async def submit(request: Request, slug: str, mode: str = "design") -> Response:
    """Store the run and go to its page, or show the form again with the faults at their fields."""
    kind, chosen = _kind_and_mode(slug, mode)
    example = await prefilled(request, kind, chosen)
    async with request.form(max_fields=200, max_part_size=10_000) as sent:
        filled = {name: str(value) for name, value in sent.items()}
    service: Service = request.app.state.service
    try:
        body = json.dumps(request_from(example, filled)).encode()
        stored = await service.submit(kind, chosen, parse(kind.jobs[chosen].request, body), None, "")
    except Busy as busy:
        problem = {"title": "Not now", "detail": str(busy)}
        fields = form_fields(example, filled)
        return page(request, "form.html", 503, kind=kind, mode=chosen, fields=fields, problem=problem)
    except Problem as problem:
        errors = {e["pointer"]: f"{e['detail']} (allowed: {e['allowed']})" for e in problem.body.get("errors", [])}
        fields = form_fields(example, filled, errors)
        shown = {field.pointer for field in fields}
        elsewhere = [text for pointer, text in errors.items() if pointer not in shown]
        return page(
            request, "form.html", 422, kind=kind, mode=chosen, fields=fields, problem=problem.body, elsewhere=elsewhere
        )
    return RedirectResponse(f"/runs/{stored.run_id}", status_code=303)
