"""Requirements on a strip: those of its design, and safeties of at least 1 against buckling, fatigue and yield."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from solvers.outcome import Accuracy, EffectReport
from solvers.rod.check import RodCheck
from solvers.rod.constraints import Constraint
from solvers.rod.effects import EFFECTS
from solvers.rod.problem import Requirements
from solvers.verdict import Criterion, Sense, Verdict, at_least, at_most, doubt, left_out, slack_of, unknown

BASIC_SAFETIES = (
    ("stability_safety", "min_stability_safety"),
    ("fatigue_safety", "min_fatigue_safety"),
    ("yield_safety", "min_yield_safety"),
)
"""Safeties that must be at least 1 in every strip, and the requirements that may demand more."""

_STABILITY = frozenset(BASIC_SAFETIES[0])

_SAFETY_EFFECTS = frozenset(effect.name for effect in EFFECTS) - {"friction"}
"""Effects that change the safeties; friction only adds results."""


def judge(
    check: RodCheck,
    accuracy: Accuracy,
    requirements: Requirements | None = None,
    effects: Iterable[EffectReport] = (),
) -> Verdict:
    """The verdict on a strip; without ``requirements`` by the basic safeties only.

    ``accuracy`` is that of the results, excluding the optimality gap of a design; ``effects`` is the manifest: a
    relevant effect left out is a caution. If the strip buckles no other result exists, and a result that does not exist
    does not satisfy its requirement.
    """
    slack = slack_of(accuracy)
    requested = () if requirements is None else requirements.requested()
    asked = [_required(check, constraint, required, slack) for constraint, required in requested]
    minima = {constraint.name: required for constraint, required in requested}
    # A requirement of 1 or more already covers the basic safety.
    basic = [_basic(check, name, slack) for name, requirement in BASIC_SAFETIES if minima.get(requirement, 0.0) < 1.0]
    cautions = (*check.warnings, *left_out(effects, _SAFETY_EFFECTS))
    designed = requirements is not None
    # The buckling force does not depend on vibration and bending, whose accuracy may not be met.
    as_if_met = replace(accuracy, estimated=min(accuracy.estimated, accuracy.requested))
    known = _STABILITY if doubt(as_if_met, designed) == 0.0 else frozenset()
    return Verdict((*asked, *basic), cautions, doubt(accuracy, designed), known)


def _required(check: RodCheck, constraint: Constraint, required: float, slack: float) -> Criterion:
    if constraint.name == "min_stability_safety":
        return _stability(check, constraint.name, required, slack, asked=True)
    if check.stresses is None:
        return unknown(constraint.name, Sense.AT_LEAST if constraint.is_minimum else Sense.AT_MOST, required)
    judged = at_least if constraint.is_minimum else at_most
    return judged(constraint.name, required, constraint.result.read(check), slack)


def _basic(check: RodCheck, name: str, slack: float) -> Criterion:
    if name == "stability_safety":
        return _stability(check, name, 1.0, slack, asked=False)
    if check.stresses is None:
        return unknown(name, Sense.AT_LEAST, 1.0, asked=False)
    return at_least(name, 1.0, getattr(check.stresses, name), slack, asked=False)


def _stability(check: RodCheck, name: str, required: float, slack: float, asked: bool) -> Criterion:
    found = at_least(name, required, check.stability_safety, slack, asked)
    if check.stresses is not None or found.margin is None:
        return found
    # The strip buckles, however close to 1 its safety is.
    return found._replace(holds=False, margin=min(found.margin, -slack))
