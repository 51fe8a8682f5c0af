"""Reduced masses of a rod from swinging it or weighing its ends, and masses of a new engine by estimate.

Pendulum: with A = g T^2/(4 pi^2) for the rod hung at each end and L the distance of the pivots, l_A = L (A_D - L)/(A_C
+ A_D - 2L) and J_0 = m_r l_A (A_C - l_A). The denominator is -L Delta J/(m_r l_A l_B): the method is singular exactly
where the two-mass model is exact. Weighing has no such singularity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput, require, require_not_negative, require_positive
from solvers.numerics.uncertainty import Function, Propagated, combined, propagate, sensitivities

STANDARD_GRAVITY = 9.80665
_NOMINAL_UNCERTAINTY = 1e-5
"""Best attainable relative uncertainty of a period, used to judge a request without uncertainties."""
_MAX_RELATIVE_UNCERTAINTY = 0.1
"""Uncertainty of the centre of mass, relative to the rod's length, above which the result is rejected."""
_MAX_SUM_ERROR = 0.02
"""Relative difference between the sum of the readings and the rod's mass above which the data is rejected."""
_NOTABLE_SUM_ERROR = 5e-6
"""Relative difference above which a warning states it; below, it would be stated as 0."""
_ROUNDING, _LEAST_REFERENCE = 4.0 * np.finfo(float).eps, 1e-7
"""Assumed relative rounding error of a result's terms; smallest reference of relative errors, relative to the terms."""
USUAL = {
    "spark ignition": ((80.0, 150.0), (100.0, 200.0)),
    "diesel": ((150.0, 300.0), (250.0, 400.0)),
}
"""Usual constructive masses [kg per m2 of piston area] of aluminium piston groups and of steel rods.

Textbook figures, quoted from memory and rounded; suitable only to detect misplaced decimals.
"""


@dataclass(frozen=True)
class RodMasses:
    """Reduced masses, SI units, None if the method does not determine them; ``uncertainty`` has the same keys.

    ``rounding`` is the greatest relative error of a result caused by rounding. That of a result near zero, whose terms
    nearly cancel (the inertia defect), is relative to at least 1e-7 of these terms.
    """

    values: Mapping[str, float | None]
    uncertainty: Propagated | None
    rounding: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Measured quantities, None if not given; ``uncertainty`` has standard uncertainties, keyed by field name."""

    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, u in self.uncertainty.items():
            known = isinstance(getattr(self, name, None), (int, float))
            require(known, f"uncertainty.{name}", "belongs to no quantity that was given", "names of the quantities")
            require(math.isfinite(u) and u >= 0, f"uncertainty.{name}", "must not be negative", "[0, inf)")

    @property
    def given(self) -> dict[str, float]:
        """The quantities that were given, by name."""
        return {name: float(v) for name, v in vars(self).items() if name != "uncertainty" and v is not None}

    @property
    def uncertain(self) -> dict[str, float]:
        """The positive uncertainties."""
        return {name: float(u) for name, u in self.uncertainty.items() if u > 0}

    def evaluate(self, formula: Function, warnings: Sequence[str]) -> RodMasses:
        """Evaluate a formula of the quantities, and propagate their uncertainties if any is positive."""
        given = self.given
        found = formula({name: np.array(value) for name, value in given.items()})
        values = {name: float(np.asarray(value)) for name, value in found.items()}
        by_input = sensitivities(formula, given)
        terms = [(abs(v), sum(abs(by_input[name][x] * given[x]) for x in given)) for name, v in values.items()]
        relative = [size / max(value, _LEAST_REFERENCE * size) for value, size in terms if size > 0.0]
        uncertainty = propagate(formula, given, self.uncertain) if self.uncertain else None
        return RodMasses(values, uncertainty, _ROUNDING * max(relative, default=0.0), tuple(warnings))


@dataclass(frozen=True)
class Pendulum(Measurement):
    """Periods [s] of the rod hung at its small and its big end; lengths in m, the amplitude in rad.

    ``pivot_distance`` is measured between the two knife edges. Edges inside the bores touch them at their far ends
    from each other: the bores' radii are then given, and the results refer to their centres.
    """

    pivot_distance: float
    period_small_end: float
    period_big_end: float
    rod_mass: float
    amplitude: float = 0.0
    gravity: float = STANDARD_GRAVITY
    small_end_bore_radius: float = 0.0
    big_end_bore_radius: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, "", "pivot_distance", "period_small_end", "period_big_end", "rod_mass", "gravity")
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        require_not_negative(self, "", "small_end_bore_radius", "big_end_bore_radius")
        require(self.length > 0, "pivot_distance", "leaves no room between the bores", "more than both bore radii")
        super().__post_init__()

    @property
    def length(self) -> float:
        """Distance of the bores' centres [m]."""
        return self.pivot_distance - self.small_end_bore_radius - self.big_end_bore_radius


@dataclass(frozen=True)
class Weighing(Measurement):
    """The level rod on two supports at its pin centres: their readings [kg], ``length`` apart [m].

    ``rod_mass``, weighed separately, checks the sum of the readings. A period of the rod hung at its small end adds
    the moment of inertia: with the centre of mass known, the pendulum's singularity does not occur.
    """

    length: float
    small_end_reading: float
    big_end_reading: float
    rod_mass: float | None = None
    period_small_end: float | None = None
    small_end_bore_radius: float = 0.0
    amplitude: float = 0.0
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        names = "length", "small_end_reading", "big_end_reading", "gravity", "rod_mass", "period_small_end"
        require_positive(self, "", *names)
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        require_not_negative(self, "", "small_end_bore_radius")
        super().__post_init__()


@dataclass(frozen=True)
class Estimate(Measurement):
    """Constructive masses m' [kg per m2 of piston area] of an existing engine, and the new bore [m]."""

    bore: float
    piston_area_density: float
    rod_area_density: float

    def __post_init__(self) -> None:
        require_positive(self, "", "bore", "piston_area_density", "rod_area_density")
        super().__post_init__()


def amplitude_factor(amplitude: NDArray | float) -> NDArray:
    """T/T_0 = 1/M(1, cos(theta/2)) of a pendulum of amplitude theta [rad], M the arithmetic-geometric mean.

    Exact for every amplitude below pi; its series begins 1 + theta^2/16 + 11 theta^4/3072. Source: Gauss's formula
    for the complete elliptic integral.
    """
    a, g = np.ones_like(np.asarray(amplitude)), np.cos(0.5 * np.asarray(amplitude))
    for _ in range(8):
        a, g = 0.5 * (a + g), np.sqrt(a * g)
    return 1.0 / a


def _reduced_length(period: NDArray, x: dict[str, NDArray]) -> NDArray:
    """A = g T_0^2/(4 pi^2) [m], the length of the equivalent simple pendulum."""
    return x["gravity"] * (period / amplitude_factor(x["amplitude"])) ** 2 / (4.0 * math.pi**2)


def _reduced_masses(cg: NDArray, length: NDArray, mass: NDArray, inertia: NDArray) -> dict[str, NDArray]:
    """Two-mass model of a rod: m_A = m (L - l_A)/L, m_B = m l_A/L, Delta J = m l_A (L - l_A) - J_0. SI units."""
    return {
        "rod_cg_from_pin": cg,
        "rod_mass_at_pin": mass * (length - cg) / length,
        "rod_mass_at_crank": mass * cg / length,
        "rod_inertia": inertia,
        "inertia_defect": mass * cg * (length - cg) - inertia,
        "rod_mass": mass,
    }


def _pendulum_formulas(x: dict[str, NDArray]) -> dict[str, NDArray]:
    """Centre of mass, reduced masses and moment of inertia from named arrays of measured quantities."""
    pivots = x["pivot_distance"]
    small, big = _reduced_length(x["period_small_end"], x), _reduced_length(x["period_big_end"], x)
    from_pivot = pivots * (big - pivots) / (small + big - 2.0 * pivots)
    cg = from_pivot - x["small_end_bore_radius"]
    length = pivots - x["small_end_bore_radius"] - x["big_end_bore_radius"]
    return _reduced_masses(cg, length, x["rod_mass"], x["rod_mass"] * from_pivot * (small - from_pivot))


def swing(pendulum: Pendulum) -> RodMasses:
    """Compute masses, centre of mass and moment of inertia from both periods.

    Raises InvalidInput, stating the uncertainty, if the periods hardly determine the centre of mass (the denominator
    tends to 0), or if no rod has such periods.
    """
    values, length, uncertain = pendulum.given, pendulum.length, pendulum.uncertain
    measured = "period_small_end", "period_big_end", "pivot_distance"
    assumed = uncertain or {name: _NOMINAL_UNCERTAINTY * values[name] for name in measured}
    with np.errstate(all="ignore"):
        results = _pendulum_formulas({name: np.array(value) for name, value in values.items()})
        derivatives = sensitivities(_pendulum_formulas, values)["rod_cg_from_pin"]
        cg_uncertainty = combined(derivatives, assumed) if np.isfinite(list(results.values())).all() else math.inf
    limit = _MAX_RELATIVE_UNCERTAINTY * length
    if cg_uncertainty <= limit:
        masses = pendulum.evaluate(_pendulum_formulas, ())
        if masses.uncertainty is not None:
            # Near the singularity linear propagation is not valid.
            cg_uncertainty = masses.uncertainty.standard["rod_cg_from_pin"]
    if not cg_uncertainty <= limit:
        condition = ""
        if not uncertain:
            condition = f" even for a relative uncertainty of {_NOMINAL_UNCERTAINTY:g} in what was measured"
        statement = "is not determined at all"
        if math.isfinite(cg_uncertainty):
            statement = f"is uncertain by {100.0 * cg_uncertainty / length:.3g} % of the rod's length{condition}"
        raise InvalidInput(
            "period_big_end",
            f"the periods fit almost every centre of mass: its distance from the wrist pin {statement} (the two "
            "pendulum lengths of these periods add up to almost twice the pivot distance)",
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
    return replace(masses, warnings=tuple(warnings))


def weigh(weighing: Weighing) -> RodMasses:
    """Compute m_A and m_B, the scale readings, and l_A = L m_B/(m_A + m_B); J_0 only with a period.

    Raises InvalidInput if the readings do not add up to the rod's mass, or no rod has the period.
    """
    warnings = []
    if weighing.rod_mass is not None:
        difference = (weighing.small_end_reading + weighing.big_end_reading) / weighing.rod_mass - 1.0
        require(
            abs(difference) <= _MAX_SUM_ERROR,
            "rod_mass",
            f"differs by {abs(difference) * 100:.1f} % from the sum of the two readings",
            "within 2 % of their sum",
        )
        if abs(difference) > _NOTABLE_SUM_ERROR:
            warnings.append(f"the readings' sum differs from the rod's mass by {difference * 100:+.3f} %")

    def formulas(x: dict[str, NDArray]) -> dict[str, NDArray]:
        mass = x["small_end_reading"] + x["big_end_reading"]
        cg = x["length"] * x["big_end_reading"] / mass
        if weighing.period_small_end is None:
            found = _reduced_masses(cg, x["length"], mass, np.zeros_like(cg))
            return {name: v for name, v in found.items() if name not in ("rod_inertia", "inertia_defect")}
        arm = cg + x["small_end_bore_radius"]
        return _reduced_masses(cg, x["length"], mass, mass * arm * (_reduced_length(x["period_small_end"], x) - arm))

    masses = weighing.evaluate(formulas, warnings)
    require(
        masses.values.get("rod_inertia", 1.0) > 0,
        "period_small_end",
        "no rod with these readings swings so fast: its moment of inertia would be negative",
        "a longer period",
    )
    return masses


def estimate(request: Estimate) -> RodMasses:
    """Estimate m = m' pi D^2/4 for piston group and rod."""

    def scaled(x: dict[str, NDArray]) -> dict[str, NDArray]:
        area = math.pi * x["bore"] ** 2 / 4.0
        return {"piston_mass": x["piston_area_density"] * area, "rod_mass": x["rod_area_density"] * area}

    warnings = []
    for part, index, value in (("piston group", 0, request.piston_area_density), ("rod", 1, request.rod_area_density)):
        low = min(ranges[index][0] for ranges in USUAL.values())
        high = max(ranges[index][1] for ranges in USUAL.values())
        if not low <= value <= high:
            warnings.append(f"the {part} lies outside {low:g} … {high:g} kg/m2, the usual figures of textbooks")
    return request.evaluate(scaled, warnings)
