"""Diagnosis of infeasible problems: each limit alone and together with all others, and the closest type."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from solvers.linkage.limits import Limits
from solvers.linkage.optimum.branch_and_bound import search
from solvers.linkage.optimum.family import Family
from solvers.linkage.problem import (
    ENCLOSING_RADIUS,
    LONGEST_LINK,
    PEAK_TORQUE,
    PIN_FORCE,
    LinkageProblem,
    Objective,
    Subproblem,
)
from solvers.outcome import Shortfall

_GAP = 1e-2
"""Gap to which an attainable value is proven optimal; the value itself is that of an actual linkage, to rounding."""


_MISFIT = Objective("fit", lambda q: q.scale[0] * q.misfit, lambda check, scene: math.nan)
"""Minimise max(W/width, H/height), the misfit of the box."""
_SHORTEST_LINK = Objective(
    "min_link",
    lambda q: 1.0 / (q.scale[1] * q.crank),
    lambda check, scene: min(check.mechanism.links),
    -1,
    improves_with_scale=True,
)
"""Maximise the crank, the shortest link."""


@dataclass(frozen=True)
class _Limit:
    """A limit, the objective that minimises its violation, and a remedy."""

    name: str
    objective: Objective
    advice: str

    def met(self, limits: Limits, value: float) -> bool:
        asked = getattr(limits, self.name)
        return value <= asked * (1 + 1e-9) if self.objective.sign > 0 else value >= asked * (1 - 1e-9)

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{self.name: 0.0 if self.name == "min_link" else None})


_LIMITS = (
    _Limit("min_link", _SHORTEST_LINK, "a lower blow frequency, a higher impact speed or restitution would raise it"),
    _Limit("longest_link", LONGEST_LINK, "a higher blow frequency or a lower impact speed would shorten it"),
    _Limit("enclosing_radius", ENCLOSING_RADIUS, "a higher blow frequency or a lower impact speed would lower it"),
    _Limit("max_pin_force", PIN_FORCE, "more room, a lower impact energy or a lower blow frequency would lower it"),
)
_SMALLER = "a higher blow frequency, a lower impact speed or smaller joints would lower it"


def diagnose(problem: LinkageProblem) -> tuple[Shortfall, ...]:
    """One entry per limit that cannot be met: alone if it is infeasible by itself, otherwise with all others.

    ``attainable`` is the best value over the allowed types beside the other limits, except those that cannot be met
    even alone, None if there is none; see ``_beside_the_others`` for limits of both sorts.
    """
    asked = problem.limits
    free = problem.fixed_scale is None
    # With a free size the minimum link determines the size, so it is kept.
    minimal = Limits(
        min_link=asked.min_link if free else 0.0,
        joint_radius=asked.joint_radius,
        transmission_angle=asked.transmission_angle,
    )
    if problem.fixed_u31_end is not None and _best(problem, minimal, PEAK_TORQUE) is None:
        return (_speed_shortfall(problem),)
    alone = _out_of_reach(problem, minimal)
    if alone:
        return _beside_the_others(problem, minimal, alone)
    return _clashing(problem, asked) or (_speed_shortfall(problem),)


def _beside_the_others(problem: LinkageProblem, minimal: Limits, alone: tuple[Shortfall, ...]) -> tuple[Shortfall, ...]:
    """The limits that cannot be met even ``alone``, with what is attainable beside the others; if these clash, then
    with what is attainable alone, and the others' own shortfalls."""
    others = replace(problem.limits, **{each.requirement: getattr(minimal, each.requirement) for each in alone})
    beside = {each.requirement: each for each in _out_of_reach(problem, others)}
    found = tuple(beside.get(each.requirement, each) for each in alone)
    if all(each.attainable is not None for each in found):
        return found
    named = {each.requirement for each in alone}
    return alone + tuple(each for each in _clashing(problem, others) if each.requirement not in named)


def _clashing(problem: LinkageProblem, limits: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of limits each of which can be met without the others."""
    why = "can be met alone, but not with the others"
    return _infeasible_limits(problem, lambda limit: limit.without(limits), limits, why)


def _out_of_reach(problem: LinkageProblem, others: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of the limits that cannot be met beside ``others``."""
    box_limits = replace(others, width=problem.limits.width, height=problem.limits.height)
    return _infeasible_limits(problem, lambda _: others, box_limits, "out of reach even alone")


def _infeasible_limits(
    problem: LinkageProblem, others: Callable[[_Limit], Limits], box_limits: Limits, why: str
) -> tuple[Shortfall, ...]:
    """Shortfalls of the limits that cannot be met together with the others."""
    asked, out = problem.limits, []
    for limit in _LIMITS:
        required = getattr(asked, limit.name)
        if not required or not _is_bounded(problem, limit, others(limit)):
            continue
        found = _best(problem, others(limit), limit.objective)
        if found is None or not limit.met(asked, found[0]):
            out.append(_shortfall(limit.name, required, found, why, limit.advice))
    return tuple(out) + _box_shortfalls(problem, box_limits, why)


def _is_bounded(problem: LinkageProblem, limit: _Limit, limits: Limits) -> bool:
    """Whether the best value for a limit is finite: a free size must be bounded on the relevant side."""
    bounded = (
        limits.sized if limit.objective.improves_with_scale else limits.min_link > 0 or limits.max_pin_force is not None
    )
    return problem.fixed_scale is not None or bounded


def _best(
    problem: LinkageProblem, limits: Limits, objective: Objective, boxed: bool = True
) -> tuple[float, str] | None:
    """The best value of the objective among the mechanisms within the limits, and its type."""
    free_motion = problem.objective.set_motion is not None
    subproblem = Subproblem(problem.scene, limits, objective, boxed=boxed, free_motion=free_motion)
    best, name = math.inf, ""
    for kind in problem.kinds:
        found = search(subproblem, Family(kind, problem.scene.restitution.gain), _GAP, best)
        if found.cost < best:
            best, name = found.cost, kind.name
    return (objective.value(best), name) if name else None


def _box_shortfalls(problem: LinkageProblem, limits: Limits, why: str) -> tuple[Shortfall, ...]:
    """Shortfalls of width and height: the minimum factor by which the room between the pads must grow."""
    if (limits.width is None and limits.height is None) or not _is_bounded(problem, _LIMITS[1], limits):
        return ()
    found = _best(problem, limits, _MISFIT, boxed=False)
    if found is not None and found[0] <= 1 + 1e-9:
        return ()
    pads, out = 2.0 * limits.joint_radius, []
    for side in ("width", "height"):
        value = getattr(limits, side)
        if value is not None:
            reached = None if found is None else (found[0] * (value - pads) + pads, found[1])
            out.append(_shortfall(side, value, reached, why, _SMALLER))
    return tuple(out)


def _speed_shortfall(problem: LinkageProblem) -> Shortfall:
    """Shortfall if every limit can be met: speed, tool radius or transmission angle are incompatible."""
    scene = problem.scene
    reason = "no allowed type strikes at this speed, frequency and tool radius within the transmission angle's limits"
    return Shortfall("impact_speed", scene.impact_speed, None, f"{reason}; another tool radius or frequency may do")


def _shortfall(name: str, required: float, found: tuple[float, str] | None, why: str, advice: str) -> Shortfall:
    if found is None:
        return Shortfall(name, required, None, f"the other limits leave no mechanism at all; {advice}")
    closest = found[1].replace("_", " ")
    return Shortfall(name, required, found[0], f"{why}, closest with the {closest}; {advice}")
