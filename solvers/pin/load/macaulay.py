"""Internal forces along a straight bar: sums of Macaulay terms, exact at every station.

A term c <x - s>^n in the shear force Q is a point force (n = 0), a uniform load (n = 1) or a linearly increasing
load (n = 2); the bending moment is M = integral of Q. Equations (4) and (5) of the paper are such sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array

_CANCELLATION_TOLERANCE = 8.0 * 2.0**-52
"""Relative magnitude below which a sum is pure rounding error."""
ROUNDING = 1e-13
"""Relative rounding error of results."""


@dataclass(frozen=True)
class MacaulayTerm:
    """c <x - s>^n in the shear force of one plane (0 or 1): ``coefficient`` c [N/m^n], ``start`` s [m], ``order`` n.

    ``residual`` is the rounding residual of a start that is itself a sum.
    """

    coefficient: float
    start: float
    order: int
    plane: int = 0
    residual: float = 0.0

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

    @cached_property
    def pieces(self) -> tuple[Pieces, Pieces]:
        """The shear force of each plane as piecewise polynomials between the starts of the terms."""
        first, second = ([term for term in self.terms if term.plane == plane] for plane in (0, 1))
        return _pieces(first), _pieces(second) if second else _UNLOADED


@dataclass(frozen=True)
class Pieces:
    """Q = sum c_j (x - s)^j from each start s to the next, shape (4, k), and M at the starts, (k,).

    Direct Macaulay sums amplify rounding errors by (x/a)^2 beyond a short boss of length a. Here the polynomials are
    shifted from start to start, and coefficients at rounding level are set to zero. ``residual``: rounding residuals
    of the starts.
    """

    start: Array
    residual: Array
    shear: Array
    moment: Array


def _pieces(terms: list[MacaulayTerm]) -> Pieces:
    starting: dict[tuple[float, float], list[MacaulayTerm]] = {}
    for term in terms:
        starting.setdefault((term.start, term.residual), []).append(term)
    starts = sorted(starting)
    shear, moment = [], []
    coefficients, bending, before = (0.0, 0.0, 0.0, 0.0), 0.0, (0.0, 0.0)
    for k, place in enumerate(starts):
        c0, c1, c2, c3 = coefficients
        parts: list[list[float]] = [[], [], [], []]
        if k:
            h = (place[0] - before[0]) + (place[1] - before[1])
            bending += h * (c0 + h * (c1 / 2.0 + h * (c2 / 3.0 + h * c3 / 4.0)))
            parts = [
                [c0, c1 * h, c2 * h * h, c3 * h * h * h], [c1, 2.0 * c2 * h, 3.0 * c3 * h * h], [c2, 3.0 * c3 * h], [c3]
            ]  # fmt: skip
        for term in starting[place]:
            parts[term.order].append(term.coefficient)
        coefficients = tuple(map(_cancelled_sum, parts))
        shear.append(coefficients)
        moment.append(bending)
        before = place
    places = np.array(starts).reshape(-1, 2)
    return Pieces(places[:, 0].copy(), places[:, 1].copy(), np.array(shear).reshape(-1, 4).T.copy(), np.array(moment))


def _cancelled_sum(parts: list[float]) -> float:
    """Sum the parts, largest first, resetting a partial sum that cancels to rounding level."""
    parts = [part for part in parts if part]
    if len(parts) < 2:
        return parts[0] if parts else 0.0
    total = size = 0.0
    for part in sorted(parts, key=abs, reverse=True):
        total, size = total + part, size + abs(part)
        if abs(total) <= _CANCELLATION_TOLERANCE * size:
            total = size = 0.0
    return total


_UNLOADED = _pieces([])


def breakpoints(cases: Sequence[LoadCase], length: float) -> list[float]:
    """Return the distinct positions inside (0, length) where a load begins or ends, ascending."""
    starts = {term.start for case in cases for term in case.terms if 0.0 < term.start < length}
    return sorted(starts)
