"""What every check and every design answers with: a typed outcome, also for an ordinary "no"."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")


class Status(StrEnum):
    SUCCEEDED = "succeeded"
    INFEASIBLE = "infeasible"
    FAILED = "failed"


class EffectState(StrEnum):
    ACTIVE = "active"
    SKIPPED = "skipped"


class EffectReport(NamedTuple):
    """One line of the effects manifest.

    ``bound`` computes ``influence``. What a request settles needs no bound to be decided: one that nobody reads is not
    computed.
    """

    name: str
    state: EffectState
    bound: Callable[[], float]
    why: str

    @property
    def influence(self) -> float:
        """The a-priori bound on the relative change that the effect makes to the main results."""
        return self.bound()

    def __reduce__(self) -> tuple[Callable[..., EffectReport], tuple[str, EffectState, float, str]]:
        """To other processes goes the number."""
        return _told, (self.name, self.state, self.influence, self.why)


def _told(name: str, state: EffectState, influence: float, why: str) -> EffectReport:
    return EffectReport(name, state, lambda: influence, why)


@dataclass(frozen=True)
class Accuracy:
    """The relative accuracy that was asked for, the estimate of what was reached, and the settings that did it."""

    requested: float
    estimated: float
    settings: Mapping[str, float | int | str] = field(default_factory=dict)

    @property
    def met(self) -> bool:
        """Whether the estimate is as small as was asked for."""
        return self.estimated <= self.requested


@dataclass(frozen=True)
class Shortfall:
    """One requirement that cannot be met: what is asked, what is attainable at best, and what would help."""

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
    """How far the answer is known to be the global optimum.

    ``bound`` bounds the objective over everything feasible (from below when minimising), ``gap`` is the relative
    distance of the answer from it, inf where nothing bounds; ``method`` and ``evidence`` say how the answer was found,
    what the bound rests on, and what is known of the answer beside it. The gap is about all other designs,
    ``Accuracy.estimated`` about the figures told of this one: neither is a part of the other.
    """

    method: str
    bound: float
    gap: float
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome(Generic[T]):
    """Status, value and everything a user needs to judge the value."""

    status: Status
    value: T | None
    effects: tuple[EffectReport, ...]
    accuracy: Accuracy
    certificate: Certificate | None = None
    diagnosis: tuple[Shortfall, ...] = ()
    timing: Mapping[str, float] = field(default_factory=dict)
