"""Minimum-area bounding box of a swept outline, over all orientations.

Between the corners of an outline's pieces (``outline``) the area f = W H has a bounded second derivative, so
f >= min(ends) - (step)^2/8 max|f''| prunes all but the neighbourhood of the minimum. The box found is within a given
relative tolerance of the global minimum. Likewise for max(W/width, H/height), the misfit of a box.
Lengths in any consistent unit; angles in rad, from the base line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solvers.linkage.swept_area.outline import arc_ends, corner_directions, extent_sinusoids, extents
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_STACK = 4096
BOX_TOLERANCE = 1e-13
"""Relative tolerance of a box's area, this sharp because it costs microseconds only."""


@dataclass(frozen=True)
class Box:
    """A rectangle rotated by ``angle`` [rad] from the base line: ``width`` along it, ``height`` across."""

    width: float
    height: float
    angle: float

    @property
    def area(self) -> float:
        return self.width * self.height


def minimum_box(outline: Array, pad: float, width: float = math.inf, height: float = math.inf) -> Box | None:
    """The box of minimum area within width and height, to ``BOX_TOLERANCE``; None if none fits."""
    none, pads = np.zeros(1), 2.0 * pad
    search = OrientationSearch(width, height, 0.0, 0.0, pads, BOX_TOLERANCE, math.inf)
    area, angle, swapped = minimum_boxes(outline[None], none + 1.0, none, none, search)[0].tolist()
    if not math.isfinite(area):
        return None
    along, across = (side + pads for side in extents(outline, angle))
    free = math.isinf(width) and math.isinf(height)
    if swapped or (free and angle < 0.0):
        return Box(across, along, angle + 0.5 * math.pi)
    return Box(along, across, angle if angle >= 0.0 else angle + math.pi)


class OrientationSearch(NamedTuple):
    """Minimisation over all orientations, with W and H at most ``width`` and ``height``: of max(W per_width,
    H per_height), or of the area W H if both of these are 0.

    ``pads`` is added to W and H. A result below ``cutoff`` is within the relative ``tolerance`` of the minimum; any
    other only states that the minimum is not below ``cutoff``.
    """

    width: float
    height: float
    per_width: float
    per_height: float
    pads: float
    tolerance: float
    cutoff: float


@kernel
def _minimum(outline: Array, along: float, across: float, search: OrientationSearch) -> tuple[float, float, bool]:
    """Minimum, its orientation, and whether pi/2 is to be added to that; inf if no box fits.

    W and H are lower bounds for outlines that deviate from this one by up to ``along`` in the base's direction and
    ``across`` perpendicular to it.
    """
    edges = corner_directions(outline)
    upright = search.width, search.height, search.per_width, search.per_height
    turned = search.height, search.width, search.per_height, search.per_width
    best, at = _minimum_near_base_line(outline, edges, along, across, search, upright, math.inf)
    if upright == turned:
        return best, at, False
    turned_best, turned_at = _minimum_near_base_line(outline, edges, along, across, search, turned, best)
    return (turned_best, turned_at, True) if turned_best < best else (best, at, False)


@kernel
def _minimum_near_base_line(
    outline: Array,
    edges: Array,
    along: float,
    across: float,
    search: OrientationSearch,
    sides: tuple[float, float, float, float],
    best: float,
) -> tuple[float, float]:
    """``_minimum`` for orientations within pi/4 of the base line; ``best`` is the incumbent."""
    tips, at = arc_ends(outline), 0.0
    most_w, most_h, per_w, per_h = sides
    area = per_w == 0.0 and per_h == 0.0
    left_ends, right_ends = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = extent_sinusoids(outline, tips, middle)
        # Less 2 (along |n_x| + across |n_y|), n their directions; signs change at multiples of pi/2, which are corners.
        c, s = math.copysign(2.0, math.cos(middle)), math.copysign(2.0, math.sin(middle))
        wx, wy, hx, hy = wx - c * along, wy - s * across, hx - c * across, hy - s * along
        wc, hc = wc + search.pads, hc + search.pads
        w1, h1 = math.hypot(wx, wy), math.hypot(hx, hy)
        curvature_bound = (abs(wc) * h1 + abs(hc) * w1 + 2.0 * w1 * h1) / 8.0
        left_ends[0], right_ends[0] = edges[k], edges[k + 1]
        depth = 1
        while depth:
            depth -= 1
            left, right = left_ends[depth], right_ends[depth]
            cl, sl, cr, sr = math.cos(left), math.sin(left), math.cos(right), math.sin(right)
            wl, hl = wc + wx * cl + wy * sl, hc + hx * cl + hy * sl
            wr, hr = wc + wx * cr + wy * sr, hc + hx * cr + hy * sr
            left_value, right_value = wl * hl, wr * hr
            if not area:
                left_value, right_value = max(wl * per_w, hl * per_h), max(wr * per_w, hr * per_h)
            if wl <= most_w and hl <= most_h and left_value < best:
                best, at = left_value, left
            if wr <= most_w and hr <= most_h and right_value < best:
                best, at = right_value, right
            if best <= 0.0:
                # Only outlines with a large deviation reach such low values; the bound is then useless.
                return 0.0, at
            step = (right - left) ** 2
            narrowest, lowest = min(wl, wr) - step / 8.0 * w1, min(hl, hr) - step / 8.0 * h1
            if narrowest > most_w or lowest > most_h:
                continue
            lower_bound = max(narrowest * per_w, lowest * per_h)
            if area:
                lower_bound = min(left_value, right_value) - step * curvature_bound
            if lower_bound >= search.cutoff or (
                best < search.cutoff and lower_bound >= best * (1.0 - search.tolerance)
            ):
                continue
            if step < 1e-28 or depth + 2 > _STACK:
                continue
            middle = 0.5 * (left + right)
            left_ends[depth], right_ends[depth] = left, middle
            left_ends[depth + 1], right_ends[depth + 1] = middle, right
            depth += 2
    return best, at


@kernel
def minimum_boxes(outlines: Array, scale: Array, along: Array, across: Array, search: OrientationSearch) -> Array:
    """Minimum of every outline at its scale, (n, 3): the value, inf if no box fits, its direction, and 1 if pi/2 is to
    be added to that.

    ``along`` and ``across`` [per scale] as in ``_minimum``. The value is 0 if W and H could both vanish within the
    deviation.
    """
    out = np.full((scale.size, 3), np.inf)
    for i in range(scale.size):
        if not math.isfinite(scale[i]):
            continue
        outline = outlines[i].copy()
        for k in range(6):
            outline[k] *= scale[i]
        deviation = along[i] * scale[i], across[i] * scale[i]
        # Each side of a box is at least twice the crank, so W + H stays positive: the lower bounds of W and H are not
        # both negative, and their product is a lower bound of the area.
        area = search.per_width == 0.0 and search.per_height == 0.0
        if area and 2.0 * outline[0] + search.pads <= math.sqrt(2.0) * (deviation[0] + deviation[1]):
            out[i, 0] = 0.0
            continue
        # W and H already include the pads minus the deviation, so they are compared with the limits directly.
        value, angle, swapped = _minimum(outline, deviation[0], deviation[1], search)
        out[i, 0], out[i, 1], out[i, 2] = value, angle, 1.0 if swapped else 0.0
    return out
