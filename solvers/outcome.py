"""Typed outcomes of checks and designs, including negative ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, NamedTuple, Protocol, TypeVar

from solvers.errors import InvalidInput

T = TypeVar("T")


class Status(StrEnum):
    SUCCEEDED = "succeeded"
    INFEASIBLE = "infeasible"
    FAILED = "failed"


class EffectState(StrEnum):
    ACTIVE = "active"
    SKIPPED = "skipped"


class EffectReport(NamedTuple):
    """An entry of the effects manifest.

    ``estimate`` computes ``influence`` on demand: if the request decides on an effect, it may never be needed.
    """

    name: str
    state: EffectState
    estimate: Callable[[], float]
    why: str

    @property
    def influence(self) -> float:
        """Estimated relative change of the main results due to the effect, before it is solved."""
        return self.estimate()

    def __reduce__(self) -> tuple[Callable[..., EffectReport], tuple[str, EffectState, float, str]]:
        """Pickle the number instead of the function."""
        return _restored, (self.name, self.state, self.influence, self.why)


def _restored(name: str, state: EffectState, influence: float, why: str) -> EffectReport:
    return EffectReport(name, state, lambda: influence, why)


@dataclass(frozen=True)
class Accuracy:
    """Requested relative accuracy, estimated accuracy reached, and the numerical settings."""

    requested: float
    estimated: float
    settings: Mapping[str, float | int | str] = field(default_factory=dict)

    @property
    def met(self) -> bool:
        """Whether the estimate meets the request."""
        return bool(self.estimated <= self.requested)


@dataclass(frozen=True)
class Shortfall:
    """An unattainable requirement: required and attainable value, and advice."""

    requirement: str
    required: float
    attainable: float | None
    advice: str


@dataclass(frozen=True)
class ActiveConstraint:
    """A constraint that holds with equality at the optimum.

    ``sensitivity`` is the relative change of the objective for a relative change of the bound
    (d ln objective / d ln bound): +0.3 says that a bound 1 % higher moves the objective up by 0.3 %.
    """

    name: str
    sensitivity: float


@dataclass(frozen=True)
class Certificate:
    """Proof of global optimality.

    ``bound`` bounds the objective over the feasible set (from below when minimising); ``gap`` is the relative distance
    of the answer from it, inf without a bound; ``method`` and ``evidence`` describe the search and the basis of the
    bound. The gap refers to all other designs, ``Accuracy.estimated`` to the values reported for this one; neither
    includes the other.
    """

    method: str
    bound: float
    gap: float
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome(Generic[T]):
    """Status, value and the information needed to judge the value."""

    status: Status
    value: T | None
    effects: tuple[EffectReport, ...]
    accuracy: Accuracy
    certificate: Certificate | None = None
    diagnosis: tuple[Shortfall, ...] = ()
    timing: Mapping[str, float] = field(default_factory=dict)


class Case(Protocol[T]):
    """The arguments of one evaluation."""

    def evaluate(self) -> Outcome[T]: ...


def evaluated(cases: Iterable[Case[T]]) -> list[Outcome[T] | InvalidInput]:
    """One outcome per case, in order; an invalid case yields its InvalidInput."""
    found: list[Outcome[T] | InvalidInput] = []
    for case in cases:
        try:
            found.append(case.evaluate())
        except InvalidInput as refusal:
            found.append(refusal)
    return found
