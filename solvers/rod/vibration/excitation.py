"""Excitation of the strip, on elements of the revolution between the corners of the axial force.

Elements are narrow enough for polynomials to represent axial force, side force and clamp moment. The decrease of their
coefficients gives the distance from the real axis up to which the motion is analytic: with the ratio 1/rho on an
element of width h, about

    y = h (rho - 1/rho)/4

(Bernstein ellipse). Such a force excites the ringing of a mode with a relative amplitude of about exp(-omega y).

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapter 8.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import INSIDE, Rule, panels_to_halve, points_on, rule_of, split
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import Radau, radau
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.state import FORCE, MOMENT, ROWS, SIDE, Strip, friction_corners, states_of
from solvers.rod.load.axial_force import Drive
from solvers.rod.scene import JUMP

RULE = radau(10)
_WIDEST = TURN / 16
"""Greatest width of an element [rad]."""
_DISTINCT = 1e-9
"""Corners closer than this [rad] are one."""
_LARGEST_SHIFT, _LARGEST_STRETCH = 0.3, 0.5
"""Largest shift of a corner [rad], and largest relative change of the distance between two, from one strip to its
neighbour."""
_MOST_CORNERS = 1000
"""Beyond this number, corners are treated as noise and ignored."""
_MOST_ELEMENTS = 2000
"""Number of elements from which on none is halved."""
FEW_CORNERS = 32
"""Number of corners above which they are those of a table."""
MANY = 128
"""Number of pieces of a load, or of elements, from which on they are narrow."""
_SUBDIVISIONS = 8
"""Intervals between two corners of the load in which corners of friction are searched."""
_NO_ANGLES = np.empty(0)
_NOISE, _ABOVE_NOISE, _NARROW = 1e-15, 10.0, TURN / 64
"""Relative rounding error of coefficients, the multiple of it from which they count, and the width of an element [rad]
up to which smaller ones say nothing."""


@dataclass(frozen=True)
class Excitation:
    """What drives one strip over a revolution that starts at the first corner.

    curvature_per_force  curvature with the same stress as an axial force [1/(N m)]
    corners              angles at which the axial force or a derivative of it jumps [rad]
    jumps                angles at which the force itself jumps, corners too
    anchors              corners and further ends of intervals in which the force is smooth
    edges                ends of elements, including the anchors
    states               at the ``rule``'s points of all elements, one element after the other (rows, elements points)
    """

    strip: Strip
    drive: Drive
    curvature_per_force: float
    corners: Array
    jumps: Array
    anchors: Array
    edges: Array
    states: Array
    rule: Radau = RULE

    @staticmethod
    def of(cycle: Cycle, tolerance: float, rule: Radau = RULE) -> Excitation:
        """The excitation in a cycle, on elements that resolve forces and moment to ``tolerance``, relative to the
        greatest of each; with an infinite one on the intervals between corners."""
        strip, drive, jumps = cycle.strip, cycle.drive, cycle.scene.load.jumps()
        corners, anchors = _anchors(cycle)
        if drive.curve.breaks.size and not corners.size:
            tolerance = max(tolerance, 1e-6)
        edges = split(anchors, _WIDEST)
        if corners.size < MANY and not math.isinf(tolerance):
            edges = _resolving_edges(drive, strip, jumps, edges, rule_of(rule.points.size), tolerance)
        states = states_in(drive, strip, jumps, edges, rule)
        return Excitation(strip, drive, _curvature_per_force(cycle), corners, jumps, anchors, edges, states, rule)

    def neighbour(self, cycle: Cycle) -> Excitation | None:
        """The excitation of a neighbouring strip on the same elements, which move with the corners; None if corners
        appear or vanish."""
        strip, drive = cycle.strip, cycle.drive
        corners, anchors = _anchors(cycle)
        if anchors.size != self.anchors.size:
            return None
        shift = anchors - self.anchors
        stretch = np.abs(np.diff(shift))
        if np.max(np.abs(shift)) > _LARGEST_SHIFT or np.any(stretch > _LARGEST_STRETCH * np.diff(self.anchors)):
            return None
        edges = np.interp(self.edges, self.anchors, anchors)
        states = states_in(drive, strip, self.jumps, edges, self.rule)
        return Excitation(
            strip, drive, _curvature_per_force(cycle), corners, self.jumps, anchors, edges, states,
            self.rule,
        )  # fmt: skip

    def refined(self, where: NDArray[np.bool_]) -> Excitation:
        """This excitation with the marked elements halved."""
        widths = np.where(where, 0.5 * (1.0 + 1e-6), 1.0) * np.diff(self.edges)
        edges = split(self.edges, widths)
        return replace(self, edges=edges, states=states_in(self.drive, self.strip, self.jumps, edges, self.rule))

    def states_on(self, edges: Array, rule: Radau) -> Array:
        """The states at all points of a rule on elements between other edges."""
        if rule is self.rule and (edges is self.edges or np.array_equal(edges, self.edges)):
            return self.states
        return states_in(self.drive, self.strip, self.jumps, edges, rule)

    def panels(self, edges: Array) -> NDArray[np.int64]:
        """The first elements behind the corners; without corners the first one of the revolution."""
        return np.searchsorted(edges, self.corners) if self.corners.size else np.zeros(1, dtype=np.int64)

    @property
    def inertia(self) -> float:
        """rho A omega^2 [N/m^2]."""
        return self.strip.line_mass * self.drive.angular_speed**2

    @cached_property
    def smoothness(self) -> Smoothness:
        return _smoothness(self.edges, self.states, self.corners, self.rule)

    @cached_property
    def mean(self) -> float:
        """The mean axial force [N]."""
        means = self.states[FORCE].reshape(-1, self.rule.points.size) @ self.rule.integral[-1]
        return float(np.diff(self.edges) @ means) / TURN


class Smoothness(NamedTuple):
    """Least and greatest axial force [N] on every element; distance of analyticity y of the motion from the real axis
    there [rad]; and second derivative of side force and moment, relative to the greatest of each [1/rad^2]."""

    least: Array
    greatest: Array
    analytic: Array
    curvature: Array


@kernel
def _smoothness(edges: Array, states: Array, corners: Array, rule: Radau) -> Smoothness:
    count, p = edges.size - 1, rule.points.size
    least, greatest, analytic, second = np.empty(count), np.empty(count), np.empty(count), np.zeros((2, count))
    greatest_load, tail = np.full(2, 1e-300), np.zeros((2, count))
    for e in range(count):
        lowest, highest = np.inf, -np.inf
        for i in range(p):
            force = states[FORCE, e * p + i]
            lowest, highest = min(lowest, force), max(highest, force)
        least[e], greatest[e] = lowest, highest
        for q in range(2):
            row = states[SIDE if q == 0 else MOMENT, e * p : (e + 1) * p]
            for i in range(p):
                greatest_load[q] = max(greatest_load[q], abs(row[i]))
            for t in range(2, rule.tail.shape[0]):
                total = 0.0
                for i in range(p):
                    total += rule.tail[t, i] * row[i]
                tail[q, e] = max(tail[q, e], abs(total))
            for t in range(p):
                total = 0.0
                for i in range(p):
                    total += rule.second[t, i] * row[i]
                second[q, e] = max(second[q, e], abs(total) / (edges[e + 1] - edges[e]) ** 2)
    curvature = np.empty(count)
    for e in range(count):
        curvature[e] = max(second[0, e] / greatest_load[0], second[1, e] / greatest_load[1])
        ratio = max(tail[0, e] / greatest_load[0], tail[1, e] / greatest_load[1]) + _NOISE
        width = edges[e + 1] - edges[e]
        rho = ratio ** (-1.0 / (p - 2))
        # In a narrow element, coefficients at rounding level say nothing about distances beyond its width; in one
        # between two corners, the error is covered by the estimates of series and polynomials.
        is_reliable = ratio > _ABOVE_NOISE * _NOISE or width > _NARROW
        is_enclosed = _contains(corners, edges[e]) and (e == count - 1 or _contains(corners, edges[e + 1]))
        analytic[e] = 0.25 * width * (rho - 1.0 / rho) if is_reliable and not is_enclosed else np.inf
    return Smoothness(least, greatest, analytic, curvature)


@kernel
def _contains(sorted_values: Array, value: float) -> bool:
    index = np.searchsorted(sorted_values, value)
    return index < sorted_values.size and sorted_values[index] == value


@kernel
def off_jumps(angle: Array, jumps: Array) -> Array:
    """The angles; those within the step that replaces a jump are moved to its end on their side of the jump."""
    out = angle.copy()
    for i in range(angle.size):
        for k in range(jumps.size):
            distance = (angle[i] - jumps[k] + 0.5 * TURN) % TURN - 0.5 * TURN
            if abs(distance) < JUMP:
                out[i] += math.copysign(JUMP, distance) - distance
    return out


@kernel
def one_sided_states(drive: Drive, strip: Strip, jumps: Array, angle: Array) -> Array:
    """The states as if jumps were not replaced by steps: extrapolated from outside the step on either side."""
    shifted, outside_angle = off_jumps(angle, jumps), np.empty(1)
    states = states_of(drive, strip, shifted)
    for i in range(angle.size if jumps.size > 0 else 0):
        if shifted[i] != angle[i]:
            inward = angle[i] - shifted[i]
            outside_angle[0] = shifted[i] - math.copysign(JUMP, inward)
            outside = states_of(drive, strip, outside_angle)
            for row in range(ROWS):
                states[row, i] += abs(inward) / JUMP * (states[row, i] - outside[row, 0])
    return states


@kernel
def states_in(drive: Drive, strip: Strip, jumps: Array, edges: Array, rule: Radau) -> Array:
    """States of the quasi-static strip, including friction feedback, at a rule's points of elements without jumps
    inside, one element after the other: (rows, angles)."""
    count, p = edges.size - 1, rule.points.size
    # Without jumps the end of an element is the start of the next one.
    shared = 1 if jumps.size == 0 else 0
    stride = p - shared
    angle = np.empty(count * stride + shared)
    for e in range(count):
        for i in range(p):
            angle[e * stride + i] = edges[e] + (edges[e + 1] - edges[e]) * rule.points[i]
        if jumps.size > 0:
            angle[e * p] += INSIDE
            angle[(e + 1) * p - 1] -= INSIDE
    distinct = one_sided_states(drive, strip, jumps, angle)
    if shared == 0:
        return distinct
    states = np.empty((ROWS, count * p))
    for row in range(ROWS):
        for e in range(count):
            for i in range(p):
                states[row, e * p + i] = distinct[row, e * stride + i]
    return states


@kernel
def _resolving_edges(drive: Drive, strip: Strip, jumps: Array, edges: Array, rule: Rule, tolerance: float) -> Array:
    """Edges, including those given, between which polynomials through the points of a rule resolve forces and moment
    to ``tolerance``, relative to the greatest of each."""
    n, scale, left, right = rule.points.size, np.full(3, 1e-300), edges[:-1].copy(), edges[1:].copy()
    starts = [0.0 for _ in range(0)]
    while left.size > 0:
        angle = points_on(left, right, rule)
        for e in range(left.size):
            angle[e * n] += INSIDE
            angle[(e + 1) * n - 1] -= INSIDE
        states, loads = one_sided_states(drive, strip, jumps, angle), np.empty((3, angle.size))
        for i in range(angle.size):
            loads[0, i], loads[1, i], loads[2, i] = states[FORCE, i], states[SIDE, i], states[MOMENT, i]
        most = _MOST_ELEMENTS - len(starts)
        halved, _, lefts, rights = panels_to_halve(loads, left, right, rule, scale, tolerance, most)
        for e in range(left.size):
            if not halved[e]:
                starts.append(left[e])
        left, right = lefts, rights
    starts.append(edges[-1])
    return np.sort(np.array(starts))


def _anchors(cycle: Cycle) -> tuple[Array, Array]:
    """Corners, and ends of intervals in which the force is smooth, over one revolution from the first corner."""
    load, drive = cycle.scene.load, cycle.drive
    sharp = _NO_ANGLES if drive.curve.breaks.size else load.sharp_angles()
    return anchors_of(drive, cycle.strip, load.corners(), load.jumps(), sharp)


@kernel
def anchors_of(
    drive: Drive, strip: Strip, load_corners: Array, jumps: Array, sharp_angles: Array
) -> tuple[Array, Array]:
    """Kernel of ``_anchors``, from the load's corners and sharp angles, in [0, 2 pi).

    With friction feedback, angles at which the piston begins or ceases to contact both walls are corners too, except if
    the load has many corners: elements are narrow then, far less changes at those angles, and they would appear and
    vanish from strip to strip.
    """
    candidates = np.sort(load_corners % TURN)
    if strip.friction != 0.0 and candidates.size < MANY:
        bearing = friction_corners(drive, strip, _subdivided(candidates))
        separate = bearing[off_jumps(bearing, jumps) == bearing]
        candidates = np.sort(np.concatenate((candidates, separate)) % TURN)
    distinct = np.ones(candidates.size, np.bool_)
    for k in range(candidates.size):
        before = candidates[k - 1] if k > 0 else candidates[candidates.size - 1] - TURN
        distinct[k] = candidates[k] - before > _DISTINCT
    corners = candidates[distinct]
    if corners.size > _MOST_CORNERS:
        corners = corners[:0].copy()
    first = corners[0] if corners.size > 0 else 0.0
    ends = np.concatenate(
        (np.concatenate((corners, first + (sharp_angles - first) % TURN)), np.array([first, first + TURN]))
    )
    ends = np.sort(ends)
    distinct = np.ones(ends.size, np.bool_)
    for k in range(ends.size - 1):
        distinct[k] = ends[k + 1] - ends[k] > _DISTINCT
    return corners, ends[distinct]


@kernel
def _subdivided(corners: Array) -> Array:
    """Angles that subdivide the intervals between corners: within a narrow one the force may rise and fall."""
    out = np.empty(corners.size * _SUBDIVISIONS)
    for k in range(corners.size):
        end = corners[k + 1] if k + 1 < corners.size else corners[0] + TURN
        for i in range(_SUBDIVISIONS):
            out[k * _SUBDIVISIONS + i] = (corners[k] + i / _SUBDIVISIONS * (end - corners[k])) % TURN
    return out


def _curvature_per_force(cycle: Cycle) -> float:
    """h/(6 EI) [1/(N m)]."""
    return cycle.dimensions.h / (6.0 * cycle.strip.stiffness)
