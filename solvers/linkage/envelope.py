"""What the moving mechanism sweeps: its least box over all orientations, and its least enclosing circle.

Links are straight, so the hull of what they sweep is the hull of what their joints sweep: the crank pin's circle about
the crank pivot, the rocker's pivot, and the arc of the rocker's joint about it. The hull's support function

    h(beta) = max(r, n.D, n.C at either end, n.D + l3 while beta lies within the arc),  n = (cos beta, sin beta)

is in pieces a constant and a sinusoid, and so are width W(alpha) = h(alpha) + h(alpha + pi) and height
H(alpha) = W(alpha + pi/2). The corners between pieces are known in closed form; between them f = W H has a bounded
second derivative, so f >= min(ends) - (step)^2/8 max|f''| prunes all but the neighbourhood of the least value. The box
found is thus within a stated relative tolerance of the least box there is.
Lengths in any one unit; angles in rad, from the base line. Pads are added on every side by the caller's ``pad``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.four_bar import FourBar
from solvers.linkage.kinds import ChangePoint, Ratios
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_STACK = 4096
_EIGHTH = 0.25 * math.pi


@dataclass(frozen=True)
class Box:
    """A rectangle turned by ``angle`` [rad] against the base line: ``width`` along it, ``height`` across."""

    width: float
    height: float
    angle: float

    @property
    def area(self) -> float:
        return self.width * self.height


def sweep(bar: FourBar, crank: float) -> Array:
    """The swept outline of one mechanism: see ``outlines``; shape (8,)."""
    return outlines(bar.kind, bar.ratios, crank, bar.swing)


def outlines(kind: ChangePoint, ratios: Ratios, crank: Array | float, swing: Array | float) -> Array:
    """Crank radius, base, rocker; x of the rocker's joint at the blow; how far it swings along the base and, signed,
    across it; first and last direction of the rocker. Shape (..., 8); six lengths, two angles.

    All links lie on one line at the blow, so that its joint is at sigma N from the crank's pivot, and it swings by
    2 lambda2/lambda0 and 2 sqrt(lambda2 (lambda0 lambda3 - lambda2))/lambda0: of long links and a small swing nothing
    cancels.
    """
    away = 2.0 * ratios.coupler / ratios.base
    side = kind.crank_sign * kind.rocker_sign * np.sqrt(np.maximum(kind.lock(ratios), 0.0) / ratios.coupler)
    lengths = (1.0 + 0.0 * away, ratios.base, ratios.rocker, kind.rocker_sign * kind.turn(ratios), away, away * side)
    parts = [*(crank * length for length in lengths), *_arc(kind, swing)]
    return np.stack(np.broadcast_arrays(*(np.asarray(part, float) for part in parts)), axis=-1)


def _arc(kind: ChangePoint, swing: Array | float) -> tuple[Array | float, Array | float]:
    """First and last direction of the rocker: it leaves the blow upward, except for the largest rocker."""
    if kind.rocker_sign > 0:
        return 0.0 * swing, swing
    return (math.pi + 0.0 * swing, math.pi + swing) if kind.crank_sign > 0 else (math.pi - swing, math.pi + 0.0 * swing)


def least_box(
    outline: Array, pad: float, width: float = math.inf, height: float = math.inf, tolerance: float = 1e-12
) -> Box | None:
    """The box of least area within width and height, to a relative tolerance; None where none fits."""
    area, angle, turned = least_area(outline, 2.0 * pad, 0.0, 0.0, width, height, tolerance, math.inf)
    if not math.isfinite(area):
        return None
    along, across = (side + 2.0 * pad for side in extents(outline, angle))
    free = math.isinf(width) and math.isinf(height)
    if turned or (free and angle < 0.0):
        return Box(across, along, angle + 0.5 * math.pi)
    return Box(along, across, angle if angle >= 0.0 else angle + math.pi)


def enclosing_radius(outline: Array, pad: float) -> float:
    """Radius of the least circle around the swept outline and its pads."""
    return enclosing(outline) + pad


@kernel
def _tips(outline: Array) -> tuple[float, float, float, float]:
    """Both ends of the rocker joint's arc: x, y at the blow and at the other end."""
    _, base, _, blow, away, rise, _, _ = outline
    return blow, 0.0, (blow - away if blow > base else blow + away), rise


@kernel
def _support(
    outline: Array, tips: tuple[float, float, float, float], beta: float, cos: float, sin: float
) -> tuple[float, float, float]:
    """The piece of h active at beta: (constant, x, y) with h = constant + x cos(beta) + y sin(beta)."""
    r, base, rocker, _, _, _, first, last = outline
    best, constant, x, y = r, r, 0.0, 0.0
    if base * cos > best:
        best, constant, x, y = base * cos, 0.0, base, 0.0
    for px, py in ((tips[0], tips[1]), (tips[2], tips[3])):
        reach = px * cos + py * sin
        if reach > best:
            best, constant, x, y = reach, 0.0, px, py
    turned = (beta - first) % (2.0 * math.pi)
    if turned <= last - first and base * cos + rocker > best:
        constant, x, y = rocker, base, 0.0
    return constant, x, y


@kernel
def _folded(x: float, y: float) -> float:
    """The direction of a vector less the nearest quarter turn, in [-pi/4, pi/4], sharp next to 0."""
    return math.atan(y / x) if abs(y) <= abs(x) else -math.atan(x / y)


@kernel
def _corners(outline: Array) -> Array:
    """All directions in [-pi/4, pi/4] at which a piece of W or H may change, with 0 and both ends, sorted.

    Pieces change across common tangents, which are built as vectors: directions close to the base line decide over
    boxes of long links.
    """
    r, base, rocker, blow, away, rise, _, _ = outline
    tips = _tips(outline)
    found = np.zeros(13)
    count = 0
    for x, y in ((base, 0.0), (tips[0], tips[1]), (tips[2], tips[3])):
        distance = math.hypot(x, y)
        if distance > r:
            along = math.sqrt((distance - r) * (distance + r))
            found[count] = _folded(r * x - along * y, r * y + along * x)
            found[count + 1] = _folded(r * x + along * y, r * y - along * x)
            count += 2
    found[count], found[count + 1] = _folded(away, rise if blow < base else -rise), 0.0
    swung = rocker - away if blow > base else away - rocker
    found[count + 2] = _folded(swung, rise) if swung != 0.0 or rise != 0.0 else 0.0
    count += 3
    # The crank's circle beside the rocker's: n.D + l3 = r.
    beside = (blow if blow < base else base - rocker) + r
    above = base - r + rocker
    if beside >= 0.0 and above > 0.0:
        across = math.sqrt(beside * above)
        found[count], found[count + 1] = _folded(r - rocker, across), _folded(r - rocker, -across)
        count += 2
    found[count], found[count + 1] = -_EIGHTH, _EIGHTH
    # A dozen numbers, in the shortest way for the compiler too.
    for k in range(1, count + 2):
        m = k
        while m > 0 and found[m - 1] > found[m]:
            found[m - 1], found[m] = found[m], found[m - 1]
            m -= 1
    return found[: count + 2]


@kernel
def _pieces(
    outline: Array, tips: tuple[float, float, float, float], middle: float
) -> tuple[float, float, float, float, float, float]:
    """W and H around a direction: constants and the factors of cos(alpha), sin(alpha)."""
    cos, sin = math.cos(middle), math.sin(middle)
    c1, x1, y1 = _support(outline, tips, middle, cos, sin)
    c2, x2, y2 = _support(outline, tips, middle + math.pi, -cos, -sin)
    c3, x3, y3 = _support(outline, tips, middle + 0.5 * math.pi, -sin, cos)
    c4, x4, y4 = _support(outline, tips, middle + 1.5 * math.pi, sin, -cos)
    return c1 + c2, x1 - x2, y1 - y2, c3 + c4, y3 - y4, x4 - x3


@kernel
def extents(outline: Array, angle: float) -> tuple[float, float]:
    """W and H at a direction, pads not included."""
    wc, wx, wy, hc, hx, hy = _pieces(outline, _tips(outline), angle)
    cos, sin = math.cos(angle), math.sin(angle)
    return wc + wx * cos + wy * sin, hc + hx * cos + hy * sin


@kernel
def _less(
    wx: float, wy: float, hx: float, hy: float, along: float, across: float, middle: float
) -> tuple[float, float, float, float]:
    """The factors of cos(alpha), sin(alpha) in W and H less 2 (along |n_x| + across |n_y|), n their directions.

    No corner lies between ``middle`` and the ends of its piece, and every quarter turn from the base line is one.
    """
    c, s = math.copysign(2.0, math.cos(middle)), math.copysign(2.0, math.sin(middle))
    return wx - c * along, wy - s * across, hx - c * across, hy - s * along


@kernel
def least_area(
    outline: Array, pads: float, along: float, across: float, width: float, height: float, tolerance: float,
    enough: float,
) -> tuple[float, float, bool]:  # fmt: skip
    """(least area, its direction, whether a quarter turn is to be added to it) over all orientations whose box keeps
    within width and height; inf where none does.

    ``pads`` is added to W and H; of outlines that may differ from this one by ``along`` in the base's direction and by
    ``across`` across it, W and H are told from below. An answer below ``enough`` is within ``tolerance`` of the least
    area; any other says only that the least area is not below ``enough``.
    """
    edges = _corners(outline)
    best, at = _least_upright(
        outline, edges, pads, along, across, width, height, tolerance, enough, math.inf
    )  # fmt: skip
    if width == height:
        return best, at, False
    other, there = _least_upright(outline, edges, pads, along, across, height, width, tolerance, enough, best)
    return (other, there, True) if other < best else (best, at, False)


@kernel
def _least_upright(
    outline: Array, edges: Array, pads: float, along: float, across: float, width: float, height: float,
    tolerance: float, enough: float, best: float,
) -> tuple[float, float]:  # fmt: skip
    """``least_area`` within an eighth of a turn about the base line; ``best`` is what is known already."""
    tips = _tips(outline)
    free, at = width == math.inf and height == math.inf, 0.0
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = _pieces(outline, tips, middle)
        wx, wy, hx, hy = _less(wx, wy, hx, hy, along, across, middle)
        wc, hc = wc + pads, hc + pads
        w1, h1 = math.hypot(wx, wy), math.hypot(hx, hy)
        bend = (abs(wc) * h1 + abs(hc) * w1 + 2.0 * w1 * h1) / 8.0
        lefts[0], rights[0] = edges[k], edges[k + 1]
        depth = 1
        while depth:
            depth -= 1
            left, right = lefts[depth], rights[depth]
            cl, sl, cr, sr = math.cos(left), math.sin(left), math.cos(right), math.sin(right)
            wl, hl = wc + wx * cl + wy * sl, hc + hx * cl + hy * sl
            wr, hr = wc + wx * cr + wy * sr, hc + hx * cr + hy * sr
            if wl <= width and hl <= height and wl * hl < best:
                best, at = wl * hl, left
            if wr <= width and hr <= height and wr * hr < best:
                best, at = wr * hr, right
            if best <= 0.0:
                # A bound that tells nothing: only what moves a long way comes so low.
                return 0.0, at
            step = (right - left) ** 2
            if not free and (min(wl, wr) - step / 8.0 * w1 > width or min(hl, hr) - step / 8.0 * h1 > height):
                continue
            least = min(wl * hl, wr * hr) - step * bend
            if least >= enough or (best < enough and least >= best * (1.0 - tolerance)):
                continue
            if step < 1e-28 or depth + 2 > _STACK:
                continue
            middle = 0.5 * (left + right)
            lefts[depth], rights[depth] = left, middle
            lefts[depth + 1], rights[depth + 1] = middle, right
            depth += 2
    return best, at


@kernel
def least_fit(outline: Array, along: float, across: float, width: float, height: float, tolerance: float) -> float:
    """The least over all orientations of max(W/width, H/height); at most 1 where the outline fits.

    ``along`` and ``across`` as in ``least_area``.
    """
    edges = _corners(outline)
    best = _least_upright_fit(outline, edges, along, across, width, height, tolerance, math.inf)
    if width == height:
        return best
    return _least_upright_fit(outline, edges, along, across, height, width, tolerance, best)


@kernel
def _least_upright_fit(
    outline: Array, edges: Array, along: float, across: float, width: float, height: float, tolerance: float,
    best: float,
) -> float:  # fmt: skip
    """``least_fit`` within an eighth of a turn about the base line; ``best`` is what is known already."""
    tips = _tips(outline)
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = _pieces(outline, tips, middle)
        wx, wy, hx, hy = _less(wx, wy, hx, hy, along, across, middle)
        wc, wx, wy, hc, hx, hy = wc / width, wx / width, wy / width, hc / height, hx / height, hy / height
        w1, h1 = math.hypot(wx, wy), math.hypot(hx, hy)
        lefts[0], rights[0] = edges[k], edges[k + 1]
        depth = 1
        while depth:
            depth -= 1
            left, right = lefts[depth], rights[depth]
            cl, sl, cr, sr = math.cos(left), math.sin(left), math.cos(right), math.sin(right)
            wl, hl = wc + wx * cl + wy * sl, hc + hx * cl + hy * sl
            wr, hr = wc + wx * cr + wy * sr, hc + hx * cr + hy * sr
            best = min(best, max(wl, hl), max(wr, hr))
            if best <= 0.0:
                return 0.0
            step = (right - left) ** 2
            least = max(min(wl, wr) - step * w1 / 8.0, min(hl, hr) - step * h1 / 8.0)
            if least >= best * (1.0 - tolerance) or step < 1e-28 or depth + 2 > _STACK:
                continue
            middle = 0.5 * (left + right)
            lefts[depth], rights[depth] = left, middle
            lefts[depth + 1], rights[depth + 1] = middle, right
            depth += 2
    return best


@kernel
def _through(circles: Array, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Centre and radius of the circle that two (k < 0) or three circles (x, y, radius) touch from inside."""
    x1, y1, r1 = circles[i]
    x2, y2, r2 = circles[j]
    dx, dy = x2 - x1, y2 - y1
    distance = math.hypot(dx, dy)
    if k < 0:
        radius = 0.5 * (distance + r1 + r2)
        if distance <= abs(r1 - r2):
            return (x1, y1, r1) if r1 > r2 else (x2, y2, r2)
        share = (radius - r1) / distance
        return x1 + share * dx, y1 + share * dy, radius
    x3, y3, r3 = circles[k]
    ex, ey = x3 - x1, y3 - y1
    determinant = 2.0 * (dx * ey - dy * ex)
    if abs(determinant) < 1e-14 * (dx * dx + dy * dy + ex * ex + ey * ey):
        return 0.0, 0.0, math.inf
    # |c - c1|^2 = (R - r1)^2 and the like, subtracted: the centre is linear in S = R - r1.
    a1, b1 = dx * dx + dy * dy - (r2 - r1) ** 2, r2 - r1
    a2, b2 = ex * ex + ey * ey - (r3 - r1) ** 2, r3 - r1
    px, py = (a1 * ey - a2 * dy) / determinant, (a2 * dx - a1 * ex) / determinant
    qx, qy = 2.0 * (b1 * ey - b2 * dy) / determinant, 2.0 * (b2 * dx - b1 * ex) / determinant
    a, b, c = qx * qx + qy * qy - 1.0, px * qx + py * qy, px * px + py * py
    if abs(a) < 1e-14:
        s = -0.5 * c / b if b != 0.0 else math.inf
    else:
        inner = b * b - a * c
        if inner < 0.0:
            return 0.0, 0.0, math.inf
        low, high = (-b - math.sqrt(inner)) / a, (-b + math.sqrt(inner)) / a
        low, high = min(low, high), max(low, high)
        need = max(0.0, b1, b2)
        s = low if low >= need else high
    if s < max(0.0, b1, b2):
        return 0.0, 0.0, math.inf
    return x1 + px + qx * s, y1 + py + qy * s, s + r1


@kernel
def _reach(circles: Array, count: int, x: float, y: float) -> float:
    """Radius of the least circle about a centre that holds the first ``count`` circles."""
    found = 0.0
    for m in range(count):
        found = max(found, math.hypot(circles[m, 0] - x, circles[m, 1] - y) + circles[m, 2])
    return found


@kernel
def enclosing(outline: Array) -> float:
    """Radius of the least circle around the outline.

    A circle held by two or three touching parts is the least around them; the part that sticks out farthest joins
    them, and the least circle around these four is found by trial, until nothing sticks out. The radius only grows.
    """
    r, base, rocker, _, _, _, first, last = outline
    tips = _tips(outline)
    parts = np.zeros((4, 3))
    parts[0, 2] = r
    parts[1, 0], parts[1, 1] = tips[2], tips[3]
    count = 2
    x, y, radius = _through(parts, 0, 1, -1)
    for _ in range(200):
        # The farthest part from the centre.
        far, fx, fy, fr = math.hypot(x, y) + r, 0.0, 0.0, r
        if math.hypot(x - base, y) > far:
            far, fx, fy, fr = math.hypot(x - base, y), base, 0.0, 0.0
        for px, py in ((tips[0], tips[1]), (tips[2], tips[3])):
            if math.hypot(px - x, py - y) > far:
                far, fx, fy, fr = math.hypot(px - x, py - y), px, py, 0.0
        away = math.atan2(-y, base - x)
        if (away - first) % (2.0 * math.pi) <= last - first and math.hypot(x - base, y) + rocker > far:
            far = math.hypot(x - base, y) + rocker
            fx, fy, fr = base + rocker * math.cos(away), rocker * math.sin(away), 0.0
        if far <= radius * (1.0 + 1e-13):
            break
        parts[count, 0], parts[count, 1], parts[count, 2] = fx, fy, fr
        count += 1
        best, bx, by, bi, bj, bk = math.inf, x, y, 0, 0, -1
        for i in range(count):
            for j in range(i + 1, count):
                for k in range(j, count):
                    third = -1 if k == j else k
                    cx, cy, size = _through(parts, i, j, third)
                    if size == math.inf:
                        continue
                    # What the centre needs, rather than whether its circle holds all: rounding cannot rule all out.
                    size = _reach(parts, count, cx, cy)
                    if size < best:
                        best, bx, by, bi, bj, bk = size, cx, cy, i, j, third
        if best <= radius:
            # Rounding alone is left.
            radius = max(radius, far)
            break
        x, y, radius = bx, by, best
        kept = np.zeros((4, 3))
        count = 3 if bk >= 0 else 2
        for k in range(3):
            kept[0, k], kept[1, k] = parts[bi, k], parts[bj, k]
            if bk >= 0:
                kept[2, k] = parts[bk, k]
        parts = kept
    return radius
