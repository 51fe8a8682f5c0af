"""The pin as a ring: ovalization under the pressure of rod and piston, and the resulting stresses.

Two models are combined. The textbook formula is that of a thin ring under a pressure proportional to |sin| on both
sides, with an empirical factor K = 1.5 - 15 (alpha - 0.4)^3 for the load concentration along a stiff pin. The plane
elastic ring (Michell's series) covers any wall with a uniform load along the pin, a lower bound for any pin's ring.
K falls below 1 at 0.722 and to zero at 0.864 without physical reason, which a mass optimiser would exploit. So the
formula applies while it gives at least the elastic ring's value, up to about 0.73 for the growth and 0.70 to 0.73
for the stresses; beyond, the elastic ring applies, value by value. All are continuous, and growth and maximum stress
increase with the bore.

Sources: the ovalization formulas of the textbooks on engine design (Kolchin and Demidov); J. H. Michell (1899).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import LIMIT_TOLERANCE

_FORMULA_TO, _ELASTIC_FROM = 0.65, 0.8
"""d/D up to which the formula gives the larger value of every result, and from which the elastic ring gives it."""

_MAX_RATIO = 1.0 - 1e-6
"""Maximum d/D of a ring: its compliance is inversely proportional to the cube of the wall."""

_RATIO_TOLERANCE = 2e-16
"""Tolerance of the d/D at which a limit is attained."""
_SOLID_RATIO = 0.02
"""d/D below which a pin is treated as solid: the inner fibre's stress formula contains 1/alpha."""
MIN_HOOP_RATIO = 0.3
"""d/D above which the maximum hoop stress increases with the bore."""
_SUM_OF_SQUARES = (math.pi**2 - 8.0) / (4.0 * math.pi)
"""Sum over even n of (4/pi)/(n^2 - 1)^2.

|sin theta| = 2/pi - (4/pi) sum over even n of cos(n theta)/(n^2 - 1): the amplitudes sum to 2/pi, with their signs
at the top to 2/pi - 1, and with 2 n/(n^2 - 1), in which neighbours cancel, to 2/pi.
"""
_MAX_HARMONICS, _NEGLIGIBLE = 5000, 1e-18
"""Maximum number of harmonics, and the relative size below which a term is neglected."""


class Ring(NamedTuple):
    """Growth of the diameter across the load [m], hoop stresses [Pa] at the outer and inner fibre, at the side (the
    mean plane) and at the top (under the load), and whether the formula governs the growth."""

    ovalization: float
    outer_side: float
    inner_side: float
    outer_top: float
    inner_top: float
    by_formula: bool

    @property
    def greatest(self) -> float:
        """Greatest hoop stress [Pa]."""
        return max(map(abs, self[1:5]))

    @property
    def model(self) -> str:
        """Name of the model that governs the growth."""
        return "thin ring with load factor" if self.by_formula else "plane elastic ring"


@kernel
def load_factor(ratio: float) -> float:
    """Return K = 1.5 - 15 (alpha - 0.4)^3."""
    return 1.5 - 15.0 * (ratio - 0.4) ** 3


@kernel
def classical(force: float, diameter: float, length: float, ratio: float, modulus: float) -> Ring:
    """Return the textbook ring: growth 0.09 (P/(E l)) ((1 + alpha)/(1 - alpha))^3 K and four stresses, alpha = d/D.

    Valid for alpha up to about 0.72.
    """
    k, wall = load_factor(ratio), 1.0 - ratio
    a = max(ratio, _SOLID_RATIO)
    growth = 0.09 * force / (modulus * length) * ((1.0 + ratio) / wall) ** 3 * k
    f, g = k * force / (length * diameter), (1.0 + ratio) / wall**2
    return Ring(
        growth,
        f * (0.19 * (2.0 + ratio) * g - 1.0 / wall),
        -f * (0.19 * (1.0 + 2.0 * a) * g / a + 1.0 / wall),
        -f * (0.174 * (2.0 + ratio) * g + 0.636 / wall),
        f * (0.174 * (1.0 + 2.0 * a) * g / a - 0.636 / wall),
        True,
    )


@kernel
def thick_ring(force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float) -> Ring:
    """Return the plane elastic ring under p = (2 P/(pi R l)) |sin theta| on its outer surface, inner surface free.

    theta is measured from the side; plane stress. Hoop stresses at the four points; growth of the outer diameter at
    the side. The mean load gives Lame's stresses, -(2/pi) (1 + alpha^2)/(1 - alpha^2) and twice -(2/pi)/(1 -
    alpha^2); its harmonics are summed as in ``_bending``. Exact to rounding for alpha up to 0.999, to 1e-11 beyond.
    """
    outer = 0.5 * diameter
    pressure = 2.0 * force / (math.pi * outer * length)
    mean = -2.0 / math.pi
    scale = mean / ((1.0 - ratio) * (1.0 + ratio))
    outer_mean, inner_mean = scale * (1.0 + ratio**2), 2.0 * scale
    outer_side, inner_side, outer_top, inner_top, growth = _bending(ratio)
    uniform_part = outer_mean - poisson * mean - mean - (1.0 - poisson) * _SUM_OF_SQUARES
    return Ring(
        2.0 * outer * pressure / modulus * (uniform_part + growth),
        pressure * (outer_mean + outer_side - mean),
        pressure * (inner_mean + inner_side),
        pressure * (outer_mean + outer_top - mean - 1.0),
        pressure * (inner_mean + inner_top),
        False,
    )


@kernel
def _bending(ratio: float) -> tuple[float, float, float, float, float]:
    """Return sums over the load's harmonics without the terms independent of the ratio: hoop stresses at outer and
    inner side, at outer and inner top, and the outer radial displacement at the side times E/R.

    With f(r) cos(n theta) = r phi(ln r) cos(n theta), the shear vanishes where phi' does, and there sigma_r is (1 -
    n^2) phi/r and sigma_t is phi''/r: phi is 0 with zero slope inside, 1/(1 - n^2) with zero slope outside, composed
    of exp(+-(n - 1) ln r) and exp(+-(n + 1) ln r). For sigma_r = cos(n theta) outside, with t = ln(1/alpha) and Z =
    sinh^2(n t) - n^2 sinh^2(t),

        outer sigma_t = 1 + 2 n^2 sinh^2(t)/Z,  inner sigma_t = -2 n sinh(n t) sinh(t)/(alpha Z)
        E u_r = [2 n - (1 - nu)]/(n^2 - 1) + n [1 - exp(-2 n t) + n sinh(2 t) + 2 n^2 sinh^2(t)]/((n^2 - 1) Z)

    The first terms, independent of the thickness, converge slowly and are summed in closed form by the caller; the
    remainder (``_harmonic_remainder``) is positive and decays as exp(-2 n t), for n below 1/t as n^-4. The truncation
    error at ``_MAX_HARMONICS`` is less than 1e-11.
    """
    t = -math.log(ratio)
    excess = _sinh_minus_argument(t)
    outer_side, inner_side, outer_top, inner_top, growth = 0.0, 0.0, 0.0, 0.0, 0.0
    sign = -1.0
    for k in range(1, _MAX_HARMONICS):
        n = 2.0 * k
        amplitude = 4.0 / (math.pi * (n * n - 1.0))
        outer, inner, moved = _harmonic_remainder(n, ratio, t, excess)
        outer, inner, moved = amplitude * outer, amplitude * inner, amplitude * moved
        outer_side += outer
        outer_top += sign * outer
        inner_side -= inner
        inner_top -= sign * inner
        growth += moved
        if inner < _NEGLIGIBLE * -inner_side and outer < _NEGLIGIBLE * outer_side and moved < _NEGLIGIBLE * growth:
            break
        sign = -sign
    return outer_side, inner_side, outer_top, inner_top, growth


@kernel
def _harmonic_remainder(n: float, ratio: float, t: float, excess: float) -> tuple[float, float, float]:
    """One harmonic of ``_bending``: outer and, sign reversed, inner stress, E u_r; ``excess`` is sinh(t) - t."""
    x, n_sinh_t = n * t, n * 0.5 * (1.0 - ratio) * (1.0 + ratio) / ratio
    if x > 1.0:
        decay = math.exp(-x)
        sinh_x, decayed = 0.5 * (1.0 / decay - decay), 1.0 - decay * decay
        excess_x = sinh_x - x
    else:
        sinh_x, decayed, excess_x = math.sinh(x), -math.expm1(-2.0 * x), _sinh_minus_argument(x)
    # Z from sinh(n t) - n sinh(t), with n t subtracted from both terms: the second remainder is a quarter of the first.
    denominator = (excess_x - n * excess) * (sinh_x + n_sinh_t)
    outer, inner = 2.0 * n_sinh_t * n_sinh_t / denominator, 2.0 * n_sinh_t * sinh_x / (ratio * denominator)
    numerator = decayed + n_sinh_t * (1.0 / ratio + ratio) + 2.0 * n_sinh_t * n_sinh_t
    return outer, inner, n * numerator / ((n * n - 1.0) * denominator)


@kernel
def _sinh_minus_argument(x: float) -> float:
    """Return sinh(x) - x for x >= 0, without cancellation."""
    if x > 1.0:
        return math.sinh(x) - x
    xx, series = x * x, 1.0
    for k in range(9, 1, -1):
        series = 1.0 + series * xx / (2.0 * k * (2.0 * k + 1.0))
    return x * xx / 6.0 * series


@kernel
def ring(force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float) -> Ring:
    """Return the ring results for bore ratio alpha = d/D: of the growth and each stress the larger of both models."""
    if ratio >= _ELASTIC_FROM:
        return thick_ring(force, diameter, length, ratio, modulus, poisson)
    formula = classical(force, diameter, length, ratio, modulus)
    if ratio <= _FORMULA_TO:
        return formula
    elastic = thick_ring(force, diameter, length, ratio, modulus, poisson)
    return Ring(
        max(formula.ovalization, elastic.ovalization),
        formula.outer_side if abs(formula.outer_side) >= abs(elastic.outer_side) else elastic.outer_side,
        formula.inner_side if abs(formula.inner_side) >= abs(elastic.inner_side) else elastic.inner_side,
        formula.outer_top if abs(formula.outer_top) >= abs(elastic.outer_top) else elastic.outer_top,
        formula.inner_top if abs(formula.inner_top) >= abs(elastic.inner_top) else elastic.inner_top,
        formula.ovalization >= elastic.ovalization,
    )


def _greatest_ratio_within(quantity: Callable[[float], float], limit: float, start: float) -> float | None:
    """Return the greatest d/D in [start, 1) at which an increasing quantity does not exceed ``limit``; None if it
    exceeds it everywhere.

    The quantities vary approximately as the inverse square of the wall, so their inverse roots are nearly linear.
    """
    from scipy.optimize import brentq

    def excess_x(ratio: float) -> float:
        return 1.0 - math.sqrt(limit / quantity(ratio))

    if quantity(start) > limit * (1.0 + LIMIT_TOLERANCE):
        return None
    # Thin rings require many harmonics: bracket the root from the thick side by halving the wall.
    low = high = start
    while quantity(high) <= limit:
        if high == _MAX_RATIO:
            return high
        low, high = high, min(0.5 * (1.0 + high), _MAX_RATIO)
    if high == start:
        return start
    found = float(brentq(excess_x, low, high, xtol=_RATIO_TOLERANCE, rtol=4.0 * sys.float_info.epsilon))
    while found > start and quantity(found) > limit:
        found = min(math.nextafter(found, 0.0), found - _RATIO_TOLERANCE)
    return max(found, start)


@lru_cache(maxsize=64)
def greatest_ratio(
    limit: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float | None:
    """Return the greatest d/D up to which the ovalization is within ``limit``; None if even a solid pin exceeds it."""

    def growth(ratio: float) -> float:
        return ring(force, diameter, length, ratio, modulus, poisson).ovalization

    return _greatest_ratio_within(growth, limit, 0.0)


def greatest_stress(
    force: float, diameter: float, length: float, ratio: float, modulus: float, poisson: float
) -> float:
    """Return the maximum hoop stress [Pa]; for a bore below 0.3 D that of 0.3 D, an upper bound.

    (Below 0.3 D the formula's inner-fibre stress increases as 1/alpha, which is unphysical: the elastic ring's
    continues to decrease.)
    """
    return ring(force, diameter, length, max(ratio, MIN_HOOP_RATIO), modulus, poisson).greatest


@lru_cache(maxsize=64)
def ratio_within_stress(
    limit: float, force: float, diameter: float, length: float, modulus: float, poisson: float
) -> float | None:
    """Return the greatest d/D up to which the hoop stress is within ``limit``; None if even a solid pin exceeds it."""

    def stress(ratio: float) -> float:
        return greatest_stress(force, diameter, length, ratio, modulus, poisson)

    return _greatest_ratio_within(stress, limit, MIN_HOOP_RATIO)


@lru_cache(maxsize=64)
def outer_within_stress(
    limit: float, force: float, bore: float, length: float, modulus: float, poisson: float
) -> float:
    """Return the least outer diameter [m] for a given bore from which on the hoop stress is within ``limit``.

    The stress times D is a function of d/D only.
    """

    def unit_stress(ratio: float) -> float:
        return greatest_stress(force, 1.0, length, ratio, modulus, poisson)

    outer_for_small_bore = unit_stress(0.0) / limit
    if bore <= MIN_HOOP_RATIO * outer_for_small_bore:
        return outer_for_small_bore
    return bore / _greatest_ratio_within(lambda ratio: unit_stress(ratio) * ratio, limit * bore, MIN_HOOP_RATIO)
