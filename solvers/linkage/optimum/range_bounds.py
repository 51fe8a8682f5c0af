"""Rigorous bounds of the output quantities over ranges of members.

Over a range of the free ratio every length per V, |u31(2 pi)| and the swing lie between their values at the ends
(``family``). No point of the swept outline of a member is farther from that of the midpoint of the range than

    d_x = max(change of l1, change of l0 + change of l3 + l3 sin (change of the swing)),
    d_y = max(change of l1, sin (change of l3) + l3 (change of the swing)),   sin: its maximum over the arc,

along and across the base, so width and height in a direction n change by at most 2 (d_x |n_x| + d_y |n_y|): a long base
hardly affects the height. Enclosing radius and peak loads: see ``radius_bounds`` and ``load_bounds``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import FORCE, TORQUE
from solvers.linkage.mechanism.change_point import Ratios
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.optimum.family import Family, lengths_per_stroke
from solvers.linkage.optimum.load_bounds import load_lower_bounds
from solvers.linkage.optimum.member_quantities import feasible_scales
from solvers.linkage.optimum.radius_bounds import radius_lower_bounds
from solvers.linkage.problem import Subproblem
from solvers.linkage.swept_area.bounding_box import minimum_box_areas, minimum_misfits
from solvers.linkage.swept_area.outline import outlines
from solvers.numerics.arrays import Array

_SLACK = 1e-10
"""Relative allowance for rounding in a bound."""

_AREA_TOLERANCE, _FIT_TOLERANCE = 1e-3, 1e-9
"""Relative tolerances of the orientation search within bounds. An area is only compared with ``cutoff``, so it need not
be sharp; a misfit decides feasibility."""


@dataclass(frozen=True)
class RangeBounds:
    """Bounds over the ranges [low, high] of q, shape (n,). Areas above ``cutoff`` need not be sharp."""

    subproblem: Subproblem
    family: Family
    low: Array
    high: Array
    cutoff: float

    @cached_property
    def _members(self) -> FourBar:
        """Members at lower ends, upper ends and midpoints, in this order."""
        return self.family.members(np.concatenate([self.low, self.high, 0.5 * (self.low + self.high)]))

    def _three(self, values: Array) -> Array:
        """Values of ``_members`` as (3, n, ...): at lower ends, upper ends and midpoints."""
        return values.reshape(3, self.low.size, *values.shape[1:])

    @cached_property
    def _lengths(self) -> Array:
        """Crank, base, coupler, rocker per V: (3, n, 4)."""
        return self._three(lengths_per_stroke(self._members))

    @cached_property
    def _outlines(self) -> Array:
        """Swept outlines per V of the midpoints."""
        bar = self._members
        ratios = Ratios(*(self._three(values)[2] for values in vars(bar.ratios).values()))
        return outlines(bar.kind, ratios, self._lengths[2, :, 0], self._three(bar.swing)[2])

    @cached_property
    def _displacement_bounds(self) -> tuple[Array, Array]:
        """d_x and d_y per V."""
        lengths, swings = self._lengths, self._three(self._members.swing)
        crank, base, _, rocker = np.abs(lengths[:2] - lengths[2]).max(axis=0).T
        swing, widest = np.abs(swings[:2] - swings[2]).max(axis=0), swings[:2].max(axis=0)
        sine = np.where(widest < 0.5 * math.pi, np.sin(widest), 1.0) * (1.0 + 1e-12)
        arc_displacement = lengths[:2, :, 3].max(axis=0) * swing
        along, across = base + rocker + sine * arc_displacement, sine * rocker + arc_displacement
        return np.maximum(crank, along), np.maximum(crank, across)

    @cached_property
    def crank(self) -> Array:
        return self._lengths[:2, :, 0].max(axis=0)

    @cached_property
    def longest(self) -> Array:
        return self._lengths[:2].min(axis=0).max(axis=1)

    @cached_property
    def radius(self) -> Array:
        low, high, middle = self._three(self._members.coefficients)
        swings = self._three(self._members.swing)
        swing_deficits = np.maximum(swings[2] - swings[:2].min(axis=0), 0.0)
        return radius_lower_bounds(low, middle, high, self._outlines, swing_deficits, self.family.gain.value) * (
            1 - 1e-12
        )

    @cached_property
    def misfit(self) -> Array:
        width, height = self.subproblem.room
        found = minimum_misfits(self._outlines, *self._displacement_bounds, width, height, _FIT_TOLERANCE)
        return np.maximum(found * (1 - _FIT_TOLERANCE), 0.0)

    def _least(self, which: int) -> Array:
        """Lower bounds of a load over the ranges."""
        low, high, middle = self._three(self._members.coefficients)
        return load_lower_bounds(
            low, middle, high, self._three(self._members.u31_end)[2], self.family.gain.value, which
        )

    @cached_property
    def torque(self) -> Array:
        return self._least(TORQUE)

    @cached_property
    def force(self) -> Array:
        return self._least(FORCE)

    @cached_property
    def u31_end_low(self) -> Array:
        return self._three(self._members.u31_end)[:2].min(axis=0)

    @cached_property
    def u31_end_high(self) -> Array:
        return self._three(self._members.u31_end)[:2].max(axis=0)

    @cached_property
    def scale(self) -> tuple[Array, Array]:
        angles = self._three(self._members.middle_transmission_angle)[:2]
        return feasible_scales(self, angles.min(axis=0), angles.max(axis=0), _SLACK)

    def area(self, scale: Array) -> Array:
        limits = self.subproblem.limits
        pads = 2.0 * limits.joint_radius
        along, across = self._displacement_bounds
        room = *limits.sides, _AREA_TOLERANCE, self.cutoff
        found = minimum_box_areas(self._outlines, scale, along, across, pads, *room)[:, 0]
        found = np.where(found < self.cutoff, found * (1.0 - _AREA_TOLERANCE), found)
        # A coarse bound, but insensitive to a wide range: each side is at least twice the crank, and the longer one at
        # least the base over sqrt(2).
        crank, base = self._lengths[:2, :, :2].min(axis=0).T
        with np.errstate(invalid="ignore"):
            side = 2.0 * crank * scale + pads
            long_side = np.maximum(side, base * scale / math.sqrt(2.0) + pads)
        return np.fmax(found, side * long_side)
