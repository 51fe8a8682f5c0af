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

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.panels import inside, resolve, rule_of, split
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
_ROUGH, _ROUNDED, _NARROW = 1e-15, 10.0, TURN / 64


@dataclass(frozen=True)
class Excitation:
    """``corners`` [rad] are angles at which derivatives of the axial force jump, ``jumps`` those of them at which it
    jumps itself, ``anchors`` all these and others between
    which it is smooth, over one turn from the first corner on, ``edges`` the ends of elements, anchors among them,
    ``states`` those at ``RULE``'s points of every element, one after the other; ``inertia`` is rho A omega^2
    [N/m^2]."""

    strip: Strip
    drive: Drive
    inertia: float
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
        rule = rule_of(RULE.points.size)

        def checked(angle: Array) -> Array:
            return states_beside(drive, strip, jumps, inside(angle, rule))[[FORCE, SIDE, MOMENT]]

        edges = split(anchors, _WIDEST)
        if corners.size < MANY:
            edges = resolve(checked, edges, rule, 3, wanted, _MOST_ELEMENTS)[0].edges
        states = _states_in(drive, strip, jumps, edges, RULE)
        return Excitation(strip, drive, _inertia(cycle), corners, jumps, anchors, edges, states)

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
        states = _states_in(drive, strip, self.jumps, edges, RULE)
        return Excitation(strip, drive, _inertia(cycle), corners, self.jumps, anchors, edges, states)

    def halved(self, where: NDArray[np.bool_]) -> Excitation:
        """With two elements in place of each one that is marked."""
        parts = np.where(where, 0.5 * (1.0 + 1e-6), 1.0) * np.diff(self.edges)
        edges = split(self.edges, parts)
        return replace(self, edges=edges, states=_states_in(self.drive, self.strip, self.jumps, edges, RULE))

    def states_on(self, edges: Array, rule: Radau) -> Array:
        """The states at all points of a rule in elements between other edges."""
        if rule is RULE and np.array_equal(edges, self.edges):
            return self.states
        return _states_in(self.drive, self.strip, self.jumps, edges, rule)

    def panels(self, edges: Array) -> NDArray[np.int64]:
        """The first elements behind the corners; without corners the first one of the turn."""
        return np.searchsorted(edges, self.corners) if self.corners.size else np.zeros(1, dtype=np.int64)

    @cached_property
    def mean(self) -> float:
        """The mean axial force [N]."""
        weights = np.outer(np.diff(self.edges), RULE.integral[-1]).ravel() / TURN
        return float(weights @ self.states[FORCE])

    @cached_property
    def analytic(self) -> Array:
        """How far from the real axis [rad] the motion stays analytic, of every element."""
        values = np.abs(self.states[[SIDE, MOMENT]].reshape(2, -1, RULE.points.size))
        most = values.max(axis=(1, 2), initial=1e-300)[:, None]
        last = np.abs(self.states[[SIDE, MOMENT]].reshape(values.shape) @ RULE.tail[2:].T).max(axis=2)
        ratio, widths = np.max(last / most, axis=0) + _ROUGH, np.diff(self.edges)
        rho = ratio ** (-1.0 / (RULE.points.size - 2))
        # In a narrow element, coefficients at rounding tell nothing of what lies farther away than it is wide.
        told = (ratio > _ROUNDED * _ROUGH) | (widths > _NARROW)
        # In one that lies between two corners, whatever is not followed is what its series and polynomials leave out.
        told &= ~np.isin(self.edges[:-1], self.corners) | ~np.isin(self.edges[1:], np.append(self.corners, self.last))
        return np.where(told, 0.25 * widths * (rho - 1.0 / rho), np.inf)

    @property
    def last(self) -> float:
        """The turn's end [rad]."""
        return float(self.edges[-1])


def off_jumps(angle: Array, jumps: Array) -> Array:
    """The angles; those within the step that replaces a jump at its end on their side of the jump."""
    if not jumps.size:
        return angle
    apart = np.mod(angle[:, None] - jumps + 0.5 * TURN, TURN) - 0.5 * TURN
    return angle + np.sum(np.where(np.abs(apart) < JUMP, np.copysign(JUMP, apart) - apart, 0.0), axis=1)


def _states_in(drive: Drive, strip: Strip, jumps: Array, edges: Array, rule: Radau) -> Array:
    """The states at a rule's points of elements, none of which holds a jump."""
    angle = points(edges, rule)
    return states_beside(drive, strip, jumps, inside(angle, rule)) if jumps.size else states_at(drive, strip, angle)


def states_beside(drive: Drive, strip: Strip, jumps: Array, angle: Array) -> Array:
    """The states as they would be with jumps in place of steps: extrapolated from outside the step, on every side."""
    out = off_jumps(angle, jumps)
    states, within = states_at(drive, strip, out), np.flatnonzero(out != angle)
    if within.size:
        inward = angle[within] - out[within]
        change = states[:, within] - states_at(drive, strip, out[within] - np.copysign(JUMP, inward))
        states[:, within] += np.abs(inward) / JUMP * change
    return states


def states_at(drive: Drive, strip: Strip, angle: Array) -> Array:
    """The states of the quasi-static strip at the angles, with friction closed in: (rows, angles)."""
    states = np.empty((ROWS, angle.size))
    fill_states(drive, strip, angle, states)
    return states


def points(edges: Array, rule: Radau = RULE) -> Array:
    """Angles of all elements' points, one element after the other."""
    return (edges[:-1, None] + np.diff(edges)[:, None] * rule.points).ravel()


def _anchors(cycle: Cycle) -> tuple[Array, Array]:
    """Corners, and the ends of pieces over one turn in which the force is smooth, from the first corner on."""
    drive = cycle.drive
    corners = _corners(cycle)
    sharp = np.empty(0) if drive.breaks.size else np.mod(cycle.scene.load.sharp_angles(), TURN)
    corners = corners[: corners.size if corners.size <= _MOST_CORNERS else 0]
    first = corners[0] if corners.size else 0.0
    ends = np.unique(np.concatenate([corners, first + np.mod(sharp - first, TURN), [first, first + TURN]]))
    return corners, ends[np.append(np.diff(ends) > _APART, True)]


def _inertia(cycle: Cycle) -> float:
    """rho A omega^2 [N/m^2]."""
    d = cycle.dimensions
    return cycle.scene.material.density * d.b * d.h * cycle.scene.mechanism.angular_speed**2


def _corners(cycle: Cycle) -> Array:
    """Angles in [0, 2 pi), rising: those of the load, and where the piston begins or ceases to bear on both
    walls if friction acts back. Among many pieces the latter, where far less changes, are left to narrow elements: they
    would come and go from strip to strip."""
    drive, strip, load = cycle.drive, cycle.strip, cycle.scene.load
    found = np.mod(load.corners(), TURN)
    if strip.friction and found.size < MANY:
        bearing = friction_corners(drive, strip, np.unique(np.concatenate([_GRID, found])))
        found = np.concatenate([found, bearing[off_jumps(bearing, load.jumps()) == bearing]])
    found = np.unique(np.mod(found, TURN))
    return found[np.diff(found, prepend=found[-1:] - TURN) > _APART]
