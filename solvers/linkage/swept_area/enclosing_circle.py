"""Smallest enclosing circle of a swept outline. Lengths in any consistent unit."""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.swept_area.outline import arc_ends
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


def enclosing_radius(outline: Array, pad: float) -> float:
    """Radius of the smallest circle around the padded swept outline."""
    return float(enclosing_radii(outline[None])[0]) + pad


@kernel
def _tangent_circle(circles: Array, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Centre and radius of the circle internally tangent to two (k < 0) or three circles (x, y, radius)."""
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
    # Differences of |c - c1|^2 = (R - r1)^2 and its counterparts: the centre is linear in S = R - r1.
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
def _radius_about(circles: Array, count: int, x: float, y: float) -> float:
    """Radius of the smallest circle about a given centre that contains the first ``count`` circles."""
    found = 0.0
    for m in range(count):
        found = max(found, math.hypot(circles[m, 0] - x, circles[m, 1] - y) + circles[m, 2])
    return found


@kernel
def smallest_circle(outline: Array) -> tuple[float, float, float, Array]:
    """Radius of the smallest circle around the outline, its centre, and the two or three parts that it touches: circles
    (x, y, radius).

    Iteration over sets of two or three tangent parts, whose smallest circle is known: the part that protrudes farthest
    is added, and the smallest circle around these four is found by enumeration, until no part protrudes. The radius
    increases monotonically.
    """
    r, base, rocker, _, _, _, first, last = outline
    tips = arc_ends(outline)
    parts = np.zeros((4, 3))
    parts[0, 2] = r
    parts[1, 0], parts[1, 1] = tips[2], tips[3]
    count = 2
    x, y, radius = _tangent_circle(parts, 0, 1, -1)
    for _ in range(200):
        # The part farthest from the centre.
        far, fx, fy, fr = 0.0, 0.0, 0.0, 0.0
        for px, py, pr in ((0.0, 0.0, r), (base, 0.0, 0.0), (tips[0], tips[1], 0.0), (tips[2], tips[3], 0.0)):
            if math.hypot(px - x, py - y) + pr > far:
                far, fx, fy, fr = math.hypot(px - x, py - y) + pr, px, py, pr
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
                    cx, cy, size = _tangent_circle(parts, i, j, third)
                    if size == math.inf:
                        continue
                    # The radius required at this centre, not a containment test, which rounding could fail for all.
                    size = _radius_about(parts, count, cx, cy)
                    if size < best:
                        best, bx, by, bi, bj, bk = size, cx, cy, i, j, third
        if best <= radius:
            # Only rounding remains.
            radius, count = max(radius, far), count - 1
            break
        x, y, radius = bx, by, best
        count = 3 if bk >= 0 else 2
        # In place: bi < bj < bk.
        for k in range(3):
            parts[0, k], parts[1, k], parts[2, k] = parts[bi, k], parts[bj, k], parts[max(bk, 2), k]
    return radius, x, y, parts[:count]


@kernel
def enclosing_radii(outlines: Array) -> Array:
    """Smallest enclosing radius of every outline."""
    out = np.empty(outlines.shape[0])
    for i in range(out.size):
        out[i] = smallest_circle(outlines[i])[0]
    return out
