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
from solvers.numerics.jit import kernel

_CANCELLATION_TOLERANCE = 8.0 * 2.0**-52
"""Relative magnitude below which a sum is pure rounding error."""
_BINOMIAL = np.array([[float(math.comb(j, order)) for order in range(4)] for j in range(4)])
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
    start, residual = np.array(sorted({(t.start, t.residual) for t in terms})).reshape(-1, 2).T.copy()
    shear, moment = np.zeros((4, start.size)), np.zeros(start.size)
    rows = np.array([(t.start, t.residual, t.order, t.coefficient) for t in terms], dtype=float).reshape(-1, 4)
    _shift_and_add(rows, start, residual, shear, moment)
    return Pieces(start, residual, shear, moment)


@kernel
def _shift_and_add(terms: Array, start: Array, residual: Array, shear: Array, moment: Array) -> None:
    """Write ``shear`` and ``moment`` of ``Pieces`` for terms (start, residual, order, coefficient), (n, 4)."""
    parts = np.empty(4 + terms.shape[0])
    for k in range(start.size):
        h = (start[k] - start[k - 1]) + (residual[k] - residual[k - 1]) if k > 0 else 0.0
        for order in range(4):
            count, power = 0, 1.0
            for j in range(order, 4 if k > 0 else 0):
                parts[count] = _BINOMIAL[j, order] * shear[j, k - 1] * power
                count, power = count + 1, power * h
                if order == 0:
                    moment[k] += shear[j, k - 1] * power / (j + 1)
            for t in range(terms.shape[0]):
                if terms[t, 0] == start[k] and terms[t, 1] == residual[k] and terms[t, 2] == order:
                    parts[count] = terms[t, 3]
                    count += 1
            shear[order, k] = _cancelled_sum(parts[:count])
        if k > 0:
            moment[k] += moment[k - 1]


@kernel
def _cancelled_sum(parts: Array) -> float:
    """Sum the parts, largest first, resetting a partial sum that cancels to rounding level; ``parts`` is sorted."""
    total, size = 0.0, 0.0
    for i in range(parts.size):
        for j in range(i + 1, parts.size):
            if abs(parts[j]) > abs(parts[i]):
                parts[i], parts[j] = parts[j], parts[i]
        total, size = total + parts[i], size + abs(parts[i])
        if abs(total) <= _CANCELLATION_TOLERANCE * size:
            total, size = 0.0, 0.0
    return total


_UNLOADED = Pieces(np.empty(0), np.empty(0), np.empty((4, 0)), np.empty(0))


def breakpoints(cases: Sequence[LoadCase], length: float) -> list[float]:
    """Return the distinct positions inside (0, length) where a load begins or ends, ascending."""
    starts = {term.start for case in cases for term in case.terms if 0.0 < term.start < length}
    return sorted(starts)
