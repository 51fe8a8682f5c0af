"""Actions on a run's page: accuracy study, rerun with an effect switched, rerun to stock sizes, cancel."""

from __future__ import annotations

import json
from typing import Annotated, Literal

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse

from app.api.bodies import parse
from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of, modes_of
from app.edge.disconnect import cancel_on_disconnect
from app.errors import PASSING, Problem, problem_of
from app.submission import Service
from app.web.form_pages import begun
from app.web.forms.faults import Faults, placed
from app.web.forms.shown_in import NAME, as_shown
from app.web.forms.tree import form_of
from app.web.run_pages import run_of, shown
from app.web.stock import FORM, rounded, stock_offer
from app.words.effects import switched
from app.words.solver_texts import spoken
from app.words.units import System, measuring

router = APIRouter(include_in_schema=False)


SHOWN_IN_MM = NAME + System.METRIC
"""Name of the input with the language in which the form of stock sizes, always in millimetres, was shown."""


def _redirect(path: str) -> Response:
    return RedirectResponse(path, status_code=303)


@router.post("/runs/{run_id}/accuracy")
async def study_accuracy(request: Request, run_id: str) -> Response:
    """Start an accuracy study of a stored run and redirect to its page."""
    run = await run_of(request, run_id)
    kind = KINDS[run["kind"]]
    if run["mode"] not in kind.jobs or Mode.ACCURACY not in modes_of(kind):
        raise Problem(409, "Nothing to study", "the accuracy of this run is no choice")
    service: Service = request.app.state.service
    asked = parse(job_of(kind, Mode.ACCURACY).request, json.dumps({"spec": run["spec"]}).encode())
    study = await service.submit_later(kind, Mode.ACCURACY, asked, None, "")
    return _redirect(f"/runs/{study.run_id}")


@router.post("/runs/{run_id}/effects")
async def switch_effect(
    request: Request,
    run_id: str,
    name: Annotated[str, Form(max_length=64)],
    state: Annotated[Literal["on", "off"], Form()],
) -> Response:
    """Rerun with one effect switched on or off, or show the form with messages at the fields that do not allow it."""
    run = await run_of(request, run_id)
    kind = KINDS[run["kind"]]
    if run["mode"] not in kind.jobs:
        raise Problem(409, "Nothing to switch", "effects are those of a design, a check or an analysis")
    mode, spec = Mode(run["mode"]), switched(run, name, state == "on")
    texts: dict[str, str] = {}
    form_of(kind, mode).take(spec, texts)
    return await begun(request, kind, mode, texts, spec)


@router.post("/runs/{run_id}/stock")
async def to_stock(
    request: Request,
    run_id: str,
    sizes: Annotated[str, Form(max_length=5000)] = "",
    width: Annotated[str, Form(max_length=40)] = "",
    length: Annotated[str, Form(max_length=40)] = "",
    language: Annotated[str, Form(max_length=40, alias=SHOWN_IN_MM)] = "",
) -> Response:
    """Redesign the strip from stock sizes and redirect to the comparison with the unrestricted design, or show the
    run's page again with messages at the faulty fields."""
    run = await run_of(request, run_id)
    if stock_offer(run) is None:
        raise Problem(409, "Nothing to round", "only a found strip without a stock of its own is rounded")
    service: Service = request.app.state.service
    kind, texts = KINDS[run["kind"]], {"sizes": sizes, "width": width, "length": length}
    with as_shown(texts | {SHOWN_IN_MM: language}):
        spec = rounded(run, texts)
    try:
        asked = parse(job_of(kind, Mode.DESIGN).request, json.dumps(spec).encode())
        work = service.submit_within(kind, Mode.DESIGN, asked, request.app.state.settings.form_patience_s)
        rounded_id = await cancel_on_disconnect(request.receive, work)
    except Problem as problem:
        with measuring(System.METRIC):
            faults = placed(FORM, texts, problem)
        return shown(request, run, 422, texts, faults)
    except PASSING as error:
        refused = problem_of(error)
        answer = shown(request, run, refused.status, texts, Faults(elsewhere=(spoken(refused.body["detail"]),)))
        answer.headers.update(refused.headers)
        return answer
    return _redirect(f"/runs/compare?a={run_id}&b={rounded_id}")


@router.get("/runs/{run_id}/accuracy")
@router.get("/runs/{run_id}/cancel")
@router.get("/runs/{run_id}/effects")
@router.get("/runs/{run_id}/stock")
async def back_to_run(request: Request, run_id: str) -> Response:
    """The run's page: what was posted here is shown with messages, from where language and units can be changed, and a
    login leads back to here."""
    await run_of(request, run_id)
    return _redirect(f"/runs/{run_id}")


@router.post("/runs/{run_id}/cancel")
async def cancel(request: Request, run_id: str) -> Response:
    """Cancel a queued or running run and redirect to its page."""
    service: Service = request.app.state.service
    await service.cancel(run_id)
    return _redirect(f"/runs/{run_id}")
