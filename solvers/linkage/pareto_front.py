"""Pareto fronts: the optimal objective under a varying limit on a second quantity, each point proven over all types.

The limit runs from the least attainable value of the second quantity to its value at the unconstrained optimum of the
objective; beyond these there is no trade-off. Every point is a design with its own certificate, so non-convex parts of
the front are covered too, which a weighted sum would miss.

Source of the method: the epsilon-constraint of Y. Y. Haimes, L. S. Lasdon, D. A. Wismer (1971).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.linkage.design import design
from solvers.linkage.problem import OBJECTIVES, LinkageProblem
from solvers.linkage.result import LinkageCheck

MOST_POINTS = 25
_ROUNDING = 1e-9
_SIZES_AND_LOADS = EffectSelection(
    frozenset({"envelope"}), frozenset({"impact_dynamics", "coupler_elasticity", "tolerances"}), automatic=True
)
"""Only sizes and loads appear in a front."""

AGAINST = {"longest_link": "longest_link", "enclosing_radius": "enclosing_radius", "pin_force": "max_pin_force"}
"""Second quantities of a front, and the limit that constrains each."""


@dataclass(frozen=True)
class FrontPoint:
    """One design of the front: both quantities, and the gap of its proof."""

    objective: float
    against: float
    gap: float
    check: LinkageCheck


def front(
    problem: LinkageProblem,
    against: str,
    points: int,
    accuracy: float = 1e-4,
    solved: Callable[[], None] = lambda: None,
) -> tuple[FrontPoint, ...]:
    """The front of the problem's objective against another quantity, by increasing values of that quantity.

    against   a key of ``AGAINST``, other than the objective's own name
    points    2 … 25 limits, logarithmically spaced; equal designs are listed once
    solved    called after each design; there are at most as many as limits

    Empty if no design is feasible. Raises InvalidInput for an invalid request.
    """
    if problem.objective.set_motion:
        allowed = [name for name, objective in OBJECTIVES.items() if not objective.set_motion]
        raise InvalidInput("objective", "no front can be drawn of it", ", ".join(allowed))
    if against not in AGAINST or against == problem.objective.name:
        raise InvalidInput("front.against", "no front can be drawn against it", ", ".join(AGAINST))
    if not 2 <= points <= MOST_POINTS:
        raise InvalidInput("front.points", "lies outside what can be asked for", f"2 … {MOST_POINTS}")

    other = OBJECTIVES[against]

    def point(of: LinkageProblem) -> FrontPoint | None:
        outcome = design(of, _SIZES_AND_LOADS, accuracy=accuracy)
        solved()
        if outcome.value is None:
            return None
        quantities = (objective.read(outcome.value.check, problem.scene) for objective in (problem.objective, other))
        return FrontPoint(*quantities, outcome.certificate.gap, outcome.value.check)

    # The design with the least second quantity is known; a limit that tight would leave no range to search.
    found = [point(problem), point(replace(problem, objective=other))]
    if None in found:
        return ()
    high, low = (each.against for each in found)
    if high <= low * (1.0 + _ROUNDING):
        return (found[0],)
    for limit in np.geomspace(low, high, points)[1:-1]:
        tightened = replace(problem.limits, **{AGAINST[against]: float(limit)})
        found.append(point(replace(problem, limits=tightened)))
    # By increasing second quantity, without dominated ones.
    kept: list[FrontPoint] = []
    for each in sorted((each for each in found if each is not None), key=lambda p: (p.against, p.objective)):
        if not kept or each.objective < kept[-1].objective * (1.0 - _ROUNDING):
            kept.append(each)
    return tuple(kept)
