"""Why there is no strip: each requirement judged alone and with all the others, and what would help."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from solvers.outcome import Shortfall
from solvers.rod.certificate import Sizes, search
from solvers.rod.focus import Machine
from solvers.rod.polish import Limits
from solvers.rod.problem import OBJECTIVES, Objective, Requirements

_GAP = 1e-3
_BOXES = 3000
_UPRIGHT = 1.0 + 1e-6


@dataclass(frozen=True)
class _Requirement:
    """A requirement: the objective that serves it, the limits without it, and what would help."""

    name: str
    objective: Objective
    limit: str
    advice: str

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{self.limit: _UPRIGHT if self.limit == "stability" else None})

    def alone(self) -> Limits:
        return Limits(fatigue=None, stability=_UPRIGHT)


_REQUIREMENTS = (
    _Requirement(
        "min_fatigue_safety", OBJECTIVES["fatigue_safety"], "fatigue",
        "a longer strip, a wider one, a smaller crank radius, a stronger material or a lower pressure would raise it",
    ),
    _Requirement(
        "min_stability_safety", OBJECTIVES["stability_safety"], "stability",
        "a thicker or wider strip, a smaller piston or a lower pressure would raise it",
    ),
    _Requirement(
        "max_contact_pressure", OBJECTIVES["contact_pressure"], "pressure",
        "a longer or thinner strip, a longer skirt or a smaller crank radius would lower it",
    ),
    _Requirement(
        "max_friction_power", OBJECTIVES["friction_power"], "power",
        "a longer or thinner strip, a lower friction coefficient or a lower speed would lower it",
    ),
)  # fmt: skip


def diagnose(machine: Machine, limits: Limits, sizes: Sizes, asked: Requirements) -> tuple[Shortfall, ...]:
    """One entry per requirement that cannot be met: alone if it cannot be met even alone, else with all the others.

    ``attainable`` is the best value to be had in that company, None where the others leave no strip at all.
    """
    entries = []
    for requirement in _REQUIREMENTS:
        required = getattr(asked, requirement.name)
        if required is None:
            continue
        alone = _best(machine, requirement, requirement.alone(), sizes)
        if alone is None:
            entries.append(_entry(requirement, required, None, "no strip within the bounds stands at all"))
        elif not _reached(requirement, alone, required):
            entries.append(_entry(requirement, required, alone, "out of reach even with no other requirement"))
    if entries:
        return tuple(entries)
    for requirement in _REQUIREMENTS:
        required = getattr(asked, requirement.name)
        if required is None:
            continue
        joint = _best(machine, requirement, requirement.without(limits), sizes)
        if joint is None or not _reached(requirement, joint, required):
            entries.append(_entry(requirement, required, joint, "can be met alone, but not while the others hold"))
    if asked.min_yield_safety is not None and not entries:
        why = "cannot be met together with the others; a higher yield strength or a longer strip would help"
        entries.append(Shortfall("min_yield_safety", asked.min_yield_safety, None, why))
    return tuple(entries)


def _best(machine: Machine, requirement: _Requirement, limits: Limits, sizes: Sizes) -> float | None:
    found = search(machine, requirement.objective, limits, sizes, _GAP, _BOXES).best
    return None if found is None else math.exp(requirement.objective.sign * found.log_cost)


def _reached(requirement: _Requirement, value: float, required: float) -> bool:
    return value >= required if requirement.objective.sign < 0 else value <= required


def _entry(requirement: _Requirement, required: float, attainable: float | None, why: str) -> Shortfall:
    return Shortfall(requirement.name, required, attainable, f"{why}; {requirement.advice}")
