"""GET /healthz, /readyz and the effects of a kind."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.designs.registry import KINDS
from app.errors import Problem
from app.submission import Service

router = APIRouter()


@router.get("/healthz", tags=["operation"], summary="Is the process alive")
async def healthz() -> dict[str, str]:
    """Answers as long as the event loop turns."""
    return {"status": "ok"}


@router.get(
    "/readyz", tags=["operation"], summary="Can it answer now", responses={503: {"description": "it is starting"}}
)
async def readyz(request: Request, response: Response) -> dict[str, object]:
    """200 once the database answers, a worker lives and all kernels are there; else 503. Tells how far each kind is."""
    service: Service = request.app.state.service
    await service.store.ping()
    alive, warmths = service.executor.ready, service.executor.warmths
    warm = all(each.state in ("warm", "failed") for each in warmths)
    response.status_code = 200 if alive and warm else 503
    return {
        "status": "ready" if alive and warm else "warming up",
        "database": "ok",
        "workers": "warm" if alive else "starting",
        "kernels": {
            each.kind: {
                "state": each.state,
                "compiled": each.compiled,
                "of": each.of,
                "remaining_s": round(each.remaining_s),
            }
            for each in warmths
        },
    }


@router.get(
    "/api/v1/effects/{kind}",
    tags=["effects"],
    summary="The effects a kind's scene can call for",
    responses={404: {"description": "there is no such kind"}},
)
async def effects(kind: str) -> dict[str, object]:
    """Each with what it adds and its a-priori measure."""
    if kind not in KINDS:
        raise Problem(404, "No such kind", "there are " + ", ".join(KINDS))
    return {"kind": kind, "effects": KINDS[kind].effects()}
