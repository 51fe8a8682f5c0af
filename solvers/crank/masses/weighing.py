"""Reduced masses of a rod from weighing its ends: the two scale readings are the two masses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.crank.masses.pendulum import STANDARD_GRAVITY, reduced_length
from solvers.crank.masses.reduced_rod import RodMasses, evaluate, reduced_masses, require_known
from solvers.errors import require, require_not_negative, require_positive


@dataclass(frozen=True)
class Weighing:
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
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = "length", "small_end_reading", "big_end_reading", "gravity", "rod_mass", "period_small_end"
        require_positive(self, "", *names)
        require(0 <= self.amplitude < math.pi / 2, "amplitude", "must be less than a right angle", "[0, pi/2)")
        require_not_negative(self, "", "small_end_bore_radius")
        require_known(self, self.uncertainty)


_MAX_SUM_ERROR = 0.02
"""Relative difference between the sum of the readings and the rod's mass above which the data is rejected."""

_NOTABLE_SUM_ERROR = 5e-6
"""Relative difference above which a warning states it; below, it would be stated as 0."""


def weigh(weighing: Weighing) -> RodMasses:
    """Compute m_A and m_B, the scale readings, and l_A = L m_B/(m_A + m_B); J_0 only with a period.

    Raises InvalidInput if the readings do not add up to the rod's mass, or no rod has the period.
    """
    total = weighing.small_end_reading + weighing.big_end_reading
    warnings = []
    if weighing.rod_mass is not None:
        difference = total / weighing.rod_mass - 1.0
        require(
            abs(difference) <= _MAX_SUM_ERROR,
            "rod_mass",
            f"differs by {abs(difference) * 100:.1f} % from the sum of the two readings",
            "within 2 % of small_end_reading + big_end_reading",
        )
        if abs(difference) > _NOTABLE_SUM_ERROR:
            warnings.append(f"the readings' sum differs from the rod's mass by {difference * 100:+.3f} %")

    def formulas(x: dict[str, NDArray]) -> dict[str, NDArray]:
        mass = x["small_end_reading"] + x["big_end_reading"]
        cg = x["length"] * x["big_end_reading"] / mass
        found = reduced_masses(cg, x["length"], mass, np.zeros_like(cg))
        if weighing.period_small_end is None:
            return {name: v for name, v in found.items() if name not in ("rod_inertia", "inertia_defect")}
        arm = cg + x["small_end_bore_radius"]
        inertia = mass * arm * (reduced_length(x["period_small_end"], x["amplitude"], x["gravity"]) - arm)
        return reduced_masses(cg, x["length"], mass, inertia)

    masses = evaluate(formulas, weighing, warnings)
    require(
        masses.values.get("rod_inertia", 1.0) > 0,
        "period_small_end",
        "no rod with these readings swings so fast: its moment of inertia would be negative",
        "a longer period",
    )
    return masses
