"""Figures of members, and rigorous bounds of the figures of ranges of members.

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

from solvers.linkage import envelope
from solvers.linkage.family import Family, Members
from solvers.linkage.loads import Load, force_over, over, torque_over, unit_peaks
from solvers.linkage.problem import Figures, Question
from solvers.numerics.intervals import variable
from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
_SLACK = 1e-10
"""What rounding may spoil of a bound, relative."""

AREA_TOLERANCE, FIT_TOLERANCE = 1e-3, 1e-9
"""Relative tolerances of the orientation's search in bounds; members themselves are found to ``tolerance``. An area is
asked only whether it is below what is enough, and then need not be sharp; a fit decides what is allowed."""

PEAK_TOLERANCE, ANGLE_TOLERANCE = 1e-14, 1e-9
"""Relative tolerances of a member's peak loads, and of the peaks at whose angles the loads of a range are bounded: any
angle gives a bound, and one next to the peak a good one."""


def allowed_scales(figures: Figures) -> tuple[Array, Array]:
    """Least and greatest V [m] of members whose lower and upper figures these are; least > greatest: none."""
    question, limits = figures.question, figures.question.limits
    low, high = np.zeros_like(figures.crank), np.full_like(figures.crank, np.inf)
    if limits.min_link > 0:
        low = np.maximum(low, limits.min_link / figures.crank)
    if limits.max_pin_force is not None:
        force = question.scene.impact_energy * figures.force / figures.crank
        low = np.maximum(low, force / limits.max_pin_force)
    with np.errstate(divide="ignore"):
        if limits.longest_link is not None:
            high = np.minimum(high, limits.longest_link / figures.longest)
        if limits.enclosing_radius is not None:
            high = np.minimum(high, (limits.enclosing_radius - limits.joint_radius) / figures.radius)
        if question.boxed and question.room is not None:
            high = np.minimum(high, 1.0 / figures.fit)
    return low, high


def within(question: Question, low: Array, high: Array, narrowest: Array, widest: Array) -> tuple[Array, Array]:
    """The allowed scales, narrowed to the fixed one where there is one; least > greatest: none.

    ``narrowest`` and ``widest`` enclose the mid-cycle transmission angle.
    """
    if question.limits.transmission_angle is not None:
        least, greatest = question.limits.transmission_angle
        met = (widest >= least - 1e-12) & (narrowest <= greatest + 1e-12)
        low, high = np.where(met, low, np.inf), np.where(met, high, -np.inf)
    fixed = question.fixed_scale
    if fixed is None:
        return low, high
    slack = 1e-12 * fixed
    met = (low <= fixed + slack) & (fixed <= high + slack)
    return np.where(met, fixed, np.inf), np.where(met, fixed, -np.inf)


@dataclass(frozen=True)
class MemberFigures:
    """Figures of the members at q, shape (n,)."""

    question: Question
    family: Family
    q: Array
    tolerance: float

    @cached_property
    def members(self) -> Members:
        return self.family.members(self.q)

    @cached_property
    def outlines(self) -> Array:
        return self.family.outlines(self.members)

    @cached_property
    def _peaks(self) -> Array:
        return unit_peaks(self.members.coefficients, self.members.end, PEAK_TOLERANCE)

    @cached_property
    def crank(self) -> Array:
        return self.members.lengths[:, 0]

    @cached_property
    def longest(self) -> Array:
        return self.members.longest

    @cached_property
    def radius(self) -> Array:
        return enclosing_radii(self.outlines)

    @cached_property
    def fit(self) -> Array:
        none = np.zeros_like(self.q)
        return least_fits(self.outlines, none, none, *self.question.room, self.tolerance)

    @property
    def torque(self) -> Array:
        return self._peaks[:, 0]

    @property
    def force(self) -> Array:
        return self._peaks[:, 2]

    @property
    def end_low(self) -> Array:
        return self.members.end

    end_high = end_low

    @cached_property
    def scale(self) -> tuple[Array, Array]:
        angle = self.members.transmission
        return within(self.question, *allowed_scales(self), angle, angle)

    def area(self, scale: Array) -> Array:
        limits = self.question.limits
        width = math.inf if limits.width is None else limits.width * (1 + 1e-12)
        height = math.inf if limits.height is None else limits.height * (1 + 1e-12)
        none, pads = np.zeros_like(scale), 2.0 * limits.joint_radius
        return least_areas(self.outlines, scale, none, none, pads, width, height, self.tolerance, math.inf)


@dataclass(frozen=True)
class RangeFigures:
    """Bounds over the ranges [low, high] of q, shape (n,). ``enough``: an area above it need not be known."""

    question: Question
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
        return self._all.figures(slice(2 * self.low.size, None))

    @cached_property
    def _ends(self) -> tuple[Members, Members]:
        n = self.low.size
        return self._all.figures(slice(0, n)), self._all.figures(slice(n, 2 * n))

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
        width, height = self.question.room
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
        return within(self.question, low * (1 - _SLACK), high * (1 + _SLACK), np.minimum(*angles), np.maximum(*angles))

    def area(self, scale: Array) -> Array:
        limits = self.question.limits
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


@kernel
def least_areas(
    outlines: Array,
    scale: Array,
    along: Array,
    across: Array,
    pads: float,
    width: float,
    height: float,
    tolerance: float,
    enough: float,
) -> Array:
    """Least box area of every outline at its scale, within width and height; inf where none fits.

    ``along`` and ``across`` [per scale] as in ``envelope.least_area``. An area is told to ``tolerance``, or is above
    ``enough``; where W and H could both vanish within what moves it is 0.
    """
    out = np.full(scale.size, np.inf)
    for i in range(scale.size):
        if not math.isfinite(scale[i]):
            continue
        outline = outlines[i].copy()
        outline[:6] *= scale[i]
        moved = along[i] * scale[i], across[i] * scale[i]
        # Neither side of a box is below twice the crank: W + H keeps above 0, so the lower bounds of W and H are not
        # both negative, and their product is a lower bound of the area.
        if 2.0 * outline[0] + pads <= math.sqrt(2.0) * (moved[0] + moved[1]):
            out[i] = 0.0
            continue
        # W, H already carry the pads less what is uncertain, so the limits are compared as they are.
        out[i] = envelope.least_area(outline, pads, moved[0], moved[1], width, height, tolerance, enough)[0]
    return out


@kernel
def least_fits(outlines: Array, along: Array, across: Array, width: float, height: float, tolerance: float) -> Array:
    """Least max(W/width, H/height) of every outline."""
    out = np.empty(outlines.shape[0])
    for i in range(out.size):
        out[i] = envelope.least_fit(outlines[i], along[i], across[i], width, height, tolerance)
    return out


@kernel
def enclosing_radii(outlines: Array) -> Array:
    """Least enclosing radius of every outline."""
    out = np.empty(outlines.shape[0])
    for i in range(out.size):
        out[i] = envelope.enclosing(outlines[i])
    return out
