"""What errors of the lengths do: a closure that is missed, and a restitution that is not the one designed for.

A change-point mechanism needs its lengths to close exactly. With a closure surplus delta (in cranks, see
``ChangePoint.surplus``) the line is missed by the window phi_w = sqrt(2 |delta| e/lambda0) about phi = 0:

    delta < 0  the crank is blocked within +-phi_w
    delta > 0  the crank passes, but the rocker turns back short of its place by sqrt(g^2 - 1) phi_w/e

to first order in sqrt(|delta|). While the closure holds, R_k moves with the lengths by
dR_k/R_k = g/(g^2 - 1) (dlambda0/lambda0 + dlambda2/lambda2 - dlambda3/lambda3).
Lengths in cranks, angles in rad. Derivation: docs/theory/impact-linkage.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.linkage.four_bar import FourBar
from solvers.linkage.kinds import KINDS, ChangePoint

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
    """A missed closure: half width [rad] of the crank angles concerned, and how far short the rocker stops [rad]."""

    angle: float
    blocked: bool
    short_stop: float


def closure(base: float, crank: float, coupler: float, rocker: float) -> Closure:
    """The nearest kind, by the surplus relative to the longest link: the same for lengths in any unit."""
    longest = max(base, crank, coupler, rocker)
    found = []
    for kind in KINDS.values():
        # Scaled by the crank, so that the 1 of the closure is the crank itself.
        surplus = math.fsum(_signed(kind, base, crank, coupler, rocker))
        found.append(Closure(kind, surplus / crank, surplus / longest))
    return min(found, key=lambda c: abs(c.relative))


def _signed(kind: ChangePoint, base: float, crank: float, coupler: float, rocker: float) -> tuple[float, ...]:
    """The terms of the closure, each exact."""
    signs = (kind.surplus(1.0, 0.0, 0.0) + 1.0, kind.surplus(0.0, 1.0, 0.0) + 1.0, kind.surplus(0.0, 0.0, 1.0) + 1.0)
    return signs[0] * base, -crank, signs[1] * coupler, signs[2] * rocker


def window(bar: FourBar, surplus: float) -> Window:
    """What a closure surplus [cranks] does to a mechanism that nearly closes."""
    reach = abs(float(bar.kind.reach(bar.ratios)))
    angle = math.sqrt(2.0 * abs(surplus) * reach / bar.ratios.base)
    blocked = surplus < 0
    short = 0.0 if blocked else math.sqrt(max(bar.gain**2 - 1.0, 0.0)) * angle / reach
    return Window(angle, blocked, short)


def restitution_sensitivity(gain: float) -> float:
    """dR_k/R_k for a relative error of lambda0 or lambda2 (of lambda3: the negative), while the closure holds."""
    return gain / abs(gain * gain - 1.0) if gain != 1.0 else math.inf


def restitution_error(bar: FourBar, crank: float, tolerance: float) -> float:
    """Greatest relative error of R_k when every length may be off by ``tolerance`` [m], while the closure holds."""
    base, coupler, rocker = (crank * r for r in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    return restitution_sensitivity(bar.gain) * tolerance * (1.0 / base + 1.0 / coupler + 1.0 / rocker)


def closure_error(bar: FourBar, crank: float, tolerance: float) -> float:
    """Greatest closure surplus [cranks] when each of the four lengths may be off by ``tolerance`` [m]."""
    return 4.0 * tolerance / crank
