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

from solvers.linkage.swept_area.outline import corners, extents, pieces, tips_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_STACK = 4096


@dataclass(frozen=True)
class Box:
    """A rectangle rotated by ``angle`` [rad] from the base line: ``width`` along it, ``height`` across."""

    width: float
    height: float
    angle: float

    @property
    def area(self) -> float:
        return self.width * self.height


def least_box(
    outline: Array, pad: float, width: float = math.inf, height: float = math.inf, tolerance: float = 1e-12
) -> Box | None:
    """The box of minimum area within width and height, to a relative tolerance; None if none fits."""
    none = np.zeros(1)
    boxes = least_boxes(outline[None], none + 1.0, none, none, 2.0 * pad, width, height, tolerance, math.inf)
    area, angle, turned = boxes[0].tolist()
    if not math.isfinite(area):
        return None
    along, across = (side + 2.0 * pad for side in extents(outline, angle))
    free = math.isinf(width) and math.isinf(height)
    if turned or (free and angle < 0.0):
        return Box(across, along, angle + 0.5 * math.pi)
    return Box(along, across, angle if angle >= 0.0 else angle + math.pi)


@kernel
def _reduced(
    wx: float, wy: float, hx: float, hy: float, along: float, across: float, middle: float
) -> tuple[float, float, float, float]:
    """Coefficients of cos(alpha), sin(alpha) in W and H minus 2 (along |n_x| + across |n_y|), n their directions.

    No corner lies between ``middle`` and the ends of its piece; the multiples of pi/2 are corners.
    """
    c, s = math.copysign(2.0, math.cos(middle)), math.copysign(2.0, math.sin(middle))
    return wx - c * along, wy - s * across, hx - c * across, hy - s * along


class Task(NamedTuple):
    """What is minimised over the orientations: the area W H within ``width`` and ``height``, or with ``fit`` the misfit
    max(W/width, H/height).

    ``pads`` is added to W and H. They are lower bounds for outlines that deviate from this one by up to ``along`` in
    the base's direction and ``across`` perpendicular to it. A result below ``enough`` is within the relative
    ``tolerance`` of the minimum; any other only states that the minimum is not below ``enough``.
    """

    fit: bool
    width: float
    height: float
    pads: float
    along: float
    across: float
    tolerance: float
    enough: float


@kernel
def _least(outline: Array, task: Task) -> tuple[float, float, bool]:
    """The minimum, its direction, and whether pi/2 is to be added to it; inf if no box keeps within width and
    height."""
    edges, width, height = corners(outline), task.width, task.height
    best, at = _least_upright(outline, edges, task, width, height, math.inf)
    if width == height:
        return best, at, False
    other, there = _least_upright(outline, edges, task, height, width, best)
    return (other, there, True) if other < best else (best, at, False)


@kernel
def _least_upright(
    outline: Array, edges: Array, task: Task, width: float, height: float, best: float
) -> tuple[float, float]:  # fmt: skip
    """``_least`` within pi/4 about the base line; ``best`` is the incumbent."""
    tips, at, fit = tips_of(outline), 0.0, task.fit
    unit_w, unit_h, most_w, most_h = 1.0, 1.0, width, height
    if fit:
        unit_w, unit_h, most_w, most_h = width, height, math.inf, math.inf
    lefts, rights = np.empty(_STACK), np.empty(_STACK)
    for k in range(edges.size - 1):
        if not edges[k + 1] > edges[k]:
            continue
        middle = 0.5 * (edges[k] + edges[k + 1])
        wc, wx, wy, hc, hx, hy = pieces(outline, tips, middle)
        wx, wy, hx, hy = _reduced(wx, wy, hx, hy, task.along, task.across, middle)
        wc, wx, wy = (wc + task.pads) / unit_w, wx / unit_w, wy / unit_w
        hc, hx, hy = (hc + task.pads) / unit_h, hx / unit_h, hy / unit_h
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
            one, other = (max(wl, hl), max(wr, hr)) if fit else (wl * hl, wr * hr)
            if wl <= most_w and hl <= most_h and one < best:
                best, at = one, left
            if wr <= most_w and hr <= most_h and other < best:
                best, at = other, right
            if best <= 0.0:
                # Only outlines with a large deviation reach such low values; the bound is then useless.
                return 0.0, at
            step = (right - left) ** 2
            narrowest, lowest = min(wl, wr) - step / 8.0 * w1, min(hl, hr) - step / 8.0 * h1
            if narrowest > most_w or lowest > most_h:
                continue
            least = max(narrowest, lowest) if fit else min(one, other) - step * bend
            if least >= task.enough or (best < task.enough and least >= best * (1.0 - task.tolerance)):
                continue
            if step < 1e-28 or depth + 2 > _STACK:
                continue
            middle = 0.5 * (left + right)
            lefts[depth], rights[depth] = left, middle
            lefts[depth + 1], rights[depth + 1] = middle, right
            depth += 2
    return best, at


@kernel
def least_boxes(
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
    """Minimum box area of every outline at its scale, within width and height, (n, 3): the area, inf if none fits, its
    direction, and 1 if pi/2 is to be added to it.

    ``along`` and ``across`` [per scale] as in ``Task``. An area is accurate to ``tolerance``, or above
    ``enough``; it is 0 if W and H could both vanish within the deviation.
    """
    out = np.full((scale.size, 3), np.inf)
    for i in range(scale.size):
        if not math.isfinite(scale[i]):
            continue
        outline = outlines[i].copy()
        for k in range(6):
            outline[k] *= scale[i]
        moved = along[i] * scale[i], across[i] * scale[i]
        # Each side of a box is at least twice the crank, so W + H stays positive: the lower bounds of W and H are not
        # both negative, and their product is a lower bound of the area.
        if 2.0 * outline[0] + pads <= math.sqrt(2.0) * (moved[0] + moved[1]):
            out[i, 0] = 0.0
            continue
        # W and H already include the pads minus the deviation, so they are compared with the limits directly.
        task = Task(False, width, height, pads, moved[0], moved[1], tolerance, enough)
        area, angle, turned = _least(outline, task)
        out[i, 0], out[i, 1], out[i, 2] = area, angle, 1.0 if turned else 0.0
    return out


@kernel
def least_fits(outlines: Array, along: Array, across: Array, width: float, height: float, tolerance: float) -> Array:
    """Minimum over all orientations of max(W/width, H/height) for every outline; at most 1 if it fits.

    ``along`` and ``across`` as in ``Task``.
    """
    out = np.empty(outlines.shape[0])
    for i in range(out.size):
        task = Task(True, width, height, 0.0, along[i], across[i], tolerance, math.inf)
        out[i] = _least(outlines[i], task)[0]
    return out
