"""Where damped resonances part strips from others that may be better: the gaps between them on both sides.

The strip's first mode is at a resonance wherever a harmonic of the speed meets the mean over the turn of its natural
frequency, close to whole Omega = omega_1/omega under the mean axial force. A strip on the way from one gap to the next
is dearer by what rings, and damping rounds what is between: a share of about the loss factor of Omega. So optima close
to a strip lie in other gaps.

The least cost of strips of a given Omega is followed over gaps, in steps that resolve them. The path is that of strips
whose limits corrections add as much to as where it begins; of each strip on it corrections are solved, and the cost of
holding the limits at the same Omega is that of a linear programme (``at_ratio``). That cost is rough, and there may be
several valleys in a gap: so every place on the path is a start of a search, the cheapest first, away from where
searches have begun or ended. Along a ridge of nearly equal cost strips of the same Omega may be far from each other: an
end about as good as the best, but elsewhere, has a path of its own.

Width and thickness may be exchanged for each other, b h^3 alike, and the core's forces, deflections and stability stay
as they are: the least cost may hardly change over dozens of gaps. The strips at the two ends of that exchange, within
the bounds, are places to start from, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from solvers.rod import rows
from solvers.rod.optimum.full_model.corrections import frequency_slopes, log_frequency_ratio
from solvers.rod.optimum.full_model.model import Array, FullRows
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.optimum.search.at_ratio import PENALTY, AtRatio
from solvers.rod.optimum.search.local_search import Iterate, Task
from solvers.rod.optimum.sqp import program
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

APART = 0.2
"""In Omega: nearer to where a search has begun or ended no other begins, where sizes may be chosen at will."""
_GAPS, _STEPS = 2, 6
"""So many gaps are followed to each side, in so many steps each."""
_FARTHEST, _NEAREST = 0.2, 0.05
"""In ln b, ln h, ln l: of a path, and of the strip that holds its limits from the one on the path."""
_BESIDE = 0.03
"""In ln b, ln h, ln l: farther away from each other strips of the same Omega are others, and have a path each."""
_PACE = 2.0
"""In ln b, ln h, ln l: what a strip moves aside for a unit of change of ln Omega, at most."""
_DEARER, _LOST = 0.008, 0.1
"""In ln objective: places dearer than the best strip by more are no starts; a path is not followed where a whole gap
is dearer by more."""
_UNSTEADY = 2e-3
"""In ln objective: a strip that plain slopes promise to better by more at its own Omega is held by its corrections."""
_LEAST_STEP = 0.3
"""Of a step in ln Omega: where less is made, sizes have come to their bounds."""


class Place(NamedTuple):
    """A strip x on the path at Omega = ``ratio``, the one ``held`` within its limits there, to first order, and the ln
    objective of that one, with a penalty for what it misses them by."""

    ratio: float
    x: Array
    held: Array
    cost: float


@dataclass
class Gaps:
    """Places of strips where no search has begun, the Omega ``known`` as beginnings and ends of searches, and
    those at which the least cost has been ``followed``, with the strips there, on the paths through all ``origins``.

    No start lies closer than ``apart`` to a known Omega.
    """

    task: Task
    bounds: Bounds
    apart: float = APART
    places: list[Place] = field(default_factory=list)
    known: list[float] = field(default_factory=list)
    followed: list[tuple[float, Array]] = field(default_factory=list)
    origins: list[Iterate] = field(default_factory=list)

    @property
    def box(self) -> Array:
        """The bounds of ln(b, h, l), (3, 2)."""
        return np.log([self.bounds.b, self.bounds.h, self.bounds.l])

    @property
    def range(self) -> tuple[float, float] | None:
        """The least and greatest Omega of what was followed; None if nothing was."""
        looked = [*self.known, *(ratio for ratio, _ in self.followed)]
        return (min(looked), max(looked)) if looked else None

    def next(self, best: Iterate, untried: Callable[[Dimensions], bool]) -> Dimensions | None:
        """The most promising strip of another gap, from where a search may find a better one; None without any."""
        active = best.memory.active
        if all(best is not origin for origin in self.origins):
            ratio, first = self.leave_out(best), not self.origins
            self._follow(best)
            self.places += self._exchanged(best, _GAPS * math.exp(-ratio)) if first else []
        self.places = [p for p in self.places if self._away(p.ratio)]
        while promising := [p for p in self.places if p.cost < best.log_cost + _DEARER]:
            place = min(promising, key=lambda place: place.cost)
            self.places.remove(place)
            for x in self._starts(best, place):
                d = dimensions_of(x, active.model.scene)
                if untried(d):
                    self.known.append(place.ratio)
                    return d
        return None

    def follow(self, strip: Iterate) -> None:
        """The places on the path through a strip that is about as good as the best, but elsewhere."""
        if all(np.max(np.abs(strip.x - origin.x)) > _BESIDE for origin in self.origins):
            self._follow(strip)

    def leave_out(self, end: Iterate) -> float:
        """No search begins close to the end of one; the ln Omega there."""
        ratio = log_frequency_ratio(end.memory.active.home_cycle)
        self.known.append(math.exp(ratio))
        return ratio

    def _follow(self, strip: Iterate) -> None:
        self.origins.append(strip)
        self.places += [*self._path(strip, -1.0), *self._path(strip, 1.0)]

    def _starts(self, best: Iterate, place: Place) -> list[Array]:
        """The strip of a place on the path, that which holds its limits, and that by its own peaks and corrections,
        the best first."""
        before = best.memory.active
        d = dimensions_of(place.x, before.model.scene)
        active = before.model.rows_near(before.model.peaks(d).merged_with(before.peaks), d)
        p = program(self.task.objective, best.limits, active.layout, self.task.guard)
        x = logarithms(d)
        held = self._at_ratio(best, active)(active.corrected_values(x), active.plain_slopes(x), x, 0.0, _NEAREST)[0]

        def merit(x: Array) -> float:
            values = active.corrected_values(x)
            return p.cost(values) + PENALTY * max(p.violation(values), 0.0)

        return sorted((place.x, place.held, held), key=merit)

    def _away(self, ratio: float) -> bool:
        """Whether no search has begun or ended near an Omega."""
        return all(abs(ratio - known) > self.apart for known in self.known)

    def _new(self, ratio: float, x: Array) -> bool:
        """Whether the cost of strips near x at an Omega is unknown, and asked for."""
        near = (known for known, other in self.followed if np.max(np.abs(x - other)) < _BESIDE)
        return self._away(ratio) and all(abs(ratio - known) > 0.5 / _STEPS for known in near)

    def _path(self, best: Iterate, side: float) -> list[Place]:
        """The cheapest strips of rising (``side`` 1) or falling Omega where it has not been followed."""
        active, x, out = best.memory.active, best.x, []
        ratio = log_frequency_ratio(active.home_cycle)
        until, step = ratio + side * _GAPS * math.exp(-ratio), side * math.exp(-ratio) / _STEPS
        least = self._at_ratio(best, active)
        if least is None:
            return out
        (plain, added), slopes_of = active.taken_apart(x), active.plain_slopes
        if least(plain + added, slopes_of(x), x, 0.0, _NEAREST)[1] < best.log_cost - _UNSTEADY:
            slopes_of = active.slopes_at_ratio
        slopes = slopes_of(x)
        while side * (until - ratio) > 0.0:
            x, before = least(plain + added, slopes, x, step, _PACE * abs(step))[0], ratio
            strip = active.model.strip(dimensions_of(x, active.model.scene), corrected=False)
            ratio = log_frequency_ratio(strip.cycle)
            if side * (ratio - before) < _LEAST_STEP * abs(step) or np.max(np.abs(x - best.x)) > _FARTHEST:
                return out
            plain, slopes = active.plain_values(x), slopes_of(x)
            if not self._new(math.exp(ratio), x):
                continue
            self.followed.append((math.exp(ratio), x))
            place = _held(active, least, x, ratio, slopes)
            if place is None:
                return out
            out.append(place)
            if len(out) >= _STEPS and min(place.cost for place in out[-_STEPS:]) > best.log_cost + _LOST:
                return out
        return out

    def _exchanged(self, best: Iterate, near: float) -> list[Place]:
        """The strips of the best one's b h^3 and l that are as wide and as narrow as bounds allow, if farther away in
        ln Omega than paths lead."""
        active, (low, high), out = best.memory.active, self.box.T, []
        least = self._at_ratio(best, active)
        if least is None:
            return out
        for thicker in (
            max(low[1] - best.x[1], (best.x[0] - high[0]) / 3.0),
            min(high[1] - best.x[1], (best.x[0] - low[0]) / 3.0),
        ):
            if abs(thicker) > near:
                x = best.x + thicker * np.array([-3.0, 1.0, 0.0])
                strip = active.model.strip(dimensions_of(x, active.model.scene), corrected=False)
                place = _held(active, least, x, log_frequency_ratio(strip.cycle), active.plain_slopes(x))
                out += [] if place is None else [place]
        return out

    def _at_ratio(self, best: Iterate, active: FullRows) -> AtRatio | None:
        """The linear programme for rows, with the limits as the best strip's exact check shifts them."""
        p = program(self.task.objective, best.limits, active.layout, self.task.guard)
        return AtRatio.of(p, self.box, frequency_slopes(active.home_cycle))


def _held(active: FullRows, least: AtRatio, x: Array, ratio: float, slopes: Array) -> Place | None:
    """The place of a strip of that ln Omega, by its corrections at some strip's peaks; None if it buckles."""
    values = active.corrected_values(x)
    if rows.BUCKLED in (active.plain_values(x)[rows.UTILISATION], values[rows.UTILISATION]):
        return None
    return Place(math.exp(ratio), x, *least(values, slopes, x, 0.0, _NEAREST))
