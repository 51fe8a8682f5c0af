"""Results of a check that a design minimises, maximises or limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from solvers.effects import Demand
from solvers.rod.check import RodCheck
from solvers.rod.rows import LENGTH, POWER, PRESSURE, SIDE, STABILITY, STRESS, TAU, THICKNESS, UTILISATION
from solvers.rod.scene import Scene


@dataclass(frozen=True)
class Objective:
    """A result that is better the smaller (``sign`` +1) or the greater (-1) it is.

    weights   the coefficients of the logarithmic cost in the rows of ``solvers.rod.rows``
    read      the result in a check; None without a load that can cause failure
    effect    the effect required for the result to exist
    unit      the unit of the result in the cost, in SI units: the density, ln(mass/density) = ln l - ln tau - 2 ln h,
              or the yield strength, whose ratio to the safety is the maximum stress
    """

    name: str
    sign: int
    weights: tuple[tuple[int, float], ...]
    read: Callable[[RodCheck], float | None]
    effect: str | None = None
    unit: Callable[[Scene], float] = lambda scene: 1.0

    @property
    def is_geometric(self) -> bool:
        """Whether the cost depends on the sizes alone, whatever the effects."""
        return all(row in (TAU, LENGTH, THICKNESS) for row, _ in self.weights)

    def demands(self) -> tuple[Demand, ...]:
        return () if self.effect is None else (Demand(self.effect, f"objective {self.name}"),)

    def log_cost(self, check: RodCheck, scene: Scene) -> float:
        """Logarithmic cost of a check's result, as given by ``weights``: of 1/n for a safety, of mass/density.

        -inf at an unbounded optimum: a safety without a load that can cause failure, zero friction.
        """
        value = self.read(check)
        return self.log_cost_of(value, scene) if value else -math.inf

    def log_cost_of(self, value: float, scene: Scene) -> float:
        """Logarithmic cost of a value of the result."""
        return self.sign * math.log(value / self.unit(scene))

    def value_at(self, log_cost: float, scene: Scene) -> float:
        """The value of the result at a logarithmic cost."""
        return self.unit(scene) * math.exp(self.sign * log_cost)


MASS = Objective(
    "mass", 1, ((LENGTH, 1.0), (TAU, -1.0), (THICKNESS, -2.0)), lambda check: check.mass,
    unit=lambda scene: scene.material.density,
)  # fmt: skip
FRICTION_POWER = Objective(
    "friction_power", 1, ((POWER, 1.0),), lambda check: check.stresses.friction_power, "friction"
)
CONTACT_PRESSURE = Objective(
    "contact_pressure", 1, ((PRESSURE, 1.0),), lambda check: check.stresses.contact_pressure_max, "friction"
)
SIDE_FORCE = Objective("side_force", 1, ((SIDE, 1.0),), lambda check: check.stresses.side_force_max)
FATIGUE_SAFETY = Objective("fatigue_safety", -1, ((UTILISATION, 1.0),), lambda check: check.stresses.fatigue_safety)
STABILITY_SAFETY = Objective(
    "stability_safety", -1, ((STABILITY, 1.0),), lambda check: check.stability_safety, "beam_column"
)
YIELD_SAFETY = Objective(
    "yield_safety", -1, ((STRESS, 1.0),), lambda check: check.stresses.yield_safety,
    unit=lambda scene: scene.material.yield_strength,
)  # fmt: skip
"""Optimised only to diagnose a requirement that cannot be met."""

OBJECTIVES = {
    objective.name: objective
    for objective in (MASS, FRICTION_POWER, CONTACT_PRESSURE, SIDE_FORCE, FATIGUE_SAFETY, STABILITY_SAFETY)
}
"""The objectives that a design may have, by name."""
