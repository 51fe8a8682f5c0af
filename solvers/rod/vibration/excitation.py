"""What drives the strip, on elements of the turn between the corners of the axial force.

An element is narrow enough where a polynomial follows force, side force and clamp moment. How fast its coefficients
fall tells how far from the real axis the motion stays analytic: with ratio 1/rho on an element of width h, up to about

    y = h (rho - 1/rho)/4

(Bernstein's ellipse). Of a mode's ringing such a force excites about exp(-omega y) of itself.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapter 8.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.panels import INSIDE, Rule, largest, panel_error, rule_of, split
from solvers.numerics.radau import Radau, radau
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.state import FORCE, MOMENT, ROWS, SIDE, Strip, fill_states, friction_corners
from solvers.rod.load.axial_force import Drive
from solvers.rod.scene import JUMP

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
RULE = radau(10)
_GRID = TURN / 128 * np.arange(129)
_WIDEST = TURN / 16
_APART = 1e-9
"""Corners closer than this [rad] are one."""
_SAME_CORNER, _WIDENED = 0.3, 0.5
"""By no more than this [rad] a corner moves from a strip to the next, and by this share what is between two."""
_MOST_CORNERS = 1000
"""More are no corners to a motion, but texture."""
_MOST_ELEMENTS = 2000
MANY = 128
"""So many pieces of a load, or elements, are narrow."""
_DIVIDED = 8
"""Between two corners of the load friction's are looked for in so many parts."""
_NOWHERE = np.empty(0)
_ROUGH, _ROUNDED, _NARROW = 1e-15, 10.0, TURN / 64
_BENT_DEGREE = 4
"""Second derivatives are those of the part up to this degree, of which rounding leaves enough in a narrow element."""


@dataclass(frozen=True)
class Excitation:
    """``corners`` [rad] are angles at which derivatives of the axial force jump, ``jumps`` those of them at which it
    jumps itself, ``anchors`` all these and others between
    which it is smooth, over one turn from the first corner on, ``edges`` the ends of elements, anchors among them,
    ``states`` those at ``RULE``'s points of every element, one after the other; ``inertia`` is rho A omega^2
    [N/m^2]; ``stretch`` [1/(N m)] makes of a force the curvature that has the same stress."""

    strip: Strip
    drive: Drive
    inertia: float
    stretch: float
    corners: Array
    jumps: Array
    anchors: Array
    edges: Array
    states: Array

    @staticmethod
    def of(cycle: Cycle, wanted: float) -> Excitation:
        """On elements that follow forces and moment to ``wanted`` of the greatest of each."""
        strip, drive, jumps = cycle.strip, cycle.drive, cycle.scene.load.jumps()
        corners, anchors = _anchors(cycle)
        if drive.breaks.size and not corners.size:
            wanted = max(wanted, 1e-6)
        if corners.size >= MANY:
            wanted = np.inf
        edges = _following(drive, strip, jumps, anchors, rule_of(RULE.points.size), wanted)
        states = states_in(drive, strip, jumps, edges, RULE)
        return Excitation(strip, drive, _inertia(cycle), _stretch(cycle), corners, jumps, anchors, edges, states)

    def beside(self, cycle: Cycle) -> Excitation | None:
        """Of a strip next to this one, on the same elements, which go with the corners; None where corners come and
        go."""
        strip, drive = cycle.strip, cycle.drive
        corners, anchors = _anchors(cycle)
        if anchors.size != self.anchors.size:
            return None
        moved = anchors - self.anchors
        if np.max(np.abs(moved)) > _SAME_CORNER or np.any(np.abs(np.diff(moved)) > _WIDENED * np.diff(self.anchors)):
            return None
        edges = np.interp(self.edges, self.anchors, anchors)
        states = states_in(drive, strip, self.jumps, edges, RULE)
        return Excitation(strip, drive, _inertia(cycle), _stretch(cycle), corners, self.jumps, anchors, edges, states)

    def halved(self, where: NDArray[np.bool_]) -> Excitation:
        """With two elements in place of each one that is marked."""
        parts = np.where(where, 0.5 * (1.0 + 1e-6), 1.0) * np.diff(self.edges)
        edges = split(self.edges, parts)
        return replace(self, edges=edges, states=states_in(self.drive, self.strip, self.jumps, edges, RULE))

    def states_on(self, edges: Array, rule: Radau) -> Array:
        """The states at all points of a rule in elements between other edges."""
        if rule is RULE and (edges is self.edges or np.array_equal(edges, self.edges)):
            return self.states
        return states_in(self.drive, self.strip, self.jumps, edges, rule)

    def panels(self, edges: Array) -> NDArray[np.int64]:
        """The first elements behind the corners; without corners the first one of the turn."""
        return np.searchsorted(edges, self.corners) if self.corners.size else np.zeros(1, dtype=np.int64)

    @cached_property
    def smoothness(self) -> Smoothness:
        return _smoothness(self.edges, self.states, self.corners, RULE)

    @cached_property
    def mean(self) -> float:
        """The mean axial force [N]."""
        means = self.states[FORCE].reshape(-1, RULE.points.size) @ RULE.integral[-1]
        return float(np.diff(self.edges) @ means) / TURN


class Smoothness(NamedTuple):
    """The least and the greatest axial force [N] of every element; how far from the real axis [rad] the motion stays
    analytic there; and the second derivatives of what drives it, over its greatest [1/rad^2]."""

    least: Array
    greatest: Array
    analytic: Array
    curvature: Array


@kernel
def _smoothness(edges: Array, states: Array, corners: Array, rule: Radau) -> Smoothness:
    count, p = edges.size - 1, rule.points.size
    least, greatest, out, bent = np.empty(count), np.empty(count), np.empty(count), np.zeros((2, count))
    most, last = np.full(2, 1e-300), np.zeros((2, count))
    for e in range(count):
        low, high = np.inf, -np.inf
        for i in range(p):
            force = states[FORCE, e * p + i]
            low, high = min(low, force), max(high, force)
        least[e], greatest[e] = low, high
        for q in range(2):
            row = states[SIDE if q == 0 else MOMENT, e * p : (e + 1) * p]
            for i in range(p):
                most[q] = max(most[q], abs(row[i]))
            for t in range(2, rule.tail.shape[0]):
                total = 0.0
                for i in range(p):
                    total += rule.tail[t, i] * row[i]
                last[q, e] = max(last[q, e], abs(total))
            for t in range(p):
                total = 0.0
                for i in range(p):
                    total += rule.seconds[_BENT_DEGREE, t, i] * row[i]
                bent[q, e] = max(bent[q, e], abs(total) / (edges[e + 1] - edges[e]) ** 2)
    curvature = np.empty(count)
    for e in range(count):
        curvature[e] = max(bent[0, e] / most[0], bent[1, e] / most[1])
        ratio, width = max(last[0, e] / most[0], last[1, e] / most[1]) + _ROUGH, edges[e + 1] - edges[e]
        rho = ratio ** (-1.0 / (p - 2))
        # In a narrow element, coefficients at rounding tell nothing of what lies farther away than it is wide; in one
        # between two corners, whatever is not followed is what its series and polynomials leave out.
        told = ratio > _ROUNDED * _ROUGH or width > _NARROW
        enclosed = _among(corners, edges[e]) and (e == count - 1 or _among(corners, edges[e + 1]))
        out[e] = 0.25 * width * (rho - 1.0 / rho) if told and not enclosed else np.inf
    return Smoothness(least, greatest, out, curvature)


@kernel
def _among(rising: Array, value: float) -> bool:
    place = np.searchsorted(rising, value)
    return place < rising.size and rising[place] == value


@kernel
def off_jumps(angle: Array, jumps: Array) -> Array:
    """The angles; those within the step that replaces a jump at its end on their side of the jump."""
    out = angle.copy()
    for i in range(angle.size):
        for k in range(jumps.size):
            apart = (angle[i] - jumps[k] + 0.5 * TURN) % TURN - 0.5 * TURN
            if abs(apart) < JUMP:
                out[i] += math.copysign(JUMP, apart) - apart
    return out


@kernel
def states_beside(drive: Drive, strip: Strip, jumps: Array, angle: Array) -> Array:
    """The states as they would be with jumps in place of steps: extrapolated from outside the step, on every side."""
    out, states = off_jumps(angle, jumps), np.empty((ROWS, angle.size))
    fill_states(drive, strip, out, states)
    one, outside = np.empty(1), np.empty((ROWS, 1))
    for i in range(angle.size if jumps.size > 0 else 0):
        if out[i] != angle[i]:
            inward = angle[i] - out[i]
            one[0] = out[i] - math.copysign(JUMP, inward)
            fill_states(drive, strip, one, outside)
            for row in range(ROWS):
                states[row, i] += abs(inward) / JUMP * (states[row, i] - outside[row, 0])
    return states


@kernel
def states_in(drive: Drive, strip: Strip, jumps: Array, edges: Array, rule: Radau) -> Array:
    """The states of the quasi-static strip, with friction closed in, at a rule's points of elements, none of which
    holds a jump, one element after the other: (rows, angles)."""
    p = rule.points.size
    angle = np.empty((edges.size - 1) * p)
    for e in range(edges.size - 1):
        for i in range(p):
            angle[e * p + i] = edges[e] + (edges[e + 1] - edges[e]) * rule.points[i]
        if jumps.size > 0:
            angle[e * p] += INSIDE
            angle[(e + 1) * p - 1] -= INSIDE
    return states_beside(drive, strip, jumps, angle)


@kernel
def _following(drive: Drive, strip: Strip, jumps: Array, anchors: Array, rule: Rule, wanted: float) -> Array:
    """Edges, anchors among them, between which polynomials through the points of a rule follow forces and moment to
    ``wanted`` of the greatest of each."""
    n, rows, scale, count = rule.points.size, (FORCE, SIDE, MOMENT), np.full(3, 1e-300), 0
    left, right, starts = [0.0 for _ in range(0)], [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    for k in range(anchors.size - 1):
        whole = anchors[k + 1] - anchors[k]
        parts = max(math.ceil(whole / _WIDEST * (1.0 - 1e-9)), 1)
        for part in range(parts):
            left.append(anchors[k] + part / parts * whole)
            right.append(anchors[k] + (part + 1) / parts * whole if part + 1 < parts else anchors[k + 1])
    while len(left) > 0:
        angle = np.empty(len(left) * n)
        for e in range(len(left)):
            for i in range(n):
                angle[e * n + i] = 0.5 * (left[e] + right[e]) + 0.5 * (right[e] - left[e]) * rule.points[i]
            angle[e * n] += INSIDE
            angle[(e + 1) * n - 1] -= INSIDE
        states, halve, number = states_beside(drive, strip, jumps, angle), np.zeros(len(left), np.bool_), 0
        for k in range(3):
            scale[k] = max(scale[k], largest(states[rows[k]]))
        for e in range(len(left)):
            for k in range(3):
                missed = panel_error(states[rows[k], e * n : (e + 1) * n], rule)
                halve[e] = halve[e] or missed > wanted * scale[k]
            halve[e] = halve[e] and right[e] - left[e] > _APART
            number += halve[e]
        if count + len(left) + number > _MOST_ELEMENTS:
            halve[:] = False
        lefts, rights = [0.0 for _ in range(0)], [0.0 for _ in range(0)]
        for e in range(len(left)):
            if halve[e]:
                middle = 0.5 * (left[e] + right[e])
                lefts += [left[e], middle]
                rights += [middle, right[e]]
            else:
                starts.append(left[e])
                count += 1
        left, right = lefts, rights
    starts.append(anchors[-1])
    return np.sort(np.array(starts))


def states_at(drive: Drive, strip: Strip, angle: Array) -> Array:
    """The states of the quasi-static strip at the angles, with friction closed in: (rows, angles)."""
    states = np.empty((ROWS, angle.size))
    fill_states(drive, strip, angle, states)
    return states


def _anchors(cycle: Cycle) -> tuple[Array, Array]:
    """Corners, and the ends of pieces over one turn in which the force is smooth, from the first corner on."""
    load, drive = cycle.scene.load, cycle.drive
    sharp = _NOWHERE if drive.breaks.size else load.sharp_angles()
    return anchors_of(drive, cycle.strip, load.corners(), load.jumps(), sharp)


@kernel
def anchors_of(drive: Drive, strip: Strip, known: Array, jumps: Array, sharp: Array) -> tuple[Array, Array]:
    """``_anchors`` from ``known`` corners, those of the load, in [0, 2 pi), and ``sharp`` angles. Where the piston
    begins or ceases to bear on both walls there is another if friction acts back. Among many pieces these, where far
    less changes, are left to narrow elements: they would come and go from strip to strip."""
    found = np.sort(known % TURN)
    if strip.friction != 0.0 and found.size < MANY:
        bearing = friction_corners(drive, strip, np.sort(np.concatenate((_GRID, _within(found)))))
        apart = bearing[off_jumps(bearing, jumps) == bearing]
        found = np.sort(np.concatenate((found, apart)) % TURN)
    kept = np.ones(found.size, np.bool_)
    for k in range(found.size):
        kept[k] = found[k] - (found[k - 1] if k > 0 else found[found.size - 1] - TURN) > _APART
    corners = found[kept]
    if corners.size > _MOST_CORNERS:
        corners = corners[:0].copy()
    first = corners[0] if corners.size > 0 else 0.0
    ends = np.concatenate((np.concatenate((corners, first + (sharp - first) % TURN)), np.array([first, first + TURN])))
    ends = np.sort(ends)
    kept = np.ones(ends.size, np.bool_)
    for k in range(ends.size - 1):
        kept[k] = ends[k + 1] - ends[k] > _APART
    return corners, ends[kept]


@kernel
def _within(corners: Array) -> Array:
    """Angles that divide what lies between corners: in a narrow piece the force may go up and down."""
    out = np.empty(corners.size * _DIVIDED)
    for k in range(corners.size):
        end = corners[k + 1] if k + 1 < corners.size else corners[0] + TURN
        for i in range(_DIVIDED):
            out[k * _DIVIDED + i] = (corners[k] + i / _DIVIDED * (end - corners[k])) % TURN
    return out


def _inertia(cycle: Cycle) -> float:
    """rho A omega^2 [N/m^2]."""
    d = cycle.dimensions
    return cycle.scene.material.density * d.b * d.h * cycle.scene.mechanism.angular_speed**2


def _stretch(cycle: Cycle) -> float:
    """h/(6 EI) [1/(N m)]."""
    return cycle.dimensions.h / (6.0 * cycle.strip.stiffness)
