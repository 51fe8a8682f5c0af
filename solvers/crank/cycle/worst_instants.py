"""Critical instants of a cycle, at which its loads are greatest, for one cylinder or several acting together.

All quantities are sampled together at a few points of every piece, including both ends, each piece separately, since
the pressure may jump at a break. A sampled local maximum is refined if it may exceed the incumbent by more than the
tolerance: with K the bound of the second difference, four times that of the samples, and d the deficit of
the higher neighbour, a maximum may rise by K/2 (1/2 - d/K)^2. The remaining possible excess counts as error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.crank.cycle.forces import Instant, Machine, instant, norm
from solvers.crank.cycle.group import CylinderGroup
from solvers.crank.gas.unrolled_pressure import Unrolled, brix_pressure_at, piece_of, wrapped
from solvers.numerics.arrays import Array, Index
from solvers.numerics.brackets import shrink_bracket, trial_points
from solvers.numerics.jit import inlined_kernel, kernel

PINS, BRIX, TORQUE, ROWS = 5, 7, 8, 10
"""Rows of quantities: first the loads, those of crank pin and bearing from the sixth on; the error of Brix's pressure;
the torque and its negative; and their number."""
SUBINTERVALS = 4
"""Sampling subintervals per piece. Halving it saves a tenth of the time but misses maxima the estimate must cover."""
_MAX_REFINED, _MAX_ROUNDS = 1024, 40
_UNREFINED_FRACTION, _REFINED_FRACTION = 0.5, 0.01
"""As fractions of the tolerance: possible excess left unrefined, and the error of a refined maximum, whose last
round gains many digits."""
_ROUNDING = 4.0 * np.finfo(float).eps


class Maxima(NamedTuple):
    """Maxima of some rows, their angles [rad], absolute errors, and the pressures there: (rows,) each."""

    value: Array
    place: Array
    error: Array
    pressure: Array


@inlined_kernel
def instant_of(angle: float, n: int, cylinder: int, machine: Machine, gas: Unrolled, group: CylinderGroup) -> Instant:
    """Return one cylinder's forces at a shaft angle of the group's piece ``n``."""
    phi, k = angle + group.shift[n, cylinder], group.piece[n, cylinder]
    if k < 0:
        phi = wrapped(phi, gas.breaks)
        k = piece_of(phi, gas.breaks)
    return instant(phi, k, machine, gas)


@kernel
def _write_rows(
    angle: Array, pieces: Index, machine: Machine, gas: Unrolled, group: CylinderGroup, brix: bool, out: Array
) -> None:
    """Write the rows at shaft angles of the group's pieces, (rows, angles); where the piece is -1, the values of the
    previous angle are repeated.

    Of a single cylinder all rows; of several four: loads of crank pin and bearing, torque and its negative, summed.
    The row of Brix's error only if ``brix``.
    """
    alone, cylinders, r = out.shape[0] == ROWS, group.shift.shape[1], machine.geometry.r
    pins = PINS if alone else 0
    for i in range(angle.size):
        n = pieces[i]
        if n < 0:
            for row in range(out.shape[0]):
                out[row, i] = out[row, i - 1]
            continue
        at = instant_of(angle[i], n, 0, machine, gas, group)
        tangential, radial = at.tangential, at.radial
        for cylinder in range(1, cylinders):
            other = instant_of(angle[i], n, cylinder, machine, gas, group)
            tangential += other.tangential
            radial += other.radial
        out[pins, i] = norm(tangential, radial - cylinders * machine.big_end)
        out[pins + 1, i] = norm(tangential, radial - machine.rotating)
        out[-2, i], out[-1, i] = tangential * r, -tangential * r
        if alone:
            out[0, i], out[1, i], out[2, i] = at.gas, at.rod, -at.rod
            out[3, i], out[4, i] = abs(at.side), norm(at.wrist_pin_axial, at.side)
        if brix:
            out[BRIX, i] = abs(brix_pressure_at(at.at, group.piece[n, 0], gas) - at.pressure)


@kernel
def sampled_rows(machine: Machine, gas: Unrolled, group: CylinderGroup, alone: bool) -> tuple[Array, Array]:
    """Return the sampling points, SUBINTERVALS + 1 per piece, and the rows there, (rows, points)."""
    count, each = group.bounds.size - 1, SUBINTERVALS + 1
    places, pieces = np.empty(count * each), np.empty(count * each, np.intp)
    out, brix = np.zeros((ROWS if alone else 4, count * each)), gas.by_volume and gas.geometry.offset == 0.0
    for n in range(count):
        low, high = group.bounds[n], group.bounds[n + 1]
        for j in range(each):
            places[n * each + j], pieces[n * each + j] = min(low + (high - low) * (j / SUBINTERVALS), high), n
        continuous = n > 0
        for cylinder in range(group.shift.shape[1] if continuous else 0):
            k = group.piece[n, cylinder]
            continuous &= k >= 0 and gas.stroke[group.piece[n - 1, cylinder]] == gas.stroke[k]
        if continuous:
            pieces[n * each] = -1
    _write_rows(places, pieces, machine, gas, group, alone and brix, out)
    return places, out


@inlined_kernel
def _upper_estimate(values: Array, first: int, j: int, second_difference: float) -> float:
    """Return an upper estimate of a local maximum between sample ``j`` of the piece that starts at ``first`` and its
    neighbours, with up to four times the second difference of the samples; -inf if it is none."""
    deficit, value = np.inf, values[first + j]
    if j > 0:
        deficit = value - values[first + j - 1]
    if j < SUBINTERVALS:
        deficit = min(deficit, value - values[first + j + 1])
    if not deficit >= 0.0:
        return -np.inf
    rise = max(2.0 * second_difference - deficit, 0.0)
    return value + (rise * rise / (8.0 * second_difference) if rise > 0.0 else 0.0)


@kernel
def refined_maxima(
    machine: Machine, gas: Unrolled, group: CylinderGroup, places: Array, samples: Array, first_row: int, end_row: int,
    tolerance: float,
) -> Maxima:  # fmt: skip
    """Return the refined maxima of some of the sampled rows; ``tolerance`` is relative to them."""
    count, each = places.size, SUBINTERVALS + 1
    found, out = np.empty((4, end_row - first_row)), np.empty((samples.shape[0], 5))
    place, value, points = np.empty(3), np.empty(3), np.empty(5)
    estimates, owner, pieces = np.empty(count), np.empty(count, np.intp), np.empty(5, np.intp)
    for row in range(first_row, end_row):
        values = samples[row]
        sample, candidates = np.argmax(values), 0
        best, where, piece = values[sample], places[sample], sample // each
        scale = max(abs(best), abs(values.min()))
        for first in range(0, count, each):
            second_difference = 0.0  # the greatest of the piece, in magnitude
            for j in range(first + 1, first + SUBINTERVALS):
                second_difference = max(second_difference, abs(values[j - 1] - 2.0 * values[j] + values[j + 1]))
            for j in range(each):
                if values[first + j] + 0.5 * second_difference > best:
                    estimate = _upper_estimate(values, first, j, second_difference)
                    if estimate > best:
                        estimates[candidates], owner[candidates] = estimate, first + j
                        candidates += 1
        upper_bound = best
        for iteration in range(_MAX_REFINED + 1 if candidates else 0):
            candidate = np.argmax(estimates[:candidates])
            slack = _UNREFINED_FRACTION * tolerance * abs(best) + _ROUNDING * scale
            if (estimates[candidate] <= best + slack and iteration > 0) or iteration == _MAX_REFINED:
                upper_bound = max(upper_bound, estimates[candidate])
                break
            n, j = owner[candidate] // each, owner[candidate] % each
            estimates[candidate] = -np.inf
            for i in range(3):
                m = n * each + min(max(j + i - 1, 0), SUBINTERVALS)
                place[i], value[i] = places[m], values[m]
            gain_bound = np.inf
            pieces[:] = n
            for _ in range(_MAX_ROUNDS):
                trial_points(place, value, points)
                _write_rows(points, pieces, machine, gas, group, row == BRIX, out)
                gain_bound = shrink_bracket(place, value, points, out[row])
                if (
                    gain_bound <= _REFINED_FRACTION * tolerance * abs(value[1]) + _ROUNDING * scale
                    or value[1] + gain_bound <= best + slack
                    or place[2] - place[0] <= 1e-15
                ):
                    break
            upper_bound = max(upper_bound, value[1] + gain_bound)
            if value[1] > best:
                # The pressure depends on the place to first order: the vertex of the last bracket is nearer.
                trial_points(place, value, points)
                best, where, piece = value[1], points[1], n
        at = row - first_row
        found[0, at], found[1, at], found[2, at] = best, where, upper_bound - best + _ROUNDING * scale
        found[3, at] = instant_of(where, piece, 0, machine, gas, group).pressure
    return Maxima(found[0], found[1], found[2], found[3])
