"""Diagnosis of infeasibility: which requirements cannot be met, and the best value of each under the others.

The attainable value is the optimum of a separate design problem; if the time is over, the core's optimum, evaluated on
the full model. Conflicting requirements are identified by the active limits of that design, or by searches on the core.
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
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Constraint, Limits
from solvers.rod.optimum.answer.core_requirement import Best, CoreOptima
from solvers.rod.optimum.answer.requirement_as_objective import AttainableBest, RequirementsAsObjectives
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.scene import Dimensions
from solvers.watch import OutOfTime

_STABILITY_ONLY: Limits = {rows.STABILITY: -math.log(1.0 + 1e-6)}
_STABILITY = BY_NAME["min_stability_safety"]
_OUT_OF_REACH = "out of reach even with no other requirement"
_JUST_MISSED = (
    "can be met together with the others only to within the search's accuracy: a slightly looser requirement would do"
)
_WITHOUT_EFFECTS = "can be met together with the others only without the effects beyond the core"
_OTHERS_CONFLICT = "the other requirements conflict with each other, too: relaxing this one does not suffice"
_SLIGHTLY = 0.02
"""Relative change of a requirement that is slight."""


def diagnose(
    core: CoreOptima, limits: Limits, full: RequirementsAsObjectives, model: FullModel, influence: float
) -> tuple[tuple[Shortfall, ...], float]:
    """The shortfall of each requirement that cannot be met, and the estimated relative error of the attainable values.

    If any requirement is infeasible by itself, only such are listed; otherwise those that conflict with others.

    ``attainable`` is the best value under all other requirements; for requirements infeasible by themselves, under all
    others that are not; if the others conflict among themselves, the worst of the values under one opponent at a time.
    ``limits`` are the requirements in terms of the core. With effects beyond the core they differ from the requested
    ones by the change due to the effects, at most ``influence``. The core's strip is then checked on the full model:
    the value is that of the check, and its deviation from the value expected by the search is part of the error.
    """
    entries = _Diagnosis(core, limits, full, model, influence).entries()
    return tuple(entry.shortfall for entry in entries), max(entry.error for entry in entries)


class _Attainable(NamedTuple):
    """The best attainable value of a result, None without a strip or a load, and its estimated relative error."""

    value: float | None
    error: float


class _Entry(NamedTuple):
    """A requirement, its shortfall, and the estimated relative error of the attainable value."""

    requirement: Constraint
    shortfall: Shortfall
    error: float

    @property
    def unattainable(self) -> bool:
        """Whether the attainable value does not meet the requirement."""
        attainable = self.shortfall.attainable
        return attainable is None or not self.requirement.admits(attainable, self.shortfall.required)


@dataclass
class _Diagnosis:
    core: CoreOptima
    limits: Limits
    full: RequirementsAsObjectives
    model: FullModel
    influence: float

    def __post_init__(self) -> None:
        self.asked = self.full.problem.requirements
        self.requirements = [constraint for constraint, _ in self.asked.requested()]

    def entries(self) -> list[_Entry]:
        for r, attained in self.full.known(self.requirements).items():
            return self.entries_from_optimum(r, attained)
        infeasible_alone = [r for r in self.requirements if not self.core.is_feasible(self.limits_of(r))]
        if len(infeasible_alone) == len(self.requirements) and self.every_strip_buckles():
            return [self.entry(_STABILITY, "no strip within the bounds is stable", self.stability_of_stiffest())]
        if infeasible_alone:
            return self.entries_infeasible_alone([*infeasible_alone, *self.further_infeasible(infeasible_alone)])
        pairs = combinations(self.requirements, 2)
        pairs = [pair for pair in pairs if not self.core.is_feasible(self.limits_of(*pair))]
        if not pairs:
            return _unattainable([self.entry_beside_all(r) for r in self.requirements])
        found = []
        for r in self.requirements:
            opponents = [b if r is a else a for a, b in pairs if r in (a, b)]
            if opponents:
                found.append(self.entry(r, self.conflict(r, opponents), self.best_under_others(r)))
        return _unattainable(found)

    def every_strip_buckles(self) -> bool:
        """Whether no strip is stable on the core, or the stiffest one is not and no design for stability finds one."""
        if not self.core.is_feasible(_STABILITY_ONLY):
            return True
        stiffest = self.check(self.core.stiffest)
        buckles = stiffest is not None and stiffest.stresses is None
        return buckles and self.full.best(_STABILITY, self.requirements) is None and self.full.in_time()

    def stability_of_stiffest(self) -> _Attainable:
        """The stability safety of the stiffest strip: the greatest one, but for what friction adds to the compression
        of strips with a greater side force."""
        check = self.check(self.core.stiffest)
        is_greatest = not self.model.choice.has("friction_feedback")
        error = self.model.accuracy if is_greatest else self.influence
        return _Attainable(None if check is None else check.stability_safety, error)

    def further_infeasible(self, infeasible_alone: Sequence[Constraint]) -> list[Constraint]:
        """Requirements that are infeasible on the full model beside all except ``infeasible_alone``, too."""
        if not self.full.are_infeasible_without(infeasible_alone):
            return []
        others = [o for o in self.requirements if o not in infeasible_alone]
        attained = [(o, self.full.best(o, infeasible_alone)) for o in others]
        return [o for o, best in attained if best is not None and not o.meets(best.check, self.required(o))]

    def entries_infeasible_alone(self, infeasible_alone: Sequence[Constraint]) -> list[_Entry]:
        """Entries of requirements infeasible by themselves, without those that the full model meets."""
        others = [o for o in self.requirements if o not in infeasible_alone]
        remaining = [r for r in infeasible_alone if not self.is_met_by_core_optimum(r, others)]
        if 0 < len(remaining) < len(infeasible_alone):
            return self.entries_infeasible_alone(remaining)
        best = {
            r: self.best_under_others(r, infeasible_alone) or self.best_on_core(r, _STABILITY_ONLY)
            for r in infeasible_alone
        }
        found = [self.entry(r, _OUT_OF_REACH, best[r]) for r in infeasible_alone]
        unattainable = _unattainable(found)
        if len(unattainable) == len(found):
            return found
        return self.entries_infeasible_alone([entry.requirement for entry in unattainable])

    def entries_from_optimum(self, r: Constraint, attained: AttainableBest) -> list[_Entry]:
        """Entries from a known optimum for ``r``, whose opponents are the requirements active there. If no size is
        continuous none is active; its opponents are those that cannot be met beside it."""
        others = [o for o in self.requirements if o is not r]
        opponents = [o for o in attained.opponents if o in others] if self.core.sizes.free else others
        if self.is_out_of_reach(r, opponents):
            return [self.entry(r, _OUT_OF_REACH, _of_design(r, attained))]
        if not self.core.sizes.free:
            opponents = [o for o in opponents if self.is_missed(o, self.best_under_others(o))]
        entries = [self.entry(r, self.conflict(r, opponents), _of_design(r, attained))]
        for o in opponents:
            best = self.best_under_others(o)
            if self.is_missed(o, best):
                entries.append(self.entry(o, self.conflict(o, [r]), best))
        return _unattainable(entries)

    def is_out_of_reach(self, r: Constraint, opponents: Sequence[Constraint]) -> bool:
        """Whether a requirement cannot be met alone: on the core or, unless the core's best strip for it or one that
        drops an opponent meets it, on the full model.

        Without continuous sizes a design for it alone takes less time than those without an opponent."""
        if not opponents or not self.core.is_feasible(self.limits_of(r)):
            return True
        if self.is_met_by_core_optimum(r):
            return False
        if self.core.sizes.free and not all(self.full.are_infeasible_without([o]) for o in opponents):
            return False
        alone = self.full.best(r, [o for o in self.requirements if o is not r])
        return alone is not None and not r.meets(alone.check, self.required(r))

    def is_met_by_core_optimum(self, r: Constraint, others: Sequence[Constraint] = ()) -> bool:
        """Whether the core's best strip for a requirement beside ``others`` meets all of them on the full model."""
        best = self.core.best(r, self.limits_of(*others))
        check = None if best is None else self.check(best.strip)
        return check is not None and all(c.meets(check, self.required(c)) for c in (r, *others))

    def check(self, strip: Dimensions) -> RodCheck | None:
        """The check of a strip on the full model; None if it has none, or after the time."""
        try:
            return self.model.check(strip).value
        except (InvalidInput, OutOfTime):
            return None

    def best_under_others(self, r: Constraint, but: Sequence[Constraint] = ()) -> _Attainable | None:
        """The best value under all other requirements except ``but``; if these conflict among themselves, the worst of
        the values under one of them at a time; the core's if the time is over."""
        others = [o for o in self.requirements if o is not r and o not in but]
        found = self.full.best(r, but)
        if found is None and len(others) > 1:
            alone = (self.full.best(r, [o for o in self.requirements if o is not one]) for one in others)
            values = [best for best in alone if best is not None]
            found = (min if r.is_minimum else max)(values, key=lambda best: r.result.read(best.check), default=None)
        return self.best_on_core(r, self.limits_of(*others)) if found is None else _of_design(r, found)

    def best_on_core(self, r: Constraint, limits: Limits) -> _Attainable | None:
        """What the core's best strip under ``limits`` attains; None if these are infeasible."""
        best = self.core.best(r, limits)
        return None if best is None else self.on_full_model(r, best)

    def limits_of(self, *requirements: Constraint) -> Limits:
        """Limits on the core for these requirements, always including stability."""
        return {**_STABILITY_ONLY, **{r.row: self.limits[r.row] for r in requirements}}

    def is_missed(self, r: Constraint, best: _Attainable | None) -> bool:
        """Whether the best value that is attainable is known and does not meet a requirement."""
        return best is not None and best.value is not None and not r.admits(best.value, self.required(r))

    def required(self, r: Constraint) -> float:
        return getattr(self.asked, r.name)

    def conflict(self, r: Constraint, opponents: Sequence[Constraint]) -> str:
        """Why a requirement cannot be met beside its opponents."""
        why = f"can be met alone, but not while {' or '.join(o.name for o in opponents)} holds"
        return f"{why}; {_OTHERS_CONFLICT}" if self.full.are_infeasible_without([r]) else why

    def entry(self, r: Constraint, why: str, best: _Attainable | None) -> _Entry:
        value, error = best or _Attainable(None, self.influence)
        return _Entry(r, Shortfall(r.name, self.required(r), value, f"{why}; {r.advice}"), error)

    def entry_beside_all(self, r: Constraint) -> _Entry:
        """The entry of a requirement that the core meets together with any other one."""
        best = self.best_under_others(r)
        if not self.core.is_feasible(self.limits_of(*self.requirements)):
            return self.entry(r, "can be met together with any other one, but not with all of them", best)
        value = None if best is None else best.value
        nearly = value is not None and abs(value / self.required(r) - 1.0) <= _SLIGHTLY
        return self.entry(r, _JUST_MISSED if nearly else _WITHOUT_EFFECTS, best)

    def on_full_model(self, r: Constraint, best: Best) -> _Attainable:
        """Value of the core's best strip on the full model, if it has one, and its relative error."""
        required, scene = self.required(r), self.model.scene
        changed = self.limits[r.row] - r.log_limit(required, scene)
        expected = r.result.value_at(r.log_limit(best.value, scene) - changed, scene)
        try:
            outcome = self.model.check(best.strip)
        except (InvalidInput, OutOfTime):
            return _Attainable(expected, 1.0 + self.influence)
        if outcome.value.stresses is None:
            # What the core meets is not attained by a strip that buckles.
            buckled = outcome.value.stability_safety if r is _STABILITY else None
            return _Attainable(buckled if r.admits(expected, required) else expected, 1.0 + self.influence)
        attained = r.result.read(outcome.value)
        error = float(best.gap + outcome.accuracy.estimated + abs(attained / expected - 1.0)) + self.influence
        # A strip that meets this requirement violates another one, by less than the search resolves.
        return _Attainable(expected if r.meets(outcome.value, required) else attained, error)


def _of_design(r: Constraint, best: AttainableBest) -> _Attainable:
    return _Attainable(r.result.read(best.check), best.error)


def _unattainable(entries: list[_Entry]) -> list[_Entry]:
    """The unattainable entries (for the others the core's limits were inexact), or all if there are none."""
    return [entry for entry in entries if entry.unattainable] or entries
