"""The requirements of a rod's design: one table that problem, search, sensitivities and diagnosis read.

A requirement limits one result of a check, and one row of the search (``solvers.rod.rows``): "row at most so
much", the row being a logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.scene import Scene

Limits = Mapping[int, float]
"""What a strip has to meet: the logarithm of the greatest admissible value, by row."""

LEAST_STABILITY = 1.0 + 1e-9
"""What a search asks of stability at the least: results beyond buckling mean nothing."""


@dataclass(frozen=True)
class Constraint:
    """A requirement on one result.

    name       the field of ``Requirements``, in SI units
    row        the row of the search that it limits
    least      whether it is a least value, of a safety, or a greatest one
    read       the result of a check that it limits; None where there is no load to fail under
    serves     the objective that makes this result as good as can be
    advice     what would help where it cannot be met
    effect     the effect without which the result does not exist
    """

    name: str
    row: int
    least: bool
    read: Callable[[RodCheck], float | None]
    serves: str
    advice: str
    effect: str | None = None

    def log_limit(self, required: float, scene: Scene) -> float:
        """What the row may be at the most."""
        if self.row == rows.STABILITY:
            required = max(required, LEAST_STABILITY)
        return _log(self.row, required, self.least, scene)

    def log_value(self, check: RodCheck, scene: Scene) -> float:
        """The row of a check, -inf where there is no load to fail under."""
        value = self.read(check)
        if value is None or value == 0.0:
            return -math.inf
        return _log(self.row, value, self.least, scene)

    def required_by(self, log_limit: float, scene: Scene) -> float:
        """The inverse of ``log_limit``."""
        value = math.exp(-log_limit if self.least else log_limit)
        return value * scene.material.yield_strength if self.row == rows.STRESS else value

    def meets(self, check: RodCheck, required: float) -> bool:
        """Whether a strip meets the requirement; one that is not loaded does."""
        value = self.read(check)
        return value is None or (value >= required if self.least else value <= required)


def _log(row: int, value: float, least: bool, scene: Scene) -> float:
    if row == rows.STRESS:
        return math.log(scene.material.yield_strength / value)
    return -math.log(value) if least else math.log(value)


CONSTRAINTS = (
    Constraint(
        "min_fatigue_safety", rows.UTILISATION, True, lambda check: check.stresses.fatigue_safety, "fatigue_safety",
        "a longer strip, a wider one, a smaller crank radius, a stronger material or a lower pressure would raise it",
    ),
    Constraint(
        "min_stability_safety", rows.STABILITY, True, lambda check: check.stability_safety, "stability_safety",
        "a thicker or wider strip, a smaller piston or a lower pressure would raise it", "beam_column",
    ),
    Constraint(
        "max_contact_pressure", rows.PRESSURE, False, lambda check: check.stresses.contact_pressure_max,
        "contact_pressure", "a longer or thinner strip, a longer skirt or a smaller crank radius would lower it",
        "friction",
    ),
    Constraint(
        "max_friction_power", rows.POWER, False, lambda check: check.stresses.friction_power, "friction_power",
        "a longer or thinner strip, a lower friction coefficient or a lower speed would lower it", "friction",
    ),
    # Last, so that of a pair of opponents it is the one that is held and not the one that is searched for.
    Constraint(
        "min_yield_safety", rows.STRESS, True, lambda check: check.stresses.yield_safety, "fatigue_safety",
        "a longer strip, a smaller crank radius, a higher yield strength or a lower pressure would raise it",
    ),
)  # fmt: skip
BY_NAME = {constraint.name: constraint for constraint in CONSTRAINTS}
