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
from dataclasses import dataclass

import numpy as np

from solvers.linkage.mechanism.change_point import ChangePoint, Gain
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.numerics.arrays import Array

MAX_MARGIN = 1e3
"""Maximum relative distance of a design's free ratio from its least value: beyond it the links grow without bound."""

PROOF_RANGE_FACTOR = 1e6
"""Factor by which proofs extend closer to both ends of the family: to 1e-12 from the parallelogram and to links of 1e9
cranks. Beyond these ends no quantity changes by more than a relative 1e-8, except those that grow without bound."""


@dataclass(frozen=True)
class Family:
    """A kind at one restitution. The free ratio is p = least (1 + exp(q)) with the search variable q."""

    kind: ChangePoint
    gain: Gain

    @property
    def design_range(self) -> tuple[float, float]:
        """Range of q for designs."""
        return math.log(self.kind.minimum_margin(self.gain)), math.log(MAX_MARGIN)

    @property
    def proof_range(self) -> tuple[float, float]:
        """Range of q covered by proofs."""
        low, high = self.design_range
        return low - math.log(PROOF_RANGE_FACTOR), high + math.log(PROOF_RANGE_FACTOR)

    def member(self, q: Array | float) -> FourBar:
        """The member at q; at an array of q all of them, as one mechanism with arrays for ratios."""
        parameter = self.kind.parameter_limit(self.gain) * (1.0 + np.exp(q))
        return FourBar(self.kind, self.kind.family(self.gain, parameter if np.ndim(q) else float(parameter)))

    def subrange(self, quantity: Callable[[FourBar], float], least: float, greatest: float) -> tuple[float, float]:
        """Range of q in which ``quantity``, decreasing in q, lies within limits; (inf, -inf): none."""
        low, high = self.proof_range
        top, bottom = quantity(self.member(low)), quantity(self.member(high))
        if top < least or bottom > greatest:
            return math.inf, -math.inf
        return (
            self.solve(quantity, greatest, low, high) if top > greatest else low,
            self.solve(quantity, least, low, high) if bottom < least else high,
        )

    def solve(self, quantity: Callable[[FourBar], float], wanted: float, low: float, high: float) -> float | None:
        """The q in [low, high] at which ``quantity``, monotone in q, equals ``wanted``; None if there is none."""
        from scipy.optimize import brentq

        try:
            return float(brentq(lambda q: quantity(self.member(q)) - wanted, low, high, xtol=1e-15, rtol=1e-15))
        except ValueError:
            return None
