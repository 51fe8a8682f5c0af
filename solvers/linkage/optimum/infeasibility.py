"""Diagnosis of infeasible problems: each limit alone and together with all others, and the closest type."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from solvers.errors import InvalidInput
from solvers.linkage.limits import Limits
from solvers.linkage.optimum.branch_and_bound import FamilyOptimum, search_all
from solvers.linkage.optimum.quantities import EXCESS, Quantities
from solvers.linkage.problem import ENCLOSING_RADIUS, LONGEST_LINK, PEAK_TORQUE, PIN_FORCE, LinkageProblem, Objective
from solvers.linkage.scene import TRANSMISSION
from solvers.numerics.arrays import Array
from solvers.outcome import Shortfall

_GAP = 1e-2
"""Gap to which an attainable value is proven optimal; the value itself is that of an actual linkage, to rounding."""

_ROUNDING = 1e-9
"""Relative excess over a limit at which it counts as met."""

_SHORTEST_LINK = Objective(
    "min_link",
    lambda q: 1.0 / (q.greatest * q.crank),
    lambda check, scene: min(check.mechanism.links),
    -1,
    improves_with_scale=True,
)
"""Maximise the crank, the shortest link."""


@dataclass(frozen=True)
class _Group:
    """Limits that are met or missed together, and the objective that minimises their violation.

    limits      the limits by name [SI]
    allowed     the objective's cost up to which they are met
    advice      the remedy for limits that are out of reach even alone
    attained    the attainable value of a limit, from the limit and the objective's optimum
    best        the mechanism closest to the limits, once it has been searched for
    """

    limits: dict[str, float]
    objective: Objective
    allowed: float
    advice: str
    attained: Callable[[float, float], float] = lambda limit, best: best
    best: FamilyOptimum | None = None

    def without(self, limits: Limits) -> Limits:
        return replace(limits, **{name: 0.0 if name == "min_link" else None for name in self.limits})

    def met_by(self, best: FamilyOptimum) -> bool:
        return best.cost <= self.allowed * (1.0 + _ROUNDING)

    def violation(self, quantities: Quantities) -> Array:
        """The objective's cost where the limits are missed, otherwise a constant below ``allowed`` by twice the gap.

        So the search ends with the first member that meets them: by how much they are met is not needed.
        """
        cost = self.objective.cost(quantities)
        return np.where(cost <= self.allowed * (1.0 + _ROUNDING), self.allowed * (1.0 - 2.0 * _GAP), cost)

    def out_of_reach(self, hint: str) -> Iterable[Shortfall]:
        why = "out of reach even alone" if len(self.limits) == 1 else "both are out of reach together"
        return self.shortfalls(why, self.advice + hint)

    def shortfalls(self, why: str, advice: str) -> Iterable[Shortfall]:
        for name, limit in self.limits.items():
            if self.best.mechanism is None:
                yield Shortfall(name, limit, None, f"the other limits leave no mechanism at all; {advice}")
            else:
                value = float(self.attained(limit, self.objective.value(self.best.cost)))
                closest = self.best.family.kind.name.replace("_", " ")
                yield Shortfall(name, limit, value, f"{why}, closest with the {closest}; {advice}")


def _groups(problem: LinkageProblem, asked: Limits) -> list[_Group]:
    """Groups of the limits that are ``asked``."""
    shorter, smaller = _smaller(problem)
    # Least links and pin forces are out of reach alone only if speed and frequency fix the size.
    longer = "a lower blow frequency or a higher impact speed would raise it"
    weaker = "a lower impact energy, a lower blow frequency or a higher impact speed would lower it"
    if problem.limits.sized:
        longer = "a lower blow frequency or a higher impact speed would raise it, with looser limits on the size"
        softer = "a lower impact energy would lower it"
        roomier = "with looser limits on the size, a lower blow frequency or a higher impact speed would, too"
        weaker = f"{softer}; {roomier}"
    single = (
        ("min_link", _SHORTEST_LINK, longer),
        ("longest_link", LONGEST_LINK, shorter),
        ("enclosing_radius", ENCLOSING_RADIUS, smaller),
        ("max_pin_force", PIN_FORCE, weaker),
    )
    found = [
        _Group({name: limit}, objective, objective.value(limit), advice)
        for name, objective, advice in single
        if (limit := getattr(asked, name))
    ]
    sides = [_side(asked, name, smaller) for name in ("width", "height") if getattr(asked, name)]
    return found + (sides if len(sides) < 2 else [_box(asked, smaller)])


def _side(asked: Limits, name: str, advice: str) -> _Group:
    """One side of the box, within the limit on the other one if there is any."""
    objective = Objective("side", lambda q: q.side(q.sizes, min(q.problem.limits.sides)), lambda *_: math.nan)
    return _Group({name: getattr(asked, name)}, objective, getattr(asked, name), advice)


def _box(asked: Limits, advice: str) -> _Group:
    """Both sides of the box, by the factor by which it must grow, less the joints, to hold a mechanism."""
    pads = 2.0 * asked.joint_radius
    room = tuple(side - pads for side in asked.sides)
    objective = Objective("fit", lambda q: q.misfit(room, q.sizes), lambda *_: math.nan)
    limits = {"width": asked.width, "height": asked.height}
    return _Group(limits, objective, 1.0, advice, lambda side, factor: factor * (side - pads) + pads)


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
    any_size = _Group({}, PEAK_TORQUE, 0.0, "")
    if problem.fixed_u31_end is not None and not _best(problem, any_size, replace(minimal, min_link=1.0)).mechanism:
        return (_speed_shortfall(problem),)
    alone = _missed(problem, asked, lambda _: minimal)
    if not alone:
        return _clashing(problem, asked) or (_speed_shortfall(problem),)
    others = replace(asked, **{name: getattr(minimal, name) for each in alone for name in each.limits})
    beside = [replace(each, best=_best(problem, each, others, each.best)) for each in alone]
    hint = "" if asked.transmission_angle == TRANSMISSION else "; other transmission angles may help, too"
    clear = all(each.best.mechanism for each in beside)
    told = tuple(entry for each in (beside if clear else alone) for entry in each.out_of_reach(hint))
    return told if clear else told + _clashing(problem, others)


def _clashing(problem: LinkageProblem, limits: Limits) -> tuple[Shortfall, ...]:
    """Shortfalls of limits each of which can be met without the others."""
    missed = _missed(problem, limits, lambda group: group.without(limits))
    named = {name for each in missed for name in each.limits}
    remedies = ["looser other limits would help"]
    if problem.limits.joint_radius > 0.0 and named & {"enclosing_radius", "width", "height"}:
        remedies.append("smaller joints would help, too")
    if "max_pin_force" in named:
        remedies.append("a lower impact energy would help, too")
    advice, why = "; ".join(remedies), "can be met alone, but not with the others"
    return tuple(entry for each in missed for entry in each.shortfalls(why, advice))


def _missed(problem: LinkageProblem, asked: Limits, others: Callable[[_Group], Limits]) -> list[_Group]:
    """The limits ``asked`` that cannot be met together with the others."""
    out = []
    for group in _groups(problem, asked):
        try:
            best = _best(problem, group, others(group))
        except InvalidInput:
            # The size is free, and nothing bounds it on the side that this limit favours.
            continue
        if group.met_by(best):
            continue
        if len(group.limits) > 1:
            # Of two sides of the box one may be out of reach by itself: then it alone is reported. Orientations are
            # free, so that the least width is also the least height.
            sides = sorted((_side(asked, name, group.advice) for name in group.limits), key=lambda side: side.allowed)
            least = _best(problem, sides[0], others(group))
            if not sides[0].met_by(least) and sides[1].met_by(least):
                group = sides[0]
                best = _best(problem, group, others(group), least)
        out.append(replace(group, best=best))
    return out


def _best(
    problem: LinkageProblem, group: _Group, limits: Limits, relaxed: FamilyOptimum | None = None
) -> FamilyOptimum:
    """The mechanism within the limits that is closest to those of a group; speed and frequency are as free as in the
    problem. Raises InvalidInput if it improves without end.

    ``relaxed`` is the closest one within looser limits: if it is within these, no other is closer.
    """
    objective = replace(group.objective, cost=group.violation, set_motion=problem.objective.set_motion)
    problem = replace(problem, objective=objective, limits=limits)
    if relaxed is not None:
        q = np.array([relaxed.q or 0.0])
        if Quantities(problem, relaxed.family, q, q).cost[0] <= relaxed.cost * (1.0 + EXCESS):
            return relaxed
    return min(search_all(problem, _GAP), key=lambda each: each.cost)


def _speed_shortfall(problem: LinkageProblem) -> Shortfall:
    """Shortfall if every limit can be met: speed, tool radius or transmission angle are incompatible."""
    reason = "no allowed type strikes at this speed, frequency and tool radius within the transmission angle's limits"
    return Shortfall(
        "impact_speed", problem.scene.impact_speed, None, f"{reason}; another tool radius or frequency may do"
    )
