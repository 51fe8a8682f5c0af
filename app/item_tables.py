"""Curves and tables of batch items, which are stored without them: the item is solved again."""

from __future__ import annotations

import json

from app.designs.kind import Answer, Job, Mode
from app.designs.registry import KINDS, job_of
from app.json_comparison import equal_json
from app.store.hashing import canonical_json
from app.store.record import RunRecord, RunStatus


def job_of_run(run: RunRecord) -> Job:
    """The job that answered a run."""
    return job_of(KINDS[run.kind], Mode(run.mode))


def lacks_tables(run: RunRecord) -> bool:
    """Whether a run is a batch item stored without its curves and tables."""
    if run.batch_id is None or run.status != RunStatus.SUCCEEDED or run.result is None:
        return False
    tables = job_of_run(run).tables
    return bool(tables) and json.loads(run.result).keys().isdisjoint(tables)


def with_tables(run: RunRecord, answer: Answer) -> bytes | None:
    """The stored result of such an item, and the curves and tables of the new ``answer``; None if their numbers
    disagree."""
    kept = json.loads(run.result or b"{}")
    if answer.result is None or not equal_json(kept, {name: answer.result.get(name) for name in kept}):
        return None
    return canonical_json({**answer.result, **kept})
