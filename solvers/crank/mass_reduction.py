"""Finding a rod's reduced masses: by swinging it from both ends, by weighing its ends, or by estimate.

Swinging: with A = g T^2/(4 pi^2) for each end and L the distance of the pivots, l_A = L (A_D - L)/(A_C + A_D - 2L)
and J_0 = m_r l_A (A_C - l_A). The denominator is -L Delta J/(m_r l_A l_B): the method fails just where the two-mass
model is exact. Weighing has no such place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.crank.uncertainty import Propagated, linear, propagate, sensitivities
from solvers.errors import InvalidInput, require

STANDARD_GRAVITY = 9.80665
_NOMINAL = 1e-5
"""Relative uncertainty of a period that the best stopwatch cannot beat; it judges a request that names none."""
MEANINGLESS = 0.1
"""Share of the rod's length; a centre of mass less certain than that is no result."""


@dataclass(frozen=True)
class RodMasses:
    """What was found, SI units, None where a method cannot tell; ``uncertainty`` has the same names."""

    values: Mapping[str, float | None]
    uncertainty: Propagated | None
    warnings: tuple[str, ...] = ()


def _positive(owner: object, *names: str) -> None:
    for name in names:
        value = getattr(owner, name)
        require(math.isfinite(value) and value > 0, name, "must be positive", "(0, inf)")


def amplitude_factor(amplitude: NDArray | float) -> NDArray:
    """T/T_0 = 1/M(1, cos(theta/2)) of a pendulum of amplitude theta [rad], M the arithmetic-geometric mean.

    Exact for every amplitude below pi; its series begins 1 + theta^2/16 + 11 theta^4/3072. Source: Gauss's formula for
    the complete elliptic integral.
    """
    a, g = np.ones_like(np.asarray(amplitude)), np.cos(0.5 * np.asarray(amplitude))
    for _ in range(8):
        a, g = 0.5 * (a + g), np.sqrt(a * g)
    return 1.0 / a


@dataclass(frozen=True)
class Pendulum:
    """Periods [s] of the rod hung at its small and its big end; lengths in m, the amplitude in rad.

    ``pivot_distance`` is measured between the two knife edges. Edges that carry the rod inside its bores touch them at
    their far ends from each other: the bores' radii are then given, and the results refer to their centres.
    ``uncertainty`` has standard uncertainties by the names of these fields.
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
        _positive(self, "pivot_distance", "period_small_end", "period_big_end", "rod_mass", "gravity")
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        for name in ("small_end_bore_radius", "big_end_bore_radius"):
            require(0 <= getattr(self, name) < math.inf, name, "must not be negative", "[0, inf)")
        between = self.pivot_distance - self.small_end_bore_radius - self.big_end_bore_radius
        require(between > 0, "pivot_distance", "leaves no room between the bores", "more than both bore radii")
        _check_uncertainty(self, self.uncertainty)


_INPUTS = (
    "pivot_distance",
    "period_small_end",
    "period_big_end",
    "rod_mass",
    "amplitude",
    "gravity",
    "small_end_bore_radius",
    "big_end_bore_radius",
)


def _check_uncertainty(owner: object, uncertainty: Mapping[str, float]) -> None:
    for name, u in uncertainty.items():
        known = isinstance(getattr(owner, name, None), (int, float))
        require(known, f"uncertainty.{name}", "belongs to no quantity that was given", "names of the quantities")
        require(math.isfinite(u) and u >= 0, f"uncertainty.{name}", "must not be negative", "[0, inf)")


def _reduced_length(period: NDArray, amplitude: NDArray, gravity: NDArray) -> NDArray:
    """A = g T_0^2/(4 pi^2) [m], the length of the equivalent simple pendulum."""
    return gravity * (period / amplitude_factor(amplitude)) ** 2 / (4.0 * math.pi**2)


def _swung(x: dict[str, NDArray]) -> dict[str, NDArray]:
    """The pendulum's formulas on named arrays."""
    pivots = x["pivot_distance"]
    small = _reduced_length(x["period_small_end"], x["amplitude"], x["gravity"])
    big = _reduced_length(x["period_big_end"], x["amplitude"], x["gravity"])
    from_pivot = pivots * (big - pivots) / (small + big - 2.0 * pivots)
    cg = from_pivot - x["small_end_bore_radius"]
    length = pivots - x["small_end_bore_radius"] - x["big_end_bore_radius"]
    return _shares(cg, length, x["rod_mass"], x["rod_mass"] * from_pivot * (small - from_pivot))


def _shares(cg: NDArray, length: NDArray, mass: NDArray, inertia: NDArray) -> dict[str, NDArray]:
    return {
        "rod_cg_from_pin": cg,
        "rod_mass_at_pin": mass * (length - cg) / length,
        "rod_mass_at_crank": mass * cg / length,
        "rod_inertia": inertia,
        "inertia_defect": mass * cg * (length - cg) - inertia,
        "rod_mass": mass,
    }


def _scalars(found: Mapping[str, NDArray]) -> dict[str, float]:
    return {name: float(np.asarray(value)) for name, value in found.items()}


def swing(pendulum: Pendulum) -> RodMasses:
    """Masses, centre and moment of inertia from both periods.

    Raises InvalidInput, with the uncertainty in words, where the periods fit almost every centre of mass (the
    denominator tends to 0), and where no rod has such periods.
    """
    values = {name: float(getattr(pendulum, name)) for name in _INPUTS}
    given = {name: float(u) for name, u in pendulum.uncertainty.items() if u > 0}
    judged = given or {n: _NOMINAL * values[n] for n in ("period_small_end", "period_big_end", "pivot_distance")}
    length = pendulum.pivot_distance - pendulum.small_end_bore_radius - pendulum.big_end_bore_radius
    with np.errstate(all="ignore"):
        found = _scalars(_swung({name: np.array(value) for name, value in values.items()}))
        spread = (
            linear(_swung, values, judged)["rod_cg_from_pin"] if all(map(math.isfinite, found.values())) else math.inf
        )
    if not spread <= MEANINGLESS * length:
        by = "" if given else f" even for a relative uncertainty of {_NOMINAL:g} in what was measured"
        told = f"is uncertain by {spread:.3g} m{by}" if math.isfinite(spread) else "is not determined at all"
        raise InvalidInput(
            "period_big_end",
            f"the periods fit almost every centre of mass: its distance from the wrist pin {told}, the rod being "
            f"{length:.3g} m long (A_C + A_D is too near 2L)",
            "periods of a rod further from the two-mass model, or more certain ones, or the method weighing",
        )
    require(
        0 < found["rod_cg_from_pin"] < length and found["rod_inertia"] > 0,
        "period_small_end",
        "no rod has these periods: its centre of mass would lie outside it, or its moment of inertia would be negative",
        "periods longer than that of a simple pendulum as long as the distance of the centre of mass",
    )
    uncertainty = propagate(_swung, values, given) if given else None
    warnings = []
    common = sensitivities(_swung, values)["rod_cg_from_pin"]
    shift = (
        common["period_small_end"] * values["period_small_end"] + common["period_big_end"] * values["period_big_end"]
    )
    if abs(shift) * 1e-3 > 0.005 * length:
        warnings.append(
            f"a common error of +0.1 % in both periods moves the centre of mass by {shift * 1e-3 * 1e3:+.2f} mm; "
            "weighing both ends is the robust alternative"
        )
    return RodMasses(found, uncertainty, tuple(warnings))


@dataclass(frozen=True)
class Weighing:
    """The rod level on two supports at its pin centres: what each reads [kg], ``length`` apart [m].

    ``rod_mass``, weighed by itself, tells how well the readings close. A period of the rod hung at its small end adds
    the moment of inertia: the centre of mass is known, so the pendulum's weakness does not show.
    """

    length: float
    small_end_reading: float
    big_end_reading: float
    rod_mass: float | None = None
    period_small_end: float | None = None
    small_end_bore_radius: float = 0.0
    amplitude: float = 0.0
    gravity: float = STANDARD_GRAVITY
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _positive(self, "length", "small_end_reading", "big_end_reading", "gravity")
        if self.rod_mass is not None:
            _positive(self, "rod_mass")
        if self.period_small_end is not None:
            _positive(self, "period_small_end")
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        require(0 <= self.small_end_bore_radius < math.inf, "small_end_bore_radius", "must not be negative", "[0, inf)")
        _check_uncertainty(self, self.uncertainty)


CLOSURE = 0.02
"""Relative difference between the two readings' sum and the rod's mass beyond which one of them is wrong."""


def weigh(weighing: Weighing) -> RodMasses:
    """m_A and m_B are what the scales read; l_A = L m_B/(m_A + m_B). J_0 only with a period.

    Raises InvalidInput where the readings do not add up to the rod's mass, or no rod has the period.
    """
    names = ["length", "small_end_reading", "big_end_reading", "amplitude", "gravity", "small_end_bore_radius"]
    swung = weighing.period_small_end is not None
    values = {name: float(getattr(weighing, name)) for name in [*names, *(["period_small_end"] if swung else [])]}
    total = weighing.small_end_reading + weighing.big_end_reading
    warnings = []
    if weighing.rod_mass is not None:
        gap = total / weighing.rod_mass - 1.0
        require(
            abs(gap) <= CLOSURE,
            "rod_mass",
            f"differs by {abs(gap) * 100:.2g} % from the sum of the two readings",
            "within 2 % of small_end_reading + big_end_reading",
        )
        warnings.append(f"the readings' sum differs from the rod's mass by {gap * 100:+.3f} %")

    def read(x: dict[str, NDArray]) -> dict[str, NDArray]:
        mass = x["small_end_reading"] + x["big_end_reading"]
        cg = x["length"] * x["big_end_reading"] / mass
        found = _shares(cg, x["length"], mass, np.zeros_like(cg))
        if not swung:
            return {name: v for name, v in found.items() if name not in ("rod_inertia", "inertia_defect")}
        arm = cg + x["small_end_bore_radius"]
        inertia = mass * arm * (_reduced_length(x["period_small_end"], x["amplitude"], x["gravity"]) - arm)
        return _shares(cg, x["length"], mass, inertia)

    found = _scalars(read({name: np.array(value) for name, value in values.items()}))
    require(
        found.get("rod_inertia", 1.0) > 0,
        "period_small_end",
        "no rod with these readings swings so fast: its moment of inertia would be negative",
        "a longer period",
    )
    given = {name: float(u) for name, u in weighing.uncertainty.items() if u > 0 and name in values}
    return RodMasses(found, propagate(read, values, given) if given else None, tuple(warnings))


USUAL = {
    "spark ignition": ((80.0, 150.0), (100.0, 200.0)),
    "diesel": ((150.0, 300.0), (250.0, 400.0)),
}
"""Usual constructive masses [kg per m2 of piston area] of aluminium piston groups and of steel rods: textbook figures,
quoted from memory and rounded; they tell a slip of a decimal from a design, no more."""


@dataclass(frozen=True)
class Estimate:
    """Constructive masses m' [kg per m2 of piston area] of an existing engine, and the new bore [m]."""

    bore: float
    piston_area_density: float
    rod_area_density: float
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _positive(self, "bore", "piston_area_density", "rod_area_density")
        _check_uncertainty(self, self.uncertainty)


def estimate(request: Estimate) -> RodMasses:
    """m = m' pi D^2/4 for piston group and rod."""

    def scaled(x: dict[str, NDArray]) -> dict[str, NDArray]:
        area = math.pi * x["bore"] ** 2 / 4.0
        return {"piston_mass": x["piston_area_density"] * area, "rod_mass": x["rod_area_density"] * area}

    values = {name: float(getattr(request, name)) for name in ("bore", "piston_area_density", "rod_area_density")}
    given = {name: float(u) for name, u in request.uncertainty.items() if u > 0}
    warnings = []
    for part, index, value in (("piston group", 0, request.piston_area_density), ("rod", 1, request.rod_area_density)):
        low = min(ranges[index][0] for ranges in USUAL.values())
        high = max(ranges[index][1] for ranges in USUAL.values())
        if not low <= value <= high:
            warnings.append(f"the {part} lies outside {low:g} … {high:g} kg/m2, the usual figures of textbooks")
    found = _scalars(scaled({name: np.array(value) for name, value in values.items()}))
    return RodMasses(found, propagate(scaled, values, given) if given else None, tuple(warnings))
