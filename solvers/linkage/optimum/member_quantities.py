"""Output quantities of individual members, and the scales at which they are feasible."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import FORCE, TORQUE, peaks_per_energy
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.optimum.family import Family, lengths_per_stroke
from solvers.linkage.problem import Quantities, Subproblem
from solvers.linkage.swept_area.bounding_box import minimum_box_areas, minimum_misfits
from solvers.linkage.swept_area.enclosing_circle import enclosing_radii
from solvers.linkage.swept_area.outline import outlines
from solvers.numerics.arrays import Array

_TOLERANCE = 1e-13
"""Relative tolerance of the least box of a member."""

EXCESS = 1e-10
"""Relative excess over limits by which a member is still feasible: the search tells members apart by 1e-11, and two
limits that an answer just meets may leave that one member."""


def feasible_scales(quantities: Quantities, narrowest: Array, widest: Array, slack: float = 0.0) -> tuple[Array, Array]:
    """Minimum and maximum feasible V [m] from lower and upper quantities of members; minimum > maximum: none.

    ``narrowest`` and ``widest`` enclose the mid-cycle transmission angle; limits on V are relaxed by ``slack``,
    relative. A fixed V is both.
    """
    subproblem, limits = quantities.subproblem, quantities.subproblem.limits
    low, high = np.zeros_like(quantities.crank), np.full_like(quantities.crank, np.inf)
    if limits.min_link > 0:
        low = np.maximum(low, limits.min_link / quantities.crank)
    if limits.max_pin_force is not None:
        low = np.maximum(low, subproblem.scene.impact_energy * quantities.force / limits.max_pin_force)
    with np.errstate(divide="ignore"):
        if limits.longest_link is not None:
            high = np.minimum(high, limits.longest_link / quantities.longest)
        if limits.enclosing_radius is not None:
            high = np.minimum(high, (limits.enclosing_radius - limits.joint_radius) / quantities.radius)
        if subproblem.boxed and subproblem.room is not None:
            high = np.minimum(high, 1.0 / quantities.misfit)
    if slack:
        low, high = low * (1.0 - slack), high * (1.0 + slack)
    if limits.transmission_angle is not None:
        least, greatest = limits.transmission_angle
        met = (widest >= least - 1e-12) & (narrowest <= greatest + 1e-12)
        low, high = np.where(met, low, np.inf), np.where(met, high, -np.inf)
    fixed = subproblem.fixed_scale
    if fixed is None:
        return low, high
    met = (low <= fixed * (1.0 + EXCESS)) & (fixed * (1.0 - EXCESS) <= high)
    return np.where(met, fixed, np.inf), np.where(met, fixed, -np.inf)


@dataclass(frozen=True)
class MemberQuantities:
    """Quantities of the members at q, shape (n,)."""

    subproblem: Subproblem
    family: Family
    q: Array

    @cached_property
    def members(self) -> FourBar:
        return self.family.members(self.q)

    @cached_property
    def lengths(self) -> Array:
        """Crank, base, coupler, rocker per V: (n, 4)."""
        return lengths_per_stroke(self.members)

    @cached_property
    def outlines(self) -> Array:
        bar = self.members
        return outlines(bar.kind, bar.ratios, self.crank, bar.swing)

    def _peak(self, which: int) -> Array:
        return peaks_per_energy(self.members.coefficients, self.members.u31_end, which, 1)[:, 0]

    @property
    def crank(self) -> Array:
        return self.lengths[:, 0]

    @cached_property
    def longest(self) -> Array:
        return self.lengths.max(axis=1)

    @cached_property
    def radius(self) -> Array:
        return enclosing_radii(self.outlines)

    @cached_property
    def misfit(self) -> Array:
        none = np.zeros_like(self.q)
        return minimum_misfits(self.outlines, none, none, *self.subproblem.room, _TOLERANCE)

    @cached_property
    def torque(self) -> Array:
        return self._peak(TORQUE)

    @cached_property
    def force(self) -> Array:
        return self._peak(FORCE) / self.crank

    @property
    def u31_end_low(self) -> Array:
        return self.members.u31_end

    u31_end_high = u31_end_low

    @cached_property
    def scale(self) -> tuple[Array, Array]:
        angle = self.members.middle_transmission_angle
        return feasible_scales(self, angle, angle)

    def area(self, scale: Array) -> Array:
        limits = self.subproblem.limits
        width, height = (side * (1 + 1e-12) for side in limits.sides)
        none, pads = np.zeros_like(scale), 2.0 * limits.joint_radius
        return minimum_box_areas(self.outlines, scale, none, none, pads, width, height, _TOLERANCE, math.inf)[:, 0]
