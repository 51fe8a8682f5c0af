"""How solves end without an answer: logged, and counted."""

from __future__ import annotations

from app import metrics
from app.logging import get_logger
from app.store.record import RunRecord

logger = get_logger(__name__)


def named(run: RunRecord) -> dict[str, str]:
    """What the log says of a run."""
    return {"run_id": run.id, "kind": run.kind, "mode": run.mode}


_CUT = {
    "overrun": (logger.warning, "solve_overran"),
    "memory": (logger.warning, "solve_out_of_memory"),
    "crash": (logger.error, "worker_crashed"),
    "failure": (logger.error, "solve_failed"),
}


def cut(reason: str, run: RunRecord, error: Exception, **more: str) -> None:
    """Log and count a solve that ended without an answer."""
    log, event = _CUT[reason]
    log(event, **named(run), reason=str(error), **more)
    metrics.ENDED.labels(reason).inc()
