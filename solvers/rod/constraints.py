"""Requirements of a rod's design: the common table of problem, search, sensitivities and diagnosis.

A requirement limits one result of a check, and one row of the search (``solvers.rod.rows``) from above, the row being a
logarithm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.objectives import (
    CONTACT_PRESSURE,
    FATIGUE_SAFETY,
    FRICTION_POWER,
    STABILITY_SAFETY,
    YIELD_SAFETY,
    Objective,
)
from solvers.rod.scene import Scene

Limits = Mapping[int, float]
"""Limits of the search: the logarithm of the maximum admissible value, by row."""

LEAST_STABILITY = 1.0 + 1e-9
"""Minimum stability required in a search: results beyond buckling are meaningless."""


@dataclass(frozen=True)
class Constraint:
    """A requirement: a maximum of a result, or a minimum of a safety.

    name    the field of ``Requirements``, in SI units
    result  what it limits
    advice  remedy if it cannot be met
    """

    name: str
    result: Objective
    advice: str

    @property
    def row(self) -> int:
        """The row of the search that it limits."""
        ((row, _),) = self.result.weights
        return row

    @property
    def is_minimum(self) -> bool:
        """Whether the requirement is a minimum, of a safety, or a maximum."""
        return self.result.sign < 0

    def log_limit(self, required: float, scene: Scene) -> float:
        """Upper limit of the row."""
        if self.row == rows.STABILITY:
            required = max(required, LEAST_STABILITY)
        return self.result.log_cost_of(required, scene)

    def meets(self, check: RodCheck, required: float) -> bool:
        """Whether a strip meets the requirement: a buckled one never does, an unloaded one always."""
        if check.stresses is None:
            return False
        value = self.result.read(check)
        return value is None or self.admits(value, required)

    def admits(self, value: float, required: float) -> bool:
        """Whether a value of the result meets the requirement."""
        return value >= required if self.is_minimum else value <= required


CONSTRAINTS = (
    Constraint(
        "min_fatigue_safety", FATIGUE_SAFETY,
        "a longer strip, a wider one, a smaller crank radius, a stronger material or a lower pressure would raise it",
    ),
    Constraint(
        "min_stability_safety", STABILITY_SAFETY,
        "a thicker or wider strip, a smaller piston or a lower pressure would raise it",
    ),
    Constraint(
        "max_contact_pressure", CONTACT_PRESSURE,
        "a longer or thinner strip, a longer skirt or a smaller crank radius would lower it",
    ),
    Constraint(
        "max_friction_power", FRICTION_POWER,
        "a longer or thinner strip, a lower friction coefficient or a lower speed would lower it",
    ),
    Constraint(
        "min_yield_safety", YIELD_SAFETY,
        "a longer strip, a smaller crank radius, a higher yield strength or a lower pressure would raise it",
    ),
)  # fmt: skip
BY_NAME = {constraint.name: constraint for constraint in CONSTRAINTS}
