"""The two worked examples, a hand-held breaker and a pipe cleaner, and how tests design linkages."""

from __future__ import annotations

from typing import Any

from solvers import linkage
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.quantities import Quantities
from solvers.numerics.arrays import Array
from solvers.outcome import Outcome

KINDS = tuple(linkage.KINDS)
BREAKER = linkage.Scene(linkage.Restitution(0.05, 0.3), blow_frequency=20.0, impact_speed=8.0, impact_energy=10.0)
BREAKER_LIMITS = linkage.Limits(min_link=8e-3, joint_radius=6e-3)
CLEANER = linkage.Scene(linkage.Restitution(0.3, 0.3), blow_frequency=25.0, impact_speed=5.0, impact_energy=2.0)
CLEANER_LIMITS = linkage.Limits(min_link=12e-3, joint_radius=5e-3)


def problem(scene: linkage.Scene, limits: linkage.Limits, objective: str, *kinds: str) -> linkage.LinkageProblem:
    """A design problem over the named kinds, or over all."""
    allowed = tuple(linkage.KINDS[name] for name in kinds) or tuple(linkage.KINDS.values())
    return linkage.LinkageProblem(scene, limits, linkage.OBJECTIVES[objective], allowed)


def designed(scene: linkage.Scene, limits: linkage.Limits, objective: str, *kinds: str, **more: Any) -> Outcome[Any]:
    """The outcome of a design problem."""
    return linkage.design(problem(scene, limits, objective, *kinds), **more)


def of_members(asked: linkage.LinkageProblem, family: Family, q: Array) -> Quantities:
    """The quantities of single members instead of ranges."""
    return Quantities(asked, family, q, q)
