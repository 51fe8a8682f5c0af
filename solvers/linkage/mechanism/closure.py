"""Lengths that miss the closure of a change-point mechanism, and how far the crank turns.

A change-point mechanism needs its lengths to close exactly. With a closure surplus delta (in cranks, see
``ChangePoint.surplus``) the line is missed by a window phi_w about phi = 0:

    delta < 0  the crank is blocked within +-phi_w,    sin^2(phi_w/2) = |delta| (2 e +- |delta|)/(4 lambda0)
    delta > 0  the crank passes, but the rocker turns back short of its place by psi,
               sin^2(psi/2) = delta (2 |N| +- delta)/(4 lambda0 lambda3)

with + in the first for the largest coupler and rocker, in the second for the largest coupler, and - otherwise; so
phi_w = sqrt(2 |delta| e/lambda0) and psi = sqrt(g^2 - 1) phi_w/e to first order in sqrt(|delta|).
Lengths in cranks, angles in rad. Derivation: docs/theory/impact-linkage.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.linkage.mechanism.change_point import KINDS, ChangePoint
from solvers.linkage.mechanism.kinematics import FourBar

CLOSES = 1e-12
"""Relative closure error that the rounding of decimal lengths explains."""


@dataclass(frozen=True)
class Closure:
    """The kind whose closure the lengths come nearest to; the surplus in cranks and relative to the longest link."""

    kind: ChangePoint
    surplus: float
    relative: float

    @property
    def closes(self) -> bool:
        return abs(self.relative) <= CLOSES


@dataclass(frozen=True)
class Window:
    """A missed closure: half width [rad] of the crank angles concerned, and how far short the rocker stops [rad].

    Where the crank is not blocked the angle is that of a deficit of the same size.
    """

    angle: float
    blocked: bool
    short_stop: float


def closure(base: float, crank: float, coupler: float, rocker: float, preferred: ChangePoint | None = None) -> Closure:
    """The nearest kind, by the surplus relative to the longest link: the same for lengths in any unit.

    A parallelogram closes as two kinds at once; the preferred one of them is taken.
    """
    longest = max(base, crank, coupler, rocker)
    links, found = (base, coupler, rocker), []
    for kind in KINDS.values():
        # Scaled by the crank, so that the 1 of the closure is the crank itself.
        surplus = math.fsum((-crank, *(sign * link for sign, link in zip(kind.closure_signs, links, strict=True))))
        found.append(Closure(kind, surplus / crank, surplus / longest))
    return min(found, key=lambda c: (0.0 if c.closes else abs(c.relative), c.kind is not preferred))


def window(bar: FourBar, surplus: float) -> Window:
    """What a closure surplus [cranks] does: exact for ``bar`` made of the lengths as they are.

    From the law of cosines in the triangle of base and crank, and in that of base and rocker where crank and coupler
    lie on one line.
    """
    r, miss = bar.ratios, abs(surplus)
    reach, turn = float(bar.kind.pin_to_pivot(r)), abs(float(bar.kind.half_angle_coefficient(r)))
    angle = _twice_arcsine(miss * (2.0 * reach + bar.kind.crank_sign * miss) / (4.0 * r.base))
    if surplus < 0:
        return Window(angle, True, 0.0)
    stop = miss * (2.0 * turn + bar.kind.rocker_sign * miss) / (4.0 * r.base * r.rocker)
    return Window(angle, False, _twice_arcsine(stop))


def _twice_arcsine(square: float) -> float:
    return 2.0 * math.asin(math.sqrt(min(max(square, 0.0), 1.0)))


def turns_fully(base: float, crank: float, coupler: float, rocker: float) -> bool:
    """Whether the crank turns fully: from its pin the coupler reaches the rocker at every angle."""
    near, far = abs(base - crank), base + crank
    return near >= abs(coupler - rocker) and far <= coupler + rocker


def confinement(bar: FourBar) -> float | None:
    """The crank angle [rad] to either side of the blow beyond which the links do not reach; None where they do."""
    r = bar.ratios
    base_less, base_more = r.base_less_one, r.base + 1.0
    if bar.kind.crank_sign > 0:
        square = (r.coupler + r.rocker - base_less) * (r.coupler + r.rocker + base_less) / (4.0 * r.base)
    else:
        apart = abs(r.coupler - r.rocker)
        square = (base_more - apart) * (base_more + apart) / (4.0 * r.base)
    return None if square >= 1.0 else _twice_arcsine(square)
