"""The instants of a cycle at which its loads are greatest, for one cylinder or for several that act together.

All quantities are sampled at once at a few places of every piece, its two ends included, each piece for itself, since
the pressure may jump at a break. Of the humps of the samples those are then climbed that may reach above the best by
more than the tolerance: with K the bound of a hump's bend over a step, four times that of the samples, and d what the
higher neighbour lies below it, it may rise by K/2 (1/2 - d/K)^2. What is left unclimbed counts as error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.crank.cycle.forces import Cycle, Instant, Machine, instant, length_of
from solvers.crank.gas.unrolled_pressure import Unrolled, brix_pressure_at, piece_of, pressure_at, within
from solvers.crank.motion.slider_crank import acceleration_of, displacement_of, stand_at
from solvers.crank.problem import LOADS
from solvers.numerics.brackets import narrow, trial_points
from solvers.numerics.jit import inlined_kernel, kernel

Array = NDArray[np.float64]
Index = NDArray[np.intp]

ROWS = 12
"""Gas force, rod compression, rod tension, |side force|, loads of wrist pin, crank pin and main bearing, torque and its
negative; then what the textbooks get wrong (``textbook_error``): displacement, acceleration, pressure."""
CRANK_PIN, TORQUE, TEXTBOOK = 5, 7, 9
WITHIN = 4
"""Steps of a piece between its samples. Half as many save a tenth of the time and miss what the estimate must cover."""
_MOST_HUMPS, _MOST_ROUNDS = 64, 40
_LEFT, _MISSED = 0.5, 0.01
"""Of the tolerance: what may be left unclimbed, and what a climb may still miss; its last round gains many digits."""
_ROUNDING = 4.0 * np.finfo(float).eps


class Group(NamedTuple):
    """Cylinders that act together: the pieces' bounds (n + 1,) [rad] on the shaft, and for each piece and cylinder the
    piece of the cylinder's own pressures (-1: look for it) and what is added to the shaft's angle, (n, cylinders)."""

    bounds: Array
    piece: Index
    shift: Array


@dataclass(frozen=True)
class Worst:
    """The instant at which a force is greatest: its name, where [rad], its value [N] and the pressure [Pa] there."""

    name: str
    angle: float
    force: float
    pressure: float


@dataclass(frozen=True)
class Greatest:
    """Greatest values of some rows, where [rad], their absolute errors, and the pressures there; all (rows,).

    ``places`` and ``samples`` are where all pieces were seen, (pieces, places), and the rows there, (pieces, rows,
    places).
    """

    value: Array
    place: Array
    error: Array
    pressure: Array
    places: Array
    samples: Array


def alone(gas: Unrolled) -> Group:
    """One cylinder by itself."""
    count = gas.stroke.size
    return Group(gas.breaks, np.arange(count)[:, None], np.zeros((count, 1)))


@inlined_kernel
def instant_of(angle: float, n: int, cylinder: int, machine: Machine, gas: Unrolled, group: Group) -> Instant:
    """One cylinder at a shaft angle of the group's piece ``n``."""
    phi, k = angle + group.shift[n, cylinder], group.piece[n, cylinder]
    if k < 0:
        phi = within(phi, gas.breaks)
        k = piece_of(phi, gas.breaks)
    return instant(phi, k, machine, gas)


@kernel
def _rows(
    angle: Array, start: int, n: int, machine: Machine, gas: Unrolled, group: Group, first: int, out: Array
) -> None:
    """The rows from ``first`` on, (rows, angles), at shaft angles of piece ``n``, those before ``start`` left out; all
    cylinders together."""
    r = machine.frame.r
    for i in range(start, angle.size):
        if first >= TEXTBOOK:
            _textbook_rows(angle[i], group.piece[n, 0], machine, gas, first, out[:, i])
            continue
        at = instant_of(angle[i], n, 0, machine, gas, group)
        tangential, radial = at.tangential, at.radial
        for cylinder in range(1, group.shift.shape[1]):
            other = instant_of(angle[i], n, cylinder, machine, gas, group)
            tangential += other.tangential
            radial += other.radial
        if first == 0:
            axial = at.gas + at.inertia
            out[0, i], out[1, i] = at.gas, math.copysign(length_of(axial, at.side), axial)
            out[2, i], out[3, i], out[4, i] = -out[1, i], abs(at.side), length_of(at.on_pin, at.side)
        if first <= CRANK_PIN:
            out[CRANK_PIN - first, i] = length_of(tangential, radial - machine.big_end)
            out[CRANK_PIN + 1 - first, i] = length_of(tangential, radial - machine.turning)
        if first + out.shape[0] > TORQUE:
            out[TORQUE - first, i], out[TORQUE + 1 - first, i] = tangential * r, -tangential * r


@kernel
def _textbook_rows(angle: float, k: int, machine: Machine, gas: Unrolled, first: int, out: Array) -> None:
    r, ratio = machine.frame.r, machine.frame.r / machine.frame.length
    if first == TEXTBOOK + 2:
        out[0] = abs(brix_pressure_at(angle, k, gas) - pressure_at(angle, k, gas))
        return
    at = stand_at(angle, machine.frame)
    moved = 2.0 * at.half_sine * at.half_sine + 0.5 * ratio * at.sine * at.sine
    hastened = at.cosine + ratio * (at.cosine - at.sine) * (at.cosine + at.sine)
    out[0] = abs(moved - displacement_of(at, machine.frame) / r)
    out[1] = abs(hastened - acceleration_of(at, machine.frame) / r) / (1.0 + ratio)


@kernel
def _joined(n: int, gas: Unrolled, group: Group) -> bool:
    """Whether nothing jumps where a piece begins."""
    for cylinder in range(group.shift.shape[1]):
        k = group.piece[n, cylinder]
        if n == 0 or k < 0 or gas.stroke[group.piece[n - 1, cylinder]] != gas.stroke[k]:
            return False
    return True


@kernel
def _sampled(machine: Machine, gas: Unrolled, group: Group, first: int, rows: int) -> tuple[Array, Array]:
    """Places (pieces, WITHIN + 1) and the rows there (pieces, rows, WITHIN + 1)."""
    count = group.bounds.size - 1
    places, values = np.empty((count, WITHIN + 1)), np.empty((count, rows, WITHIN + 1))
    for n in range(count):
        low, high = group.bounds[n], group.bounds[n + 1]
        for j in range(WITHIN + 1):
            places[n, j] = min(low + (high - low) * (j / WITHIN), high)
        known = 1 if _joined(n, gas, group) else 0
        if known:
            for row in range(rows):
                values[n, row, 0] = values[n - 1, row, WITHIN]
        _rows(places[n], known, n, machine, gas, group, first, values[n])
    return places, values


@kernel
def _reach(values: Array, j: int) -> float:
    """What a function four times as bent as the samples of its piece may reach between hump ``j`` and its neighbours;
    -inf where there is no hump."""
    fall, here = np.inf, values[j]
    if j > 0:
        fall = here - values[j - 1]
    if j < WITHIN:
        fall = min(fall, here - values[j + 1])
    if not fall >= 0.0:
        return -np.inf
    m = min(max(j, 1), WITHIN - 1)
    bend = abs(values[m - 1] - 2.0 * values[m] + values[m + 1])
    rise = max(2.0 * bend - fall, 0.0)
    return here + (rise * rise / (8.0 * bend) if rise > 0.0 else 0.0)


@kernel
def _climbed(
    machine: Machine, gas: Unrolled, group: Group, first: int, places: Array, samples: Array, tolerance: float
) -> Array:
    """(4, rows): greatest values, places, errors, pressures."""
    rows, count = samples.shape[1], places.shape[0]
    found, out = np.empty((4, rows)), np.empty((rows, 5))
    place, value, points = np.empty(3), np.empty(3), np.empty(5)
    reach, owner = np.empty(count * (WITHIN + 1)), np.empty(count * (WITHIN + 1), np.intp)
    for row in range(rows):
        best, scale, at = -np.inf, 0.0, 0
        for n in range(count):
            for j in range(WITHIN + 1):
                scale = max(scale, abs(samples[n, row, j]))
                if samples[n, row, j] > best:
                    best, at = samples[n, row, j], n * (WITHIN + 1) + j
        where, piece = places[at // (WITHIN + 1), at % (WITHIN + 1)], at // (WITHIN + 1)
        humps = 0
        for n in range(count):
            for j in range(WITHIN + 1):
                high = _reach(samples[n, row], j)
                if high > best:
                    reach[humps], owner[humps] = high, n * (WITHIN + 1) + j
                    humps += 1
        left = best
        for _ in range(_MOST_HUMPS + 1):
            top = -1
            for h in range(humps):
                if top < 0 or reach[h] > reach[top]:
                    top = h
            slack = _LEFT * tolerance * abs(best) + _ROUNDING * scale
            if top < 0 or reach[top] <= best + slack or _ == _MOST_HUMPS:
                if top >= 0:
                    left = max(left, reach[top])
                break
            n, j = owner[top] // (WITHIN + 1), owner[top] % (WITHIN + 1)
            reach[top] = -np.inf
            for i in range(3):
                m = min(max(j + i - 1, 0), WITHIN)
                place[i], value[i] = places[n, m], samples[n, row, m]
            missing = np.inf
            for _round in range(_MOST_ROUNDS):
                trial_points(place, value, points)
                _rows(points, 0, n, machine, gas, group, first, out)
                missing = narrow(place, value, points, out[row])
                if (
                    missing <= _MISSED * tolerance * abs(value[1]) + _ROUNDING * scale
                    or value[1] + missing <= best + slack
                    or place[2] - place[0] <= 1e-15
                ):
                    break
            left = max(left, value[1] + missing)
            if value[1] > best:
                best, where, piece = value[1], place[1], n
        found[0, row], found[1, row], found[2, row] = best, where, left - best + _ROUNDING * scale
        found[3, row] = instant_of(where, piece, 0, machine, gas, group).pressure
    return found


def greatest(machine: Machine, gas: Unrolled, group: Group, rows: range, tolerance: float) -> Greatest:
    """The greatest values of the rows; ``tolerance`` is relative to them."""
    places, samples = _sampled(machine, gas, group, rows.start, len(rows))
    found = _climbed(machine, gas, group, rows.start, places, samples, tolerance)
    return Greatest(*found, places, samples)


def worst_instants(found: Greatest, cycle: Cycle) -> tuple[Worst, ...]:
    """The loads' rows in words."""
    period = cycle.scene.cylinder.period
    told = zip(LOADS, found.place.tolist(), found.value.tolist(), found.pressure.tolist(), strict=False)
    return tuple(Worst(name, place % period, force, p) for name, place, force, p in told)
