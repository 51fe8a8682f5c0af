"""GET /healthz, /startedz, /readyz, /metrics and the effects of a kind."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from app import metrics
from app.designs.registry import KINDS
from app.errors import Problem
from app.store.batch_reads import open_items
from app.store.errors import StoreError
from app.store.faults import FaultKind, StoreFault
from app.submission import Service

router = APIRouter()
_TIMEOUT_S = 4.5


@router.get("/healthz", tags=["operation"], summary="Is the process alive")
async def healthz() -> dict[str, str]:
    """Responds as long as the event loop runs."""
    return {"status": "ok"}


@router.get(
    "/startedz", tags=["operation"], summary="Has it started", responses={503: {"description": "it is starting"}}
)
async def startedz(request: Request, response: Response) -> dict[str, str]:
    """200 as soon as all kernels have been compiled once; never 503 again afterwards."""
    service: Service = request.app.state.service
    started = service.executor.warm
    response.status_code = 200 if started else 503
    return {"status": "started" if started else "starting"}


@router.get("/readyz", tags=["operation"], summary="Can it serve requests", responses={503: {"description": "not now"}})
async def readyz(request: Request, response: Response) -> dict[str, object]:
    """200 if the database accepts writes, a worker is alive and all kernels are compiled; otherwise 503. Includes the
    warm-up status of every kind."""
    service: Service = request.app.state.service
    fault = await _store_fault(service)
    executor = service.executor
    stopping = service.stopping.is_set()
    ready = executor.ready and executor.warm and fault is None and not stopping
    response.status_code = 200 if ready else 503
    return {
        "status": "ready" if ready else "stopping" if stopping else "not ready" if fault else "warming up",
        "database": fault or "ok",
        "workers": "warm" if executor.ready else "starting",
        "kernels": {
            each.kind: {
                "state": each.state,
                "compiled": each.compiled,
                "of": each.of,
                "remaining_s": round(each.remaining_s),
            }
            for each in executor.warmup_status
        },
    }


@router.get("/metrics", include_in_schema=False)
async def all_metrics(request: Request) -> Response:
    """All metrics in Prometheus format. Those of a store that does not answer stay as they were."""
    service: Service = request.app.state.service
    with suppress(StoreError, TimeoutError):
        metrics.OPEN_BATCH_ITEMS.set(await asyncio.wait_for(service.store.query(open_items), _TIMEOUT_S))
    return Response(generate_latest(), media_type=CONTENT_TYPE_LATEST)


async def _store_fault(service: Service) -> str | None:
    """The database fault, if any."""
    try:
        await asyncio.wait_for(service.store.ping(), _TIMEOUT_S)
    except StoreFault as fault:
        return str(fault.kind)
    except (StoreError, TimeoutError):
        return str(FaultKind.BUSY)
    return None


@router.get(
    "/api/v1/effects/{kind}",
    tags=["effects"],
    summary="The effects of a kind",
    responses={404: {"description": "there is no such kind"}},
)
async def effects(kind: str) -> dict[str, object]:
    """The effects of a kind, each with what it adds and how its influence is estimated."""
    if kind not in KINDS:
        raise Problem(404, "No such kind", "there are " + ", ".join(KINDS))
    return {"kind": kind, "effects": KINDS[kind].effects()}
