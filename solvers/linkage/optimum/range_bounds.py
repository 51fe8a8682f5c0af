"""Rigorous bounds of the output quantities of ranges of members.

Over a range of the free ratio every length per V, |u31(2 pi)| and the swing lie between their values at the ends
(``family``). The swept outline of any member then lies within the Hausdorff distance

    d = max(change of l1, change of l0 + change of l3 + l3 (change of the swing))

of the outline in the middle of the range, and the enclosing radius changes by at most d. Along the base and across it

    d_x = max(change of l1, change of l0 + change of l3 + l3 sin (change of the swing)),
    d_y = max(change of l1, sin (change of l3) + l3 (change of the swing)),   sin: the greatest over the arc,

so width and height in a direction n change by at most 2 (d_x |n_x| + d_y |n_y|): a long base moves the height little.
Peak loads are nowhere below their value at one crank angle, which interval arithmetic bounds over the range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.loads.torque_and_pin_force import unit_peaks
from solvers.linkage.optimum.family import Family, Members
from solvers.linkage.optimum.load_bounds import Load, force_over, over, torque_over
from solvers.linkage.optimum.member_quantities import allowed_scales, within
from solvers.linkage.problem import Subproblem
from solvers.linkage.swept_area.bounding_box import least_areas, least_fits
from solvers.linkage.swept_area.enclosing_circle import enclosing_radii
from solvers.numerics.intervals import variable

Array = NDArray[np.float64]
_SLACK = 1e-10
"""What rounding may spoil of a bound, relative."""

AREA_TOLERANCE, FIT_TOLERANCE = 1e-3, 1e-9
"""Relative tolerances of the orientation's search in bounds; An area is
asked only whether it is below what is enough, and then need not be sharp; a fit decides what is allowed."""

ANGLE_TOLERANCE = 1e-9
"""Relative tolerance of the peaks at whose angles the loads of a range are bounded: any angle gives a bound, and one
next to the peak a good one."""


@dataclass(frozen=True)
class RangeBounds:
    """Bounds over the ranges [low, high] of q, shape (n,). ``enough``: an area above it need not be known."""

    subproblem: Subproblem
    family: Family
    low: Array
    high: Array
    enough: float

    @cached_property
    def _all(self) -> Members:
        """Lower ends, upper ends and middles, in one call."""
        return self.family.members(np.concatenate([self.low, self.high, 0.5 * (self.low + self.high)]))

    @cached_property
    def _middle(self) -> Members:
        return self._all.part(slice(2 * self.low.size, None))

    @cached_property
    def _ends(self) -> tuple[Members, Members]:
        n = self.low.size
        return self._all.part(slice(0, n)), self._all.part(slice(n, 2 * n))

    @cached_property
    def _outlines(self) -> Array:
        return self.family.outlines(self._middle)

    @cached_property
    def _moves(self) -> tuple[Array, Array, Array]:
        """d, d_x and d_y per V."""
        changes = [np.abs(end.lengths - self._middle.lengths) for end in self._ends]
        crank, base, _, rocker = np.maximum(*changes).T
        swing = np.maximum(*(np.abs(end.swing - self._middle.swing) for end in self._ends))
        widest = np.maximum(*(end.swing for end in self._ends))
        sine = np.where(widest < 0.5 * math.pi, np.sin(widest), 1.0) * (1.0 + 1e-12)
        turned = np.maximum(*(end.lengths[:, 3] for end in self._ends)) * swing
        along, across = base + rocker + sine * turned, sine * rocker + turned
        return np.maximum(crank, base + rocker + turned), np.maximum(crank, along), np.maximum(crank, across)

    @cached_property
    def crank(self) -> Array:
        return np.maximum(*(end.lengths[:, 0] for end in self._ends))

    @cached_property
    def longest(self) -> Array:
        return np.minimum(*(end.lengths for end in self._ends)).max(axis=1)

    @cached_property
    def radius(self) -> Array:
        return np.maximum(enclosing_radii(self._outlines) * (1 - 1e-12) - self._moves[0], 0.0)

    @cached_property
    def fit(self) -> Array:
        width, height = self.subproblem.room
        found = least_fits(self._outlines, *self._moves[1:], width, height, FIT_TOLERANCE)
        return np.maximum(found * (1 - FIT_TOLERANCE), 0.0)

    @cached_property
    def _peaks(self) -> Array:
        """Of the members in the middle."""
        rows = slice(2 * self.low.size, None)
        return unit_peaks(self._all.coefficients[rows], self._middle.end, ANGLE_TOLERANCE)

    def _over(self, load: Load, peak: Array, angle: Array) -> Array:
        """A lower bound of a load over the ranges, from its value at the angle at which the middle has its peak."""
        low, high, place = self.family.parameter(np.stack([self.low, self.high, 0.5 * (self.low + self.high)]))
        with np.errstate(all="ignore"):
            found = load(over(self.family.kind, self.family.gain, variable(low, high), angle))
        return np.maximum(found.least(peak, np.maximum(high - place, place - low)), 0.0)

    @cached_property
    def torque(self) -> Array:
        return self._over(torque_over, self._peaks[:, 0], self._peaks[:, 1])

    @cached_property
    def force(self) -> Array:
        return self._over(force_over, self._peaks[:, 2], self._peaks[:, 3])

    @cached_property
    def end_low(self) -> Array:
        return np.minimum(*(end.end for end in self._ends))

    @cached_property
    def end_high(self) -> Array:
        return np.maximum(*(end.end for end in self._ends))

    @cached_property
    def scale(self) -> tuple[Array, Array]:
        low, high = allowed_scales(self)
        angles = [end.transmission for end in self._ends]
        return within(
            self.subproblem, low * (1 - _SLACK), high * (1 + _SLACK), np.minimum(*angles), np.maximum(*angles)
        )

    def area(self, scale: Array) -> Array:
        limits = self.subproblem.limits
        width = math.inf if limits.width is None else limits.width
        height = math.inf if limits.height is None else limits.height
        pads = 2.0 * limits.joint_radius
        _, along, across = self._moves
        found = least_areas(self._outlines, scale, along, across, pads, width, height, AREA_TOLERANCE, self.enough)
        found = np.where(found < self.enough, found * (1.0 - AREA_TOLERANCE), found)
        # Far from exact, but not spoilt by a wide range: no side is below twice the crank, nor the longer one below
        # the base over sqrt(2).
        shortest = np.minimum(*(end.lengths for end in self._ends))
        with np.errstate(invalid="ignore"):
            side = 2.0 * shortest[:, 0] * scale + 2.0 * limits.joint_radius
            long_side = np.maximum(side, shortest[:, 1] * scale / math.sqrt(2.0) + 2.0 * limits.joint_radius)
        return np.fmax(found, side * long_side)
