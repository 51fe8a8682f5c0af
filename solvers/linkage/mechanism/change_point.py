"""The three change-point four-bars that can strike, and their families of equal kinematic restitution.

Lengths are relative to the crank: base lambda0, coupler lambda2, rocker lambda3; at the blow all four links are
collinear.

    largest coupler  lambda0 + lambda3 = 1 + lambda2
    largest rocker   lambda0 + lambda2 = 1 + lambda3
    largest base     lambda2 + lambda3 = 1 + lambda0

The restitution R_k = (g - 1)/(g + 1) requires lambda0 lambda2 = g^2 lambda3; with the closure one free ratio remains.
Differences such as lambda0 - 1 are computed from g^2 - 1 = 4R/(1 - R)^2, never by subtracting rounded ratios; a link
that cannot be shorter than the crank is 1 + that difference, hence rounded only once.
All formulas accept floats, arrays or intervals.

Source: the closures and the condition R_k = R are those of a paper on crank-rocker impact mechanisms (see
docs/theory/impact-linkage.md); the families in this form are derived there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Number = Any
"""A float, an array, or an interval."""

MIN_PARALLELOGRAM_MARGIN = 1e-6
"""Minimum relative distance of a design from the parallelogram, where the crank barely passes the second change
point."""

MIN_LONG_LINK_MARGIN = 1e-3
"""Minimum distance of a design from infinitely long links, as a fraction of g^2 - 1."""


@dataclass(frozen=True)
class Gain:
    """g = (1 + R)/(1 - R) of a restitution R in [0, 1), with g^2 - 1 to full precision."""

    restitution: float

    @property
    def value(self) -> float:
        return (1.0 + self.restitution) / (1.0 - self.restitution)

    @property
    def square(self) -> float:
        return self.value**2

    @property
    def square_minus_one(self) -> float:
        return 4.0 * self.restitution / (1.0 - self.restitution) ** 2

    def excess_of(self, ratio: Number) -> Number:
        """ratio - g; for a float correctly rounded, however close the ratio is to g."""
        if isinstance(ratio, float):
            return self._exact_excess(ratio, 1)
        return ((ratio - 1.0) - self.restitution * (ratio + 1.0)) / (1.0 - self.restitution)

    def square_excess_of(self, ratio: Number) -> Number:
        """ratio - g^2, rounded likewise."""
        return self._exact_excess(ratio, 2) if isinstance(ratio, float) else (ratio - 1.0) - self.square_minus_one

    def _exact_excess(self, ratio: float, power: int) -> float:
        """ratio - g^power by ratios of integers, whose quotients Python rounds correctly."""
        (p, q), (r, s) = ratio.as_integer_ratio(), self.restitution.as_integer_ratio()
        numerator, denominator = (s + r) ** power, (s - r) ** power
        return (p * denominator - q * numerator) / (q * denominator)


@dataclass(frozen=True)
class Ratios:
    """Link-to-crank ratios, with lambda - 1 of each to full precision: the input of the kinematics besides the kind."""

    base: Number
    coupler: Number
    rocker: Number
    base_minus_one: Number
    coupler_minus_one: Number
    rocker_minus_one: Number


def plain_ratios(base: float, coupler: float, rocker: float, crank: float = 1.0) -> Ratios:
    """Ratios of given lengths, with lambda - 1 by subtraction."""
    links = (base, coupler, rocker)
    return Ratios(*(link / crank for link in links), *((link - crank) / crank for link in links))


@dataclass(frozen=True)
class ChangePoint:
    """One collinear configuration of the four links.

    ``crank_sign`` and ``rocker_sign`` give the side of crank pin and rocker joint at the blow, along the base from
    their own pivots: +1 in the direction from crank pivot to rocker pivot, -1 against it. The closure is
    crank_sign lambda0 - rocker_sign lambda2 + crank_sign rocker_sign lambda3 = 1.
    """

    name: str
    parameter: str
    crank_sign: float
    rocker_sign: float

    @property
    def _opposed(self) -> bool:
        """Whether the two signs differ: only those of the largest rocker."""
        return self.crank_sign != self.rocker_sign

    def family(self, gain: Gain, parameter: Number) -> Ratios:
        """The mechanism with R_k = R and the free ratio ``parameter``."""
        one_less, square_less = parameter - 1.0, gain.square_minus_one
        if self._opposed:
            divisor = gain.square_excess_of(parameter)
            rocker_minus_one = (one_less * one_less + square_less) / divisor
            rocker = 1.0 + rocker_minus_one
        else:
            divisor = parameter + gain.square
            rocker_minus_one = gain.excess_of(parameter) * (parameter + gain.value) / divisor
            rocker = parameter * (parameter + 1.0) / divisor
        other_minus_one = parameter * square_less / divisor
        if self.crank_sign > 0.0:
            return Ratios(1.0 + other_minus_one, parameter, rocker, other_minus_one, one_less, rocker_minus_one)
        # Closure and restitution are those of the largest coupler with base and coupler exchanged.
        return Ratios(parameter, 1.0 + other_minus_one, rocker, one_less, other_minus_one, rocker_minus_one)

    def parameter_limit(self, gain: Gain) -> float:
        """Lower limit of the free ratio for full rotation of the crank; there, the largest coupler and the largest base
        are parallelograms."""
        return gain.square if self._opposed else gain.value

    def pole(self, gain: Gain) -> float:
        """Free ratio up to which no mechanism exists."""
        return gain.square if self._opposed else 0.0

    def minimum_margin(self, gain: Gain) -> float:
        """Minimum relative distance of a design's free ratio above ``parameter_limit``; the base of the largest rocker
        is then about 1000 g^2 cranks long."""
        return MIN_LONG_LINK_MARGIN * gain.square_minus_one / gain.square if self._opposed else MIN_PARALLELOGRAM_MARGIN

    @property
    def closure_signs(self) -> tuple[float, float, float]:
        """Signs of base, coupler and rocker in the closure."""
        return self.crank_sign, -self.rocker_sign, self.crank_sign * self.rocker_sign

    def half_angle_coefficient(self, ratios: Ratios) -> Number:
        """N, the coefficient in the numerator of tan(phi3/2)."""
        return self.crank_sign * self._crank_pivot_to_joint(ratios)

    def rotatability_margin(self, ratios: Ratios) -> Number:
        """M = lambda0 (lambda2 lambda3 - lambda0); the crank rotates fully if it is not negative."""
        return ratios.base * self._rocker_minus_sign(ratios) * self._crank_pivot_to_joint(ratios)

    def straight_swing_margin(self, ratios: Ratios) -> Number:
        """lambda0 lambda3 - lambda2, zero for a rocker swing of 180 degrees."""
        return self.pin_to_pivot(ratios) * self._rocker_minus_sign(ratios)

    def pin_to_pivot(self, ratios: Ratios) -> Number:
        """e, the distance from the rocker's pivot to the crank pin at the blow."""
        return ratios.base_minus_one if self.crank_sign > 0 else ratios.base + 1.0

    def _crank_pivot_to_joint(self, ratios: Ratios) -> Number:
        """|N| = lambda2 + rocker_sign."""
        return ratios.coupler + 1.0 if self.rocker_sign > 0 else ratios.coupler_minus_one

    def _rocker_minus_sign(self, ratios: Ratios) -> Number:
        """lambda3 - crank_sign rocker_sign."""
        return ratios.rocker + 1.0 if self._opposed else ratios.rocker_minus_one


LARGEST_COUPLER = ChangePoint("largest_coupler", "lambda2", crank_sign=1.0, rocker_sign=1.0)
LARGEST_ROCKER = ChangePoint("largest_rocker", "lambda2", crank_sign=1.0, rocker_sign=-1.0)
LARGEST_BASE = ChangePoint("largest_base", "lambda0", crank_sign=-1.0, rocker_sign=-1.0)
KINDS: dict[str, ChangePoint] = {kind.name: kind for kind in (LARGEST_COUPLER, LARGEST_ROCKER, LARGEST_BASE)}
"""The kinds by name."""
