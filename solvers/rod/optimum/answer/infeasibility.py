"""Diagnosis of infeasibility: which requirements cannot be met, and the best value of each under the others.

What is attainable is the optimum of a separate design problem. With effects beyond the core that is a design on the
full model where one was made or takes little time, and otherwise the core's, with what its strip reaches on the full
model. Which requirements conflict is told by the limits that hold that design, or by searches on the core.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

from solvers.errors import InvalidInput
from solvers.outcome import Shortfall
from solvers.rod import rows
from solvers.rod.constraints import BY_NAME, Constraint, Limits
from solvers.rod.optimum.answer.core_requirement import Best, CoreOptima
from solvers.rod.optimum.answer.requirement_as_objective import Reached, RequirementsAsObjectives
from solvers.rod.optimum.full_model.model import FullModel
from solvers.watch import OutOfTime

_NOTHING: Limits = {rows.STABILITY: -math.log(1.0 + 1e-6)}
_STABILITY = BY_NAME["min_stability_safety"]
_OUT_OF_REACH = "out of reach even with no other requirement"


def diagnose(
    core: CoreOptima, limits: Limits, full: RequirementsAsObjectives, model: FullModel, influence: float
) -> tuple[tuple[Shortfall, ...], float]:
    """One entry per requirement that cannot be met: alone if any is infeasible by itself, otherwise with the others;
    and the estimated relative error of what is attainable.

    ``attainable`` is the best value under all other requirements; of those infeasible by themselves, under all others
    that are not; if the others conflict among themselves, the worst under any single opponent.
    ``limits`` are the requirements in terms of the core: if it is not the full model, they differ from those asked by
    the effects' change, which is at most ``influence``. The core's strip is then checked on the full model: the value
    is what that strip reaches, and how far that is from what the search knows of it is part of the error.
    """
    entries = _Diagnosis(core, limits, full, model, influence).entries()
    return tuple(entry.shortfall for entry in entries), max(entry.error for entry in entries)


class _Entry(NamedTuple):
    """A requirement, what is told of it, and the estimated relative error of what is attainable."""

    requirement: Constraint
    shortfall: Shortfall
    error: float

    @property
    def short(self) -> bool:
        """Whether less is attainable than required."""
        told = self.shortfall
        if told.attainable is None:
            return True
        return told.attainable < told.required if self.requirement.least else told.attainable > told.required


@dataclass
class _Diagnosis:
    core: CoreOptima
    limits: Limits
    full: RequirementsAsObjectives
    model: FullModel
    influence: float

    def __post_init__(self) -> None:
        self.asked = self.full.problem.requirements
        self.wanted = [constraint for constraint, _ in self.asked.asked()]

    def entries(self) -> list[_Entry]:
        for r, reached in self.full.known(self.wanted).items():
            return self.held(r, reached)
        beyond = [r for r in self.wanted if not self.core.admits(self.only(r))]
        if len(beyond) == len(self.wanted) and not self.core.admits(_NOTHING):
            why = f"no strip within the bounds stands at all; {_STABILITY.advice}"
            told = Shortfall(_STABILITY.name, self.asked.min_stability_safety, self.core.stoutest(), why)
            return [_Entry(_STABILITY, told, self.model.accuracy)]
        if beyond:
            return self.out_of_reach(beyond)
        pairs = [pair for pair in combinations(self.wanted, 2) if not self.core.admits(self.only(*pair))]
        if not pairs:
            why = "can be met together with any other one, but not with all of them"
            if len(self.wanted) == 2:
                why = (
                    "can be met together with the other one only to within the search's accuracy: a slightly lower "
                    "requirement would do"
                )
            return _short([self.entry(r, why, self.under(r)) for r in self.wanted])
        found = []
        for r in self.wanted:
            opponents = [b if r is a else a for a, b in pairs if r in (a, b)]
            if opponents:
                found.append(self.entry(r, _against(opponents), self.beside(r, opponents)))
        return _short(found)

    def out_of_reach(self, beyond: Sequence[Constraint]) -> list[_Entry]:
        """The entries of requirements that cannot be met alone, but for those that the full model does meet."""
        best = {r: self.under(r, beyond) or self.core.best(r, _NOTHING) for r in beyond}
        found = [self.entry(r, _OUT_OF_REACH, best[r]) for r in beyond]
        short = _short(found)
        return found if len(short) == len(found) else self.out_of_reach([entry.requirement for entry in short])

    def held(self, r: Constraint, reached: Reached) -> list[_Entry]:
        """The entries where the best strip by ``r`` is known: what keeps it from being better are its opponents."""
        opponents = [o for o in reached.opponents if o is not r]
        if not opponents or not self.core.admits(self.only(r)):
            return [self.entry(r, _OUT_OF_REACH, reached)]
        entries = [self.entry(r, _against(opponents), reached)]
        for o in opponents:
            best = self.under(o)
            if best is not None and not self.meets(o, best):
                entries.append(self.entry(o, _against([r]), best))
        return _short(entries)

    def beside(self, r: Constraint, opponents: Sequence[Constraint]) -> Best | Reached | None:
        """The best value under all others, else the worst under a single opponent."""
        found = self.under(r)
        if found is not None:
            return found
        left = [one for opponent in opponents if (one := self.core.best(r, self.only(opponent))) is not None]
        return (min if r.least else max)(left, key=lambda one: one.value, default=None)

    def under(self, r: Constraint, but: Sequence[Constraint] = ()) -> Best | Reached | None:
        """The best value under all other requirements but some, on the full model if that takes little time."""
        if self.full.quick and all(o is r for o in but):
            reached = self.full.best(r)
            if reached is not None:
                return reached
        return self.core.best(r, self.only(*(o for o in self.wanted if o is not r and o not in but)))

    def only(self, *requirements: Constraint) -> Limits:
        return {**_NOTHING, **{r.row: self.limits[r.row] for r in requirements}}

    def meets(self, r: Constraint, best: Best | Reached | None) -> bool:
        if isinstance(best, Reached):
            return r.meets(best.check, getattr(self.asked, r.name))
        return best is not None and r.log_limit(best.value, self.model.scene) <= self.limits[r.row]

    def entry(self, r: Constraint, why: str, best: Best | Reached | None) -> _Entry:
        required = getattr(self.asked, r.name)
        if isinstance(best, Reached):
            value, error = r.read(best.check), best.error
        else:
            value, error = (None, 0.0) if best is None else self.on_full_model(r, best)
            error += self.influence
        return _Entry(r, Shortfall(r.name, required, value, f"{why}; {r.advice}"), error)

    def on_full_model(self, r: Constraint, best: Best) -> tuple[float, float]:
        """What the core's strip of the best value reaches there, and the error of that but for the influence."""
        required, scene = getattr(self.asked, r.name), self.model.scene
        changed = self.limits[r.row] - r.log_limit(required, scene)
        expected = r.required_by(r.log_limit(best.value, scene) - changed, scene)
        try:
            outcome = None if self.core.sizes.discrete else self.full.best_near(r, best.strip)
            if outcome is None:
                outcome = self.model.check(best.strip, self.core.accuracy)
        except (InvalidInput, OutOfTime):
            return expected, 1.0
        if outcome.value.stresses is None:
            return expected, 1.0
        reached = r.read(outcome.value)
        error = float(best.gap + outcome.accuracy.estimated + abs(reached / expected - 1.0))
        # What fulfils the requirement breaks another one, by less than the search can tell.
        return (expected if r.meets(outcome.value, required) else reached), error


def _short(entries: list[_Entry]) -> list[_Entry]:
    """Those of which less is attainable than required: of others the core's limits were off. All, if none is."""
    return [entry for entry in entries if entry.short] or entries


def _against(opponents: Sequence[Constraint]) -> str:
    return f"can be met alone, but not while {' or '.join(o.name for o in opponents)} holds"
