"""The best value of a limited result under all other requirements: a design with that result as objective."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Constraint
from solvers.rod.problem import LIMITED_RESULTS, Requirements, RodProblem

_LOOSEST = {
    "min_fatigue_safety": 1e-6, "min_yield_safety": None, "max_contact_pressure": None, "max_friction_power": None,
    "min_stability_safety": 1.0,
}  # fmt: skip
"""Values of the requirements that every strip short of buckling meets, those most sensitive to vibration first."""


class AttainableBest(NamedTuple):
    """A requirement, a strip with the best attainable value of its result, the estimated relative error of that value,
    and the requirements active there."""

    requirement: Constraint
    check: RodCheck
    error: float
    opponents: tuple[Constraint, ...]


class KnownOptima(NamedTuple):
    """The optimum that a search for a feasible strip has made, if any, and a function for those of other requirements,
    if they take little time; it returns None if the other requirements are infeasible."""

    attained: AttainableBest | None = None
    of: Callable[[Constraint], AttainableBest | None] | None = None


def first_violated(asked: Requirements, nearest: RodCheck) -> Constraint | None:
    """The requirement to optimise first: one that the strip ``nearest`` to feasibility violates, if any."""
    order = [BY_NAME[name] for name, loosest in _LOOSEST.items() if getattr(asked, name) != loosest]
    violated = [c for c in order if not c.meets(nearest, getattr(asked, c.name))]
    return next(iter(violated or order), None)


def as_objective(p: RodProblem, c: Constraint) -> RodProblem:
    """The problem with the result of a requirement as objective, under all other requirements."""
    without = replace(p.requirements, **{c.name: _LOOSEST[c.name]})
    return replace(p, objective=LIMITED_RESULTS[c.objective], requirements=without)
