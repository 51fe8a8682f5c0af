"""Internal forces along a straight bar: sums of Macaulay terms, exact at every station.

A term c <x - s>^n in the shear force Q is a point force (n = 0), a uniform load (n = 1) or a load that grows in
proportion to x - s (n = 2); the bending moment is M = integral of Q. Equation (4) and (5) of the paper are such sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_NOTHING = 8.0 * 2.0**-52
"""Sums below this share of their parts are rounding."""
ROUNDING = 1e-13
"""What rounding may do to results, relative."""


@dataclass(frozen=True)
class MacaulayTerm:
    """c <x - s>^n in the shear force of one plane (0 or 1): ``coefficient`` c [N/m^n], ``start`` s [m], ``order`` n.

    ``rest`` is what rounding left out of a start that is itself a sum.
    """

    coefficient: float
    start: float
    order: int
    plane: int = 0
    rest: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.coefficient) and math.isfinite(self.start)):
            raise InvalidInput("load.terms", "a coefficient or a start is not finite", "finite numbers")
        if self.order not in (0, 1, 2, 3):
            raise InvalidInput("load.terms.order", "is no load this model knows", "0, 1, 2 or 3")
        if self.plane not in (0, 1):
            raise InvalidInput("load.terms.plane", "there are two planes", "0 or 1")


@dataclass(frozen=True)
class LoadCase:
    """What acts at one time: transverse terms in two planes, an axial force [N] and a torque [N m] along the bar."""

    terms: tuple[MacaulayTerm, ...]
    axial_force: float = 0.0
    torque: float = 0.0

    @cached_property
    def pieces(self) -> tuple[Pieces, Pieces]:
        """The shear force of each plane as polynomials between the places where terms start."""
        return tuple(_pieces([term for term in self.terms if term.plane == plane]) for plane in (0, 1))


@dataclass(frozen=True)
class Pieces:
    """Q = sum c_j (x - s)^j from each start s to the next, shape (4, k), and M at the starts, (k,).

    Sums of Macaulay terms as they stand lose (x/a)^2 digits behind a short boss. Here the terms are shifted from start
    to start, and a coefficient that only rounding tells from zero is zero. ``rest`` belongs to the starts.
    """

    start: Array
    rest: Array
    shear: Array
    moment: Array


def _pieces(terms: list[MacaulayTerm]) -> Pieces:
    starting: dict[tuple[float, float], list[MacaulayTerm]] = {}
    for term in terms:
        starting.setdefault((term.start, term.rest), []).append(term)
    starts = sorted(starting)
    shear, moment = [], []
    now, bent, before = (0.0, 0.0, 0.0, 0.0), 0.0, (0.0, 0.0)
    for k, place in enumerate(starts):
        c0, c1, c2, c3 = now
        parts: list[list[float]] = [[], [], [], []]
        if k:
            h = (place[0] - before[0]) + (place[1] - before[1])
            bent += h * (c0 + h * (c1 / 2.0 + h * (c2 / 3.0 + h * c3 / 4.0)))
            parts = [
                [c0, c1 * h, c2 * h * h, c3 * h * h * h], [c1, 2.0 * c2 * h, 3.0 * c3 * h * h], [c2, 3.0 * c3 * h], [c3]
            ]  # fmt: skip
        for term in starting[place]:
            parts[term.order].append(term.coefficient)
        now = tuple(map(_settled, parts))
        shear.append(now)
        moment.append(bent)
        before = place
    places = np.array(starts).reshape(-1, 2)
    return Pieces(places[:, 0].copy(), places[:, 1].copy(), np.array(shear).reshape(-1, 4).T.copy(), np.array(moment))


def _settled(parts: list[float]) -> float:
    """Their sum, the greatest first: what those leave of each other by rounding is no part of what follows."""
    total = size = 0.0
    for part in sorted(parts, key=abs, reverse=True):
        total, size = total + part, size + abs(part)
        if abs(total) <= _NOTHING * size:
            total = size = 0.0
    return total


@dataclass(frozen=True)
class DeflectionReference:
    """The deflection half-way between two points, against the straight line through them.

    ``rest`` is what rounding left out of ``right``.
    """

    left: float
    right: float
    rest: float = 0.0

    def unit_load(self, x: Array, rest: Array | float = 0.0) -> tuple[Array, Array]:
        """Moment and shear magnitude of a unit force half-way: (x - left)/2 and 1/2 up to the middle, mirrored.

        ``rest`` as in ``forces_at``.
        """
        inside = (x >= self.left) & (x <= self.right)
        arm = np.maximum(0.5 * np.minimum(x - self.left + rest, self.right - x + (self.rest - rest)), 0.0)
        sign = np.where(x <= 0.5 * (self.left + self.right), 0.5, -0.5)
        return np.where(inside, arm, 0.0), np.where(inside, sign, 0.0)


@dataclass(frozen=True)
class InternalForces:
    """Resultants at stations: bending moments and shear forces of both planes (2, n), axial force and torque."""

    moment: Array
    shear: Array
    axial_force: float
    torque: float

    @property
    def moment_total(self) -> Array:
        return _both(self.moment)

    @property
    def shear_total(self) -> Array:
        return _both(self.shear)


def _both(planes: Array) -> Array:
    """The size of vectors (2, n), of which mostly only the first component is not zero."""
    return np.hypot(planes[0], planes[1]) if planes[1].any() else np.abs(planes[0])


def piston_pin_case(force: float, boss_length: float, small_end_length: float, gap: float) -> LoadCase:
    """The pin's load: uniform in the rod's small end, in each boss a triangle that is highest at its inner edge.

    Q(x) = P/(2a^2)(<x>^2 - <x-a>^2) - (P/a)<x-a> - (P/b)(<x-x1> - <x-x2>) + (P/a)<x-x3> - (P/(2a^2))<x-x3>^2,
    x1 = a + delta, x2 = x1 + b, x3 = x2 + delta. The moment in the middle is the textbook's
    P (L + 2(b + 2 delta) - 1.5 b)/12. Source: the paper's equations (4) and (5), after figure 2.
    """
    a, b = boss_length, small_end_length
    _, (x1, rest1), _, (x2, rest2), (x3, rest3), _ = pin_places(a, b, gap)
    ramp, boss, rod = force / (2.0 * a * a), force / a, force / b
    return LoadCase(
        (
            MacaulayTerm(ramp, 0.0, 2),
            MacaulayTerm(-ramp, a, 2),
            MacaulayTerm(-boss, a, 1),
            MacaulayTerm(-rod, x1, 1, rest=rest1),
            MacaulayTerm(rod, x2, 1, rest=rest2),
            MacaulayTerm(boss, x3, 1, rest=rest3),
            MacaulayTerm(-ramp, x3, 2, rest=rest3),
        )
    )


@lru_cache(maxsize=256)
def pin_places(boss_length: float, small_end_length: float, gap: float) -> tuple[tuple[float, float], ...]:
    """Where boss, small end, middle, gap, boss and pin end, each with what rounding leaves out of the float.

    Beside a long boss a short rod would otherwise lose the digits of its own length.
    """
    boss = (boss_length, 0.0)
    rod = _added(boss, gap)
    middle = _added(rod, 0.5 * small_end_length)
    rod_end = _added(rod, small_end_length)
    far_boss = _added(rod_end, gap)
    return boss, rod, middle, rod_end, far_boss, _added(far_boss, boss_length)


def _added(place: tuple[float, float], length: float) -> tuple[float, float]:
    """A sum of two floats and one more, likewise: Knuth's exact sum, and what is left of it once more."""
    total = place[0] + length
    part = total - place[0]
    rest = place[1] + ((place[0] - (total - part)) + (length - part))
    rounded = total + rest
    return rounded, rest - (rounded - total)


def forces_at(case: LoadCase, x: Array, side_of: Array, rest: Array | float = 0.0) -> InternalForces:
    """The resultants of a case at stations ``x``, of which rounding left out ``rest``.

    A term acts where it starts at or before ``side_of`` (same shape as x): a station on a point force belongs to the
    side on which its panel lies.
    """
    rest = np.array(np.broadcast_to(rest, x.shape), dtype=float, order="C")
    moment, shear = np.zeros((2, x.size)), np.zeros((2, x.size))
    for plane, pieces in enumerate(case.pieces):
        if pieces.start.size:
            _evaluate(
                x, rest, side_of, pieces.start, pieces.rest, pieces.shear, pieces.moment,
                moment[plane], shear[plane],
            )  # fmt: skip
    return InternalForces(moment, shear, case.axial_force, case.torque)


@kernel
def _evaluate(
    x: Array, rest: Array, side: Array, start: Array, start_rest: Array, c: Array, m: Array, moment: Array,
    shear: Array,
) -> None:  # fmt: skip
    k = 0
    for i in range(x.size):
        # Stations mostly rise, so the piece is the last one's or the next.
        while k > 0 and start[k] > side[i]:
            k -= 1
        while k + 1 < start.size and start[k + 1] <= side[i]:
            k += 1
        if start[k] > side[i]:
            continue
        t = (x[i] - start[k]) + (rest[i] - start_rest[k])
        shear[i] = c[0, k] + t * (c[1, k] + t * (c[2, k] + t * c[3, k]))
        moment[i] = m[k] + t * (c[0, k] + t * (c[1, k] / 2.0 + t * (c[2, k] / 3.0 + t * c[3, k] / 4.0)))


def breakpoints(cases: Sequence[LoadCase], length: float) -> list[float]:
    """The places inside (0, length) where a load begins or ends, rising, each once."""
    starts = {term.start for case in cases for term in case.terms if 0.0 < term.start < length}
    return sorted(starts)
