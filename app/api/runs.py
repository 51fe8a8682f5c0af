"""GET /api/v1/runs: listing, single runs and plots."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from app import runs
from app.api.queries import check_kind, check_query_names
from app.api.validators import NOT_MODIFIED, with_tag
from app.designs.kind import Mode
from app.designs.problems import INVALID
from app.designs.registry import KINDS, plots_for, plots_of
from app.designs.schema import entry
from app.edge.disconnect import cancel_on_disconnect
from app.errors import Problem
from app.store.record import ITEM_ORDERS, RunFilter, RunOrder, RunStatus
from app.submission import Service
from app.words.languages import Language
from app.words.units import System

router = APIRouter(prefix="/api/v1/runs", tags=["runs"], dependencies=[Depends(check_query_names)])
_ANIMATION = re.compile(r"<animate [^>]*/>")
_ORDERS = (
    "name lists only runs that have a name, and is no order of the items of a batch; least and greatest list only runs "
    "that have a main figure, in the order of its values"
)
_MISSING: dict[int | str, dict[str, str]] = {404: {"description": "there is no such run"}}


def _check_time(field: str, value: datetime) -> None:
    """Raise Problem for a time without a zone, or outside the calendar in UTC."""
    if value.tzinfo is None:
        found, allowed = "has no time zone", "2026-01-31T12:00:00Z"
    elif not _has_utc(value):
        found, allowed = "is beyond the calendar", "0001-01-01T00:00:00Z to 9999-12-31T23:59:59Z"
    else:
        return
    raise Problem(422, INVALID, f"{field} {found}", [entry(f"/{field}", found, allowed)])


def _has_utc(value: datetime) -> bool:
    try:
        value.astimezone(UTC)
    except OverflowError:
        return False
    return True


class SvgResponse(Response):
    """A drawing."""

    media_type = "image/svg+xml"


@router.get("", summary="List runs")
async def list_runs(
    request: Request,
    kind: Annotated[str | None, Query(description="one of GET /api/v1/kinds")] = None,
    mode: Annotated[Mode | None, Query(description="what was requested")] = None,
    status: Annotated[RunStatus | None, Query(description="how the solve ended; see holds, too")] = None,
    name: Annotated[str | None, Query(max_length=200, description="the exact name; use text for parts of it")] = None,
    batch_id: Annotated[str | None, Query(description="only items of this batch")] = None,
    created_after: Annotated[
        datetime | None, Query(description="exclusive; a date and time with its time zone")
    ] = None,
    holds: Annotated[bool | None, Query(description="only runs whose verdict holds (true) or does not (false)")] = None,
    text: Annotated[str | None, Query(max_length=200, description="any part of the name, case-insensitive")] = None,
    created_before: Annotated[
        datetime | None, Query(description="exclusive; a date and time with its time zone")
    ] = None,
    order: Annotated[RunOrder, Query(description=_ORDERS)] = RunOrder.NEWEST,
    cursor: Annotated[str | None, Query(max_length=2000, description="next_cursor of the previous page")] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="runs per page")] = 50,
) -> dict[str, object]:
    """Runs matching all filters; ``next_cursor`` requests the next page and is null on the last one. A search for a
    name among the items of a large batch takes many pages, some of which may have no item."""
    for field, value in (("created_after", created_after), ("created_before", created_before)):
        if value is not None:
            _check_time(field, value)
    check_kind(kind)
    if batch_id is not None and order not in ITEM_ORDERS:
        found = entry("/order", "is no order of the items of a batch", ", ".join(ITEM_ORDERS))
        raise Problem(422, INVALID, "items of a batch have no order by name", [found])
    service: Service = request.app.state.service
    wanted = RunFilter(kind, mode, status, name, batch_id, created_after, holds, text, created_before)
    page = await service.store.list_runs(wanted, cursor, limit, order)
    items = [runs.summary(item) for item in page.items]
    return {"items": items, "next_cursor": page.next_cursor, "damaged": list(page.damaged)}


@router.get("/{run_id}", summary="One run", responses={**NOT_MODIFIED, **_MISSING})
async def one_run(request: Request, run_id: str) -> Response:
    """The run, whatever its status; with ``progress`` while a long one is running."""
    service: Service = request.app.state.service
    found = Response(
        await service.as_json(run_id), media_type="application/json", headers={"Cache-Control": "private, no-cache"}
    )
    return with_tag(request, found)


@router.delete(
    "/{run_id}",
    summary="Cancel a run",
    responses={**_MISSING, 409: {"description": "the run has ended; nothing is ever deleted"}},
)
async def cancel(request: Request, run_id: str) -> Response:
    """Cancel a queued or running run and its solve; the run stays stored."""
    service: Service = request.app.state.service
    return Response(await service.cancel(run_id), media_type="application/json")


@router.get(
    "/{run_id}/plots/{plot}",
    summary="A plot of a run, as SVG",
    response_class=SvgResponse,
    responses={
        **NOT_MODIFIED,
        **_MISSING,
        409: {"description": "the run has nothing to draw"},
        504: {"description": "the plot took longer to draw than the solve time limit of the service; see Retry-After"},
    },
)
async def plot(
    request: Request,
    run_id: str,
    plot: str,
    still: Annotated[bool, Query(description="an animated plot as a still picture")] = False,
    language: Annotated[Language, Query(description="language of the labels")] = Language.EN,
    units: Annotated[System, Query(description="units of the labels")] = System.METRIC,
) -> Response:
    """One of the kind's plots, drawn from the stored result."""
    service: Service = request.app.state.service
    run = await service.complete(run_id)
    plots = plots_of(KINDS[run.kind], Mode(run.mode))
    if plot not in plots:
        raise Problem(404, "No such plot", "there are " + ", ".join(plots) if plots else "the run has none")
    if run.status != RunStatus.SUCCEEDED:
        raise Problem(409, "Nothing to draw", f"the run is {run.status}")
    shown = runs.run_json(run)
    if plot not in plots_for(KINDS[run.kind], json.loads(shown)):
        raise Problem(409, "Nothing to draw", "this run's result has nothing for this plot")
    drawn = await cancel_on_disconnect(request.receive, service.plot(run, plot, shown, language, units))
    if still:
        drawn = _ANIMATION.sub("", drawn)
    return with_tag(request, SvgResponse(drawn, headers={"Cache-Control": "private, max-age=3600"}))
