"""Minimum-area bounding box of a swept outline, over all orientations.

Between the corners of an outline's pieces (``outline``) the area f = W H has a bounded second derivative, so
f >= min(ends) - (step)^2/8 max|f''| prunes all but the neighbourhood of the minimum. The box found is within a given
relative tolerance of the global minimum. Likewise for max(W/width, H/height), the misfit of a box, and for lower bounds
of both over ranges of outlines that lie between two of them: there the product of W and H is least at one of both.
Lengths in any consistent unit; angles in rad, from the base line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solvers.linkage.swept_area.outline import corner_directions, extent_sinusoids, extents, touched_parts
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_EXACT, _UNIT = np.zeros((1, 5)), np.ones(1)
"""Deductions and size of one outline."""
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
    pads, outlines = 2.0 * pad, outline[None]
    search = OrientationSearch(width, height, 0.0, 0.0, pads, BOX_TOLERANCE, math.inf)
    area, angle, swapped = minimum_boxes(outlines, outlines, outlines, _EXACT, _UNIT, _UNIT, search)[0].tolist()
    if not math.isfinite(area):
        return None
    along, across = extents(outline, angle)
    along, across = along + pads, across + pads
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


Extremes = tuple[float, float, float, float]
"""W and H of both outlines between which all others lie."""


@kernel
def _minimum(outlines: Array, deductions: Array, search: OrientationSearch) -> tuple[float, float, bool]:
    """Minimum, its orientation, and whether pi/2 is to be added to that; inf if no box fits.

    ``outlines`` and ``deductions`` as in ``minimum_boxes``, of one range at its sizes, (3, 8) and (2, 5).
    """
    edges = corner_directions(outlines[0])
    upright = search.width, search.height, search.per_width, search.per_height
    turned = search.height, search.width, search.per_height, search.per_width
    best, at = _minimum_near_base_line(outlines, deductions, edges, search, upright, math.inf)
    if upright == turned:
        return best, at, False
    turned_best, turned_at = _minimum_near_base_line(outlines, deductions, edges, search, turned, best)
    return (turned_best, turned_at, True) if turned_best < best else (best, at, False)


@kernel
def _least(sides: Extremes, limits: tuple[float, float, float, float], floor: float) -> float:
    """Minimum between two outlines: an area at one of them, a misfit also where W and H are equal. No side is below
    ``floor``; inf where one exceeds its limit."""
    w0, h0, w1, h1 = sides
    most_w, most_h, per_w, per_h = limits
    if min(w0, w1) > most_w or min(h0, h1) > most_h:
        return math.inf
    if per_w == 0.0 and per_h == 0.0:
        if min(min(w0, h0), min(w1, h1)) > floor:
            return min(w0 * h0, w1 * h1)
        return max(min(w0, w1), floor) * max(min(h0, h1), floor)
    w0, h0, w1, h1 = w0 * per_w, h0 * per_h, w1 * per_w, h1 * per_h
    least, excess, other_excess = min(max(w0, h0), max(w1, h1)), w0 - h0, w1 - h1
    if excess * other_excess < 0.0:
        least = min(least, (excess * w1 - other_excess * w0) / (excess - other_excess))
    return max(least, floor * max(per_w, per_h))


@kernel
def _minimum_near_base_line(
    outlines: Array,
    deductions: Array,
    edges: Array,
    search: OrientationSearch,
    limits: tuple[float, float, float, float],
    best: float,
) -> tuple[float, float]:
    """``_minimum`` for orientations within pi/4 of the base line; ``best`` is the incumbent."""
    area, at, pads = search.per_width == 0.0 and search.per_height == 0.0, 0.0, search.pads
    # No side is less than twice the crank.
    floor = 2.0 * min(outlines[1, 0], outlines[2, 0]) + pads
    # Right ends of the intervals that remain, the first of which begins at ``left``; halved 50 times at most.
    right_ends = np.empty(64)
    for k in range(edges.size - 1):
        left, right = edges[k], edges[k + 1]
        if not right > left:
            continue
        middle = 0.5 * (left + right)
        parts = touched_parts(outlines[0], middle)
        first = extent_sinusoids(outlines[1], deductions[0], parts, middle)
        second = extent_sinusoids(outlines[2], deductions[1], parts, middle)
        bend_w, bend_h = math.hypot(first[1], first[2]), math.hypot(first[4], first[5])
        more_w, more_h = math.hypot(second[1], second[2]), math.hypot(second[4], second[5])
        greater_w, greater_h = max(bend_w, more_w), max(bend_h, more_h)
        wc, hc = max(abs(first[0]), abs(second[0])) + pads, max(abs(first[3]), abs(second[3])) + pads
        curvature_bound = (wc * greater_h + hc * greater_w + 2.0 * greater_w * greater_h) / 8.0
        at_left, right_ends[0], depth = _extremes(first, second, left, pads), right, 1
        value = _least(at_left, limits, floor)
        if value < best:
            best, at = value, left
        while depth:
            right = right_ends[depth - 1]
            at_right, step = _extremes(first, second, right, pads), (right - left) ** 2
            value = _least(at_right, limits, floor)
            if value < best:
                best, at = value, right
            lowest = (
                min(at_left[0], at_right[0]) - step / 8.0 * bend_w,
                min(at_left[1], at_right[1]) - step / 8.0 * bend_h,
                min(at_left[2], at_right[2]) - step / 8.0 * more_w,
                min(at_left[3], at_right[3]) - step / 8.0 * more_h,
            )
            lower_bound = _least(lowest, limits, floor)
            if area and min(min(lowest[0], lowest[1]), min(lowest[2], lowest[3])) > 0.0:
                ends = min(at_left[0] * at_left[1], at_left[2] * at_left[3])
                ends = min(ends, min(at_right[0] * at_right[1], at_right[2] * at_right[3]))
                lower_bound = max(lower_bound, ends - step * curvature_bound)
            improvable = lower_bound < search.cutoff and (
                best >= search.cutoff or lower_bound < best * (1.0 - search.tolerance)
            )
            if improvable and step >= 1e-28:
                right_ends[depth], depth = 0.5 * (left + right), depth + 1
            else:
                left, at_left, depth = right, at_right, depth - 1
    return best, at


@kernel
def _extremes(first: tuple[float, ...], second: tuple[float, ...], angle: float, pads: float) -> Extremes:
    """W and H of both outlines at a direction, with pads."""
    c, s = math.cos(angle), math.sin(angle)
    return (
        first[0] + pads + first[1] * c + first[2] * s,
        first[3] + pads + first[4] * c + first[5] * s,
        second[0] + pads + second[1] * c + second[2] * s,
        second[3] + pads + second[4] * c + second[5] * s,
    )


@kernel
def minimum_boxes(
    within: Array, low: Array, high: Array, deductions: Array, size: Array, high_size: Array, search: OrientationSearch
) -> Array:
    """Minima over ranges of outlines, (n, 3): the value, inf if no box fits, its direction, and 1 if pi/2 is to be
    added to that.

    ``within``, ``low`` and ``high`` are outlines of the range and of its ends, (n, 8) each, these to be multiplied by
    their sizes. Between the ends no extent of a part falls below the linear interpolation by more than ``deductions``
    per size, (n, 5): those of the crank, of the rocker, of arcs that end earlier, and of the arc's other end along and
    across the base. Results are lower bounds over each range; for a range of one outline, without deductions, its own.
    """
    out, outlines, less = np.full((within.shape[0], 3), np.inf), np.empty((3, 8)), np.empty((2, 5))
    for i in range(within.shape[0]):
        if not math.isfinite(size[i]):
            continue
        outlines[0], outlines[1], outlines[2] = within[i], low[i], high[i]
        outlines[1, :6] *= size[i]
        outlines[2, :6] *= high_size[i]
        less[0], less[1] = size[i] * deductions[i], high_size[i] * deductions[i]
        # W and H already include the pads minus the deductions, so they are compared with the limits directly.
        value, angle, swapped = _minimum(outlines, less, search)
        out[i, 0], out[i, 1], out[i, 2] = value, angle, 1.0 if swapped else 0.0
    return out
