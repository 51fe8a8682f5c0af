"""Outline of the area swept by the mechanism, and its extents in any direction.

Links are straight, so the convex hull of the swept area is that of the joints' paths: the crank pin's circle about the
crank pivot, the rocker's pivot, and the arc of the rocker's joint about it. The hull's support function

    h(beta) = max(r, n.D, n.C at either end, n.D + l3 while beta lies within the arc),  n = (cos beta, sin beta)

is piecewise a constant plus a sinusoid, and so are width W(alpha) = h(alpha) + h(alpha + pi) and height
H(alpha) = W(alpha + pi/2). The corners between pieces are known in closed form.
Lengths in any consistent unit; angles in rad, from the base line. Pads are not included; callers add them.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.mechanism.kinematics import FourBar
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_EIGHTH = 0.25 * math.pi


def sweep(bar: FourBar, crank: Array | float) -> Array:
    """The swept outline of a mechanism, or of many: crank radius, base, rocker; x of the rocker's joint at the blow;
    its displacement along and, signed, across the base; first and last direction of the rocker. Shape (..., 8); six
    lengths, two angles.

    At the blow all links are collinear with the joint at sigma N from the crank's pivot; its displacements are
    2 lambda2/lambda0 and 2 sqrt(lambda2 (lambda0 lambda3 - lambda2))/lambda0, free of cancellation for long links and a
    small swing. The rocker departs upward from the blow, except for the largest rocker.
    """
    kind, ratios, swing = bar.kind, bar.ratios, bar.swing
    away = 2.0 * ratios.coupler / ratios.base
    side = np.sqrt(np.maximum(kind.straight_swing_margin(ratios), 0.0) / ratios.coupler)
    rise = away * side * kind.crank_sign * kind.rocker_sign
    blow = kind.rocker_sign * kind.half_angle_coefficient(ratios)
    out = np.empty((*np.shape(away * crank), 8))
    for k, length in enumerate((1.0, ratios.base, ratios.rocker, blow, away, rise)):
        out[..., k] = crank * length
    first = 0.0 if kind.rocker_sign > 0 else math.pi if kind.crank_sign > 0 else math.pi - swing
    out[..., 6], out[..., 7] = first, first + swing
    return out


@kernel
def arc_ends(outline: Array) -> tuple[float, float, float, float]:
    """Both ends of the rocker joint's arc: x, y at the blow and at the other end."""
    _, base, _, blow, away, rise, _, _ = outline
    return blow, 0.0, (blow - away if blow > base else blow + away), rise


@kernel
def touched_part(outline: Array, beta: float, cos: float, sin: float) -> int:
    """The part of the outline that is touched at beta: the crank's circle 0, the rocker's pivot 1, the arc's end at the
    blow 2, its other end 3, the arc 4."""
    r, base, rocker, _, _, _, first, last = outline
    x, y, end_x, end_y = arc_ends(outline)
    support, part = r, 0
    if base * cos > support:
        support, part = base * cos, 1
    if x * cos + y * sin > support:
        support, part = x * cos + y * sin, 2
    if end_x * cos + end_y * sin > support:
        support, part = end_x * cos + end_y * sin, 3
    if (beta - first) % (2.0 * math.pi) <= last - first and base * cos + rocker > support:
        part = 4
    return part


@kernel
def part_extent(outline: Array, deductions: Array, part: int, cos: float, sin: float) -> tuple[float, float, float]:
    """Constant and coefficients of cos(beta), sin(beta) of a part's extent, less ``deductions``, in a quadrant of beta
    given by the signs of its cosine and sine."""
    r, base, rocker, blow, _, _, _, _ = outline
    crank_less, rocker_less, swing_less, along_less, rise_less = deductions
    outward = blow > base
    if part == 0:
        return r if outward else r - crank_less, 0.0, 0.0
    x, y, end_x, end_y = arc_ends(outline)
    if part == 1:
        return 0.0, base if outward else base - rocker_less, 0.0
    if part == 2:
        return 0.0, x, y
    if part == 3:
        return 0.0, end_x - math.copysign(along_less, cos), end_y - math.copysign(rise_less, sin)
    return rocker - rocker_less - swing_less, base + rocker_less if outward else base - rocker_less, 0.0


@kernel
def _modulo_quarter_turn(x: float, y: float) -> float:
    """The direction of a vector modulo pi/2, in [-pi/4, pi/4], accurate near 0."""
    return math.atan(y / x) if abs(y) <= abs(x) else -math.atan(x / y)


@kernel
def corner_directions(outline: Array) -> Array:
    """All directions in [-pi/4, pi/4] at which a piece of W or H may change, with 0 and both ends, sorted.

    Pieces change at common tangents, which are computed as vectors: for long links the box depends on directions very
    close to the base line.
    """
    r, base, rocker, blow, away, rise, _, _ = outline
    tips = arc_ends(outline)
    found = np.zeros(13)
    count = 0
    for x, y in ((base, 0.0), (tips[0], tips[1]), (tips[2], tips[3])):
        distance = math.hypot(x, y)
        if distance > r:
            along = math.sqrt((distance - r) * (distance + r))
            found[count] = _modulo_quarter_turn(r * x - along * y, r * y + along * x)
            found[count + 1] = _modulo_quarter_turn(r * x + along * y, r * y - along * x)
            count += 2
    found[count], found[count + 1] = _modulo_quarter_turn(away, rise if blow < base else -rise), 0.0
    pivot_to_end = rocker - away if blow > base else away - rocker
    found[count + 2] = _modulo_quarter_turn(pivot_to_end, rise) if pivot_to_end != 0.0 or rise != 0.0 else 0.0
    count += 3
    # The crank's circle against the rocker's: n.D + l3 = r.
    inner = (blow if blow < base else base - rocker) + r
    outer = base - r + rocker
    if inner >= 0.0 and outer > 0.0:
        across = math.sqrt(inner * outer)
        found[count], found[count + 1] = (
            _modulo_quarter_turn(r - rocker, across),
            _modulo_quarter_turn(r - rocker, -across),
        )
        count += 2
    found[count], found[count + 1] = -_EIGHTH, _EIGHTH
    # Insertion sort: a dozen values, and fast to compile.
    for k in range(1, count + 2):
        m = k
        while m > 0 and found[m - 1] > found[m]:
            found[m - 1], found[m] = found[m], found[m - 1]
            m -= 1
    return found[: count + 2]


@kernel
def touched_parts(outline: Array, middle: float) -> tuple[int, int, int, int]:
    """The parts between which the outline's W and H are measured near a direction."""
    cos, sin = math.cos(middle), math.sin(middle)
    return (
        touched_part(outline, middle, cos, sin),
        touched_part(outline, middle + math.pi, -cos, -sin),
        touched_part(outline, middle + 0.5 * math.pi, -sin, cos),
        touched_part(outline, middle + 1.5 * math.pi, sin, -cos),
    )


@kernel
def extent_sinusoids(
    outline: Array, deductions: Array, parts: tuple[int, int, int, int], middle: float
) -> tuple[float, float, float, float, float, float]:
    """W and H between these parts, less ``deductions``, near a direction: constants and the coefficients of cos(alpha),
    sin(alpha)."""
    cos, sin = math.cos(middle), math.sin(middle)
    c1, x1, y1 = part_extent(outline, deductions, parts[0], cos, sin)
    c2, x2, y2 = part_extent(outline, deductions, parts[1], -cos, -sin)
    c3, x3, y3 = part_extent(outline, deductions, parts[2], -sin, cos)
    c4, x4, y4 = part_extent(outline, deductions, parts[3], sin, -cos)
    return c1 + c2, x1 - x2, y1 - y2, c3 + c4, y3 - y4, x4 - x3


@kernel
def extents(outline: Array, angle: float) -> tuple[float, float]:
    """W and H at a direction, without pads."""
    wc, wx, wy, hc, hx, hy = extent_sinusoids(outline, np.zeros(5), touched_parts(outline, angle), angle)
    cos, sin = math.cos(angle), math.sin(angle)
    return wc + wx * cos + wy * sin, hc + hx * cos + hy * sin
