"""JSON representation of a batch in the HTTP contract."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from app.store.batch_records import BatchRecord, BatchStatus
from app.store.record import utc_now


def batch_json(batch: BatchRecord) -> dict[str, Any]:
    """The batch with its counters, rate, estimated remaining time [s] and links."""
    at = f"/api/v1/batches/{batch.id}"
    rate = _rate(batch, batch.ended_at or utc_now())
    going = batch.status in (BatchStatus.QUEUED, BatchStatus.RUNNING)
    return {
        "id": batch.id,
        "kind": batch.kind,
        "mode": batch.mode,
        "name": batch.name or "",
        "detail": batch.detail,
        "status": batch.status,
        "created_at": batch.created_at.isoformat(),
        "ended_at": batch.ended_at and batch.ended_at.isoformat(),
        "items": {
            "total": batch.total,
            "done": batch.done,
            "succeeded": batch.succeeded,
            "infeasible": batch.infeasible,
            "failed": batch.failed,
            "refused": batch.refused,
            "cancelled": batch.cancelled,
        },
        "rate_per_s": rate,
        "remaining_s": (batch.total - batch.done) / rate if going and rate else 0.0 if not going else None,
        "solver": {"name": batch.solver_name, "version": batch.solver_version},
        "links": {
            "self": at,
            "page": f"/batches/{batch.id}",
            "results": f"{at}/results",
            "events": f"{at}/events",
            "runs": f"/api/v1/runs?batch_id={batch.id}",
        },
    }


def _rate(batch: BatchRecord, until: datetime) -> float | None:
    """Mean throughput since the start [items/s]."""
    if batch.started_at is None or not batch.done:
        return None
    return batch.done / max(1e-3, (until - batch.started_at).total_seconds())
