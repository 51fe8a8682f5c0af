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
from solvers.linkage.kinds import ChangePoint
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_STACK = 4096
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Box:
    """A rectangle turned by ``angle`` [rad] against the base line: ``width`` along that direction, ``height`` across."""

    width: float
    height: float
    angle: float

    @property
    def area(self) -> float:
        return self.width * self.height


def sweep(bar: FourBar, crank: float) -> Array:
    """The swept outline: crank radius, base, rocker, first and last direction of the rocker; shape (5,)."""
    first, last = arc(bar.kind, bar.swing)
    return np.array([crank, crank * bar.ratios.base, crank * bar.ratios.rocker, first, last])


def arc(kind: ChangePoint, swing: Array | float) -> tuple[Array | float, Array | float]:
    """First and last direction of the rocker: it leaves the blow upward, except for the largest base."""
    if kind.rocker_sign > 0:
        return 0.0 * swing, swing
    return (math.pi + 0.0 * swing, math.pi + swing) if kind.crank_sign > 0 else (math.pi - swing, math.pi + 0.0 * swing)


def least_box(
    outline: Array, pad: float, width: float = math.inf, height: float = math.inf, tolerance: float = 1e-12
) -> Box | None:
    """The box of least area within width and height, to a relative tolerance; None where none fits."""
    area, angle = least_area(outline, 2.0 * pad, width, height, tolerance, math.inf)
    if not math.isfinite(area):
        return None
    across, along = extent(outline, angle + 0.5 * math.pi), extent(outline, angle)
    return Box(along + 2.0 * pad, across + 2.0 * pad, angle)


def enclosing_radius(outline: Array, pad: float) -> float:
    """Radius of the least circle around the swept outline and its pads."""
    return enclosing(outline) + pad


@kernel
def _support(outline: Array, beta: float) -> tuple[float, float, float]:
    """The piece of h active at beta: (constant, x, y) with h = constant + x cos(beta) + y sin(beta)."""
    r, base, rocker, first, last = outline
    cos, sin = math.cos(beta), math.sin(beta)
    best, constant, x, y = r, r, 0.0, 0.0
    if base * cos > best:
        best, constant, x, y = base * cos, 0.0, base, 0.0
    for angle in (first, last):
        px, py = base + rocker * math.cos(angle), rocker * math.sin(angle)
        reach = px * cos + py * sin
        if reach > best:
            best, constant, x, y = reach, 0.0, px, py
    turned = (beta - first) % (2.0 * math.pi)
    if turned <= last - first and base * cos + rocker > best:
        constant, x, y = rocker, base, 0.0
    return constant, x, y


@kernel
def extent(outline: Array, alpha: float) -> float:
    """W(alpha), pads not included."""
    c1, x1, y1 = _support(outline, alpha)
    c2, x2, y2 = _support(outline, alpha + math.pi)
    return c1 + c2 + (x1 - x2) * math.cos(alpha) + (y1 - y2) * math.sin(alpha)


@kernel
def _corners(outline: Array, turn: float) -> Array:
    """All directions in [0, turn] at which a piece of W or H may change, with both ends, sorted."""
    r, base, rocker, first, last = outline
    found = np.empty(72)
    count = 0
    xs = np.array([base, base + rocker * math.cos(first), base + rocker * math.cos(last)])
    ys = np.array([0.0, rocker * math.sin(first), rocker * math.sin(last)])
    raw = np.empty(16)
    n = 0
    for i in range(3):
        distance = math.hypot(xs[i], ys[i])
        if distance > r:
            middle, half = math.atan2(ys[i], xs[i]), math.acos(r / distance)
            raw[n], raw[n + 1] = middle + half, middle - half
            n += 2
        j = (i + 1) % 3
        raw[n] = math.atan2(ys[j] - ys[i], xs[j] - xs[i])
        n += 1
    raw[n], raw[n + 1] = first, last
    n += 2
    if abs(r - rocker) <= base:
        half = math.acos((r - rocker) / base)
        raw[n], raw[n + 1] = half, -half
        n += 2
    quarter = 0.5 * math.pi
    for i in range(n):
        place = raw[i] % quarter
        while place <= turn:
            found[count] = place
            count += 1
            place += quarter
    found[count], found[count + 1] = 0.0, turn
    return np.sort(found[: count + 2])


@kernel
def _pieces(outline: Array, middle: float) -> tuple[float, float, float, float, float, float]:
    """W and H around a direction: constants and the factors of cos(alpha), sin(alpha)."""
    c1, x1, y1 = _support(outline, middle)
    c2, x2, y2 = _support(outline, middle + math.pi)
    c3, x3, y3 = _support(outline, middle + 0.5 * math.pi)
    c4, x4, y4 = _support(outline, middle + 1.5 * math.pi)
    return c1 + c2, x1 - x2, y1 - y2, c3 + c4, y3 - y4, x4 - x3


@kernel
def least_area(
    outline: Array, pads: float, width: float, height: float, tolerance: float, enough: float
) -> tuple[float, float]:
    """(least area, its direction) over all orientations whose box keeps within width and height; inf where none does.

    ``pads`` is added to W and H. The value is within ``tolerance`` of the least one, or the least one exceeds
    ``enough``: then what is returned exceeds it as well.
    """
    free = width == math.inf and height == math.inf
    turn = 0.5 * math.pi if free else math.pi
    edges = _corners(outline, turn)
    best, at = math.inf, 0.0
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if edges[k + 1] - edges[k] < 1e-15:
            continue
        wc, wx, wy, hc, hx, hy = _pieces(outline, 0.5 * (edges[k] + edges[k + 1]))
        wc, hc = wc + pads, hc + pads
        w1, h1 = math.hypot(wx, wy), math.hypot(hx, hy)
        bend = (abs(wc) * h1 + abs(hc) * w1 + 2.0 * w1 * h1) / 8.0
        lefts[0], rights[0] = edges[k], edges[k + 1]
        depth = 1
        while depth:
            depth -= 1
            left, right = lefts[depth], rights[depth]
            wl, hl = wc + wx * math.cos(left) + wy * math.sin(left), hc + hx * math.cos(left) + hy * math.sin(left)
            wr, hr = wc + wx * math.cos(right) + wy * math.sin(right), hc + hx * math.cos(right) + hy * math.sin(right)
            if wl <= width and hl <= height and wl * hl < best:
                best, at = wl * hl, left
            if wr <= width and hr <= height and wr * hr < best:
                best, at = wr * hr, right
            step = (right - left) ** 2
            if not free and (min(wl, wr) - step / 8.0 * w1 > width or min(hl, hr) - step / 8.0 * h1 > height):
                continue
            least = min(wl * hl, wr * hr) - step * bend
            if least >= min(best * (1.0 - tolerance), enough) or step < 1e-28 or depth + 2 > _STACK:
                # What is pruned because it is enough still bounds the answer from below.
                continue
            middle = 0.5 * (left + right)
            lefts[depth], rights[depth] = left, middle
            lefts[depth + 1], rights[depth + 1] = middle, right
            depth += 2
    return best, at


@kernel
def least_fit(outline: Array, width: float, height: float, tolerance: float) -> tuple[float, float]:
    """(m, alpha): the least over all orientations of max(W/width, H/height); at most 1 where the outline fits."""
    edges = _corners(outline, math.pi)
    best, at = math.inf, 0.0
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if edges[k + 1] - edges[k] < 1e-15:
            continue
        wc, wx, wy, hc, hx, hy = _pieces(outline, 0.5 * (edges[k] + edges[k + 1]))
        wc, wx, wy, hc, hx, hy = wc / width, wx / width, wy / width, hc / height, hx / height, hy / height
        w1, h1 = math.hypot(wx, wy), math.hypot(hx, hy)
        lefts[0], rights[0] = edges[k], edges[k + 1]
        depth = 1
        while depth:
            depth -= 1
            left, right = lefts[depth], rights[depth]
            wl, hl = wc + wx * math.cos(left) + wy * math.sin(left), hc + hx * math.cos(left) + hy * math.sin(left)
            wr, hr = wc + wx * math.cos(right) + wy * math.sin(right), hc + hx * math.cos(right) + hy * math.sin(right)
            if max(wl, hl) < best:
                best, at = max(wl, hl), left
            if max(wr, hr) < best:
                best, at = max(wr, hr), right
            step = (right - left) ** 2
            least = max(min(wl, wr) - step * w1 / 8.0, min(hl, hr) - step * h1 / 8.0)
            if least >= best * (1.0 - tolerance) or step < 1e-28 or depth + 2 > _STACK:
                continue
            middle = 0.5 * (left + right)
            lefts[depth], rights[depth] = left, middle
            lefts[depth + 1], rights[depth + 1] = middle, right
            depth += 2
    return best, at


@kernel
def _farthest(outline: Array, x: float, y: float) -> float:
    """Distance from a centre to the farthest point swept; convex in the centre."""
    r, base, rocker, first, last = outline
    far = max(math.hypot(x, y) + r, math.hypot(x - base, y))
    for angle in (first, last):
        far = max(far, math.hypot(base + rocker * math.cos(angle) - x, rocker * math.sin(angle) - y))
    turned = (math.atan2(-y, base - x) - first) % (2.0 * math.pi)
    if turned <= last - first:
        far = max(far, math.hypot(x - base, y) + rocker)
    return far


@kernel
def _least_along(outline: Array, x: float, low: float, high: float) -> float:
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fa, fb = _farthest(outline, x, a), _farthest(outline, x, b)
    for _ in range(60):
        if fa <= fb:
            high, b, fb = b, a, fa
            a = high - _GOLDEN * (high - low)
            fa = _farthest(outline, x, a)
        else:
            low, a, fa = a, b, fb
            b = low + _GOLDEN * (high - low)
            fb = _farthest(outline, x, b)
    return min(fa, fb)


@kernel
def enclosing(outline: Array) -> float:
    """Radius of the least circle around the outline: the farthest distance, convex in the centre, made least."""
    r, base, rocker, _, _ = outline
    size = r + base + rocker
    low, high = -size, size
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fa, fb = _least_along(outline, a, -size, size), _least_along(outline, b, -size, size)
    for _ in range(60):
        if fa <= fb:
            high, b, fb = b, a, fa
            a = high - _GOLDEN * (high - low)
            fa = _least_along(outline, a, -size, size)
        else:
            low, a, fa = a, b, fb
            b = low + _GOLDEN * (high - low)
            fb = _least_along(outline, b, -size, size)
    return min(fa, fb)
