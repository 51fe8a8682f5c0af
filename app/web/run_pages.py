"""Pages of runs: list, comparison, single run."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from app.designs.accuracy import STEPS
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS, modes_of, plots_for
from app.errors import Problem
from app.store.errors import UnknownRun
from app.store.record import OPEN_STATUSES, RunFilter, RunStatus
from app.submission import Service
from app.web.comparison import compare
from app.web.downloads import downloads_of
from app.web.forms.faults import Faults, faults_of
from app.web.forms.nodes import Texts
from app.web.listing import Listing, asked_of
from app.web.rendering import page
from app.web.stock import stock_offer
from app.words.captions import captioned
from app.words.drawings import part_of
from app.words.effects import effect_rows
from app.words.fields import choice
from app.words.inputs import groups
from app.words.shaping import loosened, sentences
from app.words.solver_texts import spoken

router = APIRouter(include_in_schema=False)
_PAGE_SIZE = 50
_SHOWN_ELSEWHERE = ("value", "value_unit", "reference", "reference_accuracy")
"""Results shown elsewhere on the page under a clearer label."""


async def run_of(request: Request, run_id: str) -> dict[str, Any]:
    """A run as parsed JSON."""
    service: Service = request.app.state.service
    try:
        return json.loads(await service.as_json(run_id, complete=True))
    except UnknownRun:
        raise Problem(404, "No such run", "no run has this id") from None


@router.get("/runs")
async def listing(request: Request) -> HTMLResponse:
    """Paginated list of the runs that match the filter."""
    service: Service = request.app.state.service
    asked = asked_of(request.query_params)
    found = await service.store.list_runs(asked.wanted, asked.cursor, _PAGE_SIZE, asked.order)
    return page(
        request, "runs.html", 422 if asked.errors else 200, asked=asked, runs=found.items, **_paging(asked, found)
    )


def _paging(asked: Listing, found: Any) -> dict[str, Any]:
    return {
        "next_page": found.next_cursor and asked.link(cursor=found.next_cursor),
        "first_page": asked.link() if asked.cursor else None,
        "damaged": found.damaged,
    }


@router.get("/runs/compare")
async def comparison(
    request: Request,
    a: str | None = None,
    b: str | None = None,
    run: Annotated[list[str] | None, Query(max_length=10)] = None,
) -> HTMLResponse:
    """Compare two runs of one kind; given a single run, list the candidates."""
    service: Service = request.app.state.service
    ids = [each for each in (a, b, *(run or ())) if each]
    found = [await run_of(request, each) for each in ids[:2]]
    if len(ids) == 2 and found[0]["kind"] == found[1]["kind"]:
        faults = [faults_of(each["problem"]) for each in found]
        return page(request, "compare.html", a=found[0], b=found[1], compared=compare(*found), faults=faults)
    kind = found[0]["kind"] if found else None
    others = await service.store.list_runs(RunFilter(kind=kind), None, _PAGE_SIZE)
    chosen = found[0] if found else None
    kinds_differ = len(found) == 2
    return page(
        request,
        "choose.html",
        422 if kinds_differ or len(ids) > 2 else 200,
        chosen=chosen,
        runs=[each for each in others.items if chosen is None or each.id != chosen["id"]],
        kinds_differ=kinds_differ,
        too_many=len(ids) > 2,
    )


def _numbers(kind: Kind, mode: str, result: dict[str, Any]) -> dict[str, Any]:
    """The scalars of a result in the order of its model, with choices in words; without standard uncertainties, which
    are shown with their results."""
    names = [*kind.jobs[Mode(mode)].result.model_fields] if mode in kind.jobs else []
    found = {}
    for name in [*names, *(other for other in result if other not in names)]:
        value, uncertainty = result.get(name), name.endswith("_u") and name.removesuffix("_u") in result
        if isinstance(value, (int, float, str)) and not isinstance(value, bool) and not uncertainty:
            found[name] = choice(kind, name, value) or value
    return {name: value for name, value in found.items() if name not in _SHOWN_ELSEWHERE}


@router.get("/runs/{run_id}")
async def run_page(request: Request, run_id: str) -> HTMLResponse:
    """Page of one run: verdict, results, what shaped them, figures and actions."""
    return shown(request, await run_of(request, run_id))


def shown(
    request: Request,
    run: dict[str, Any],
    status: int = 200,
    stock_texts: Texts | None = None,
    stock_faults: Faults | None = None,
) -> HTMLResponse:
    """A run's page; with what was entered as stock sizes and what is wrong with it."""
    kind, result = KINDS[run["kind"]], run["result"] or {}
    numbers = _numbers(kind, run["mode"], result)
    succeeded = run["status"] == RunStatus.SUCCEEDED
    own = run["mode"] in kind.jobs
    return page(
        request,
        "run.html",
        status,
        run=run,
        kind=kind,
        result=result,
        numbers=numbers,
        faults=faults_of(run["problem"]),
        steps={step: spoken(step) for step in STEPS},
        open=run["status"] in OPEN_STATUSES,
        plots=captioned(run["kind"], plots_for(kind, run)) if succeeded else [],
        studied=own and succeeded and Mode.ACCURACY in modes_of(kind),
        again=own,
        checkable=run["mode"] == Mode.DESIGN and succeeded and Mode.CHECK in kind.jobs,
        inputs=groups(run),
        shaped=sentences(run),
        worth=bool(loosened(run)),
        effects=effect_rows(kind, run),
        switchable=own and run["status"] not in OPEN_STATUSES,
        stock=stock_texts or stock_offer(run),
        stock_faults=stock_faults or Faults(),
        drawn=part_of(kind, run) if own else None,
        downloads=downloads_of(run),
    )
