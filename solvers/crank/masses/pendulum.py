"""Reduced masses of a rod from its periods as a pendulum hung at both ends.

With A = g T^2/(4 pi^2) for each end and L the distance of the pivots, l_A = L (A_D - L)/(A_C + A_D - 2L) and J_0 =
m_r l_A (A_C - l_A). The denominator is -L Delta J/(m_r l_A l_B): the method is singular exactly where the two-mass
model is exact. Weighing has no such singularity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.crank.masses.reduced_rod import RodMasses, evaluate, inputs_of, reduced_masses, require_known
from solvers.errors import InvalidInput, require, require_not_negative, require_positive
from solvers.numerics.uncertainty import combined, sensitivities

STANDARD_GRAVITY = 9.80665
_NOMINAL_UNCERTAINTY = 1e-5
"""Best attainable relative uncertainty of a period, used to judge a request without uncertainties."""
_MAX_RELATIVE_UNCERTAINTY = 0.1
"""Uncertainty of the centre of mass, relative to the rod's length, above which the result is rejected."""


def amplitude_factor(amplitude: NDArray | float) -> NDArray:
    """T/T_0 = 1/M(1, cos(theta/2)) of a pendulum of amplitude theta [rad], M the arithmetic-geometric mean.

    Exact for every amplitude below pi; its series begins 1 + theta^2/16 + 11 theta^4/3072. Source: Gauss's formula
    for the complete elliptic integral.
    """
    a, g = np.ones_like(np.asarray(amplitude)), np.cos(0.5 * np.asarray(amplitude))
    for _ in range(8):
        a, g = 0.5 * (a + g), np.sqrt(a * g)
    return 1.0 / a


@dataclass(frozen=True)
class Pendulum:
    """Periods [s] of the rod hung at its small and its big end; lengths in m, the amplitude in rad.

    ``pivot_distance`` is measured between the two knife edges. Edges inside the bores touch them at their far ends
    from each other: the bores' radii are then given, and the results refer to their centres. ``uncertainty`` has
    standard uncertainties, keyed by field name.
    """

    pivot_distance: float
    period_small_end: float
    period_big_end: float
    rod_mass: float
    amplitude: float = 0.0
    gravity: float = STANDARD_GRAVITY
    small_end_bore_radius: float = 0.0
    big_end_bore_radius: float = 0.0
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(self, "", "pivot_distance", "period_small_end", "period_big_end", "rod_mass", "gravity")
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        require_not_negative(self, "", "small_end_bore_radius", "big_end_bore_radius")
        require(self.length > 0, "pivot_distance", "leaves no room between the bores", "more than both bore radii")
        require_known(self, self.uncertainty)

    @property
    def length(self) -> float:
        """Distance of the bores' centres [m]."""
        return self.pivot_distance - self.small_end_bore_radius - self.big_end_bore_radius


def reduced_length(period: NDArray, amplitude: NDArray, gravity: NDArray) -> NDArray:
    """A = g T_0^2/(4 pi^2) [m], the length of the equivalent simple pendulum."""
    return gravity * (period / amplitude_factor(amplitude)) ** 2 / (4.0 * math.pi**2)


def _pendulum_formulas(x: dict[str, NDArray]) -> dict[str, NDArray]:
    """Centre of mass, reduced masses and moment of inertia from named arrays of measured quantities."""
    pivots = x["pivot_distance"]
    small = reduced_length(x["period_small_end"], x["amplitude"], x["gravity"])
    big = reduced_length(x["period_big_end"], x["amplitude"], x["gravity"])
    from_pivot = pivots * (big - pivots) / (small + big - 2.0 * pivots)
    cg = from_pivot - x["small_end_bore_radius"]
    length = pivots - x["small_end_bore_radius"] - x["big_end_bore_radius"]
    return reduced_masses(cg, length, x["rod_mass"], x["rod_mass"] * from_pivot * (small - from_pivot))


def swing(pendulum: Pendulum) -> RodMasses:
    """Compute masses, centre of mass and moment of inertia from both periods.

    Raises InvalidInput, stating the uncertainty, if the periods hardly determine the centre of mass (the denominator
    tends to 0), or if no rod has such periods.
    """
    values, length = inputs_of(pendulum), pendulum.length
    given = {name: float(u) for name, u in pendulum.uncertainty.items() if u > 0}
    measured = "period_small_end", "period_big_end", "pivot_distance"
    assumed = given or {name: _NOMINAL_UNCERTAINTY * values[name] for name in measured}
    with np.errstate(all="ignore"):
        results = _pendulum_formulas({name: np.array(value) for name, value in values.items()})
        derivatives = sensitivities(_pendulum_formulas, values)["rod_cg_from_pin"]
        cg_uncertainty = combined(derivatives, assumed) if np.isfinite(list(results.values())).all() else math.inf
    if not cg_uncertainty <= _MAX_RELATIVE_UNCERTAINTY * length:
        condition = ""
        if not given:
            condition = f" even for a relative uncertainty of {_NOMINAL_UNCERTAINTY:g} in what was measured"
        statement = "is not determined at all"
        if math.isfinite(cg_uncertainty):
            statement = f"is uncertain by {cg_uncertainty:.3g} m{condition}"
        raise InvalidInput(
            "period_big_end",
            f"the periods fit almost every centre of mass: its distance from the wrist pin {statement}, the rod being "
            f"{length:.3g} m long (A_C + A_D is too near 2L)",
            "periods of a rod further from the two-mass model, or more certain ones, or the method weighing",
        )
    require(
        bool(0 < results["rod_cg_from_pin"] < length and results["rod_inertia"] > 0),
        "period_small_end",
        "no rod has these periods: its centre of mass would lie outside it, or its moment of inertia would be negative",
        "periods longer than that of a simple pendulum as long as the distance of the centre of mass",
    )
    warnings = []
    longer = {name: 1.001 * values[name] for name in ("period_small_end", "period_big_end")}
    moved = _pendulum_formulas({name: np.array(value) for name, value in {**values, **longer}.items()})
    shift = float(moved["rod_cg_from_pin"] - results["rod_cg_from_pin"])
    if abs(shift) > 0.005 * length:
        warnings.append(
            f"a common error of +0.1 % in both periods moves the centre of mass by {1e3 * shift:+.2f} mm; "
            "weighing both ends is the robust alternative"
        )
    return evaluate(_pendulum_formulas, pendulum, warnings)
