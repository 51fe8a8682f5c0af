"""State of a search for a better part: every evaluated part is a candidate, and the best feasible one is remembered
across searches."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

Array = np.ndarray

DIFFERENCE = 3e-6
"""Step of the finite differences in the logarithms. The check's errors, mostly below 1e-9, change a slope by less than
1e-3; a larger step would straddle corners of the limits."""
PUSH = 3e-9
"""Safety distance from the limits, so that end points are feasible."""
PENALTY = 1000.0
"""Penalty factor of violated limits; near the maximum possible fatigue safety, multipliers exceed 100."""
_LOST = 1.0
"""Violation assigned to a missing result, in addition to the stability's."""
_LITTLE, _PULLS = 1e-4, 3
"""Small violation, and number of attempts to repair a search's end point."""
PULLS = 3 * _PULLS
"""Maximum evaluations for the repair."""
_SAME = 1e-9
HOME = 1e-3
"""Distance in the logarithms of the sizes. A search whose best part comes this close to the end of an earlier search,
without being better, is stopped: it would end at the same place."""
_TURN, _APPROACH, _CLOSE = 12, 0.5, 1e-3
"""Progress required of a search with a target. After every ``_TURN`` evaluations the distance of its merit from the
target must be below ``_APPROACH`` times the previous distance, or below ``_CLOSE``; otherwise the search is stopped."""
_REMEMBERED = 400
"""Number of recent feasible parts used for repairs."""


@dataclass(frozen=True)
class Look:
    """An evaluated part: logarithm of the objective (as minimised) and logarithmic margins of the limits (negative:
    violated). Not finite if there is no result."""

    cost: float
    margins: Array

    @property
    def violation(self) -> float:
        return max(0.0, -float(self.margins.min())) if self.margins.size else 0.0


@dataclass(frozen=True)
class Space:
    """Bounds of the positive sizes [any unit], and the allowed values of those on a grid, None for the others (no grids
    at all: every size is continuous)."""

    lower: Array
    upper: Array
    grids: tuple[Array | None, ...] = ()

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of sizes that can vary, on a grid or not."""
        return tuple(int(i) for i in np.flatnonzero(self.upper > self.lower))

    @property
    def stepped(self) -> tuple[int, ...]:
        return tuple(i for i, grid in enumerate(self.grids) if grid is not None)

    def sizes(self, logs: Array) -> tuple[Array, bool]:
        """The sizes clipped to the bounds, and whether they are on the grid."""
        sizes = np.clip(np.exp(logs), self.lower, self.upper)
        had = True
        for i in self.stepped:
            nearest = self.grids[i][np.abs(self.grids[i] - sizes[i]).argmin()]
            if abs(nearest / sizes[i] - 1.0) < _SAME:
                sizes[i] = nearest
            else:
                had = False
        return sizes, had


class Spent(Exception):
    """The search has used up its evaluations."""


@dataclass
class Hunt:
    """The parts evaluated so far. With ``seeking`` False, any feasible part is accepted, regardless of its cost.

    ``difference`` is the finite-difference step of slopes, in logarithms; rough evaluations need a larger one. ``home``
    replaces ``HOME`` for rough searches, and ``target`` is the merit that they must approach (see ``_TURN``).
    """

    space: Space
    look: Callable[[Array], Look]
    seeking: bool = True
    difference: float = DIFFERENCE
    home: float = HOME
    target: float = -math.inf
    best: tuple[float, Array] | None = None
    found_by: str = ""
    evaluations: int = 0
    way: str = ""
    lead: tuple[float, Array] | None = None
    homes: list[tuple[float, Array]] = field(default_factory=list)
    """Merit and logarithms of the sizes where each rough search ended; a later search that arrives at one of them is
    stopped."""
    _left: float = math.inf
    _turn: int = 0
    _apart: float = math.inf
    _known: dict[bytes, Look] = field(default_factory=dict)
    _within: deque[tuple[Array, Look]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    _worst_cost: float = -math.inf

    @property
    def rough(self) -> bool:
        """Whether evaluations are too inaccurate to resolve corners of the limits."""
        return self.difference > DIFFERENCE

    def allow(self, evaluations: int, way: str) -> None:
        """Start the next search with a name and a budget of evaluations."""
        self._left, self.way, self.lead, self._turn, self._apart = evaluations, way, None, 0, math.inf

    def allow_more(self, evaluations: int) -> None:
        """Extend the budget of the current search."""
        self._left = evaluations

    def at(self, logs: Array) -> Look:
        """Evaluate a part, with finite substitutes for missing values."""
        sizes, had = self.space.sizes(logs)
        key = sizes.tobytes()
        if key in self._known:
            return self._known[key]
        if self._left <= 0:
            raise Spent
        self._left -= 1
        self.evaluations += 1
        seen = self.look(sizes)
        counts = had and seen.violation == 0.0 and np.all(np.isfinite(seen.margins)) and math.isfinite(seen.cost)
        if counts and (self.best is None or seen.cost < self.best[0]):
            self.best, self.found_by = (seen.cost, sizes), self.way
        self._known[key] = known = self._finite(seen)
        if known.violation == 0.0:
            self._within.append((np.log(sizes), known))
        if self.lead is None or _merit(known) < self.lead[0]:
            away = self.lead is not None
            self.lead = _merit(known), np.log(sizes)
            if away and self._at_home():
                raise Spent
        self._turn += 1
        if self._turn % _TURN == 0 and not self._approaches():
            raise Spent
        return known

    def _approaches(self) -> bool:
        """Whether the search has approached its target sufficiently since the previous call."""
        before, self._apart = self._apart, self.lead[0] - self.target
        return self._apart <= max(_CLOSE, _APPROACH * before)

    def settle(self) -> None:
        """Record where a rough search converged."""
        if self.rough and self.lead is not None and not self._at_home():
            self.homes.append(self.lead)

    def _at_home(self) -> bool:
        """Whether the best part of this search lies where an earlier search ended, and is no better."""
        merit, logs = self.lead
        return any(merit >= known and np.abs(logs - home).max() < self.home for known, home in self.homes)

    def _finite(self, seen: Look) -> Look:
        missing = ~np.isfinite(seen.margins)
        margins = np.where(missing, 0.0, seen.margins)
        margins = np.where(missing, min(0.0, float(margins.min(initial=0.0))) - _LOST, margins)
        if math.isfinite(seen.cost):
            self._worst_cost = max(self._worst_cost, seen.cost)
        cost = seen.cost if math.isfinite(seen.cost) else max(self._worst_cost, -1e3) + _LOST
        return Look(cost if self.seeking else 0.0, margins)

    def slopes(self, logs: Array, free: tuple[int, ...], difference: float = 0.0) -> tuple[Array, Array]:
        """One-sided differences of cost and margins (limits x free sizes), within the bounds."""
        here, cost, margins, difference = self.at(logs), [], [], difference or self.difference
        for i in free:
            step = difference if logs[i] + difference <= math.log(self.space.upper[i]) else -difference
            moved = logs.copy()
            moved[i] += step
            there = self.at(moved)
            cost.append((there.cost - here.cost) / step)
            margins.append((there.margins - here.margins) / step)
        return np.array(cost), np.array(margins).T

    def pull_in(self) -> None:
        """Repair a slightly infeasible best part by moving toward the most promising feasible one until the last limit
        is met."""
        for _ in range(_PULLS):
            if self.lead is None or not 0.0 < (seen := self.at(self.lead[1])).violation < _LITTLE:
                return
            there, promised, share = None, math.inf, 0.0
            for logs, other in self._within:
                short, spare = np.maximum(PUSH - seen.margins, 0.0), np.maximum(other.margins, PUSH)
                crossing = min(1.0, float((short / (short + spare)).max()))
                if (cost := seen.cost + crossing * (other.cost - seen.cost)) < promised:
                    there, promised, share = logs, cost, crossing
            if there is None or share == 1.0:
                return
            for further in (1.0, 2.0, 10.0):
                found = self.at(self.lead[1] + min(1.0, further * share) * (there - self.lead[1]))
                if found.violation == 0.0:
                    return

    def promising(self, count: int, apart: float, most: float, slack: float, known: list[Array]) -> list[Array]:
        """Logarithms of the sizes of up to ``count`` of the best parts evaluated, with the sizes on the grid.

        Their merit is at most ``most``, with limits relaxed by ``slack``; each is at least ``apart`` from the others
        and from ``known``.
        """
        merits = []
        for key, seen in self._known.items():
            merit = seen.cost + PENALTY * max(seen.violation - slack, 0.0)
            if merit <= most:
                merits.append((merit, np.log(np.frombuffer(key))))
        out: list[Array] = []
        for _, logs in sorted(merits, key=lambda one: one[0]):
            if len(out) == count:
                break
            if self.space.sizes(logs)[1] and all(np.abs(logs - other).max() > apart for other in [*known, *out]):
                out.append(logs)
        return out

    def clipped(self, logs: Array) -> Array:
        return np.clip(logs, np.log(self.space.lower), np.log(self.space.upper))

    def merit(self, logs: Array) -> float:
        return _merit(self.at(logs))


def _merit(seen: Look) -> float:
    return seen.cost + PENALTY * seen.violation
