"""The maximum size of a cone's shape, and a pattern search for the best shape.

Shapes (``tapers``) on one half: positions t are fractions of its length, bores are relative to the outer diameter.
The bore d = s f(t; r, c) of size s satisfies the strength if d <= the allowed bore at every station, the slope limit
if s (1 - r) <= steep c, and the deflection limit if

    sum weight (bend/v(u) + shear phi(u)) <= limit,    u = (1 - d) (1 + d),

1/v = f and phi = g as in ``solvers.pin.section.flexibility``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import LIMIT_TOLERANCE
from solvers.pin.optimum.program import Program, least_walls_at
from solvers.pin.section.flexibility import Flexibility, flexibilities
from solvers.pin.shapes.tapers import relative_bore, unit_volume
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES, kinks

_MIN_CELLS, _MIN_CELL_WIDTH = 64, 1e-10
"""Initial number of cells of the half in the table of corner bores, and minimum width of a cell."""
_CORNER_RISE, _COARSE_CORNER = 1e-2, 1e-4
"""Tolerance of a corner's bore between samples: its increase with the square of the distance from the best cones'
corners, and its maximum."""
_EXACT = 1.2e-15
"""Relative width at which the bracket of a size has collapsed to rounding."""
_MAX_STEPS = 120
_DIRECTIONS = 16
"""Directions of the pattern search."""
_FIRST_STEP, _LAST_STEP = 0.05, 1e-4
"""Steps of the search, the last as a fraction of the gap."""
SIZE_TOLERANCE = 1e-2
"""Relative error of sizes as a fraction of the requested gap."""


class HalfBar(NamedTuple):
    """Half of a pin for cones.

    At the stations, (n,) each: position ``x``, the widest ``bore`` that strength allows, quadrature ``weight``,
    deflection coefficients ``bend`` and ``shear``. The flexibilities' ``law``, the deflection limit with the tolerance
    by which the solid pin may exceed it, and the ``slope_coefficient`` of the slope limit, infinite without one.
    ``corners`` (3, m): positions from 0 to 1 with the widest bore there and its excess over linear interpolation up to
    the next, for cones that are widest where they end; empty for others.
    """

    x: Array
    bore: Array
    weight: Array
    bend: Array
    shear: Array
    law: Flexibility
    limit: float
    slope_coefficient: float
    corners: Array


def half_bar(half: Program, corners: Array | None = None) -> HalfBar:
    """Return the data of a half-bar program that cones need; with ``corners`` if cones are widest where they end."""
    g, slope, limit = half.scene.geometry, half.limits.max_slope, half.limit
    middle = 0.5 * g.length
    slope_coefficient = math.inf if slope is None else slope * middle / g.outer_diameter
    return HalfBar(
        half.stations.x / middle, 1.0 - half.variable.wall_of(half.lower), half.weight, half.bending, half.shear,
        half.law, math.inf if limit is None else limit * (1.0 + LIMIT_TOLERANCE), slope_coefficient,
        np.empty((3, 0)) if corners is None else corners,
    )  # fmt: skip


def corner_table(half: Program, least_tolerance: float, best: tuple[float, ...]) -> Array:
    """Return ``HalfBar.corners``, with cells halved until the bore is linear in each to a tolerance; kinks are edges.

    The tolerance is ``least_tolerance`` at the corner positions ``best`` and increases with the square of the distance
    from them.
    """
    scene = half.scene

    def bores(at: Array) -> Array:
        return 1.0 - least_walls_at(scene, half.criterion, half.floor, 0.5 * scene.geometry.length * at)

    edges = np.union1d(np.linspace(0.0, 1.0, _MIN_CELLS + 1), kinks(scene))
    edges = edges[np.concatenate([[True], np.diff(edges) > _MIN_CELL_WIDTH])]
    bore = bores(edges)
    while True:
        width = np.diff(edges)
        bend = np.abs(np.diff(np.diff(bore) / width))
        above = 0.5 * width * np.maximum(np.append(bend, bend[-1]), np.insert(bend, 0, bend[0]))
        distance = np.min([np.maximum(edges[:-1] - c, c - edges[1:]) for c in best], axis=0, initial=1.0).clip(0.0)
        tolerance = least_tolerance + np.minimum(_CORNER_RISE * distance * distance, _COARSE_CORNER)
        cut = np.flatnonzero((above > tolerance) & (width > 2.0 * _MIN_CELL_WIDTH))
        if not cut.size:
            return np.stack([edges, bore, np.append(above, 0.0)])
        middles = edges[cut] + 0.5 * width[cut]
        edges, bore = np.insert(edges, cut + 1, middles), np.insert(bore, cut + 1, bores(middles))


@kernel
def corner_range(bar: HalfBar, c0: float, c1: float) -> tuple[float, float, float, float]:
    """Return, for the widest bore at the end of a cone with c in [c0, c1]: its maximum, its logarithm at the mid-range
    c, and the range of that logarithm's slope; no limit if there are no corners."""
    if bar.corners.shape[1] == 0 or c0 >= 1.0:
        return 1.0, 0.0, 0.0, 0.0
    edges, bore, above = bar.corners[0], bar.corners[1], bar.corners[2]
    low, high, middle = 0, edges.size - 1, 0.5 * (c0 + c1)
    while high - low > 1:
        half = (low + high) // 2
        low, high = (half, high) if edges[half] <= c0 else (low, half)
    most, least, least_slope, greatest_slope, max_excess, at = 0.0, np.inf, np.inf, -np.inf, 0.0, 0.0
    for k in range(low, edges.size - 1):
        if k > low and edges[k] >= c1:
            break
        slope = (bore[k + 1] - bore[k]) / (edges[k + 1] - edges[k])
        begin, end = bore[k] + slope * max(c0 - edges[k], 0.0), bore[k] + slope * (min(c1, edges[k + 1]) - edges[k])
        most, least = max(most, begin + above[k], end + above[k]), min(least, begin, end)
        least_slope, greatest_slope = min(least_slope, slope), max(greatest_slope, slope)
        max_excess = max(max_excess, above[k])
        if edges[k] <= middle <= edges[k + 1]:
            at = bore[k] + slope * (middle - edges[k])
    if not least > 0.0:
        return most, np.inf, 0.0, 0.0
    least_slope /= most if least_slope > 0.0 else least
    greatest_slope /= least if greatest_slope > 0.0 else most
    return most, math.log(at) + max_excess / least, least_slope, greatest_slope


@kernel
def split_panels(bar: HalfBar, first_end: float, last_end: float, out: Array) -> int:
    """Write positions, weights and deflection coefficients of the stations into ``out`` (4, m), splitting loaded panels
    at two positions; return the number of stations, at most 2 NODES more than the bar's.

    Quadrature across the kink where a cone ends has a relative deflection error of 1e-4, which a search would
    exploit. Moments and shear forces are polynomials within a panel, so the nodes of its parts are interpolated from
    its own (barycentric formula; J.-P. Berrut and L. N. Trefethen, 2004).
    """
    count = 0
    for first in range(0, bar.x.size, NODES):
        begin, width = bar.x[first], bar.x[first + NODES - 1] - bar.x[first]
        loaded = False
        for j in range(first, first + NODES):
            loaded = loaded or bar.bend[j] != 0.0 or bar.shear[j] != 0.0
        if not loaded or not (begin < first_end < begin + width or begin < last_end < begin + width):
            for j in range(first, first + NODES):
                out[0, count], out[1, count] = bar.x[j], bar.weight[j]
                out[2, count], out[3, count] = bar.bend[j], bar.shear[j]
                count += 1
            continue
        low = 0.0
        for k in range(3):
            end = first_end if k == 0 else last_end
            high = min(max((end - begin) / width, low), 1.0) if k < 2 else 1.0
            if high <= low:
                continue
            for j in range(NODES):
                t = low + (high - low) * 0.5 * (1.0 + NODE_PLACES[j])
                whole, bent, sheared = 0.0, 0.0, 0.0
                for i in range(NODES):
                    apart = (2.0 * t - 1.0) - NODE_PLACES[i]
                    if apart == 0.0:
                        whole, bent, sheared = 1.0, bar.bend[first + i], bar.shear[first + i]
                        break
                    factor = NODE_WEIGHTS[i] / apart
                    whole += factor
                    bent += factor * bar.bend[first + i]
                    sheared += factor * bar.shear[first + i]
                out[0, count], out[1, count] = begin + width * t, (high - low) * bar.weight[first + j]
                out[2, count], out[3, count] = max(bent / whole, 0.0), max(sheared / whole, 0.0)
                count += 1
            low = high
    return count


@kernel
def size_for_deflection(
    bar: HalfBar, direction: int, r: float, c: float, most: float, tolerance: float, work: Array
) -> tuple[float, float]:  # fmt: skip
    """Return a bracket, of relative width ``tolerance``, of the maximum size up to ``most`` under the deflection limit.

    Regula falsi in limit/deflection - 1, which is -1 where no section is left, with a bisection every fourth step.
    """
    if bar.limit == np.inf:
        return most, most
    count = split_panels(bar, c, c, work)
    low, high, at_low, at_high, last = 0.0, most, 1.0, -1.0, 0
    for step in range(_MAX_STEPS):
        if step == 0:
            tried = high
        elif step % 4 == 0:
            tried = 0.5 * (low + high)
        else:
            least = 0.4 * max(tolerance, _EXACT) * high
            tried = min(max(low + (high - low) * at_low / (at_low - at_high), low + least), high - least)
        total = 0.0
        for i in range(count):
            if work[2, i] == 0.0 and work[3, i] == 0.0:
                continue
            d = tried * relative_bore(direction, r, c, work[0, i])
            u = (1.0 - d) * (1.0 + d)
            if u <= 0.0:
                total = np.inf
                break
            bent, sheared = flexibilities(u, bar.law)
            total += work[1, i] * (work[2, i] * bent + work[3, i] * sheared)
        value = bar.limit / total - 1.0 if total > 0.0 else np.inf
        if value >= 0.0:
            if step == 0:
                return most, most
            low, at_low = tried, value
            if last == 1:
                at_high *= 0.5
            last = 1
        else:
            high, at_high = tried, value
            if last == -1:
                at_low *= 0.5
            last = -1
        if high - low <= max(tolerance, _EXACT) * high:
            break
    return low, high


@kernel
def greatest_size_for_deflection(
    bar: HalfBar, direction: int, r: float, c: float, tolerance: float, work: Array
) -> tuple[float, float]:
    """As ``size_for_deflection``, over all sizes that leave a wall in the loaded sections: bores of unloaded
    sections may exceed the outer diameter. Infinite without a limit."""
    widest = 0.0
    for i in range(bar.x.size):
        if bar.bend[i] != 0.0 or bar.shear[i] != 0.0:
            widest = max(widest, relative_bore(direction, r, c, bar.x[i]))
    if bar.limit == np.inf or widest <= 0.0:
        return np.inf, np.inf
    return size_for_deflection(bar, direction, r, c, 1.0 / widest, tolerance, work)


@kernel
def size_for_strength(bar: HalfBar, direction: int, r: float, c: float) -> float:
    """Return the maximum size of a shape under strength."""
    size = 1.0
    for i in range(bar.x.size):
        shape = relative_bore(direction, r, c, bar.x[i])
        if bar.bore[i] < size * shape:
            size = bar.bore[i] / shape
    return size


@kernel
def size_of(bar: HalfBar, direction: int, r: float, c: float, tolerance: float, work: Array) -> float:
    """Return the maximum size of a shape relative to the outer diameter, at most ``tolerance`` less."""
    size = min(size_for_strength(bar, direction, r, c), corner_range(bar, c, c)[0])
    if r < 1.0:
        size = min(size, bar.slope_coefficient * c / (1.0 - r))
    return size_for_deflection(bar, direction, r, c, size, tolerance, work)[0]


@kernel
def workspace(bar: HalfBar) -> Array:
    """Return an array for the results of ``split_panels``."""
    return np.empty((4, bar.x.size + 2 * NODES))


@kernel
def bore_volume(bar: HalfBar, direction: int, r: float, c: float, tolerance: float, work: Array) -> float:
    """Return the maximum bore volume of a shape; ``tolerance`` is that of the size."""
    size = size_of(bar, direction, r, c, tolerance, work)
    return size * size * unit_volume(direction, r, c)


@kernel
def pattern_search(
    bar: HalfBar, direction: int, rs: Array, cs: Array, c_low: float, gap: float, work: Array
) -> tuple[float, float, float]:  # fmt: skip
    """Return (bore volume, r, c) of the best shape, c in [c_low, 1], from the grid rs x cs by pattern search.

    Sixteen directions; the step doubles on success, a gain beyond the error of sizes, and is halved otherwise. Sizes
    and the last step are finer than the relative ``gap``.
    """
    gain, r, c, step, size_tolerance = -1.0, 0.0, c_low, _FIRST_STEP, SIZE_TOLERANCE * gap
    for r1 in rs:
        for c1 in cs:
            trial = bore_volume(bar, direction, r1, c1, size_tolerance, work)
            if trial > gain:
                gain, r, c = trial, r1, c1
    while step > _LAST_STEP * gap:
        better = False
        # If the cone occupies the whole half, c = 1 and the search is along r only.
        for way in range(0, _DIRECTIONS, 1 if c_low < 1.0 else _DIRECTIONS // 2):
            angle = 2.0 * math.pi * way / _DIRECTIONS
            r1 = min(max(r + step * math.cos(angle), 0.0), 1.0)
            c1 = min(max(c + step * math.sin(angle), c_low), 1.0)
            trial = bore_volume(bar, direction, r1, c1, size_tolerance, work)
            # A smaller gain may be an error of sizes, with which the search would creep along a ridge.
            if trial > gain * (1.0 + 2.0 * size_tolerance):
                gain, r, c, better = trial, r1, c1, True
                break
        step *= 2.0 if better else 0.5
    return gain, r, c
