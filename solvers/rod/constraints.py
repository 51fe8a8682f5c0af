"""Requirements of a rod's design: the common table of problem, search, sensitivities and diagnosis.

A requirement limits one result of a check, and one row of the search (``solvers.rod.rows``) from above, the row being a
logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.scene import Scene

Limits = Mapping[int, float]
"""Limits of the search: the logarithm of the maximum admissible value, by row."""

LEAST_STABILITY = 1.0 + 1e-9
"""Minimum stability required in a search: results beyond buckling are meaningless."""


@dataclass(frozen=True)
class Constraint:
    """A requirement on one result.

    name       the field of ``Requirements``, in SI units
    row        the row of the search that it limits
    is_minimum whether the requirement is a minimum, of a safety, or a maximum
    read       the limited result of a check; None without a load that can cause failure
    objective  name of the objective that optimises this result
    advice     remedy if it cannot be met
    effect     the effect required for the result to exist
    """

    name: str
    row: int
    is_minimum: bool
    read: Callable[[RodCheck], float | None]
    objective: str
    advice: str
    effect: str | None = None

    def log_limit(self, required: float, scene: Scene) -> float:
        """Upper limit of the row."""
        if self.row == rows.STABILITY:
            required = max(required, LEAST_STABILITY)
        return _log(self.row, required, self.is_minimum, scene)

    def log_value(self, check: RodCheck, scene: Scene) -> float:
        """The row's value in a check, -inf without a load that can cause failure."""
        value = self.read(check)
        if value is None or value == 0.0:
            return -math.inf
        return _log(self.row, value, self.is_minimum, scene)

    def required_by(self, log_limit: float, scene: Scene) -> float:
        """The inverse of ``log_limit``."""
        value = math.exp(-log_limit if self.is_minimum else log_limit)
        return value * scene.material.yield_strength if self.row == rows.STRESS else value

    def meets(self, check: RodCheck, required: float) -> bool:
        """Whether a strip meets the requirement; an unloaded one does."""
        value = self.read(check)
        return value is None or (value >= required if self.is_minimum else value <= required)


def _log(row: int, value: float, is_minimum: bool, scene: Scene) -> float:
    if row == rows.STRESS:
        return math.log(scene.material.yield_strength / value)
    return -math.log(value) if is_minimum else math.log(value)


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
    Constraint(
        "min_yield_safety", rows.STRESS, True, lambda check: check.stresses.yield_safety, "max_stress",
        "a longer strip, a smaller crank radius, a higher yield strength or a lower pressure would raise it",
    ),
)  # fmt: skip
BY_NAME = {constraint.name: constraint for constraint in CONSTRAINTS}
