"""The turn of a strip that is nothing but a beam-column under its load: one compiled call for all gauges.

The search is that of ``solvers.rod.cycle.extremes_in_time.ComposedTurn``, hump by hump and bracket by bracket, without
batches. V'' and V at many angles come from series alone, which the processor takes several at a time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.brackets import MOST_ROUNDS, mark_humps, narrow, trial_points
from solvers.numerics.jit import kernel, reducing_kernel
from solvers.numerics.periodic import CROSSING, foretold_range, sampled_range
from solvers.rod.cycle.composition import BeamColumn, Cycle, Instants, PlainBending, bending_stiffness
from solvers.rod.cycle.extremes_in_time import RESOLVED, ComposedTurn, Turn, resolving
from solvers.rod.cycle.quantities import CURVATURE, DEFLECTION, FORCE, MOMENT, SIDE, TANGENT, Gauges
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.strip.stress_envelope import FORWARD_LIMIT, _long_series, beam_constants

Array = NDArray[np.float64]
_TURN = 2.0 * math.pi
_EPS = float(np.finfo(float).eps)


def turn_of(cycle: Cycle, tolerance: float) -> Turn:
    """The turn that suits what the cycle is composed of."""
    c = cycle.composition
    if c.feedback is None and not c.corrections and isinstance(c.beam, (BeamColumn, PlainBending)):
        return PlainTurn(cycle, tolerance)
    return ComposedTurn(cycle, tolerance)


@dataclass(frozen=True)
class PlainTurn:
    """A turn without feedback, shear or corrections."""

    cycle: Cycle
    tolerance: float

    @cached_property
    def instants(self) -> Instants:
        return self.cycle.at(resolving(self.cycle, lambda angle: _guide(self.cycle.drive, self._strip, angle)))

    @cached_property
    def _strip(self) -> Array:
        cycle = self.cycle
        stiffness = bending_stiffness(cycle.scene, cycle.dimensions)
        return np.array([cycle.composition.beam.couples / stiffness, stiffness, cycle.dimensions.l])

    @cached_property
    def _states(self) -> Array:
        now, c = self.instants, self.instants.shape.constants
        return np.array(
            [now.angle, now.force, now.stroke, c.coupling, c.clamp_curvature, c.clamp_shear, c.head_curvature]
        )

    def sampled(self, gauges: Gauges) -> tuple[Array, Array, Array, Array]:
        return _sampled_extremes(self._strip, self._states, gauges.weights, gauges.stations)

    def greatest(self, gauges: Gauges, relative: float, floor: float) -> tuple[Array, Array]:
        return _greatest(self.cycle.drive, self._strip, self._states, gauges.weights, gauges.stations, relative, floor)

    def extremes(self, gauges: Gauges, relative: float) -> tuple[Array, Array, Array, Array]:
        return _extremes(self.cycle.drive, self._strip, self._states, gauges.weights, gauges.stations, relative)

    def crossings(self, gauges: Gauges) -> Array:
        return _crossings(self.cycle.drive, self._strip, self._states, gauges.weights, gauges.stations)


@reducing_kernel
def _bent(q: float, clamp: float, shear: float, z: float) -> tuple[float, float]:
    """V''(z) and V(z) per unit stroke for q z^2 <= 4, by series of a quarter of the argument, doubled once."""
    t = -q * z * z
    quarter = 0.25 * t
    c2, c3 = _long_series(quarter)
    s1, s0 = 1.0 - quarter * c3, 1.0 - quarter * c2
    c3 = 0.25 * (c2 + s0 * c3)
    c2 = 0.5 * s1 * s1
    turn = shear * z
    return clamp * (1.0 - t * c2) + turn * (s0 * s1), z * z * (clamp * c2 + turn * c3)


@kernel
def _bent_by_tension(q: float, clamp: float, shear: float, head: float, l: float, z: float) -> tuple[float, float]:
    """V''(z) and V(z) per unit stroke from V'' at both ends, for strong tension."""
    k = math.sqrt(q)
    span = -math.expm1(-2.0 * k * l)
    down = math.exp(-k * z) * -math.expm1(-2.0 * k * (l - z))
    up = math.exp(-k * (l - z)) * -math.expm1(-2.0 * k * z)
    bent = (clamp * down + head * up) / span
    return bent, (bent - clamp - shear * z) / q


@reducing_kernel
def _bend_all(states: Array, l: float, z: float, curvature: Array, deflection: Array) -> None:
    """V'' and V at one section and all sampled angles."""
    stroke, q, clamp, shear, head = states[2], states[3], states[4], states[5], states[6]
    most = FORWARD_LIMIT / (l * l)
    for i in range(q.size):
        bent, sunk = _bent(min(q[i], most), clamp[i], shear[i], z)
        curvature[i], deflection[i] = bent * stroke[i], sunk * stroke[i]
    for i in range(q.size):
        if q[i] > most:
            bent, sunk = _bent_by_tension(q[i], clamp[i], shear[i], head[i], l, z)
            curvature[i], deflection[i] = bent * stroke[i], sunk * stroke[i]


@kernel
def _read_all(strip: Array, states: Array, weight: Array, curvature: Array, deflection: Array, out: Array) -> None:
    """One gauge at all sampled angles, given V'' and V at its section."""
    force, stroke, clamp, shear = states[1], states[2], states[4], states[5]
    along = weight[FORCE] + weight[TANGENT]
    side, moment = -weight[SIDE] * strip[1], weight[MOMENT] * strip[1]
    if side == 0.0 and moment == 0.0:
        for i in range(out.size):
            out[i] = along * force[i]
    else:
        for i in range(out.size):
            out[i] = along * force[i] + (side * shear[i] + moment * clamp[i]) * stroke[i]
    if weight[CURVATURE] != 0.0:
        for i in range(out.size):
            out[i] += weight[CURVATURE] * curvature[i]
    if weight[DEFLECTION] != 0.0:
        for i in range(out.size):
            out[i] += weight[DEFLECTION] * deflection[i]


@kernel
def _read(drive: Drive, strip: Array, weight: Array, z: float, angle: float) -> float:
    """One gauge at any angle."""
    force = axial_force(drive, angle)
    total = (weight[FORCE] + weight[TANGENT]) * force
    if weight[SIDE] == 0.0 and weight[MOMENT] == 0.0 and weight[CURVATURE] == 0.0 and weight[DEFLECTION] == 0.0:
        return total
    q, l, stroke = strip[0] * force, strip[2], drive.crank_radius * math.sin(angle)
    clamp, shear, head, _ = beam_constants(q, l, drive.rod_length)
    total += strip[1] * (weight[MOMENT] * clamp - weight[SIDE] * shear) * stroke
    if weight[CURVATURE] != 0.0 or weight[DEFLECTION] != 0.0:
        if q * l * l > FORWARD_LIMIT:
            bent, sunk = _bent_by_tension(q, clamp, shear, head, l, z)
        else:
            bent, sunk = _bent(q, clamp, shear, z)
        total += (weight[CURVATURE] * bent + weight[DEFLECTION] * sunk) * stroke
    return total


@kernel
def _guide(drive: Drive, strip: Array, angle: Array) -> Array:
    """Axial force, clamp moment and side force at many angles, shape (3, angles)."""
    out = np.empty((3, angle.size))
    for i in range(angle.size):
        force, stroke = axial_force(drive, angle[i]), strip[1] * drive.crank_radius * math.sin(angle[i])
        clamp, shear, _, _ = beam_constants(strip[0] * force, strip[2], drive.rod_length)
        out[0, i], out[1, i], out[2, i] = force, clamp * stroke, -shear * stroke
    return out


@kernel
def _needs_bending(weights: Array) -> bool:
    bends = False
    for row in range(weights.shape[0]):
        bends = bends or weights[row, CURVATURE] != 0.0 or weights[row, DEFLECTION] != 0.0
    return bends


@kernel
def _sampled_extremes(
    strip: Array, states: Array, weights: Array, stations: Array
) -> tuple[Array, Array, Array, Array]:
    """As ``Turn.sampled``."""
    count = states.shape[1]
    curvature, deflection, samples = np.zeros(count), np.zeros(count), np.empty(count)
    found = np.empty((4, stations.size))
    for row in range(stations.size):
        if row == 0 or stations[row] != stations[row - 1]:
            _bend_all(states, strip[2], stations[row], curvature, deflection)
        _read_all(strip, states, weights[row], curvature, deflection, samples)
        found[1, row], found[0, row] = sampled_range(samples)
        found[3, row], found[2, row] = foretold_range(states[0], samples)
    return found[0], found[1], found[2], found[3]


@kernel
def _climb(
    drive: Drive, strip: Array, weight: Array, z: float, place: Array, value: Array, wanted: float
) -> tuple[float, float]:
    """The height of one hump from its bracket, and its error."""
    points, heights, error = np.empty(5), np.empty(5), np.inf
    rounding = 4.0 * _EPS * max(abs(value[0]), abs(value[1]), abs(value[2]))
    for _ in range(MOST_ROUNDS):
        trial_points(place, value, points)
        for m in range(5):
            heights[m] = _read(drive, strip, weight, z, points[m])
        error = narrow(place, value, points, heights)
        spent = place[2] - place[0] <= 8.0 * _EPS * max(abs(place[1]), _EPS)
        if error <= max(wanted, rounding) or spent:
            break
    return value[1], max(error, rounding)


@kernel
def _top(
    drive: Drive, strip: Array, weight: Array, z: float, angle: Array, samples: Array, wanted: float
) -> tuple[float, float]:
    """The greatest value of one gauge, given its samples, and its error."""
    count = angle.size
    peaks, place, value = np.zeros(count, dtype=np.bool_), np.empty(3), np.empty(3)
    mark_humps(samples, RESOLVED, True, peaks)
    best, reach = -np.inf, -np.inf
    for n in range(count):
        if not peaks[n]:
            continue
        before, after = n - 1 if n > 0 else count - 1, n + 1 if n < count - 1 else 0
        place[0], place[2] = angle[before] - (_TURN if n == 0 else 0.0), angle[after] + (_TURN if after == 0 else 0.0)
        place[1] = angle[n]
        value[0], value[1], value[2] = samples[before], samples[n], samples[after]
        height, missing = _climb(drive, strip, weight, z, place, value, wanted)
        best, reach = max(best, height), max(reach, height + missing)
    # A lower hump matters as far as its own error lets it reach above the highest.
    return best, max(reach - best, 0.0)


@kernel
def _greatest(
    drive: Drive, strip: Array, states: Array, weights: Array, stations: Array, relative: float, floor: float
) -> tuple[Array, Array]:
    """As ``Turn.greatest``."""
    count, bends = states.shape[1], _needs_bending(weights)
    curvature, deflection, samples = np.zeros(count), np.zeros(count), np.empty(count)
    best, error = np.empty(stations.size), np.empty(stations.size)
    for row in range(stations.size):
        z, weight = stations[row], weights[row]
        if bends:
            _bend_all(states, strip[2], z, curvature, deflection)
        _read_all(strip, states, weight, curvature, deflection, samples)
        least, most = sampled_range(samples)
        wanted = relative * max(abs(most), floor * max(most, -least))
        best[row], error[row] = _top(drive, strip, weight, z, states[0], samples, wanted)
    return best, error


@kernel
def _extremes(
    drive: Drive, strip: Array, states: Array, weights: Array, stations: Array, relative: float
) -> tuple[Array, Array, Array, Array]:
    """As ``Turn.extremes``."""
    angle, count, rows = states[0], states.shape[1], stations.size
    curvature, deflection, samples = np.zeros(count), np.zeros(count), np.empty(count)
    high, low, high_error, low_error = np.empty(rows), np.empty(rows), np.empty(rows), np.empty(rows)
    turned = np.empty(weights.shape[1])
    for row in range(rows):
        z, weight = stations[row], weights[row]
        _bend_all(states, strip[2], z, curvature, deflection)
        _read_all(strip, states, weight, curvature, deflection, samples)
        least, most = sampled_range(samples)
        wanted = relative * max(most, -least)
        high[row], high_error[row] = _top(drive, strip, weight, z, angle, samples, wanted)
        for n in range(count):
            samples[n] = -samples[n]
        for n in range(weight.size):
            turned[n] = -weight[n]
        deepest, low_error[row] = _top(drive, strip, turned, z, angle, samples, wanted)
        low[row] = -deepest
    return high, low, high_error, low_error


@kernel
def _crossings(drive: Drive, strip: Array, states: Array, weights: Array, stations: Array) -> Array:
    """As ``Turn.crossings``, by the Illinois rule."""
    angle, count = states[0], states.shape[1]
    curvature, deflection, samples = np.zeros(count), np.zeros(count), np.empty(count)
    found = [0.0 for _ in range(0)]
    for row in range(stations.size):
        z, weight = stations[row], weights[row]
        _bend_all(states, strip[2], z, curvature, deflection)
        _read_all(strip, states, weight, curvature, deflection, samples)
        for n in range(count):
            after = (n + 1) % count
            left, right = angle[n], angle[after] + (_TURN if after == 0 else 0.0)
            low, high = samples[n], samples[after]
            if low * high >= 0.0:
                continue
            place = left
            for _ in range(MOST_ROUNDS):
                trial = right - high * (right - left) / (high - low)
                moved, place = abs(trial - place), trial
                value = _read(drive, strip, weight, z, place)
                if moved <= CROSSING or value == 0.0:
                    break
                if value * high < 0.0:
                    left, low = right, high
                else:
                    low *= 0.5
                right, high = place, value
            found.append(place)
    return np.array(found)
