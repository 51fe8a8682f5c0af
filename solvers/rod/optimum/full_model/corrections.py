"""What corrections add to a strip's results, as a function of the strip: a polynomial through solved strips.

The strip's inertia and large displacements cost far more than the rest of the physics. What they add to every row is
expanded about the centre of a stencil, in y = U (x - centre), x = ln(b, h, l), with orthonormal directions U:

    added(x) = added(centre) + slopes . y + y' curvatures y/2

Near a resonance it is the frequency ratio Omega = omega_1/omega that matters, so y_0 is the direction in which ln Omega
changes, and curvatures mixed with the others are small. Where nothing rings, and where a first admissible strip is
looked for, no curvature is needed, and all differences are to one side, along the axes. Where sizes come in steps, the
first directions are of those that may be chosen at will, and strips aside of them are solved only if they are asked
for. A stencil serves all strips close to its centre: at the one in question the polynomial is shifted to what was
solved there. All its strips have the centre's resolution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.rod.cycle.composition import Cycle
from solvers.rod.optimum.full_model.strip import FullStrip, dimensions_of, logarithms
from solvers.rod.scene import Dimensions
from solvers.rod.vibration.natural_frequencies import natural_frequency

Array = NDArray[np.float64]

_FREQUENCY_STEP = 1e-4
"""Of differences of ln Omega, in ln b, ln h, ln l."""
_MEAN = 2.0 * math.pi * np.arange(128) / 128
"""Angles of the mean axial force."""
_CENTRE = (0.0, 0.0, 0.0)
AddedTo = Callable[[FullStrip], Array]
"""What a strip's corrections add to its rows, (rows,)."""
_ROUNDING = 1e-13
"""Of places y: what is less is nought, for the directions that a strip has not been moved in."""
Pairs = tuple[tuple[int, int], ...]
FLAT: Pairs = ()
CURVED: Pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
CURVED_ACROSS: Pairs = ((0, 0),)
"""Pairs of directions whose curvatures are looked at: none, all, and that across resonances."""


@dataclass(frozen=True)
class Stencil:
    """A strip and those ``step`` away from it in some ``directions`` (3, 3) of ln b, ln h, ln l, solved on first use
    and kept; ``bends`` are the pairs of directions whose curvatures are looked at. Of the directions those of indices
    in ``free`` are of sizes that may be chosen at will. Strips were ``solved``, by y, at the resolution that the centre
    asked for."""

    centre: FullStrip
    step: float
    directions: Array
    bends: Pairs
    free: tuple[int, ...]
    watch: Callable[[], None]
    solved: dict[tuple[float, ...], FullStrip] = field(default_factory=dict)

    @staticmethod
    def around(
        centre: FullStrip, step: float, bends: Pairs, free: tuple[int, ...], watch: Callable[[], None]
    ) -> Stencil:
        """The stencil of a strip, which has been solved, where sizes of indices ``free`` may be chosen at will;
        ``watch`` is called before others are solved."""
        if not bends:
            return Stencil(centre, step, np.eye(3), bends, free, watch)
        return Stencil(centre, step, _frequency_first(centre.cycle, free), bends, tuple(range(len(free))), watch)

    def serves(self, d: Dimensions) -> bool:
        """Whether the polynomial holds near a strip."""
        apart = float(np.max(np.abs(logarithms(d) - self.origin)))
        return apart <= (self.step if self.bends else 0.0)

    @property
    def origin(self) -> Array:
        """ln(b, h, l) of the centre."""
        return logarithms(self.centre.dimensions)

    def place(self, x: Array) -> Array:
        """y of ln(b, h, l)."""
        y = self.directions @ (x - self.origin)
        return np.where(np.abs(y) > _ROUNDING, y, 0.0)

    def solve(self, y: tuple[float, ...]) -> None:
        """Have the strip at y among those ``solved``, and with it those that will be asked for, too."""
        if y not in self.solved:
            aside = np.flatnonzero(y)
            places = [y] if not aside.size else [y, *self._together(np.isin(aside, self.free).all())]
            self._solve([place for place in dict.fromkeys(places) if place not in self.solved])

    def _solve(self, places: list[tuple[float, ...]]) -> None:
        """Solve strips, all those that do not buckle at the same time."""
        self.watch()
        cycles = {place: self._cycle(place) for place in places}
        beside = [place for place, cycle in cycles.items() if place != _CENTRE and stands(cycle)]
        together = self.centre.cycle.neighbours([cycles[place].dimensions for place in beside])
        cycles.update((place, own) for place, own in zip(beside, together, strict=True) if own is not None)
        for place, cycle in cycles.items():
            self.solved[place] = FullStrip(cycle)

    def _cycle(self, y: tuple[float, ...]) -> Cycle:
        """The strip at y, its resolution to be sought."""
        centre = self.centre.cycle
        return centre if y == _CENTRE else replace(centre, dimensions=self._dimensions(y))

    def _together(self, free: bool) -> list[tuple[float, ...]]:
        """Places of which all are asked for, if any is: those of all slopes and curvatures, in the directions of sizes
        that may be chosen at will or in all."""
        one, among = self.step * np.eye(3), self.free if free else range(3)
        places = [one[v] for v in among]
        places += [-one[v] if v == w else one[v] + one[w] for v, w in self.bends if v in among and w in among]
        return [place for place in (tuple(y.tolist()) for y in places) if not self.ends(place)]

    def ends(self, y: tuple[float, ...]) -> bool:
        """Whether a strip there would be longer than the rod."""
        return (self.origin + np.array(y) @ self.directions)[2] > math.log(self.centre.cycle.scene.mechanism.rod_length)

    def _dimensions(self, y: tuple[float, ...]) -> Dimensions:
        return dimensions_of(self.origin + np.array(y) @ self.directions, self.centre.cycle.scene)


@dataclass(frozen=True)
class Added:
    """What the corrections add to the rows of strips near ``home``, shape (rows,) at each, as ``added_to`` reads it."""

    stencil: Stencil
    added_to: AddedTo
    home: FullStrip
    at_home: Array
    _slopes: dict[int, Array] = field(default_factory=dict)
    _beside: dict[tuple[float, ...], Array] = field(default_factory=dict)
    _bends: dict[tuple[int, int], Array] = field(default_factory=dict)

    @staticmethod
    def near(home: FullStrip, stencil: Stencil, added_to: AddedTo) -> Added:
        """The polynomial near a strip that was solved with its corrections."""
        return Added(stencil, added_to, home, added_to(home))

    def at(self, x: Array) -> Array:
        """At ln(b, h, l): the polynomial, shifted to what was solved at home."""
        s = self.stencil
        old, new = s.place(logarithms(self.home.dimensions)), s.place(x)
        out = self.at_home.copy()
        for k in np.flatnonzero(new - old).tolist():
            out += (new[k] - old[k]) * self._slope(k)
        for v, w in s.bends:
            change = new[v] * new[w] - old[v] * old[w]
            if change != 0.0:
                out += (0.5 if v == w else 1.0) * change * self._bend(v, w)
        return out

    def slopes(self, x: Array, free: NDArray[np.intp]) -> Array:
        """Its derivatives by ln b, ln h, ln l, (rows, 3), of sizes of indices ``free`` if of these alone."""
        s, out = self.stencil, np.zeros((self.at_home.size, 3))
        y = s.place(x)
        for k in np.flatnonzero(np.any(np.abs(s.directions[:, free]) > _ROUNDING, axis=1)).tolist():
            slope = self._slope(k).copy()
            for v, w in s.bends:
                along = y[w] * (v == k) + y[v] * (w == k and v != w)
                if along != 0.0:
                    slope += along * self._bend(v, w)
            out += np.outer(slope, s.directions[k])
        return out

    @cached_property
    def slopes_at_ratio(self) -> Array:
        """Derivatives by ln(b, h, l) at the centre and at a constant frequency ratio, (rows, 3): nothing across it."""
        slopes = self.slopes(self.stencil.origin, np.arange(3))
        steepest = frequency_slopes(self.stencil.centre.cycle)
        return slopes - np.outer(slopes @ steepest, steepest) / (steepest @ steepest)

    def _slope(self, k: int) -> Array:
        """The derivative by y_k at the centre; to one side at the rod's end."""
        if k not in self._slopes:
            ahead, behind = self._step(k, 1.0), self._step(k, -1.0)
            ended = self.stencil.ends(ahead), self.stencil.ends(behind)
            if (k, k) in self.stencil.bends and not any(ended):
                slope = 0.5 * (self._around(ahead) - self._around(behind))
            else:
                side = -1.0 if ended[0] else 1.0
                slope = side * (self._around(behind if ended[0] else ahead) - self._around(_CENTRE))
            self._slopes[k] = slope / self.stencil.step
        return self._slopes[k]

    def _bend(self, v: int, w: int) -> Array:
        """The second derivative by y_v and y_w at the centre; zero at the rod's end."""
        if (v, w) not in self._bends:
            first, second = self._step(v, 1.0), self._step(w, -1.0 if v == w else 1.0)
            both = _CENTRE if v == w else tuple(np.add(first, second).tolist())
            if any(self.stencil.ends(y) for y in (first, second, both)):
                bend = np.zeros_like(self.at_home)
            else:
                bend = self._around(both) + self._around(_CENTRE) - self._around(first) - self._around(second)
            self._bends[v, w] = (-bend if v == w else bend) / self.stencil.step**2
        return self._bends[v, w]

    def _step(self, k: int, side: float) -> tuple[float, ...]:
        return tuple((side * self.stencil.step * np.eye(3)[k]).tolist())

    def _around(self, y: tuple[float, ...]) -> Array:
        if y not in self._beside:
            self.stencil.solve(y)
            self._beside[y] = self.added_to(self.stencil.solved[y])
        return self._beside[y]


def stands(cycle: Cycle) -> bool:
    """Whether a strip does not buckle."""
    return -float(np.min(cycle.axial_force(_MEAN))) < min(FullStrip(cycle).critical)


def log_frequency_ratio(cycle: Cycle) -> float:
    """ln(omega_1/omega) of a strip under the mean of its axial force."""
    mean = float(np.mean(cycle.axial_force(_MEAN)))
    return math.log(natural_frequency(cycle.scene, cycle.dimensions, mean) / cycle.scene.mechanism.speed)


def frequency_slopes(cycle: Cycle) -> Array:
    """The derivatives of ``log_frequency_ratio`` by ln(b, h, l) under the same mean force."""
    scene, x, mean = cycle.scene, logarithms(cycle.dimensions), float(np.mean(cycle.axial_force(_MEAN)))
    places = [x, *(x - _FREQUENCY_STEP * unit for unit in np.eye(3))]
    logs = [math.log(natural_frequency(scene, dimensions_of(place, scene), mean)) for place in places]
    return (logs[0] - np.array(logs[1:])) / _FREQUENCY_STEP


def _frequency_first(cycle: Cycle, free: tuple[int, ...]) -> Array:
    """Orthonormal directions, rows: those of sizes of indices ``free`` first, and of all these first the one in which
    the frequency ratio changes most."""
    axes = np.eye(3)[list(free or range(3))]
    steepest = axes.T @ (axes @ frequency_slopes(cycle))
    first = steepest / np.linalg.norm(steepest)
    others = axes if len(axes) > 1 else np.eye(3)
    beside = others - np.outer(others @ first, first)
    lengths = np.linalg.norm(beside, axis=1)
    second = beside[np.argmax(lengths)] / np.max(lengths)
    return np.array([first, second, np.cross(first, second)])
