"""Smallest enclosing circle of a swept outline. Lengths in any consistent unit."""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.swept_area.outline import tips_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


def enclosing_radius(outline: Array, pad: float) -> float:
    """Radius of the smallest circle around the padded swept outline."""
    return float(enclosing_radii(outline[None])[0]) + pad


@kernel
def _through(circles: Array, i: int, j: int, k: int) -> tuple[float, float, float]:
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
def _required(outline: Array, tips: tuple[float, float, float, float], x: float, y: float) -> float:
    """Radius of the smallest circle about a centre that contains the outline."""
    r, base, rocker, _, _, _, first, last = outline
    far = max(math.hypot(x, y) + r, math.hypot(x - base, y))
    far = max(far, math.hypot(x - tips[0], y - tips[1]), math.hypot(x - tips[2], y - tips[3]))
    away = math.atan2(-y, base - x)
    if (away - first) % (2.0 * math.pi) <= last - first:
        far = max(far, math.hypot(x - base, y) + rocker)
    return far


@kernel
def enclosing_radii(outlines: Array) -> Array:
    """Smallest enclosing radius of every outline.

    Two or three parts determine the circle: crank circle, rocker's pivot, either end of the joint's arc, and the circle
    of the arc. The centre of every such combination is tried.
    """
    out, parts = np.full(outlines.shape[0], np.inf), np.zeros((5, 3))
    for n in range(out.size):
        r, base, rocker, _, _, _, _, _ = outlines[n]
        tips = tips_of(outlines[n])
        parts[0, 2], parts[1, 0], parts[4, 0], parts[4, 2] = r, base, base, rocker
        parts[2, 0], parts[2, 1], parts[3, 0], parts[3, 1] = tips
        for i in range(5):
            for j in range(i + 1, 5):
                for k in range(j, 5):
                    x, y, size = _through(parts, i, j, -1 if k == j else k)
                    if size < out[n]:
                        out[n] = min(out[n], _required(outlines[n], tips, x, y))
    return out
