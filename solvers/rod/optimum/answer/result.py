"""The result of a search for given effects, and the answer that it composes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solvers.outcome import ActiveConstraint, Outcome
from solvers.rod.check import RodCheck
from solvers.rod.scene import Dimensions


@dataclass(frozen=True)
class RodDesign:
    """The optimal strip, its check on the full model, and the active constraints.

    ``error`` is the estimated relative error of the check; the outcome's accuracy also includes the distance from the
    optimum.
    """

    check: RodCheck
    objective: str
    active: tuple[ActiveConstraint, ...]
    error: float


@dataclass(frozen=True)
class SearchResult:
    """Result of a search: its effects, the strip at which effects are to be selected next, by how much that strip is
    known to miss the requirements (0 if feasible), and a function that composes the answer, without its effects, when
    it is required. An incomplete search ended early, at a strip that calls for other effects."""

    chosen: frozenset[str]
    strip: Dimensions
    excess: float
    compose_answer: Callable[[], Outcome[RodDesign]]
    complete: bool = True

    @property
    def feasible(self) -> bool:
        return self.excess <= 0.0
