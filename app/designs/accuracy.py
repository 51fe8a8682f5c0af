"""The accuracy study of any kind: the error-against-time table of the very case that a check or a design asks for."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import BaseModel, Field, create_model

from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.schema import Entry, Strict, one_of
from solvers.accuracy import Goal, Level, Meeting, Plan, Solved, Study, Within, study

GREATEST_BUDGET_S = 60.0


class StudyRequest(Strict):
    """The case, what is wanted of a solution, and how long the levels may be timed."""

    time_budget_s: float | None = Field(
        default=None,
        ge=1e-6,
        le=1e6,
        description="what one solution may take; null: the spec's accuracy decides what is recommended",
    )
    study_budget_s: float = Field(
        default=5.0,
        ge=0.1,
        le=GREATEST_BUDGET_S,
        description="no further round of timing begins after it; the first round always ends",
    )

    def goal(self) -> Goal:
        """What the recommended level must do."""
        return Meeting(self.spec.accuracy) if self.time_budget_s is None else Within(self.time_budget_s)

    @property
    def name(self) -> str:
        return self.spec.name

    def contradictions(self) -> list[Entry]:
        return [{**found, "pointer": "/spec" + found["pointer"]} for found in self.spec.contradictions()]


class LevelResult(Strict):
    """One rung of the ladder."""

    accuracy: float
    settings: dict[str, float | int | str]
    error: float | None = Field(description="greatest relative error over the main results; null: the level failed")
    errors: dict[str, float]
    time_min_s: float
    time_median_s: float
    runs: int


class StudyResult(Strict):
    """Error against time, from loose to tight."""

    levels: list[LevelResult]
    reference: str = Field(description="how the reference was made")
    recommended: LevelResult | None = Field(
        description="the cheapest level that meets the spec's accuracy, or the best within the time"
    )


class _NoAnswer(Exception):
    """The case itself is refused or infeasible: there is nothing to measure."""

    def __init__(self, answer: Answer) -> None:
        super().__init__(answer.status)
        self.answer = answer


@cache
def study_job(kind: Kind) -> Job:
    """The study of a kind, made from its checks and designs."""
    specs = {str(mode): job.request for mode, job in kind.jobs.items() if mode in (Mode.CHECK, Mode.DESIGN)}
    request = create_model(
        f"{''.join(word.capitalize() for word in kind.slug.split('-'))}StudyRequest",
        __base__=StudyRequest,
        __doc__=StudyRequest.__doc__,
        spec=(_spec(specs), Field(description="a check or a design request of this kind")),
    )

    def run(asked: Any) -> Answer:
        mode = next(Mode(name) for name, model in specs.items() if isinstance(asked.spec, model))
        return _run(kind, kind.jobs[mode], asked)

    return Job(request, StudyResult, run, extra_s=lambda asked: asked.study_budget_s, repeatable=False)


def _spec(specs: dict[str, type[BaseModel]]) -> Any:
    """A check or a design: whichever has a field of its own in what was sent."""
    known = {name: set(model.model_fields) for name, model in specs.items()}
    own = {name: fields.difference(*(f for n, f in known.items() if n != name)) for name, fields in known.items()}

    def choose(value: Any) -> str | None:
        if isinstance(value, BaseModel):
            return next((name for name, model in specs.items() if isinstance(value, model)), None)
        if not isinstance(value, dict):
            return None
        return next((name for name, fields in own.items() if fields & value.keys()), next(iter(specs)))

    return one_of(choose, specs, "a check or a design request of this kind")


def _run(kind: Kind, job: Job, asked: Any) -> Answer:
    """Solve the case at every accuracy of the ladder."""
    last: dict[str, Answer] = {}

    def solve(accuracy: float) -> Solved:
        answer = job.run(asked.spec.model_copy(update={"accuracy": accuracy}))
        if answer.status != "succeeded" or answer.result is None:
            raise _NoAnswer(answer)
        last["answer"] = answer
        results = {name: answer.result[name] for name in kind.main_results if name in answer.result}
        for name, value in answer.result.get("dimensions", {}).items():
            results[f"dimensions.{name}"] = value
        return Solved(results, answer.accuracy["settings"] if answer.accuracy else {})

    try:
        found = study(solve, asked.goal(), Plan(time=asked.study_budget_s), job.reference(asked.spec))
    except _NoAnswer as nothing:
        return _without_study(nothing.answer)
    reached = found.recommended
    return Answer(
        status="succeeded",
        result=_result(found),
        effects=last["answer"].effects,
        accuracy={
            "requested": asked.spec.accuracy,
            "estimated": reached.error if reached else max((e for e in map(_error, found.levels)), default=0.0),
            "settings": dict(reached.settings) if reached else {},
        },
        timing={"solve_s": sum(level.time_median * level.runs for level in found.levels)},
    )


def _error(level: Level) -> float:
    return level.error or 0.0


def _without_study(answer: Answer) -> Answer:
    """A case without an answer of its own, as the answer to its study: the same refusal, one level further down."""
    problem = answer.problem
    if problem is not None and "errors" in problem:
        moved = [{**found, "pointer": "/spec" + found["pointer"]} for found in problem["errors"]]
        problem = {**problem, "errors": moved}
    return Answer(answer.status, answer.result, answer.effects, answer.accuracy, answer.timing, problem)


def _result(found: Study) -> dict[str, Any]:
    return {
        "levels": [_level(level) for level in found.levels],
        "reference": found.reference,
        "recommended": _level(found.recommended) if found.recommended else None,
    }


def _level(level: Level) -> dict[str, Any]:
    return {
        "accuracy": level.accuracy,
        "settings": dict(level.settings),
        "error": level.error,
        "errors": dict(level.errors),
        "time_min_s": level.time_min,
        "time_median_s": level.time_median,
        "runs": level.runs,
    }
