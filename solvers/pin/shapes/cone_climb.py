"""Compiled evaluation of cones: the maximum size of a shape, and a pattern search for the best shape.

Shapes (``tapers``) on one half: positions t are fractions of its length, bores are relative to the outer diameter.
The bore d = s f(t; r, c) of size s satisfies the strength if d <= the allowed bore at every station, and the
deflection limit if

    sum share (bend/v(u) + shear phi(u)) <= limit,    u = (1 - d) (1 + d),

v and phi as in ``solvers.pin.section.flexibility``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.section.flexibility import bending, phi
from solvers.pin.shapes.tapers import compiled_hollow, relative_bore
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODE_WEIGHTS, NODES

Array = NDArray[np.float64]
_DIRECTIONS = 16
"""Directions of the pattern search."""
_FIRST_STEP = 0.05


@kernel
def split(
    ends: Array, x: Array, share: Array, bend: Array, shear: Array,
    at: Array, own_share: Array, own_bend: Array, own_shear: Array,
) -> int:  # fmt: skip
    """Write the stations with their shares and deflection coefficients into four arrays, splitting loaded panels at
    ``ends``; return the number of stations.

    Quadrature across the kink where a cone ends has a relative deflection error of 1e-4, which a search would
    exploit. Moments and shear forces are polynomials within a panel, so the nodes of its parts are interpolated from
    its own (barycentric formula; J.-P. Berrut and L. N. Trefethen, 2004).
    """
    count = 0
    for first in range(0, x.size, NODES):
        begin, wide = x[first], x[first + NODES - 1] - x[first]
        cuts, pulls = 0, False
        for end in ends:
            cuts += 1 if begin < end < begin + wide else 0
        for j in range(first, first + NODES):
            pulls = pulls or bend[j] != 0.0 or shear[j] != 0.0
        if cuts == 0 or not pulls:
            for j in range(first, first + NODES):
                at[count], own_share[count], own_bend[count], own_shear[count] = x[j], share[j], bend[j], shear[j]
                count += 1
            continue
        low = 0.0
        for k in range(ends.size + 1):
            high = min(max((ends[k] - begin) / wide, low), 1.0) if k < ends.size else 1.0
            if high <= low:
                continue
            for j in range(NODES):
                t = low + (high - low) * 0.5 * (1.0 + NODE_PLACES[j])
                whole, bent, sheared = 0.0, 0.0, 0.0
                for i in range(NODES):
                    apart = (2.0 * t - 1.0) - NODE_PLACES[i]
                    if apart == 0.0:
                        whole, bent, sheared = 1.0, bend[first + i], shear[first + i]
                        break
                    weight = NODE_WEIGHTS[i] / apart
                    whole += weight
                    bent += weight * bend[first + i]
                    sheared += weight * shear[first + i]
                at[count], own_share[count] = begin + wide * t, (high - low) * share[first + j]
                own_bend[count], own_shear[count] = max(bent / whole, 0.0), max(sheared / whole, 0.0)
                count += 1
            low = high
    return count


@kernel
def greatest_size(
    turn: int, r: float, c: float, x: Array, bore: Array, at: Array, share: Array, bend: Array, shear: Array,
    a: float, b: float, limit: float, most: float,
) -> float:  # fmt: skip
    """Return the maximum size of a shape relative to the outer diameter, up to ``most``.

    Strength at stations x with allowed ``bore``, deflection at positions ``at``.
    """
    size = most
    for i in range(x.size):
        shape = relative_bore(turn, r, c, x[i])
        if bore[i] < size * shape:
            size = bore[i] / shape
    if limit == np.inf:
        return size
    # Regula falsi in limit/deflection - 1, which is -1 where no section is left, with a bisection every fourth step.
    low, high, at_low, at_high, last = 0.0, size, 1.0, -1.0, 0
    for step in range(120):
        if step == 0:
            tried = high
        elif step % 4 == 0:
            tried = 0.5 * (low + high)
        else:
            least = 5e-16 * high
            tried = min(max(low + (high - low) * at_low / (at_low - at_high), low + least), high - least)
        total = 0.0
        for i in range(at.size):
            if bend[i] == 0.0 and shear[i] == 0.0:
                continue
            d = tried * relative_bore(turn, r, c, at[i])
            u = (1.0 - d) * (1.0 + d)
            if u <= 0.0:
                total = np.inf
                break
            total += share[i] * (bend[i] * bending(u)[0] + shear[i] * phi(u, a, b))
        value = limit / total - 1.0 if total > 0.0 else np.inf
        if value >= 0.0:
            if step == 0:
                return size
            low, at_low = tried, value
            if last == 1:
                at_high *= 0.5
            last = 1
        else:
            high, at_high = tried, value
            if last == -1:
                at_low *= 0.5
            last = -1
        if high - low <= 1.2e-15 * high:
            break
    return low


@kernel
def _interpolated(x: Array, y: Array, at: float) -> float:
    """Linear interpolation through (x, y), x increasing."""
    low, high = 0, x.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x[middle] <= at:
            low = middle
        else:
            high = middle
    return y[low] + (y[high] - y[low]) * (at - x[low]) / (x[high] - x[low])


@kernel
def _bore_volume(
    turn: int, r: float, c: float, edges: Array, edge_bore: Array, steep: float, x: Array, bore: Array, share: Array,
    bend: Array, shear: Array, a: float, b: float, limit: float, work: Array,
) -> float:  # fmt: skip
    """Return the bore volume of one shape, as in ``climb``."""
    most, count, end = 1.0, 0, np.empty(1)
    if edges.size > 0 and c < 1.0:
        most = _interpolated(edges, edge_bore, c)
    if limit < np.inf:
        end[0] = c
        count = split(end, x, share, bend, shear, work[0], work[1], work[2], work[3])
    size = greatest_size(
        turn, r, c, x, bore, work[0][:count], work[1][:count], work[2][:count], work[3][:count], a, b, limit, most
    )
    if r < 1.0:
        size = min(size, steep * c / (1.0 - r))
    return size * size * compiled_hollow(turn, r, c)


@kernel
def climb(
    turn: int, rs: Array, cs: Array, c_low: float, c_high: float, least_step: float, edges: Array, edge_bore: Array,
    steep: float, x: Array, bore: Array, share: Array, bend: Array, shear: Array, a: float, b: float, limit: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return (bore volume, r, c) of the best shape, from the grid rs x cs by pattern search.

    Sixteen directions; the step doubles on success and is halved otherwise. The size of a widening shape with a
    corner is at most ``edge_bore`` there, linear between the ``edges`` (empty: no corner), under a slope limit at
    most ``steep`` c/(1 - r).
    """
    work = np.empty((4, x.size + 2 * NODES))
    gain, r, c, step = -1.0, 0.0, c_low, _FIRST_STEP
    for r1 in rs:
        for c1 in cs:
            trial = _bore_volume(turn, r1, c1, edges, edge_bore, steep, x, bore, share, bend, shear, a, b, limit, work)
            if trial > gain:
                gain, r, c = trial, r1, c1
    while step > least_step:
        better = False
        # If the cone occupies the whole half, only two directions exist.
        for way in range(0, _DIRECTIONS, 1 if c_low < c_high else _DIRECTIONS // 2):
            angle = 2.0 * math.pi * way / _DIRECTIONS
            r1 = min(max(r + step * math.cos(angle), 0.0), 1.0)
            c1 = min(max(c + step * math.sin(angle), c_low), c_high)
            trial = _bore_volume(turn, r1, c1, edges, edge_bore, steep, x, bore, share, bend, shear, a, b, limit, work)
            if trial > gain:
                gain, r, c, better = trial, r1, c1, True
                break
        step *= 2.0 if better else 0.5
    return gain, r, c
