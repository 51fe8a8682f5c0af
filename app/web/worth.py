"""Sensitivity of a design to its limits by finite differences, where no solver reports it."""

from __future__ import annotations

import json
import math

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from app.api.bodies import parse
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.edge.disconnect import cancel_on_disconnect
from app.errors import Problem
from app.jobs.errors import Busy
from app.submission import Service
from app.web.rendering import page
from app.web.run_pages import run_of
from app.words.shaping import Loosened, loosened, sentences

router = APIRouter(include_in_schema=False)


@router.get("/runs/{run_id}/worth")
async def worth(request: Request, run_id: str) -> HTMLResponse:
    """Sentences on what shaped a design, with sensitivities. Nothing is stored."""
    run = await run_of(request, run_id)
    found = {n: await _sensitivity(request, run["kind"], run["figure"], each) for n, each in loosened(run).items()}
    return page(request, "shaped.html", shaped=sentences(run, {n: s for n, s in found.items() if s is not None}))


async def _sensitivity(request: Request, slug: str, figure: dict[str, float], each: Loosened) -> float | None:
    """d ln(objective) / d ln(limit) [-], one-sided difference towards the looser limit; None if unavailable."""
    service: Service = request.app.state.service
    kind = KINDS[slug]
    try:
        asked = parse(kind.jobs[Mode.DESIGN].request, json.dumps({**each.spec, "name": ""}).encode())
        again = await cancel_on_disconnect(request.receive, service.answer(kind, Mode.DESIGN, asked))
    except (Problem, Busy):
        return None
    if again.status != "succeeded" or again.result is None:
        return None
    value = kind.headline(Mode.DESIGN, json.loads(again.result))[1]
    if not value or not figure["value"]:
        return None
    return math.log(value / figure["value"]) / math.log(each.factor)
