"""Shared parts of request and result models: strict validation, effects, accuracy, certificates, refusals.

Request fields are named after the solver's with a unit suffix (``crank_radius`` -> ``crank_radius_mm``), so that the
path in a solver's refusal can be mapped to the JSON pointer of the user's field.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, wraps
from typing import Annotated, Any, Literal, Protocol, TypeVar, Union

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag
from pydantic_core import PydanticKnownError

from app.designs.kind import REFUSED, Answer
from app.designs.problems import INVALID, OUT_OF_TIME, problem_details
from app.designs.progress import Report
from app.designs.units import figures, in_si
from app.names import Cleaned
from solvers.effects import ALL, AUTO, EffectSelection
from solvers.errors import EffectConflict, InvalidInput
from solvers.outcome import Accuracy, Certificate, Outcome, Status

LARGEST_INFLUENCE = 1e9

# Far wider than any machine, yet narrow enough that products of a few values stay in the range of a float: b h^3 of the
# smallest sizes is 1e-36 m^4, not 0.
Finite = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]

Entry = dict[str, str]
"""An invalid field in problem details: ``pointer``, ``detail``, ``allowed``."""


class Strict(BaseModel):
    """Base of all models: strict numbers, no unknown fields, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, hide_input_in_errors=True)


def _no_boolean(value: Any) -> Any:
    if isinstance(value, bool):
        raise PydanticKnownError("int_type")
    return value


WHOLE = BeforeValidator(_no_boolean)
"""For literal numbers, which compare true with 1."""


def one_named(field: str, models: Mapping[str, Any]) -> Any:
    """A union of objects whose member is named by the object's own ``field``."""
    names = ", ".join(models)
    told = {"allowed": f'an object whose "{field}" is one of {names}', "field": field, "names": names}
    return _union(lambda value: named(value, field), models, told)


def one_of(choose: Callable[[Any], str | None], models: Mapping[str, Any], needs: str) -> Any:
    """A union whose member ``choose`` selects by name from the raw value.

    Errors are then reported for the intended member only. Member names appear in pydantic's error locations in
    parentheses, see ``is_tag``.
    """
    return _union(choose, models, {"allowed": needs})


def _union(choose: Callable[[Any], str | None], models: Mapping[str, Any], told: dict[str, Any]) -> Any:
    members = tuple(Annotated[model, Tag(f"({name})")] for name, model in models.items())

    def tag(value: Any) -> str:
        return f"({choose(value)})"

    decide = Discriminator(
        tag,
        custom_error_type="one_of",
        custom_error_message="is none of the forms this field can have",
        custom_error_context=told,
    )
    return Annotated[Union[members], decide]  # noqa: UP007


def is_tag(part: int | str) -> bool:
    """Whether a part of an error location is a union member rather than a field."""
    return isinstance(part, str) and part.startswith("(") and part.endswith(")")


def named(value: Any, field: str) -> str | None:
    """The string value of ``field`` in a raw object or a model."""
    found = value.get(field) if isinstance(value, dict) else getattr(value, field, None)
    return found if isinstance(found, str) else None


def listed_or_own(listed: type[BaseModel], own: type[BaseModel]) -> Any:
    """A union of a material of a catalogue, told by its name, and one given by its properties."""

    def choose(value: Any) -> str | None:
        if isinstance(value, dict):
            return "listed" if "name" in value else "own"
        return {listed: "listed", own: "own"}.get(type(value))

    needs = "an object with the material's properties, or with its name in the catalogue"
    return one_of(choose, {"own": own, "listed": listed}, needs)


def _form_of_effects(value: Any) -> str | None:
    if isinstance(value, str):
        return "word"
    return "choice" if isinstance(value, (dict, BaseModel)) else None


EffectName = Annotated[str, Field(max_length=64)]


class EffectChoice(Strict):
    """Effects forced on or off; all others follow their influence."""

    include: list[EffectName] = Field(default=[], max_length=32)
    exclude: list[EffectName] = Field(default=[], max_length=32)


_Effects = one_of(
    _form_of_effects,
    {"word": Literal["auto", "all"], "choice": EffectChoice},
    '"auto", "all", or an object with include and exclude',
)


class SolverRequest(Strict):
    """Fields of every check and design."""

    name: Cleaned = Field(
        default="",
        max_length=200,
        pattern=r"^[^\x00]*$",
        description="a name for display; it does not affect the result",
    )
    effects: _Effects = Field(default="auto", description="auto, all, or a choice with include and exclude")
    effect_tolerance: float = Field(
        default=1e-2,
        gt=0,
        le=1,
        description="maximum relative change of the main results that all omitted effects may cause together",
    )
    accuracy: float = Field(default=1e-6, ge=1e-12, le=1e-1, description="requested relative numerical accuracy")

    def contradictions(self) -> list[Entry]:
        """Cross-field validation: one problem entry per contradiction."""
        return []

    @classmethod
    def meant_by(cls, value: dict[str, Any]) -> bool:
        """Whether a raw object that may be a check or a design is meant as this model: decided by its fields, unless a
        kind overrides this."""
        return False

    def selection(self) -> EffectSelection:
        if isinstance(self.effects, EffectChoice):
            return EffectSelection(frozenset(self.effects.include), frozenset(self.effects.exclude))
        return {"auto": AUTO, "all": ALL}[self.effects]


MAX_TIME_S = 3600.0
"""Upper limit of the service's time limit per solve [s]."""


class DesignSettings(Strict):
    """Fields of every design."""

    time_budget_s: float | None = Field(
        default=None,
        ge=1e-3,
        le=MAX_TIME_S,
        description="wall-clock limit of this design, at most the limit of the service; null: that limit. A "
        "kind that improves its design iteratively answers with the best one so far that meets "
        "every requirement, with the remaining gap and accuracy.met false; any other run that does "
        "not finish in time fails",
    )


def time_budget_of(request: BaseModel) -> float | None:
    """The time budget in the request [s], if any."""
    return request.time_budget_s if isinstance(request, DesignSettings) else None


def scaled(value: float | None, unit: float) -> float | None:
    """Convert an SI value to a unit of the API; None stays None."""
    return None if value is None else value / unit


class EffectResult(Strict):
    """An entry of the effects manifest."""

    name: str
    state: Literal["active", "skipped"]
    influence: float = Field(
        description="estimated relative change of the main results if the effect is left out; 1e9: unknown"
    )
    why: str


class AccuracyResult(Strict):
    """Requested and estimated accuracy, and the numerical settings used."""

    requested: float
    estimated: float
    met: bool = Field(description="whether estimated is at most requested")
    settings: dict[str, float | int | str]


class CertificateResult(Strict):
    """Proof of a design's optimality: what is proven, over which set, by which argument, and what is not covered."""

    method: str = Field(description="argument of the proof")
    bound: float | None = Field(
        description="proven bound on the objective of every feasible design, in the objective's unit; null: none is "
        "known"
    )
    gap: float | None = Field(description="relative distance of the answer from the bound; null: no bound is known")
    evidence: dict[str, float | int | str]
    proven: str = Field(description="what is proven")
    physics: str = Field(description="the physics to which the proof applies")
    form: str = Field(description="the designs to which the proof applies")
    range: str = Field(description="the range of designs covered")
    estimated: list[str] = Field(description="what is only estimated, and where the estimate is reported")


class ShortfallResult(Strict):
    """An unattainable requirement."""

    requirement: str
    required: float
    attainable: float | None = Field(
        description="best value beside those of the other requirements that can be met, accurate to "
        "accuracy.estimated; null: unknown"
    )
    advice: str


class RepairDone(Strict):
    """A repair of the user's points, and where the first fault was."""

    pointer: str
    what: str


class Infeasible(Strict):
    """Diagnosis of an infeasible design."""

    diagnosis: list[ShortfallResult]
    warnings: list[str] = Field(default=[], description="warnings about the diagnosis")
    certificate: CertificateResult | None = None
    repairs: list[RepairDone] = Field(default=[], description="repairs of the request's points")


def certificate_json(certificate: Certificate | None, unit: float) -> dict[str, Any] | None:
    """A certificate as JSON, its bound in the unit of the objective."""
    if certificate is None:
        return None
    bound = float(certificate.bound) / unit
    return {
        "method": certificate.method,
        "bound": bound if math.isfinite(bound) else None,
        "gap": float(certificate.gap) if math.isfinite(certificate.gap) else None,
        "evidence": dict(certificate.evidence),
    }


_NAME = re.compile(r"\b[a-z]+(?:_[a-z]+)+\b")


def diagnosis_json(outcome: Outcome, limits: Mapping[str, str]) -> list[dict[str, Any]]:
    """Unattainable requirements as JSON; ``limits`` has the API names of those that differ, and thereby their units."""
    found = []
    for shortfall in outcome.diagnosis:
        name = limits.get(shortfall.requirement, shortfall.requirement)
        unit = in_si(name)[1]
        found.append(
            {
                "requirement": name,
                "required": shortfall.required / unit,
                "attainable": scaled(shortfall.attainable, unit),
                "advice": _NAME.sub(lambda word: limits.get(word[0], word[0]), shortfall.advice),
            }
        )
    return found


def accuracy_json(accuracy: Accuracy) -> dict[str, Any]:
    """Accuracy as JSON: requested, estimated, and whether it was met."""
    return {
        "requested": accuracy.requested,
        "estimated": float(accuracy.estimated),
        "met": bool(accuracy.met),
        "settings": dict(accuracy.settings),
    }


def _with_accuracy_warning(result: dict[str, Any] | None, accuracy: Accuracy) -> dict[str, Any] | None:
    """The result with a warning prepended if the requested accuracy was missed."""
    if result is None or "warnings" not in result or accuracy.met:
        return result
    requested, estimated = figures(accuracy.requested), figures(accuracy.estimated, 2)
    missed = f"the accuracy of {requested} is not met: the estimated error is {estimated}"
    return {**result, "warnings": [missed, *result["warnings"]]}


_NOTHING_IN_TIME = problem_details(
    OUT_OF_TIME, 504, "nothing that meets every requirement was found within the time budget"
)


def envelope(
    request: BaseModel | None, outcome: Outcome, result: dict[str, Any] | None, verdict: dict[str, Any] | None = None
) -> Answer:
    """The answer of a job to a request from a solver's outcome: result, warnings, verdict and common parts. A solve
    that ran out of time before finding anything gets a problem instead of a result."""
    failed = outcome.status is Status.FAILED
    return Answer(
        status=str(outcome.status),
        result=None if failed else _with_accuracy_warning(result, outcome.accuracy),
        problem=dict(_NOTHING_IN_TIME) if failed else None,
        effects=[
            _effect_json(name, str(state), float(min(bound(), LARGEST_INFLUENCE)), _as_sent(request, why))
            for name, state, bound, why in outcome.effects
        ],
        accuracy=accuracy_json(outcome.accuracy),
        timing={name: float(seconds) for name, seconds in outcome.timing.items()},
        verdict=None if failed else verdict,
    )


@lru_cache(maxsize=4096)
def _effect_json(name: str, state: str, influence: float, why: str) -> dict[str, Any]:
    """An entry of the manifest, not to be changed: answers share it."""
    return {"name": name, "state": state, "influence": influence, "why": why}


_FIELD = re.compile(r"\b[a-z]\w*(?:\.\w+)+")


def _as_sent(request: BaseModel | None, text: str) -> str:
    """A solver's sentence with the names that were sent: needed by limits.width → needed by limits.width_mm."""
    return _FIELD.sub(lambda field: pointer(request, field[0])[1:].replace("/", "."), text)


def pointer(request: BaseModel | None, field: str) -> str:
    """The JSON pointer for a solver's dotted path, as far as it exists in the request."""
    parts: list[str] = []
    here: Any = request
    for step in field.split("."):
        name = step
        if isinstance(here, BaseModel):
            names = type(here).model_fields
            name = step if step in names else next((n for n in names if n.startswith(step + "_")), step)
            here = getattr(here, name, None)
        elif isinstance(here, (list, tuple)) and step.isdigit():
            here = here[int(step)] if int(step) < len(here) else None
        parts.append(name)
    return "/" + "/".join(parts)


class Repaired(Protocol):
    """A repair reported by a solver: dotted path of the field, and a description."""

    @property
    def field(self) -> str: ...

    @property
    def what(self) -> str: ...


def repairs_json(request: BaseModel, repairs: Iterable[Repaired]) -> list[dict[str, str]]:
    """Repairs as JSON, with pointers to the user's fields."""
    return [{"pointer": pointer(request, done.field), "what": done.what} for done in repairs]


def entry(pointer: str, detail: str, allowed: str) -> Entry:
    """An invalid field in problem details."""
    return {"pointer": pointer, "detail": detail, "allowed": allowed}


def refused(request: BaseModel, refusal: InvalidInput) -> Answer:
    """The answer for an input refused by the solver.

    A limit or objective that needs an excluded effect is reported at both fields.
    """
    places = [pointer(request, refusal.field)]
    if isinstance(refusal, EffectConflict):
        # "requirements.max_friction_power", or "objective friction_power"
        places.append(pointer(request, refusal.needed_by.partition(" ")[0]))
    reason, allowed = _as_sent(request, refusal.reason), _as_sent(request, refusal.allowed)
    errors = [entry(place, reason, allowed) for place in places]
    return Answer(REFUSED, None, [], None, {}, problem_details(INVALID, 422, reason, errors))


def refusing(run: Callable[..., Answer]) -> Callable[..., Answer]:
    """The function of a job, with the answer ``refused`` for what its solver refuses."""

    @wraps(run)
    def answered(request: BaseModel, *report: Report) -> Answer:
        try:
            return run(request, *report)
        except InvalidInput as refusal:
            return refused(request, refusal)

    return answered


R = TypeVar("R", bound=BaseModel)
C = TypeVar("C")
T = TypeVar("T")


def bulk_answers(
    requests: Sequence[R],
    case_of: Callable[[R], C],
    solve: Callable[[Sequence[C]], Sequence[Outcome[T] | InvalidInput]],
    answer: Callable[[R, C, Outcome[T]], Answer],
) -> Iterator[Answer]:
    """Answers of requests solved in bulk, one by one; ``case_of`` may refuse a request, ``solve`` a case."""
    cases: list[C] = []
    results: list[Answer | C] = []
    for request in requests:
        try:
            cases.append(case_of(request))
            results.append(cases[-1])
        except InvalidInput as refusal:
            results.append(refused(request, refusal))
    outcomes = iter(solve(cases))
    for request, case in zip(requests, results, strict=True):
        if isinstance(case, Answer):
            yield case
            continue
        outcome = next(outcomes)
        yield refused(request, outcome) if isinstance(outcome, InvalidInput) else answer(request, case, outcome)


def finite(value: Any) -> bool:
    """Whether a JSON value contains only finite numbers."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, dict):
        return all(finite(v) for v in value.values())
    if isinstance(value, (list, tuple)):
        return all(finite(v) for v in value)
    return True
