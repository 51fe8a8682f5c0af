"""The best value of a result that is limited, under all other requirements: a design with that result as objective."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from solvers.outcome import Outcome
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Constraint
from solvers.rod.problem import OBJECTIVES, RodProblem
from solvers.rod.scene import Dimensions

_LOOSEST = {
    "min_fatigue_safety": 1e-6, "max_contact_pressure": None, "max_friction_power": None, "min_stability_safety": 1.0,
}  # fmt: skip
"""What every strip that stands meets of a requirement; those that vibration changes most first. The yield safety is no
objective."""


class Reached(NamedTuple):
    """A strip with the best value of a result, the estimated relative error of that, and the requirements that keep it
    from being better."""

    check: RodCheck
    error: float
    opponents: tuple[Constraint, ...]


@dataclass
class RequirementsAsObjectives:
    """The designs made so far for a problem's requirements, one by one; None where the others leave no strip.

    designed   the design of another problem on the full model
    led        the end of one local search there from a strip; None where that does not meet the requirements
    quick      whether a design takes little time
    """

    problem: RodProblem
    designed: Callable[[RodProblem], Reached | None]
    led: Callable[[RodProblem, Dimensions], Outcome[RodCheck] | None]
    quick: bool
    found: dict[str, Reached | None] = field(default_factory=dict)

    def first_missed(self, nearest: RodCheck) -> Constraint | None:
        """The requirement to begin with: one that a strip misses, if it misses any."""
        asked = self.problem.requirements
        order = [BY_NAME[name] for name, loosest in _LOOSEST.items() if getattr(asked, name) != loosest]
        missed = [c for c in order if not c.meets(nearest, getattr(asked, c.name))]
        return next(iter(missed or order), None)

    def best(self, c: Constraint) -> Reached | None:
        """The best strip by a requirement's result under all other requirements."""
        if c.name not in _LOOSEST:
            return None
        if c.name not in self.found:
            self.found[c.name] = self.designed(self._beside(c))
        return self.found[c.name]

    def best_near(self, c: Constraint, strip: Dimensions) -> Outcome[RodCheck] | None:
        """A strip near another one that is as good as any there."""
        return self.led(self._beside(c), strip) if c.name in _LOOSEST else None

    def _beside(self, c: Constraint) -> RodProblem:
        p = self.problem
        without = replace(p.requirements, **{c.name: _LOOSEST[c.name]})
        return replace(p, objective=OBJECTIVES[c.serves], requirements=without)

    def known(self, wanted: Iterable[Constraint]) -> dict[Constraint, Reached]:
        """Those that have been found."""
        return {c: reached for c in wanted if (reached := self.found.get(c.name)) is not None}
