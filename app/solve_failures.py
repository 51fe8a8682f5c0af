"""Solves that end without an answer: their log, their count, and what the client is told."""

from __future__ import annotations

from app import metrics
from app.designs.problems import OUT_OF_TIME, SOLVER_FAILED
from app.jobs.errors import BudgetExceeded, JobError, MemoryExceeded, SolveFailed, WorkerCrashed
from app.logging import get_logger
from app.store.record import RunRecord

logger = get_logger(__name__)

FAILURES = (BudgetExceeded, MemoryExceeded, WorkerCrashed, SolveFailed)
"""Errors of the executor that are the end of a solve."""


def log_fields(run: RunRecord) -> dict[str, str]:
    """Log fields that identify a run."""
    return {"run_id": run.id, "kind": run.kind, "mode": run.mode}


_EVENTS = {
    BudgetExceeded: (logger.warning, "solve_overran", "overrun"),
    MemoryExceeded: (logger.warning, "solve_out_of_memory", "memory"),
    WorkerCrashed: (logger.error, "worker_crashed", "crash"),
    SolveFailed: (logger.error, "solve_failed", "failure"),
}


def log_failure(run: RunRecord, error: JobError) -> None:
    """Log and count a solve that ended without an answer."""
    log, event, reason = _EVENTS[type(error)]
    traceback = {"exception": error.detail} if isinstance(error, SolveFailed) else {}
    log(event, **log_fields(run), reason=str(error), **traceback)
    metrics.ENDED.labels(reason).inc()


def problem_of(error: JobError) -> tuple[int, str, str]:
    """Status, title and detail of the problem that a failed solve is for the client."""
    if isinstance(error, BudgetExceeded):
        return 504, OUT_OF_TIME, str(error)
    if isinstance(error, MemoryExceeded):
        return 507, "The memory bound was reached", str(error)
    return 500, SOLVER_FAILED, "the solve ended without an answer"
