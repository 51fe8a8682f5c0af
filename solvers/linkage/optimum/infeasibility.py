"""Diagnosis of infeasible problems: each limit alone and together with all others, and the closest type."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

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
from solvers.linkage.scene import TRANSMISSION
from solvers.outcome import Shortfall

_GAP = 1e-2
"""Gap to which an attainable value is proven optimal; the value itself is that of an actual linkage, to rounding."""

_FITTING = 1e-11
"""Relative excess of a box that counts as fitting."""

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

    ``advice`` is for a limit that is out of reach even alone. ``attained`` is the value of a limit that the objective's
    optimum stands for, from the limit and the optimum.
    """

    names: tuple[str, ...]
    objective: Objective
    advice: str
    attained: Callable[[float, float], float] = lambda limit, best: best

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{name: 0.0 if name == "min_link" else None for name in self.names})

    def misses(self, limit: float, best: tuple[float, str] | None) -> bool:
        """Whether the objective's optimum, None without any mechanism, misses a limit."""
        sign = self.objective.sign
        return best is None or sign * (self.attained(limit, best[0]) - limit * (1.0 + 1e-9 * sign)) > 0.0


def _groups(problem: LinkageProblem) -> tuple[_Group, ...]:
    shorter, smaller = _smaller(problem)
    # Least links and pin forces are out of reach alone only if speed and frequency fix the size.
    longer = "a lower blow frequency or a higher impact speed would raise it"
    weaker = "a lower impact energy, a lower blow frequency or a higher impact speed would lower it"
    if problem.limits.sized:
        longer = "a lower blow frequency or a higher impact speed would raise it, with looser limits on the size"
        softer = "a lower impact energy would lower it"
        roomier = "with looser limits on the size, a lower blow frequency or a higher impact speed would, too"
        weaker = f"{softer}; {roomier}"
    return (
        _Group(("min_link",), _SHORTEST_LINK, longer),
        _Group(("longest_link",), LONGEST_LINK, shorter),
        _Group(("enclosing_radius",), ENCLOSING_RADIUS, smaller),
        _Group(("max_pin_force",), PIN_FORCE, weaker),
        _box(problem, ("width", "height"), smaller),
    )


def _box(problem: LinkageProblem, names: tuple[str, ...], advice: str) -> _Group:
    """The sides of the box with these names, which one orientation of the mechanism must fit; the others are free."""
    pads = 2.0 * problem.limits.joint_radius
    sides = zip(("width", "height"), problem.limits.sides, strict=True)
    room = tuple(side - pads if name in names else math.inf for name, side in sides)
    return _Group(names, _misfit(room), advice, lambda side, factor: factor * (side - pads) + pads)


def _misfit(room: tuple[float, float]) -> Objective:
    """Minimise the factor by which a box of this width and height, less the joints, must grow to hold a mechanism."""
    return Objective("fit", lambda q: q.scale[0] * q.misfit(room), lambda check, scene: math.nan)


def _smaller(problem: LinkageProblem) -> tuple[str, str]:
    """What shortens the links, and what shrinks all they sweep: speed and frequency if they fix the size, else the
    minimum link, which then determines it."""
    if problem.fixed_scale is not None:
        shorter = "a higher blow frequency or a lower impact speed would shorten it"
        lower = "a higher blow frequency or a lower impact speed would lower it"
        with_joints = "a higher blow frequency, a lower impact speed or smaller joints would lower it"
    else:
        shorter = "a smaller minimum link length would shorten it"
        lower = "a smaller minimum link length would lower it"
        with_joints = "a smaller minimum link length or smaller joints would lower it"
    smaller = with_joints if problem.limits.joint_radius > 0.0 else lower
    if problem.fixed_u31_end is None:
        return shorter, smaller
    # They choose the member, whose size may be greater or less.
    other = "another tool radius, blow frequency or impact speed may, too"
    return f"{shorter}; {other}", f"{smaller}; {other}"


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
    why = "can be met alone, but not with the others"
    missed = _missed(problem, limits, lambda group: group.without(limits))
    named = {name for each in missed for name in each.limits}
    remedies = ["looser other limits would help"]
    if problem.limits.joint_radius > 0.0 and named & {"enclosing_radius", "width", "height"}:
        remedies.append("smaller joints would help, too")
    if "max_pin_force" in named:
        remedies.append("a lower impact energy would help, too")
    return tuple(entry for each in missed for entry in each.shortfalls(why, "; ".join(remedies)))


def _out_of_reach(problem: LinkageProblem, others: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of the limits that cannot be met beside ``others``."""
    hint = "" if problem.limits.transmission_angle == TRANSMISSION else "; other transmission angles may help, too"
    found: list[Shortfall] = []
    for each in _missed(problem, problem.limits, lambda _: others):
        why = "out of reach even alone" if len(each.limits) == 1 else "both are out of reach together"
        found += each.shortfalls(why, each.group.advice + hint)
    return tuple(found)


@dataclass(frozen=True)
class _Missed:
    """Limits of a group that cannot be met: what was asked, what is attainable at best, and with which type; None if
    there is no mechanism at all."""

    group: _Group
    limits: dict[str, float]
    best: tuple[float, str] | None

    def shortfalls(self, why: str, advice: str) -> Iterator[Shortfall]:
        for name, limit in self.limits.items():
            if self.best is None:
                yield Shortfall(name, limit, None, f"the other limits leave no mechanism at all; {advice}")
            else:
                value, closest = self.group.attained(limit, self.best[0]), self.best[1].replace("_", " ")
                yield Shortfall(name, limit, value, f"{why}, closest with the {closest}; {advice}")


def _missed(problem: LinkageProblem, asked: Limits, others: Callable[[_Group], Limits]) -> list[_Missed]:
    """The limits ``asked`` that cannot be met together with the others."""
    out = []
    for group in _groups(problem):
        required = {name: getattr(asked, name) for name in group.names if getattr(asked, name)}
        if not required:
            continue
        try:
            best = _best(problem, group.objective, others(group))
        except InvalidInput:
            # The size is free, and nothing bounds it on the side that this limit favours.
            continue
        required = {name: limit for name, limit in required.items() if group.misses(limit, best)}
        if len(required) > 1:
            # Of two sides of the box one may be out of reach by itself: then it alone is reported.
            sides = {name: _box(problem, (name,), group.advice) for name in required}
            found = _each_alone(problem, others(group))
            single = {name: limit for name, limit in required.items() if sides[name].misses(limit, found[name])}
            required = single or required
            if len(single) == 1:
                (name,) = single
                group, best, kept = sides[name], found[name], others(sides[name])
                if min(kept.sides) < math.inf:
                    best = _beside_the_other(problem, name, kept, found)
        if required:
            out.append(_Missed(group, required, best))
    return out


def _each_alone(problem: LinkageProblem, limits: Limits) -> dict[str, tuple[float, str] | None]:
    """The least factor of either side of the box, less its joints, whatever the other, and the type.

    Orientations are free, so both factors are those of the linkage of least width.
    """
    pads = 2.0 * problem.limits.joint_radius
    least = _best(problem, _misfit((1.0, math.inf)), limits)
    sides = zip(("width", "height"), problem.limits.sides, strict=True)
    return {name: least and (least[0] / (side - pads), least[1]) for name, side in sides}


def _beside_the_other(
    problem: LinkageProblem, name: str, limits: Limits, alone: dict[str, tuple[float, str] | None]
) -> tuple[float, str] | None:
    """The least factor of a side of the box, less its joints, at which both sides fit in one orientation, and the type.

    ``alone`` has the factor of each side without a limit on the other. None if there is none.
    """
    from scipy.optimize import brentq

    pads, free = 2.0 * problem.limits.joint_radius, replace(limits, width=None, height=None)
    if any(best is None or (side != name and best[0] > 1.0 + _FITTING) for side, best in alone.items()):
        return None

    @cache
    def fit(logarithm: float) -> tuple[float, str]:
        factors = (math.exp(logarithm) if side == name else 1.0 for side in ("width", "height"))
        room = (factor * (side - pads) for factor, side in zip(factors, problem.limits.sides, strict=True))
        return _best(problem, _misfit(tuple(room)), free)

    low = high = math.log(alone[name][0])
    while fit(high)[0] > 1.0 + _FITTING:
        high += math.log(2.0)
    found = high if high == low else brentq(lambda x: fit(x)[0] - 1.0, low, high, xtol=1e-11)
    return math.exp(found), fit(found)[1]


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
