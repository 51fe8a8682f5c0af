"""The best value of a limited result under all other requirements: a design with that result as objective."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from solvers.outcome import Outcome
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Constraint
from solvers.rod.optimum.answer.result import SearchResult
from solvers.rod.optimum.search.context import Suffices, Sufficient, never
from solvers.rod.optimum.search.feasibility import POSSIBLY_FEASIBLE
from solvers.rod.problem import RodProblem
from solvers.rod.scene import Dimensions

_LOOSEST = {
    "min_fatigue_safety": 1e-6, "min_yield_safety": None, "max_contact_pressure": None, "max_friction_power": None,
    "min_stability_safety": 1.0,
}  # fmt: skip
"""Values of the requirements that every strip short of buckling meets, those most sensitive to vibration first."""
_MAX_ERROR = 1e-2
"""Greatest error of a best value within which a requirement that it misses may still be met."""


class AttainableBest(NamedTuple):
    """A strip with the best attainable value of a result, its estimated relative error, the active requirements, and
    the result of the search."""

    check: RodCheck
    error: float
    opponents: tuple[Constraint, ...]
    result: SearchResult


@dataclass
class RequirementsAsObjectives:
    """Designs with the result of one requirement as objective; None if the other requirements are infeasible.

    accuracy   accuracy of the designs
    design_of  design of another problem on the full model; None if infeasible, or if the time is over; raises
               ``Sufficient`` at the first strip whose check suffices
    in_time    whether there is still time
    found      results so far, by requirement and all requirements left out, itself included
    """

    problem: RodProblem
    accuracy: float
    design_of: Callable[[RodProblem, Suffices], AttainableBest | None]
    in_time: Callable[[], bool]
    found: dict[tuple[Constraint, frozenset[Constraint]], AttainableBest | None] = field(default_factory=dict)

    def first_violated(self, nearest: RodCheck) -> Constraint | None:
        """The requirement to optimise first: one that the strip ``nearest`` to feasibility violates, if any."""
        asked = self.problem.requirements
        order = [BY_NAME[name] for name, loosest in _LOOSEST.items() if getattr(asked, name) != loosest]
        violated = [c for c in order if not c.meets(nearest, getattr(asked, c.name))]
        return next(iter(violated or order), None)

    def best(self, c: Constraint, but: Iterable[Constraint] = ()) -> AttainableBest | None:
        """The strip with the best value of a requirement's result under all other requirements except ``but``."""
        left_out = frozenset({c, *but})
        if (c, left_out) not in self.found:
            self.found[c, left_out] = self.design_of(self._with_objective(c, left_out), never)
        return self.found[c, left_out]

    def first_meeting(self, c: Constraint, room: float) -> Dimensions | None:
        """The first strip found on the way to the best one that meets a requirement, beside all others, by more than
        the error of its check and more than ``room`` (both relative); None if there is none, or if the best one is
        already known."""

        asked = self.problem.requirements

        def suffices(found: Outcome[RodCheck]) -> bool:
            margin = max(found.accuracy.estimated, room)
            # An estimate of the order of the values themselves says nothing of them.
            return margin < 1.0 and c.meets(found.value, getattr(asked.relaxed(-margin), c.name))

        alone = frozenset({c})
        if (c, alone) not in self.found:
            try:
                self.found[c, alone] = self.design_of(self._with_objective(c, alone), suffices)
            except Sufficient as sufficient:
                return sufficient.strip
        return None

    def are_infeasible_without(self, but: Iterable[Constraint]) -> bool:
        """Whether designs under all requirements except ``but`` have found no strip, for lack of one, not of time."""
        left_out = frozenset(but)
        return all(self.best(c, left_out) is None for c in left_out) and self.in_time()

    def may_be_met_by(self, best: AttainableBest) -> bool:
        """Whether all requirements may be met: whether the best strip misses none by more than its error."""
        error = max(POSSIBLY_FEASIBLE * self.accuracy, min(best.error, _MAX_ERROR))
        return self.problem.requirements.relaxed(error).met_by(best.check)

    def _with_objective(self, c: Constraint, left_out: frozenset[Constraint]) -> RodProblem:
        p = self.problem
        without = replace(p.requirements, **{o.name: _LOOSEST[o.name] for o in left_out})
        return replace(p, objective=c.result, requirements=without)

    def known(self, requirements: Iterable[Constraint]) -> dict[Constraint, AttainableBest]:
        """The optima found so far under all other requirements."""
        return {c: best for c in requirements if (best := self.found.get((c, frozenset({c})))) is not None}
