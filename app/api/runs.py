"""GET /api/v1/runs: every run ever made, one of them, and its plots."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app import runs
from app.designs.kind import Mode
from app.designs.registry import KINDS, plots_for, plots_of
from app.errors import Problem
from app.store.record import RunFilter, RunStatus
from app.submission import Service

router = APIRouter(prefix="/api/v1/runs", tags=["runs"])
_MISSING: dict[int | str, dict[str, str]] = {404: {"description": "there is no such run"}}


class SvgResponse(Response):
    """A drawing."""

    media_type = "image/svg+xml"


@router.get("", summary="List runs, newest first")
async def list_runs(
    request: Request,
    kind: str | None = None,
    mode: str | None = None,
    status: str | None = None,
    name: Annotated[str | None, Query(max_length=200)] = None,
    batch_id: str | None = None,
    created_after: datetime | None = None,
    holds: Annotated[bool | None, Query(description="runs whose verdict holds, or does not")] = None,
    cursor: Annotated[str | None, Query(max_length=200)] = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> dict[str, object]:
    """Runs that satisfy all filters; ``next_cursor`` asks for the next page."""
    if created_after is not None and created_after.tzinfo is None:
        entry = {"pointer": "/created_after", "detail": "has no time zone", "allowed": "2026-01-31T12:00:00Z"}
        raise Problem(422, "The request is not valid", "created_after needs a time zone", [entry])
    service: Service = request.app.state.service
    wanted = RunFilter(kind, mode, status, name, batch_id, created_after, holds)
    page = await service.store.list_runs(wanted, cursor, limit)
    return {"items": [runs.summary(item) for item in page.items], "next_cursor": page.next_cursor}


@router.get("/{run_id}", summary="One run", responses=_MISSING)
async def one_run(request: Request, run_id: str) -> Response:
    """The run, whatever became of it; ``progress`` while it runs, where it is a long one."""
    service: Service = request.app.state.service
    return Response(await service.shown(run_id), media_type="application/json")


@router.get(
    "/{run_id}/plots/{plot}",
    summary="A plot of a run, as SVG",
    response_class=SvgResponse,
    responses={**_MISSING, 409: {"description": "the run has nothing to draw"}},
)
async def plot(request: Request, run_id: str, plot: str) -> Response:
    """One of the kind's plots, drawn from the stored result."""
    service: Service = request.app.state.service
    run = await service.store.get(run_id)
    plots = plots_of(KINDS[run.kind], Mode(run.mode))
    if plot not in plots:
        raise Problem(404, "No such plot", "there are " + ", ".join(plots))
    if run.status != RunStatus.SUCCEEDED:
        raise Problem(409, "Nothing to draw", f"the run is {run.status}")
    shown = runs.run_json(run)
    if plot not in plots_for(KINDS[run.kind], json.loads(shown)):
        raise Problem(409, "Nothing to draw", "this run's result has nothing for this plot")
    return SvgResponse(await service.drawn(run, plot, shown))
