"""Effects of length errors of a change-point mechanism: on its closure, hence on the crank's rotation, and on its
restitution.

A change-point mechanism requires exact closure of its lengths. A closure surplus delta (in cranks: the
left side of ``ChangePoint``'s closure minus 1) prevents the collinear position within a window phi_w about phi = 0:

    delta < 0  the crank is blocked within +-phi_w,    sin^2(phi_w/2) = |delta| (2 e +- |delta|)/(4 lambda0)
    delta > 0  the crank passes, but the rocker reverses short of its end position by psi,
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

_CLOSURE_TOLERANCE = 1e-12
"""Relative closure error attributable to the rounding of decimal lengths."""


@dataclass(frozen=True)
class Closure:
    """The closure surplus in cranks and relative to the longest link."""

    surplus: float = 0.0
    relative: float = 0.0

    @property
    def closes(self) -> bool:
        return abs(self.relative) <= _CLOSURE_TOLERANCE


@dataclass(frozen=True)
class Window:
    """Effect of a closure error: half width [rad] of the affected crank angles, and the rocker's shortfall [rad].

    If the crank is not blocked the angle is that of a deficit of equal magnitude.
    """

    angle: float
    blocked: bool
    short_stop: float


def nearest_kind(
    base: float, crank: float, coupler: float, rocker: float, preferred: ChangePoint | None = None
) -> tuple[ChangePoint, Closure]:
    """The kind with the least surplus relative to the longest link, independent of the unit of length, and its closure.

    A parallelogram closes as two kinds at once; ``preferred`` then decides.
    """
    longest = max(base, crank, coupler, rocker)
    links, found = (base, coupler, rocker), {}
    for kind in KINDS.values():
        # Scaled by the crank, so that the 1 in the closure is the crank itself.
        surplus = math.fsum((-crank, *(sign * link for sign, link in zip(kind.closure_signs, links, strict=True))))
        found[kind] = Closure(surplus / crank, surplus / longest)
    nearest = min(found, key=lambda k: (0.0 if found[k].closes else abs(found[k].relative), k is not preferred))
    return nearest, found[nearest]


def window(bar: FourBar, surplus: float) -> Window:
    """Effect of a closure surplus [cranks]: exact if ``bar`` has the actual lengths.

    From the law of cosines in the triangle of base and crank, and in that of base and rocker with crank and coupler
    collinear.
    """
    r, error = bar.ratios, abs(surplus)
    pin_distance, joint_distance = float(bar.kind.pin_to_pivot(r)), abs(float(bar.kind.half_angle_coefficient(r)))
    angle = _twice_arcsine(error * (2.0 * pin_distance + bar.kind.crank_sign * error) / (4.0 * r.base))
    if surplus < 0:
        return Window(angle, True, 0.0)
    square = error * (2.0 * joint_distance + bar.kind.rocker_sign * error) / (4.0 * r.base * r.rocker)
    return Window(angle, False, _twice_arcsine(square))


def _twice_arcsine(square: float) -> float:
    return 2.0 * math.asin(math.sqrt(min(max(square, 0.0), 1.0)))


def rotates_fully(base: float, crank: float, coupler: float, rocker: float) -> bool:
    """Whether the crank rotates fully: the coupler reaches from its pin to the rocker at every angle."""
    near, far = abs(base - crank), base + crank
    return near >= abs(coupler - rocker) and far <= coupler + rocker


def crank_angle_limit(bar: FourBar) -> float | None:
    """The crank angle [rad] on either side of the blow beyond which the links cannot close; None if it is unlimited."""
    r = bar.ratios
    base_minus_crank, base_plus_crank = r.base_minus_one, r.base + 1.0
    if bar.kind.crank_sign > 0:
        square = (r.coupler + r.rocker - base_minus_crank) * (r.coupler + r.rocker + base_minus_crank) / (4.0 * r.base)
    else:
        difference = abs(r.coupler - r.rocker)
        square = (base_plus_crank - difference) * (base_plus_crank + difference) / (4.0 * r.base)
    return None if square >= 1.0 else _twice_arcsine(square)


def restitution_error(bar: FourBar, crank: float, tolerance: float) -> float:
    """Maximum relative error of R_k for a tolerance [m] of every length, with the closure satisfied:

    dR_k/R_k = g/(g^2 - 1) (dl0/l0 + dl2/l2 - dl3/l3 - dl1/l1).

    In the largest coupler and base the closure allows all four at their worst; in the largest rocker it requires
    dl0 + dl2 = dl1 + dl3, so that the two longest links have to make up for the two shortest.
    """
    r, gain = bar.ratios, bar.gain
    sensitivity = gain / abs(gain * gain - 1.0) if gain != 1.0 else math.inf
    smallest, small, large, largest = sorted(1.0 / (crank * link) for link in (1.0, r.base, r.coupler, r.rocker))
    opposed = bar.kind.crank_sign != bar.kind.rocker_sign
    change = largest + large - small - smallest if opposed else largest + large + small + smallest
    return sensitivity * tolerance * change
