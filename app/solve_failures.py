"""Logging and counting of solves that end without an answer."""

from __future__ import annotations

from app import metrics
from app.logging import get_logger
from app.store.record import RunRecord

logger = get_logger(__name__)


def log_fields(run: RunRecord) -> dict[str, str]:
    """Log fields that identify a run."""
    return {"run_id": run.id, "kind": run.kind, "mode": run.mode}


_EVENTS = {
    "overrun": (logger.warning, "solve_overran"),
    "memory": (logger.warning, "solve_out_of_memory"),
    "crash": (logger.error, "worker_crashed"),
    "failure": (logger.error, "solve_failed"),
}


def log_failure(reason: str, run: RunRecord, error: Exception, **more: str) -> None:
    """Log and count a solve that ended without an answer."""
    log, event = _EVENTS[reason]
    log(event, **log_fields(run), reason=str(error), **more)
    metrics.ENDED.labels(reason).inc()
