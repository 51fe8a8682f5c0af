"""Where damped resonances part strips from others that may be better: the gaps between them on both sides.

The strip's first mode is at a resonance wherever a harmonic of the speed meets it, at whole Omega = omega_1/omega. A
strip on the way from one gap to the next is dearer by what rings, and damping rounds what is between: a share of about
the loss factor of Omega. So optima close to a strip lie in other gaps.

The least cost of strips of a given Omega is followed over gaps, in steps that resolve them. The path is that of strips
whose limits corrections add as much to as where it begins; of each strip on it corrections are solved, and the cost of
holding the limits at the same Omega is that of a linear programme (``at_ratio``). Valleys of that cost are starts of
searches.

Width and thickness may be exchanged for each other, b h^3 alike, and the core's forces, deflections and stability stay
as they are: the least cost may hardly change over dozens of gaps. The strips at the two ends of that exchange, within
the bounds, are places to start from, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solvers.rod import rows
from solvers.rod.optimum.at_ratio import AtRatio
from solvers.rod.optimum.corrections import log_frequency_ratio
from solvers.rod.optimum.full_model import Array, FullRows
from solvers.rod.optimum.full_strip import dimensions_of, logarithms
from solvers.rod.optimum.local_search import Iterate, Task
from solvers.rod.optimum.sqp import program
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_GAPS, _STEPS = 2, 6
"""So many gaps are followed to each side, in so many steps each."""
_FARTHEST, _NEAREST = 0.2, 0.05
"""In ln b, ln h, ln l: of a path, and of the strip that holds its limits from the one on the path."""
_PACE = 2.0
"""In ln b, ln h, ln l: what a strip moves aside for a unit of change of ln Omega, at most."""
_DEARER, _LOST = 0.008, 0.1
"""In ln objective: valleys dearer than the best strip by more are no starts; a path is not followed where a whole gap
is dearer by more."""
_UNSTEADY = 2e-3
"""In ln objective: a strip that plain slopes promise to better by more at its own Omega is held by its corrections."""
_LEAST_STEP = 0.3
"""Of a step in ln Omega: where less is made, sizes have come to their bounds."""


class Place(NamedTuple):
    """A strip of a certain ln Omega, and the ln objective at which it holds its limits, with a penalty for what it
    misses them by."""

    ratio: float
    x: Array
    cost: float


@dataclass
class Gaps:
    """What has been followed of the least cost over ln Omega, from ``low`` to ``high``, and the valleys ``waiting``
    from where no search has begun."""

    task: Task
    bounds: Bounds
    low: float = math.inf
    high: float = -math.inf
    waiting: list[Place] | None = None

    @property
    def box(self) -> Array:
        """The bounds of ln(b, h, l), (3, 2)."""
        return np.log([self.bounds.b, self.bounds.h, self.bounds.l])

    def next(self, best: Iterate) -> Dimensions | None:
        """The most promising strip of another gap, from where a search may find a better one; None without any."""
        ratio = log_frequency_ratio(best.memory.active.home_cycle)[0]
        near = _GAPS * math.exp(-ratio)
        if self.waiting is None:
            self.waiting = self._exchanged(best, near)
        if not self.low - near < ratio < self.high + near:
            self.low, self.high = ratio, ratio
        self.low, self.high = min(self.low, ratio), max(self.high, ratio)
        if ratio - self.low < 0.5 * near:
            self._follow(best, -1.0, ratio - near)
        if self.high - ratio < 0.5 * near:
            self._follow(best, 1.0, ratio + near)
        self.waiting = [place for place in self.waiting if place.cost < best.log_cost + _DEARER]
        if not self.waiting:
            return None
        place = min(self.waiting, key=lambda place: place.cost)
        self.waiting.remove(place)
        return dimensions_of(place.x, best.memory.active.model.scene)

    def _exchanged(self, best: Iterate, near: float) -> list[Place]:
        """The strips of the best one's b h^3 and l that are as wide and as narrow as bounds allow, if farther away in
        ln Omega than paths lead."""
        active, (low, high), out = best.memory.active, self.box.T, []
        for thicker in (
            max(low[1] - best.x[1], (best.x[0] - high[0]) / 3.0),
            min(high[1] - best.x[1], (best.x[0] - low[0]) / 3.0),
        ):
            if abs(thicker) > near:
                x = best.x + thicker * np.array([-3.0, 1.0, 0.0])
                place = self._held(best, active, x)
                out += [] if place is None else [place]
        return out

    def _held(self, best: Iterate, active: FullRows, x: Array) -> Place | None:
        """The least cost at the ln Omega of a strip, by its corrections at some strip's peaks; None if it buckles."""
        plain, values = active.plain_values(x), active.corrected_values(x)
        if rows.BUCKLED in (plain[rows.UTILISATION], values[rows.UTILISATION]):
            return None
        strip = active.model.strip(dimensions_of(x, active.model.scene), corrected=False)
        least = self._at_ratio(best, active)
        ratio = log_frequency_ratio(strip.cycle)[0]
        return None if least is None else Place(ratio, *least(values, active.plain_slopes(x), x, 0.0, _NEAREST))

    def _follow(self, best: Iterate, side: float, until: float) -> None:
        """Follow the least cost from the best strip on, up (``side`` 1) or down, and note its valleys."""
        path, end = self._path(best, side, until)
        costs = np.array([best.log_cost] + [place.cost for place in path] + [math.inf])
        for n, place in enumerate(path, start=1):
            parted = float(np.max(costs[: n + 1])) > max(costs[0], place.cost)
            better = place.cost < costs[0] - self.task.enough
            least = place.cost <= min(costs[n - 1], costs[n + 1]) and place.cost < best.log_cost + _DEARER
            if least and (parted or better):
                beside = [0.5 * (place.x + other.x) for other in path[max(n - 2, 0) : n + 1]]
                tried = [self._closer(best, place, x) for x in beside]
                self.waiting.append(min(tried, key=lambda one: one.cost))
        self.low, self.high = (self.low, end) if side > 0.0 else (end, self.high)

    def _path(self, best: Iterate, side: float, until: float) -> tuple[list[Place], float]:
        """The cheapest strips of rising or falling ln Omega that have not been looked at, and how far it leads: to
        infinity where no strip is left."""
        active, x, out = best.memory.active, best.x, []
        ratio, ended = log_frequency_ratio(active.home_cycle)[0], side * math.inf
        step, least = side * math.exp(-ratio) / _STEPS, self._at_ratio(best, active)
        if least is None:
            return out, ended
        (plain, added), slopes_of = active.taken_apart(x), active.plain_slopes
        if least(plain + added, slopes_of(x), x, 0.0, _NEAREST)[1] < best.log_cost - _UNSTEADY:
            slopes_of = active.slopes_at_ratio
        slopes = slopes_of(x)
        while side * (until - ratio) > 0.0:
            x, before = least(plain + added, slopes, x, step, _PACE * abs(step))[0], ratio
            strip = active.model.strip(dimensions_of(x, active.model.scene), corrected=False)
            ratio = log_frequency_ratio(strip.cycle)[0]
            if side * (ratio - before) < _LEAST_STEP * abs(step) or np.max(np.abs(x - best.x)) > _FARTHEST:
                return out, ended
            plain, slopes = active.plain_values(x), slopes_of(x)
            if self.low < ratio < self.high:
                continue
            values = active.corrected_values(x)
            if rows.BUCKLED in (plain[rows.UTILISATION], values[rows.UTILISATION]):
                return out, ended
            out.append(Place(ratio, *least(values, slopes, x, 0.0, _NEAREST)))
            if len(out) >= _STEPS and min(place.cost for place in out[-_STEPS:]) > best.log_cost + _LOST:
                return out, ended
        return out, ratio

    def _closer(self, best: Iterate, place: Place, near: Array) -> Place:
        """A place in a valley by a strip's own peaks and corrections, there or half-way to the next on the path."""
        before = best.memory.active
        d = dimensions_of(near, before.model.scene)
        x = logarithms(d)
        if rows.BUCKLED in (before.plain_values(x)[rows.UTILISATION], before.corrected_values(x)[rows.UTILISATION]):
            return place
        active = before.model.following(before.model.peaks(d).joined(before.peaks), d)
        least = self._at_ratio(best, active)
        return Place(place.ratio, *least(active.corrected_values(x), active.plain_slopes(x), x, 0.0, _NEAREST))

    def _at_ratio(self, best: Iterate, active: FullRows) -> AtRatio | None:
        """The linear programme for rows, with the limits as the best strip's exact check shifts them."""
        p = program(self.task.objective, best.limits, active.layout, self.task.guard)
        return AtRatio.of(p, self.box, log_frequency_ratio(active.home_cycle)[1])
