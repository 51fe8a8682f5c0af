"""Several identical cylinders on one shaft, each with its cycle delayed by psi_i relative to the first."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel

_MAX_BREAKS, _MIN_BREAKS_PER_CYLINDER = 20_000, 1500
"""Maximum breaks in total, and its minimum per cylinder: beyond, equal pieces are used to bound the run time."""
_COINCIDENCE_TOLERANCE = 8.0 * np.finfo(float).eps * 4.0 * math.pi
"""Distance below which breaks of several cylinders coincide up to rounding."""


class CylinderGroup(NamedTuple):
    """Cylinders that act together.

    The pieces' bounds (n + 1,) [rad] on the shaft, and for each piece and cylinder the piece of the cylinder's own
    pressures (-1: to be searched) and the offset to the shaft angle, (n, cylinders).
    """

    bounds: Array
    piece: Index
    shift: Array


@kernel
def _on_shaft(bounds: Array, gas: Unrolled, phases: Array, exact: bool) -> CylinderGroup:
    """Return the group with these bounds; ``exact`` if no piece has breaks within."""
    breaks, count = gas.breaks, bounds.size
    start, period = breaks[0], breaks[-1] - breaks[0]
    piece = np.full((count - 1, phases.size), -1, np.intp)
    shift = np.empty((count - 1, phases.size))
    for n in range(count - 1):
        middle = 0.5 * (bounds[n] + bounds[n + 1])
        for i in range(phases.size):
            offset = -phases[i] - math.floor((middle - phases[i] - start) / period) * period
            shift[n, i] = offset
            if exact:
                piece[n, i] = piece_of(middle + offset, breaks)
    return CylinderGroup(bounds, piece, shift)


@kernel
def equal_pieces(gas: Unrolled, phases: Array, count: int) -> CylinderGroup:
    """Return the group with this many equal pieces, within which the pressures may have breaks."""
    start, period = gas.breaks[0], gas.breaks[-1] - gas.breaks[0]
    return _on_shaft(start + period * (np.arange(count + 1) / count), gas, phases, False)


@kernel
def cylinder_group(gas: Unrolled, phases: Array) -> CylinderGroup:
    """Return the group of cylinders with these phases [rad] on one shaft."""
    if phases.size == 1 and phases[0] == 0.0:
        count = gas.stroke.size
        return CylinderGroup(gas.breaks, np.arange(count).reshape(count, 1), np.zeros((count, 1)))
    breaks, limit = gas.breaks, max(_MAX_BREAKS // phases.size, _MIN_BREAKS_PER_CYLINDER)
    start, period, size = breaks[0], breaks[-1] - breaks[0], breaks.size - 1
    merged = np.empty(size * phases.size + 2)
    for i in range(phases.size):
        for k in range(size):
            merged[i * size + k] = start + (breaks[k] + phases[i] - start) % period
    merged[-2], merged[-1] = start, start + period
    merged.sort()
    count = 1
    for value in merged[1:]:
        if value - merged[count - 1] > _COINCIDENCE_TOLERANCE:
            merged[count] = value
            count += 1
    merged[count - 1] = start + period
    if count > limit:
        return equal_pieces(gas, phases, limit - 1)
    return _on_shaft(merged[:count].copy(), gas, phases, True)
