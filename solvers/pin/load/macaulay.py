"""Further load cases: sums of Macaulay terms in two planes, with an axial force and a torque.

A term c <x - s>^n in the shear force Q is a point force (n = 0), a uniform load (n = 1) or a linearly increasing
load (n = 2); the bending moment is M = integral of Q.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array

ROUNDING = 1e-13
"""Relative rounding error of results."""
LIMIT_TOLERANCE = 5 * ROUNDING
"""Relative excess of a solid section over a limit up to which it meets it, within the slack of every verdict."""


@dataclass(frozen=True)
class MacaulayTerm:
    """c <x - s>^n in the shear force of one plane (0 or 1): ``coefficient`` c [N/m^n], ``start`` s [m], ``order`` n."""

    coefficient: float
    start: float
    order: int
    plane: int = 0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.coefficient) and math.isfinite(self.start)):
            raise InvalidInput("load.terms", "a coefficient or a start is not finite", "finite numbers")
        if self.order not in (0, 1, 2, 3):
            raise InvalidInput("load.terms.order", "is no load this model knows", "0, 1, 2 or 3")
        if self.plane not in (0, 1):
            raise InvalidInput("load.terms.plane", "there are two planes", "0 or 1")


@dataclass(frozen=True)
class LoadCase:
    """Simultaneous loads: transverse terms in two planes, an axial force [N] and a torque [N m] along the bar."""

    terms: tuple[MacaulayTerm, ...]
    axial_force: float = 0.0
    torque: float = 0.0


class InternalForces(NamedTuple):
    """Magnitudes of bending moments [N m] and shear forces [N] at n stations, axial force [N] and torque [N m]."""

    moment: Array
    shear: Array
    axial_force: float = 0.0
    torque: float = 0.0


def forces_of(case: LoadCase, x: Array, side: Array) -> InternalForces:
    """Return the resultants of a case at stations ``x``; a term acts if it starts at or before the station's ``side``:
    at a point force the forces of a station are those on its panel's side."""
    moment, shear = np.zeros((2, 2, x.size))
    for term in case.terms:
        n, along = term.order, np.maximum(x - term.start, 0.0)
        acts = term.coefficient * (side >= term.start)
        shear[term.plane] += acts * along**n
        moment[term.plane] += acts * along ** (n + 1) / (n + 1)
    return InternalForces(np.hypot(*moment), np.hypot(*shear), case.axial_force, case.torque)
