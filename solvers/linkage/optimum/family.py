"""One-parameter family of mechanisms of a kind at a given restitution, with sizes per unit of stroke speed.

V = l1 lambda3 |u31(2 pi)| [m] is the ratio of the rocker joint's speed before the blow to the crank's angular speed.
Given V, the free ratio determines all lengths. With g = (1 + R)/(1 - R), l1 = V e/(lambda3 (g + 1)), and

| kind | l1/V | l0/V | l2/V | l3/V |
|---|---|---|---|---|
| largest coupler, p = lambda2 | (g-1)/(p+1) | (g-1) g^2/(g^2+p) | (g-1) p/(p+1) | (g-1) p/(g^2+p) |
| largest rocker, p = lambda2 | (g-1)/(p-1) | (g-1) g^2/(p-g^2) | (g-1) p/(p-1) | (g-1) p/(p-g^2) |
| largest base, p = lambda0 | (p+g^2)/(p(g+1)) | (p+g^2)/(g+1) | g^2 (p+1)/(p(g+1)) | (p+1)/(g+1) |

Each is monotone in p, and so are e, lambda0 (hence the swing 2 asin(g/lambda0)) and nu(pi): over a range of p each lies
between its values at the ends. The proofs of optimality rely on this.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers.linkage.mechanism.change_point import ChangePoint, Gain, Ratios
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.swept_area.outline import outlines
from solvers.numerics.arrays import Array

GREATEST_MARGIN = 1e3
"""Maximum relative distance of a design's free ratio from its least value: beyond it the links grow without bound."""

FURTHER = 1e6
"""Factor by which proofs extend closer to both ends of the family: to 1e-12 from the parallelogram and to links of 1e9
cranks. Beyond these ends no quantity changes by more than a relative 1e-8, except those that grow without bound."""


@dataclass(frozen=True)
class Members:
    """Members of a family, one per row: ratios, sizes per V (n, 4), |u31(2 pi)|, swing [rad], nu(pi) [rad]."""

    kind: ChangePoint
    ratios: Ratios
    lengths: Array
    end: Array
    swing: Array
    transmission: Array

    @cached_property
    def coefficients(self) -> Array:
        """As in ``kinematics``: (n, 7)."""
        return FourBar(self.kind, self.ratios).coefficients

    @property
    def longest(self) -> Array:
        return self.lengths.max(axis=1)

    def part(self, rows: slice) -> Members:
        """A subset of the rows."""
        ratios = Ratios(*(values[rows] for values in vars(self.ratios).values()))
        return Members(self.kind, ratios, self.lengths[rows], self.end[rows], self.swing[rows], self.transmission[rows])


@dataclass(frozen=True)
class Family:
    """A kind at one restitution. The free ratio is p = least (1 + exp(q)); the search variable q runs over the whole
    ``range``, or over a part of the family given by these ends."""

    kind: ChangePoint
    gain: Gain
    part: tuple[float, float] | None = None

    @property
    def range(self) -> tuple[float, float]:
        """Ends of q: the design range, unless the family is a part."""
        return self.part or (math.log(self.kind.least_margin(self.gain)), math.log(GREATEST_MARGIN))

    @property
    def tails(self) -> tuple[Family, Family]:
        """The parts beyond both ends: toward the parallelogram and toward infinitely long links."""
        low, high = Family(self.kind, self.gain).range
        more = math.log(FURTHER)
        return replace(self, part=(low - more, low)), replace(self, part=(high, high + more))

    def parameter(self, q: Array | float) -> Array:
        least = self.kind.least_parameter(self.gain)
        return least * (1.0 + np.exp(q))

    def member(self, q: float) -> FourBar:
        return FourBar(self.kind, self.kind.family(self.gain, float(self.parameter(q))))

    def members(self, q: Array) -> Members:
        """All closed-form quantities for an array of free ratios."""
        bar = FourBar(self.kind, self.kind.family(self.gain, self.parameter(q)))
        r = bar.ratios
        reach, g = self.kind.pin_to_pivot(r), self.gain.value
        crank = reach / (r.rocker * (g + 1.0))
        lengths = np.empty((crank.size, 4))
        lengths[:, 0], lengths[:, 1], lengths[:, 2], lengths[:, 3] = 1.0, r.base, r.coupler, r.rocker
        lengths *= crank[:, None]
        return Members(
            kind=self.kind,
            ratios=r,
            lengths=lengths,
            end=(g + 1.0) / reach,
            swing=bar.swing,
            transmission=bar.middle_transmission_angle,
        )

    def margin_of_transmission(self, angle: float, otherwise: float) -> float:
        """q of the member with nu(pi) = ``angle`` [rad], ``otherwise`` if there is none. nu(pi) decreases with q."""
        return self._margin(self.kind.of_transmission(self.gain, angle), otherwise) if angle > 0 else otherwise

    def margin_of_crank(self, crank: float, otherwise: float) -> float:
        """q of the member with this crank per V, ``otherwise`` if there is none. The crank per V decreases with q."""
        return self._margin(self.kind.of_crank(self.gain, crank), otherwise)

    def _margin(self, parameter: float, otherwise: float) -> float:
        beyond = self.kind.beyond_least(self.gain, parameter) if math.isfinite(parameter) else math.inf
        low, high = self.range
        return math.log(beyond) if math.exp(low) <= beyond <= math.exp(high) else otherwise

    def margin_where(self, read: Callable[[Members], Array], wanted: float) -> float | None:
        """q at which ``read``, positive and monotone in q, takes the wanted value; None if it does not."""
        if wanted <= 0:
            return None
        low, high = self.range

        def distance(q: float) -> float:
            return math.log(float(read(self.members(np.array([q])))[0]) / wanted)

        ends = distance(low), distance(high)
        if ends[0] * ends[1] > 0:
            return None
        from scipy.optimize import brentq

        return float(brentq(distance, low, high, xtol=1e-15, rtol=1e-15))

    def outlines(self, members: Members) -> Array:
        """Swept outlines per V (see ``swept_area.outline``): shape (n, 8)."""
        return outlines(self.kind, members.ratios, members.lengths[:, 0], members.swing)
