"""Lower bounds of the output quantities over ranges of members, and the scales at which a member is feasible.

Over a range of the free ratio every length per V, |u31(2 pi)| and the swing lie between their values at the ends
(``family``). The extents of the outline's parts (``swept_area.outline``) lie above their linear interpolation in y
(``load_bounds``) between the ends, up to deductions that decrease by the square of the range's width: a function f of y
lies below its chord by at most (sqrt(f1) - sqrt(f2))^2 if f ~ 1/x with x linear in y, and by max|f''| (y1 - y2)^2/8 in
general. Thus both ends bound boxes (``bounding_box``) and circles (``radius_bounds``). Over a range that is a single
member all bounds are its own quantities.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.linkage.loads.torque_and_pin_force import FORCE, TORQUE
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.load_bounds import load_lower_bounds
from solvers.linkage.optimum.radius_bounds import radius_lower_bounds
from solvers.linkage.problem import LinkageProblem
from solvers.linkage.swept_area.bounding_box import BOX_TOLERANCE, OrientationSearch, minimum_boxes
from solvers.linkage.swept_area.enclosing_circle import enclosing_radii
from solvers.linkage.swept_area.outline import sweep
from solvers.numerics.arrays import Array

EXCESS = 1e-10
"""Relative excess over limits by which a member is still feasible: the search tells members apart by 1e-11, and two
limits that an answer just meets may leave that one member. Also the allowance for rounding in a bound."""

_AREA_TOLERANCE, _FIT_TOLERANCE = 1e-3, 1e-9
"""Relative tolerances of the orientation search within bounds. A bound of the area is only compared with ``cutoff``, so
it need not be sharp; a misfit decides feasibility."""


@dataclass(frozen=True)
class Quantities:
    """Bounds over the ranges [low, high] of q, shape (n,), or quantities of members if both are the same array.

    ``scale`` is the minimum and maximum feasible V (minimum > maximum: none), ``u31_end`` those of |u31(2 pi)|.
    ``crank`` is an upper bound, the others are lower ones: per V the crank, the longest link and the enclosing radius;
    torque per energy and force times V per energy. Areas above ``cutoff`` need not be sharp.
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
        """How far extents may be below the linear interpolation in y between the ends, per V: (n, 5), as in
        ``minimum_boxes``.

            l1 = s y/w = sigma s (1 - g^2/w),  l3 = s/n,  l0 = n_0 - sigma l3,  n_0 = sigma |N| l1 constant,
            away = 2 g^2 s n/w^2,  rise = 2 g s sqrt((g^2 - 1) m)/w^2

        The arc's extent is n_0 cos(beta) + l3 (1 - sigma cos(beta)). Where it ends earlier than in the middle, by a
        swing smaller by d, its end reaches as far up to l3 (1 - cos(d)).
        """
        out = np.zeros((self.low.size, 5))
        if self._single:
            return out
        kind, gain, square = self.family.kind, self.family.gain.value, self.family.gain.square
        base, _, rocker, n, m, _, _ = np.moveaxis(np.stack(self._three(self.members.coefficients)[:2]), -1, 0)
        y, n, m = base / rocker, np.abs(n) / rocker, m / rocker**2
        w, crank, rocker = base * n, *(np.stack(self._three(self.lengths[:, k])[:2]) for k in (0, 3))
        s, step, least_w, least_m = gain - 1.0, (y[1] - y[0]) ** 2 / 8.0, w.min(axis=0), m.min(axis=0)
        if kind.rocker_sign < 0.0:
            out[:, 0] = np.diff(np.sqrt(crank + s), axis=0)[0] ** 2
        out[:, 1] = np.diff(np.sqrt(rocker), axis=0)[0] ** 2
        deficit = np.maximum(self._three(self.members.swing)[2] - self._ends(self.members.swing)[0], 0.0)
        out[:, 2] = 2.0 * rocker.max(axis=0) * np.sin(0.5 * deficit) ** 2
        bend = np.abs(6.0 * n - 4.0 * kind.crank_sign * w).max(axis=0) / least_w**4
        out[:, 3] = 2.0 * square * s * step * bend
        bend = 6.0 / least_w**2 + 4.0 * y.max(axis=0) / (least_m * least_w) + square / least_m**2
        largest = 2.0 * gain * s * np.sqrt((square - 1.0) * m.max(axis=0)) / least_w**2
        out[:, 4] = largest * step * bend
        return out * (1.0 + 1e-9)

    @cached_property
    def crank(self) -> Array:
        return self._ends(self.lengths[:, 0])[1]

    @cached_property
    def longest(self) -> Array:
        return self._ends(self.lengths)[0].max(axis=1)

    @cached_property
    def radius(self) -> Array:
        if self._single:
            return enclosing_radii(self._outlines[2])
        low, high, middle = self._outlines
        return radius_lower_bounds(middle, low, high, self._deductions) * (1.0 - 1e-12)

    def _boxes(self, scale: Array, loose: float, cutoff: float, *search: float) -> Array:
        """Minima of ``OrientationSearch`` at these V, for ranges to a ``loose`` tolerance."""
        tolerance = 0.0 if self._single else loose
        search = OrientationSearch(*search, max(tolerance, BOX_TOLERANCE), cutoff)
        low, high, middle = self._outlines
        found = minimum_boxes(middle, low, high, self._deductions, scale, search)[:, 0]
        return np.where(found < cutoff, found * (1.0 - tolerance), found)

    def misfit(self, room: tuple[float, float]) -> Array:
        """The minimum over orientations of max(W/width, H/height) per V without pads."""
        weights = (1.0 / side for side in room)
        return self._boxes(np.ones_like(self.low), _FIT_TOLERANCE, math.inf, math.inf, math.inf, *weights, 0.0)

    def side(self, scale: Array, other: float) -> Array:
        """The minimum of a box's side at a V if the other side is at most ``other``; inf if there is no such box."""
        pads = 2.0 * self.problem.limits.joint_radius
        return self._boxes(scale, _FIT_TOLERANCE, math.inf, other * (1.0 + 1e-12), math.inf, 0.0, 1.0, pads)

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
    def scale(self) -> tuple[Array, Array]:
        problem, limits = self.problem, self.problem.limits
        low, high = np.zeros_like(self.low), np.full_like(self.low, np.inf)
        if limits.min_link > 0:
            low = np.maximum(low, limits.min_link / self.crank)
        if limits.max_pin_force is not None:
            low = np.maximum(low, problem.scene.impact_energy * self.force / limits.max_pin_force)
        with np.errstate(divide="ignore"):
            if limits.longest_link is not None:
                high = np.minimum(high, limits.longest_link / self.longest)
            if limits.enclosing_radius is not None:
                high = np.minimum(high, (limits.enclosing_radius - limits.joint_radius) / self.radius)
            if problem.room is not None:
                high = np.minimum(high, 1.0 / self.misfit(problem.room))
        if not self._single:
            low, high = low * (1.0 - EXCESS), high * (1.0 + EXCESS)
        if limits.transmission_angle is not None:
            least, greatest = limits.transmission_angle
            narrowest, widest = self._ends(self.members.middle_transmission_angle)
            met = (widest >= least - 1e-12) & (narrowest <= greatest + 1e-12)
            low, high = np.where(met, low, np.inf), np.where(met, high, -np.inf)
        fixed = problem.fixed_scale
        if fixed is None:
            return low, high
        met = (low <= fixed * (1.0 + EXCESS)) & (fixed * (1.0 - EXCESS) <= high)
        return np.where(met, fixed, np.inf), np.where(met, fixed, -np.inf)

    def area(self, scale: Array) -> Array:
        """Minimum box area at a V; inf if no orientation keeps within width and height."""
        limits, pads = self.problem.limits, 2.0 * self.problem.limits.joint_radius
        room = (side * (1.0 + 1e-12) for side in limits.sides)
        return self._boxes(scale, _AREA_TOLERANCE, self.cutoff, *room, 0.0, 0.0, pads)

    @property
    def cost(self) -> Array:
        """The objective's cost, inf where infeasible."""
        low, high = self.scale
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            return np.where(low <= high * (1.0 + EXCESS), self.problem.objective.cost(self), np.inf)
