"""Lower bounds of the output quantities over ranges of members, and the scales at which a member is feasible.

Over a range of the free ratio every length per V, |u31(2 pi)| and the swing lie between their values at the ends
(``family``). Outlines lie nearly between those of both ends (``outline_bounds``), also if their sizes are those of the
least link. Over a range that is a single member all bounds are its own quantities.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import FORCE, TORQUE
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.load_bounds import load_lower_bounds
from solvers.linkage.optimum.outline_bounds import interpolation_deductions, radius_lower_bounds
from solvers.linkage.problem import LinkageProblem
from solvers.linkage.swept_area.bounding_box import BOX_TOLERANCE, OrientationSearch, minimum_boxes
from solvers.linkage.swept_area.enclosing_circle import enclosing_radii
from solvers.linkage.swept_area.outline import sweep
from solvers.numerics.arrays import Array

Sizes = tuple[Array, Array]
"""V [m] at both ends of ranges."""
EXCESS = 1e-10
"""Relative excess over limits by which a member is still feasible: the search tells members apart by 1e-11, and two
limits that an answer just meets may leave that one member."""

_AREA_TOLERANCE, _FIT_TOLERANCE = 1e-3, 1e-9
"""Relative tolerances of the orientation search within bounds. A bound of the area is only compared with ``cutoff``, so
it need not be sharp; a misfit decides feasibility."""


@dataclass(frozen=True)
class Quantities:
    """Bounds over the ranges [low, high] of q, shape (n,), or quantities of members if both are the same array.

    ``sizes`` are the least V [m] at both ends of each range that limits other than those on the size allow (inf:
    none), ``greatest`` is the greatest V within the limits on the size, ``u31_end`` are the least and the greatest
    |u31(2 pi)|. ``crank``, per V, and ``greatest`` are upper bounds. The others are lower bounds: the longest link, the
    enclosing radius and boxes at given sizes [m, m2]; torque per energy, and force times V per energy. Bounds of areas
    above ``cutoff`` need not be sharp.
    """

    problem: LinkageProblem
    family: Family
    low: Array
    high: Array
    cutoff: float = math.inf

    @property
    def _single(self) -> bool:
        """Whether the ranges are single members."""
        return self.low is self.high

    @cached_property
    def members(self) -> FourBar:
        """Members at lower ends, upper ends and midpoints, in this order; single members once."""
        if self._single:
            return self.family.member(self.low)
        return self.family.member(np.concatenate([self.low, self.high, 0.5 * (self.low + self.high)]))

    def _three(self, values: Array) -> tuple[Array, Array, Array]:
        """Values of ``members`` at lower ends, upper ends and midpoints, (n, ...) each."""
        return (values, values, values) if self._single else tuple(values.reshape(3, -1, *values.shape[1:]))

    def _ends(self, values: Array) -> tuple[Array, Array]:
        """Lowest and highest value over the ranges of a quantity of ``members`` that is monotone in q."""
        low, high, _ = self._three(values)
        return np.minimum(low, high), np.maximum(low, high)

    @cached_property
    def lengths(self) -> Array:
        """Crank, base, coupler, rocker of ``members`` per V: (..., 4)."""
        r = self.members.ratios
        out = np.empty((r.base.size, 4))
        out[:, 0], out[:, 1], out[:, 2], out[:, 3] = 1.0, r.base, r.coupler, r.rocker
        return out / (r.rocker * self.members.u31_end)[:, None]

    @cached_property
    def _outlines(self) -> tuple[Array, Array, Array]:
        """Swept outlines per V of ``members``."""
        return self._three(sweep(self.members, self.lengths[:, 0]))

    @cached_property
    def _deductions(self) -> Array:
        if self._single:
            return np.zeros((self.low.size, 5))
        rows, lengths = self._three(self.members.coefficients)[:2], self._three(self.lengths)[:2]
        swings = np.maximum(self._three(self.members.swing)[2] - self._ends(self.members.swing)[0], 0.0)
        return interpolation_deductions(*rows, *lengths, swings, self.family.gain.value)

    @cached_property
    def crank(self) -> Array:
        return self._ends(self.lengths[:, 0])[1]

    def longest(self, sizes: Sizes) -> Array:
        low, high, _ = self._three(self.lengths)
        found = np.minimum(low, high).max(axis=1) * np.minimum(*sizes)
        if sizes[0] is sizes[1]:
            return found
        # From both ends, which is sharper in narrow ranges.
        low, high = (
            (links - self._deductions[:, [0, 1, 0, 1]]).T * size for links, size in ((low, sizes[0]), (high, sizes[1]))
        )
        return np.maximum(found, np.minimum(low, high).max(axis=0))

    def radius(self, sizes: Sizes) -> Array:
        low, high, middle = self._outlines
        if self._single:
            return enclosing_radii(middle) * sizes[0]
        return radius_lower_bounds(middle, low, high, self._deductions, *sizes) * (1.0 - 1e-12)

    def _boxes(self, sizes: Sizes, loose: float, cutoff: float, *sought: float) -> Array:
        """Minima over orientations at these sizes, for ranges to the tolerance ``loose``; ``sought`` are the fields of
        ``OrientationSearch`` from ``width`` to ``pads``."""
        tolerance = 0.0 if self._single else loose
        search = OrientationSearch(*sought, max(tolerance, BOX_TOLERANCE), cutoff)
        low, high, middle = self._outlines
        found = minimum_boxes(middle, low, high, self._deductions, *sizes, search)[:, 0]
        return np.where(found < cutoff, found * (1.0 - tolerance), found)

    def misfit(self, room: tuple[float, float], sizes: Sizes) -> Array:
        """The minimum over orientations of max(W/width, H/height) without pads."""
        weights = (1.0 / side for side in room)
        return self._boxes(sizes, _FIT_TOLERANCE, math.inf, math.inf, math.inf, *weights, 0.0)

    def side(self, sizes: Sizes, other: float) -> Array:
        """The minimum of a box's side if the other side is at most ``other``; inf if there is no such box."""
        pads = 2.0 * self.problem.limits.joint_radius
        return self._boxes(sizes, _FIT_TOLERANCE, math.inf, other * (1.0 + 1e-12), math.inf, 0.0, 1.0, pads)

    def _peak(self, which: int) -> Array:
        low, high, middle = self._three(self.members.coefficients)
        end = self._three(self.members.u31_end)[2]
        return load_lower_bounds(low, middle, high, end, self.family.gain.value, which, self._single)

    @cached_property
    def torque(self) -> Array:
        return self._peak(TORQUE)

    @cached_property
    def force(self) -> Array:
        return self._peak(FORCE)

    @property
    def u31_end(self) -> tuple[Array, Array]:
        return self._ends(self.members.u31_end)

    @cached_property
    def sizes(self) -> Sizes:
        limits, fixed = self.problem.limits, self.problem.fixed_scale
        loaded = np.zeros_like(self.low)
        if limits.max_pin_force is not None:
            loaded = self.problem.scene.impact_energy * self.force / limits.max_pin_force
        if limits.transmission_angle is not None:
            least, greatest = limits.transmission_angle
            narrowest, widest = self._ends(self.members.middle_transmission_angle)
            loaded = np.where((widest >= least - 1e-12) & (narrowest <= greatest + 1e-12), loaded, np.inf)
        low = limits.min_link / self.crank
        if fixed is not None or self._single or limits.min_link == 0:
            low = np.maximum(low, loaded)
            if fixed is not None:
                low = np.where(low <= fixed * (1.0 + EXCESS), fixed, np.inf)
            return low, low
        if self.family.kind.rocker_sign > 0.0:
            # The crank per V is above its interpolation.
            low = low * np.maximum(1.0 - self._deductions[:, 0] / self._ends(self.lengths[:, 0])[0], 0.0)
        ends = (low * self.crank / crank for crank in self._three(self.lengths[:, 0])[:2])
        return tuple(np.where(low < loaded, loaded, size) for size in ends)

    def _within(self, sizes: Sizes) -> Iterator[tuple[Array, float]]:
        """The quantities that limits on the size bound, at these sizes, each with its limit."""
        limits = self.problem.limits
        if limits.longest_link is not None:
            yield self.longest(sizes), limits.longest_link
        if limits.enclosing_radius is not None:
            yield self.radius(sizes), limits.enclosing_radius - limits.joint_radius
        if self.problem.room is not None:
            yield self.misfit(self.problem.room, sizes), 1.0

    @cached_property
    def greatest(self) -> Array:
        if self.problem.fixed_scale is not None:
            return self.sizes[0]
        unit, high = np.ones_like(self.low), np.full_like(self.low, np.inf)
        with np.errstate(divide="ignore"):
            for quantity, limit in self._within((unit, unit)):
                high = np.minimum(high, limit / quantity)
        return high

    @property
    def fits(self) -> Array:
        """Whether a member of the least size, or of a larger one where that is better, may meet all limits."""
        found = np.isfinite(self.sizes[0])
        if self.problem.objective.improves_with_scale and self.problem.fixed_scale is None:
            found = found & (np.minimum(*self.sizes) <= self.greatest * (1.0 + EXCESS))
            if self._single:
                return found
        for quantity, limit in self._within(self.sizes):
            found = found & (quantity <= limit * (1.0 + EXCESS))
        return found

    def area(self, sizes: Sizes) -> Array:
        """Minimum box area; inf if no orientation keeps within width and height."""
        limits, pads = self.problem.limits, 2.0 * self.problem.limits.joint_radius
        room = (side * (1.0 + 1e-12) for side in limits.sides)
        return self._boxes(sizes, _AREA_TOLERANCE, self.cutoff, *room, 0.0, 0.0, pads)

    @property
    def cost(self) -> Array:
        """The objective's cost, inf where infeasible."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            return np.where(self.fits, self.problem.objective.cost(self), np.inf)
