"""The accuracy study of any kind: error against time for a given case, and the influence and cost of each effect."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, create_model

from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.progress import Counter, Report, ignore_progress
from app.designs.schema import EffectChoice, Entry, Strict, accuracy_json, one_of
from solvers.accuracy import Goal, Level, Meeting, Plan, Reference, Solved, Study, Within, closest_proof, study
from solvers.effect_costs import RUNS as EFFECT_RUNS
from solvers.effect_costs import Chosen, EffectCost, effect_costs
from solvers.outcome import Accuracy

MAX_BUDGET_S = 60.0
STEPS = REFERENCE, LADDER, TIGHTEST, EFFECTS = (
    "an independent reference",
    "solving at different accuracies",
    "the tightest solution",
    "each effect turned on or off",
)
"""Names of a study's steps, as reported by its progress."""
_REFERENCE_SHARE, _LEVELS_SHARE, _EFFECTS_SHARE = 0.4, 0.4, 0.2
"""Shares of the study's time budget."""


def _allow_any_match(schema: dict[str, Any]) -> None:
    """A spec may match the check's schema and the design's, hence anyOf."""
    spec = schema.get("properties", {}).get("spec", {})
    if "oneOf" in spec:
        spec["anyOf"] = spec.pop("oneOf")


class StudyRequest(Strict):
    """The case, the goal, and the time for measuring."""

    model_config = ConfigDict(json_schema_extra=_allow_any_match)

    time_budget_s: float | None = Field(
        default=None,
        ge=1e-6,
        le=1e6,
        description="time that one solution may take; null: the recommendation goes by the accuracy of the spec",
    )
    study_budget_s: float = Field(
        default=10.0,
        ge=0.1,
        le=MAX_BUDGET_S,
        description="time for the independent reference and the runs, without the tightest solution; a "
        "reference that takes longer is abandoned, levels for which no time is left are omitted",
    )

    def goal(self) -> Goal:
        """The goal of the recommended level."""
        return Meeting(self.spec.accuracy) if self.time_budget_s is None else Within(self.time_budget_s)

    @property
    def name(self) -> str:
        return self.spec.name

    def contradictions(self) -> list[Entry]:
        return [{**found, "pointer": "/spec" + found["pointer"]} for found in self.spec.contradictions()]


class LevelResult(Strict):
    """A level of the study."""

    accuracy: float
    settings: dict[str, float | int | str]
    error: float | None = Field(description="maximum relative error of the main results; null: the level failed")
    errors: dict[str, float] = Field(
        description="relative error of each main result, at least the uncertainty of the reference"
    )
    at_most: bool = Field(
        description="true: the error is below the uncertainty of the reference, which is shown instead"
    )
    proven_gap: float | None = Field(description="relative gap between the design and its proven bound; null: no proof")
    time_min_s: float
    time_median_s: float
    runs: int


class EffectCostResult(Strict):
    """Influence and cost of an effect; null if there is no answer without it or the time ran out."""

    name: str
    active: bool
    change: float | None = Field(description="maximum relative change of the main results if the effect is left out")
    brings: list[str] = Field(description="main results that exist only with the effect")
    time_with_s: float | None
    time_without_s: float | None
    runs: int


class StudyResult(Strict):
    """Error against time, from loose to tight, and the influence of each effect."""

    levels: list[LevelResult]
    reference: str = Field(description="method of the reference")
    reference_accuracy: float = Field(description="relative uncertainty of the reference, of its least certain result")
    recommended: LevelResult | None = Field(
        description="the cheapest level that meets the spec's accuracy, or the best within the time"
    )
    certified: LevelResult | None = Field(
        description="the cheapest level whose design is proven optimal within the accuracy of the spec, or else "
        "the one with the smallest gap; null: nothing is proven"
    )
    effect_costs: list[EffectCostResult]


class _NoAnswer(Exception):
    """The case itself is refused or infeasible."""

    def __init__(self, answer: Answer) -> None:
        super().__init__(answer.status)
        self.answer = answer


@cache
def study_job(kind: Kind) -> Job:
    """The study of a kind, built from its jobs."""
    specs = {str(mode): job.request for mode, job in kind.jobs.items()}
    asked_for = " or ".join(f"a {mode} request" if mode != Mode.ANALYSIS else "a request" for mode in specs)
    request = create_model(
        f"{''.join(word.capitalize() for word in kind.slug.split('-'))}StudyRequest",
        __base__=StudyRequest,
        __doc__=StudyRequest.__doc__,
        spec=(_spec(specs), Field(description=f"{asked_for} of this kind")),
    )

    def run(asked: Any, report: Report = ignore_progress) -> Answer:
        mode = next(Mode(name) for name, model in specs.items() if isinstance(asked.spec, model))
        return _run(kind, mode, asked, report)

    infeasible = next((job.infeasible for job in kind.jobs.values() if job.infeasible), None)
    return Job(
        request,
        StudyResult,
        run,
        extra_s=lambda asked: asked.study_budget_s,
        repeatable=False,
        infeasible=infeasible,
        in_steps=True,
    )


def _spec(specs: dict[str, type[BaseModel]]) -> Any:
    """A union of the request models, selected by ``meant_by`` or by distinctive fields."""
    known = {name: set(model.model_fields) for name, model in specs.items()}
    own = {name: fields.difference(*(f for n, f in known.items() if n != name)) for name, fields in known.items()}

    def choose(value: Any) -> str | None:
        if isinstance(value, BaseModel):
            return next((name for name, model in specs.items() if isinstance(value, model)), None)
        if not isinstance(value, dict):
            return None
        claimed = next((name for name, model in specs.items() if model.meant_by(value)), None)
        return claimed or next((name for name, fields in own.items() if fields & value.keys()), next(iter(specs)))

    return one_of(choose, specs, "a request of this kind")


def _run(kind: Kind, mode: Mode, asked: Any, report: Report) -> Answer:
    """Solve the case at every accuracy level, then with each effect toggled."""
    job, budget, last = kind.jobs[mode], asked.study_budget_s, dict[str, Answer]()
    plan = Plan(time=_LEVELS_SHARE * budget, reference_time=_REFERENCE_SHARE * budget)
    turned = EFFECT_RUNS * (1 + len(kind.known_effects))
    count = Counter(1 + plan.runs * len(plan.ladder) + turned, report)

    def solve(accuracy: float) -> Solved:
        answer = job.run(asked.spec.model_copy(update={"accuracy": accuracy}))
        count.increment()
        solved = _solved(kind, mode, answer, asked.spec)
        if solved is None:
            raise _NoAnswer(answer)
        last["answer"] = answer
        return solved

    def reference() -> Reference | None:
        count.begin(REFERENCE)
        found = job.reference(asked.spec, last["answer"])
        if found is None:
            count.begin(LADDER)
            return None

        def results(watch: Any) -> Any:
            try:
                return found.results(watch)
            finally:
                count.begin(LADDER)

        return Reference(found.made, results)

    count.begin(TIGHTEST)
    try:
        found = study(solve, asked.goal(), plan, reference)
    except _NoAnswer as nothing:
        # Its tightest solution has an accuracy that nobody asked for.
        as_asked = job.run(asked.spec)
        return _without_study(nothing.answer if as_asked.status == "succeeded" else as_asked)
    effects = last["answer"].effects
    count.begin(EFFECTS)
    costs = _effect_costs(kind, job, asked, effects, count)
    reached = found.recommended
    return Answer(
        status="succeeded",
        result={**_result(found, asked.spec.accuracy), "effect_costs": [_cost(cost) for cost in costs]},
        effects=effects,
        accuracy=accuracy_json(
            Accuracy(
                asked.spec.accuracy,
                _error(reached) if reached else max(map(_error, found.levels), default=0.0),
                dict(reached.settings) if reached else {},
            )
        ),
        timing={"solve_s": sum(level.time_median * level.runs for level in found.levels)},
    )


def _solved(kind: Kind, mode: Mode, answer: Answer, given: Any) -> Solved | None:
    """The judged values of an answer, including its dimensions unless they are given; None if it has none."""
    if answer.status != "succeeded" or answer.result is None:
        return None
    results = kind.judged_values(answer.result, mode)
    if not hasattr(given, "dimensions"):
        for name, value in answer.result.get("dimensions", {}).items():
            results[f"dimensions.{name}"] = value
    certificate = answer.result.get("certificate") or {}
    # A bound of the core model, relaxed by the effects, does not follow the requested accuracy.
    gap = None if "effects_beyond_the_core" in certificate.get("evidence", {}) else certificate.get("gap")
    if answer.accuracy is None:
        return Solved(results, gap=gap)
    return Solved(results, answer.accuracy["settings"], answer.accuracy["estimated"], gap)


def _effect_costs(
    kind: Kind, job: Job, asked: Any, manifest: list[dict[str, Any]], count: Counter
) -> tuple[EffectCost, ...]:
    names = [effect["name"] for effect in manifest]

    def solve(chosen: Chosen) -> Solved | None:
        settled = EffectChoice(include=sorted(chosen), exclude=sorted(set(names) - chosen))
        answer = job.run(asked.spec.model_copy(update={"effects": settled}))
        count.increment()
        # For a design, too: every result that an effect may add, since both designs meet the requested accuracy.
        return _solved(kind, Mode.CHECK, answer, asked.spec)

    active = frozenset(effect["name"] for effect in manifest if effect["state"] == "active")
    return effect_costs(solve, names, active, _EFFECTS_SHARE * asked.study_budget_s)


def _error(level: Level) -> float:
    return level.error or 0.0


def _without_study(answer: Answer) -> Answer:
    """The study's answer for a case without one: the same refusal, with pointers below /spec."""
    problem = answer.problem
    if problem is not None and "errors" in problem:
        moved = [{**found, "pointer": "/spec" + found["pointer"]} for found in problem["errors"]]
        problem = {**problem, "errors": moved}
    return Answer(answer.status, answer.result, answer.effects, answer.accuracy, answer.timing, problem)


def _result(found: Study, accuracy: float) -> dict[str, Any]:
    proven = closest_proof(found.levels, accuracy)
    return {
        "levels": [_level(level) for level in found.levels],
        "reference": found.reference,
        "reference_accuracy": found.reference_accuracy,
        "recommended": _level(found.recommended) if found.recommended else None,
        "certified": _level(proven) if proven else None,
    }


def _cost(cost: EffectCost) -> dict[str, Any]:
    return {
        "name": cost.name,
        "active": cost.active,
        "change": cost.change,
        "brings": list(cost.brings),
        "time_with_s": cost.time_with,
        "time_without_s": cost.time_without,
        "runs": cost.runs,
    }


def _level(level: Level) -> dict[str, Any]:
    return {
        "accuracy": level.accuracy,
        "settings": dict(level.settings),
        "error": level.error,
        "errors": dict(level.errors),
        "at_most": level.at_most,
        "proven_gap": level.gap,
        "time_min_s": level.time_min,
        "time_median_s": level.time_median,
        "runs": level.runs,
    }
