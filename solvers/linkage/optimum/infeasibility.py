"""Diagnosis of infeasible problems: each limit alone and together with all others, and the closest type."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from solvers.errors import InvalidInput
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
)
from solvers.outcome import Shortfall

_GAP = 1e-2
"""Gap to which an attainable value is proven optimal; the value itself is that of an actual linkage, to rounding."""

_SHORTEST_LINK = Objective(
    "min_link",
    lambda q: 1.0 / (q.scale[1] * q.crank),
    lambda check, scene: min(check.mechanism.links),
    -1,
    improves_with_scale=True,
)
"""Maximise the crank, the shortest link."""


@dataclass(frozen=True)
class _Group:
    """Limits that are met or missed together, the objective that minimises their violation, and a remedy.

    ``attained`` is the value of a limit that the objective's optimum stands for, from the limit and the optimum.
    """

    names: tuple[str, ...]
    objective: Objective
    advice: str
    attained: Callable[[float, float], float] = lambda limit, best: best

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{name: 0.0 if name == "min_link" else None for name in self.names})


def _groups(problem: LinkageProblem) -> tuple[_Group, ...]:
    pads, room = 2.0 * problem.limits.joint_radius, problem.room
    misfit = Objective("fit", lambda q: q.scale[0] * q.misfit(room), lambda check, scene: math.nan)
    shorter = "a higher blow frequency or a lower impact speed would shorten it"
    lower = "a higher blow frequency or a lower impact speed would lower it"
    smaller = "a higher blow frequency, a lower impact speed or smaller joints would lower it"
    higher = "a lower blow frequency, a higher impact speed or restitution would raise it"
    weaker = "more room, a lower impact energy or a lower blow frequency would lower it"
    return (
        _Group(("min_link",), _SHORTEST_LINK, higher),
        _Group(("longest_link",), LONGEST_LINK, shorter),
        _Group(("enclosing_radius",), ENCLOSING_RADIUS, lower),
        _Group(("max_pin_force",), PIN_FORCE, weaker),
        _Group(("width", "height"), misfit, smaller, lambda side, factor: factor * (side - pads) + pads),
    )


def diagnose(problem: LinkageProblem) -> tuple[Shortfall, ...]:
    """One entry per limit that cannot be met: alone if it is infeasible by itself, otherwise with all others.

    ``attainable`` is the best value over the allowed types beside the other limits, except those that cannot be met
    even alone, None if there is none. If those others clash, limits that cannot be met alone come with what is
    attainable alone, and the others with their own shortfalls.
    """
    asked = problem.limits
    # With a free size the minimum link determines the size, so it is kept.
    least = asked.min_link if problem.fixed_scale is None else 0.0
    minimal = Limits(least, asked.joint_radius, transmission_angle=asked.transmission_angle)
    # The torque does not depend on the size: any will do.
    if problem.fixed_u31_end is not None and _best(problem, PEAK_TORQUE, replace(minimal, min_link=1.0)) is None:
        return (_speed_shortfall(problem),)
    alone = _out_of_reach(problem, minimal)
    if not alone:
        return _clashing(problem, asked) or (_speed_shortfall(problem),)
    others = replace(asked, **{each.requirement: getattr(minimal, each.requirement) for each in alone})
    beside = {each.requirement: each for each in _out_of_reach(problem, others)}
    found = tuple(beside.get(each.requirement, each) for each in alone)
    if all(each.attainable is not None for each in found):
        return found
    named = {each.requirement for each in alone}
    return alone + tuple(each for each in _clashing(problem, others) if each.requirement not in named)


def _clashing(problem: LinkageProblem, limits: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of limits each of which can be met without the others."""
    return _shortfalls(
        problem, limits, lambda group: group.without(limits), "can be met alone, but not with the others"
    )


def _out_of_reach(problem: LinkageProblem, others: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of the limits that cannot be met beside ``others``."""
    return _shortfalls(problem, problem.limits, lambda _: others, "out of reach even alone")


def _shortfalls(
    problem: LinkageProblem, asked: Limits, others: Callable[[_Group], Limits], why: str
) -> tuple[Shortfall, ...]:
    """Shortfalls of the limits ``asked`` that cannot be met together with the others."""
    out = []
    for group in _groups(problem):
        required = {name: getattr(asked, name) for name in group.names if getattr(asked, name)}
        if not required:
            continue
        try:
            found = _best(problem, group.objective, others(group))
        except InvalidInput:
            # The size is free, and nothing bounds it on the side that this limit favours.
            continue
        for name, limit in required.items():
            if found is None:
                advice = f"the other limits leave no mechanism at all; {group.advice}"
                out.append(Shortfall(name, limit, None, advice))
                continue
            attained, excess = group.attained(limit, found[0]), 1e-9 * group.objective.sign
            if group.objective.sign * (attained - limit * (1.0 + excess)) > 0.0:
                closest = found[1].replace("_", " ")
                out.append(Shortfall(name, limit, attained, f"{why}, closest with the {closest}; {group.advice}"))
    return tuple(out)


def _best(problem: LinkageProblem, objective: Objective, limits: Limits) -> tuple[float, str] | None:
    """The best value of the objective among the mechanisms within the limits, and its type; speed and frequency are as
    free as in the problem. Raises InvalidInput if it improves without end."""
    objective = replace(objective, set_motion=problem.objective.set_motion)
    problem = replace(problem, objective=objective, limits=limits)
    best, name = math.inf, ""
    for kind in problem.kinds:
        found = search(problem, Family(kind, problem.scene.restitution.gain), _GAP, best)
        if found.cost < best:
            best, name = found.cost, kind.name
    return (objective.value(best), name) if name else None


def _speed_shortfall(problem: LinkageProblem) -> Shortfall:
    """Shortfall if every limit can be met: speed, tool radius or transmission angle are incompatible."""
    scene = problem.scene
    reason = "no allowed type strikes at this speed, frequency and tool radius within the transmission angle's limits"
    return Shortfall("impact_speed", scene.impact_speed, None, f"{reason}; another tool radius or frequency may do")
