"""Construction of run records from requests and answers, and their JSON."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

from pydantic import BaseModel
from pydantic_core import from_json, to_json

from app.designs.kind import Mode
from app.designs.problems import problem_details
from app.designs.progress import Progress
from app.designs.verdict import accuracy_met
from app.encoded_answer import EncodedAnswer, offered
from app.store.hashing import canonical_json, canonical_spec
from app.store.record import OPEN_STATUSES, Finish, RunRecord, RunStatus, RunSummary, new_run_id, utc_now
from app.store.viewer import viewer
from app.version import NAME, VERSION


@dataclass(frozen=True)
class AnsweredRun(RunRecord):
    """A run just answered, with the answer as it came from the worker."""

    answer: EncodedAnswer = field(kw_only=True)


def queued(slug: str, mode: Mode, request: BaseModel) -> RunRecord:
    """A new queued run."""
    spec, digest = canonical_spec(slug, str(mode), request.model_dump(mode="json"))
    return RunRecord(
        id=new_run_id(),
        kind=slug,
        mode=str(mode),
        status=RunStatus.QUEUED,
        name=getattr(request, "name", "") or None,
        created_at=utc_now(),
        spec=spec,
        spec_hash=digest,
        solver_name=NAME,
        solver_version=VERSION,
        owner=viewer.get().owner,
    )


def answered(run: RunRecord, answer: EncodedAnswer, started: float) -> RunRecord:
    """The run with its answer; a non-finite result becomes a failure, because JSON cannot represent it."""
    if not answer.finite:
        return failed(run, 500, "The result is not finite", "the solver gave a number that is not finite", started)
    changed = {
        "status": answer.status,
        "timing": to_json({**answer.timing, "total_s": time.perf_counter() - started}),
        "holds": answer.holds,
        "figure_name": answer.figure_name,
        "figure": answer.figure,
        "answer": answer,
    }
    return AnsweredRun(**{**vars(run), **changed, **answer.parts})


def effects_of(run: RunRecord) -> tuple[tuple[str, str], ...]:
    """Name and state of each effect of a run just answered; none of a failed one."""
    return run.answer.effects if isinstance(run, AnsweredRun) else ()


def failed(run: RunRecord, status: int, title: str, detail: str, started: float) -> RunRecord:
    """The run as failed without an answer; ``status`` is the HTTP status of the problem."""
    return refused(run, problem_details(title, status, detail), started)


def refused(run: RunRecord, problem: dict[str, Any], started: float) -> RunRecord:
    """The run as failed with a problem that the solver found after a 202."""
    timing = {"total_s": time.perf_counter() - started}
    return replace(run, status=RunStatus.FAILED, problem=canonical_json(problem), timing=canonical_json(timing))


def repeated(run: RunRecord, earlier: RunRecord, started: float) -> RunRecord:
    """The run answered from an earlier one with the same spec and solver version."""
    timing = canonical_json({"solve_s": 0.0, "total_s": time.perf_counter() - started})
    return replace(run, **{**vars(end_of(earlier)), "timing": timing, "cached": True})


def end_of(run: RunRecord) -> Finish:
    """The end of an answered or failed run, for the store."""
    return Finish(**{each.name: getattr(run, each.name) for each in fields(Finish)})


def complete(run: RunRecord) -> bool:
    """Whether an answered run has all current parts; old designs and checks have no verdict."""
    judged = run.mode in (Mode.DESIGN, Mode.CHECK) and run.status == RunStatus.SUCCEEDED
    return run.verdict is not None or not judged


def met(run: RunRecord | RunSummary) -> bool:
    """Whether the run met its requested accuracy."""
    return run.accuracy is not None and accuracy_met(json.loads(run.accuracy))


def run_json(run: RunRecord, progress: Progress | None = None) -> bytes:
    """The run as JSON of the API, its stored parts included byte for byte. ``progress`` is used for open runs only."""
    shown = asdict(progress) if progress is not None and run.status in OPEN_STATUSES else None
    head = to_json({**summary(run), "progress": shown})
    parts = {
        "verdict": run.verdict,
        "spec": run.spec,
        "result": run.result,
        "problem": run.problem,
        "effects": run.effects,
        "accuracy": run.accuracy,
        "timing": run.timing,
        # At the end: whoever reads the answer wants the verdict first.
        "links": to_json(links(run)),
    }
    tail = [b',"%s":%s' % (name.encode(), value or b"null") for name, value in parts.items()]
    return b"".join([head[:-1], *tail, b"}"])


def links(run: RunRecord) -> dict[str, Any]:
    """URLs of the run, its page, plots and exports."""
    at = f"/api/v1/runs/{run.id}"
    if isinstance(run, AnsweredRun):
        plots, exports = run.answer.plots, run.answer.exports
    else:
        plots, exports = offered(run.kind, run.mode, run.status, run.result and from_json(run.result))
    return {
        "self": at,
        "page": f"/runs/{run.id}",
        "plots": {name: f"{at}/plots/{name}" for name in plots},
        "exports": {name: f"{at}/exports/{name}" for name in exports},
    }


def summary(run: RunRecord | RunSummary) -> dict[str, object]:
    """The run's entry in a listing."""
    return {
        "id": run.id,
        "kind": run.kind,
        "mode": run.mode,
        "status": run.status,
        "name": run.name or "",
        "created_at": run.created_at.isoformat(),
        "spec_hash": run.spec_hash,
        "cached": run.cached,
        "batch_id": run.batch_id,
        "holds": run.holds,
        "figure": None if run.figure is None else {"name": run.figure_name, "value": run.figure},
        "solver": {"name": run.solver_name, "version": run.solver_version},
    }
