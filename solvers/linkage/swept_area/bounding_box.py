"""The least box around a swept outline, over all orientations.

Between the corners of an outline's pieces (``outline``) the area f = W H has a bounded second derivative, so
f >= min(ends) - (step)^2/8 max|f''| prunes all but the neighbourhood of the least value. The box found is thus within a
stated relative tolerance of the least box there is. Likewise for max(W/width, H/height), how far a box is from fitting.
Lengths in any one unit; angles in rad, from the base line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.swept_area.outline import corners, extents, pieces, tips_of
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_STACK = 4096


@dataclass(frozen=True)
class Box:
    """A rectangle turned by ``angle`` [rad] against the base line: ``width`` along it, ``height`` across."""

    width: float
    height: float
    angle: float

    @property
    def area(self) -> float:
        return self.width * self.height


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
    edges = corners(outline)
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
    tips = tips_of(outline)
    free, at = width == math.inf and height == math.inf, 0.0
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = pieces(outline, tips, middle)
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
    edges = corners(outline)
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
    tips = tips_of(outline)
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = pieces(outline, tips, middle)
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
def least_areas(
    outlines: Array,
    scale: Array,
    along: Array,
    across: Array,
    pads: float,
    width: float,
    height: float,
    tolerance: float,
    enough: float,
) -> Array:
    """Least box area of every outline at its scale, within width and height; inf where none fits.

    ``along`` and ``across`` [per scale] as in ``least_area``. An area is told to ``tolerance``, or is above
    ``enough``; where W and H could both vanish within what moves it is 0.
    """
    out = np.full(scale.size, np.inf)
    for i in range(scale.size):
        if not math.isfinite(scale[i]):
            continue
        outline = outlines[i].copy()
        outline[:6] *= scale[i]
        moved = along[i] * scale[i], across[i] * scale[i]
        # Neither side of a box is below twice the crank: W + H keeps above 0, so the lower bounds of W and H are not
        # both negative, and their product is a lower bound of the area.
        if 2.0 * outline[0] + pads <= math.sqrt(2.0) * (moved[0] + moved[1]):
            out[i] = 0.0
            continue
        # W, H already carry the pads less what is uncertain, so the limits are compared as they are.
        out[i] = least_area(outline, pads, moved[0], moved[1], width, height, tolerance, enough)[0]
    return out


@kernel
def least_fits(outlines: Array, along: Array, across: Array, width: float, height: float, tolerance: float) -> Array:
    """Least max(W/width, H/height) of every outline."""
    out = np.empty(outlines.shape[0])
    for i in range(out.size):
        out[i] = least_fit(outlines[i], along[i], across[i], width, height, tolerance)
    return out
