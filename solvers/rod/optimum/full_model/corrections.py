"""Contribution of the corrections to a strip's rows, as a polynomial from finite differences.

The strip's inertia and large displacements cost far more than the rest of the physics. Their contribution to every row
is expanded about the centre of a stencil in y = U (x - centre), x = ln(b, h, l), with orthonormal directions U (rows):

    c(x) = c(centre) + slopes . y + y' curvatures y/2

Near a resonance the contribution depends mainly on the frequency ratio Omega (``frequency_ratio``). Therefore y_0 is
the direction of the gradient of ln Omega, and mixed curvatures are small. If some sizes are discrete, the first
directions span the continuous sizes, and strips off these directions are solved only when required. A stencil covers
all strips close to its centre: the polynomial is shifted to agree with the solved strip in question. All strips of a
stencil are solved with the discretisation of its centre.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array, Index
from solvers.rod.cycle.composition import Cycle
from solvers.rod.optimum.full_model.frequency_ratio import is_stable, log_frequency_ratio_gradient
from solvers.rod.optimum.full_model.strip import FullStrip, dimensions_of, logarithms
from solvers.rod.scene import Dimensions

_CENTRE = (0.0, 0.0, 0.0)
CorrectionsOf = Callable[[FullStrip], Array]
"""Function that returns the contribution of a strip's corrections to its rows, (rows,)."""
_ROUNDING = 1e-13
"""Coordinates y below this are rounding errors and are set to zero."""
Pairs = tuple[tuple[int, int], ...]
ALL_CURVATURES: Pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
RATIO_CURVATURE: Pairs = ((0, 0),)
"""Pairs of directions with a curvature term: all, and only that along the gradient of ln Omega."""


@dataclass(frozen=True)
class Stencil:
    """Finite-difference stencil: a strip and its neighbours at distance ``step`` along ``directions`` (3, 3) in ln b,
    ln h, ln l, solved on first use and stored in ``solved`` by y, with the discretisation of the centre.

    ``curvature_pairs`` are the pairs of directions with a curvature term; ``free`` are the indices of directions that
    change only continuous sizes.
    """

    centre: FullStrip
    step: float
    directions: Array
    curvature_pairs: Pairs
    free: tuple[int, ...]
    watch: Callable[[], None]
    solved: dict[tuple[float, ...], FullStrip] = field(default_factory=dict)

    @staticmethod
    def around(
        centre: FullStrip, step: float, curvature_pairs: Pairs, free: tuple[int, ...], watch: Callable[[], None]
    ) -> Stencil:
        """The stencil of a solved strip, if the sizes of indices ``free`` are continuous; ``watch`` is called before
        other strips are solved."""
        directions = _directions_by_frequency(centre.cycle, free)
        return Stencil(centre, step, directions, curvature_pairs, tuple(range(len(free))), watch)

    def covers(self, d: Dimensions) -> bool:
        """Whether the polynomial is valid near a strip."""
        return float(np.max(np.abs(logarithms(d) - self.origin))) <= self.step

    @property
    def origin(self) -> Array:
        """ln(b, h, l) of the centre."""
        return logarithms(self.centre.dimensions)

    def coordinates(self, x: Array) -> Array:
        """y of x = ln(b, h, l)."""
        y = self.directions @ (x - self.origin)
        return np.where(np.abs(y) > _ROUNDING, y, 0.0)

    def solve(self, y: tuple[float, ...]) -> None:
        """Ensure that the strip at y is in ``solved``, together with the strips that will be required next."""
        if y not in self.solved:
            nonzero = np.flatnonzero(y)
            points = [y] if not nonzero.size else [y, *self._companions(np.isin(nonzero, self.free).all())]
            self._solve([point for point in dict.fromkeys(points) if point not in self.solved])

    def _solve(self, points: list[tuple[float, ...]]) -> None:
        """Solve strips; those that do not buckle are solved simultaneously."""
        self.watch()
        cycles = {point: self._cycle(point) for point in points}
        stable = [point for point, cycle in cycles.items() if point != _CENTRE and is_stable(cycle)]
        neighbours = self.centre.cycle.neighbours([cycles[point].dimensions for point in stable])
        cycles.update((point, own) for point, own in zip(stable, neighbours, strict=True) if own is not None)
        for point, cycle in cycles.items():
            self.solved[point] = FullStrip(cycle)

    def _cycle(self, y: tuple[float, ...]) -> Cycle:
        """The cycle of the strip at y, without a discretisation."""
        centre = self.centre.cycle
        return centre if y == _CENTRE else replace(centre, dimensions=self._dimensions(y), prepared=None)

    def _companions(self, free: bool) -> list[tuple[float, ...]]:
        """Points required together: those of all slopes and curvatures, in the ``free`` directions or in all."""
        offsets, indices = self.step * np.eye(3), self.free if free else range(3)
        points = [offsets[v] for v in indices]
        pairs = [(v, w) for v, w in self.curvature_pairs if v in indices and w in indices]
        points += [-offsets[v] if v == w else offsets[v] + offsets[w] for v, w in pairs]
        return [point for point in (tuple(y.tolist()) for y in points) if not self.exceeds_rod(point)]

    def exceeds_rod(self, y: tuple[float, ...]) -> bool:
        """Whether the strip at y would be longer than the rod."""
        return (self.origin + np.array(y) @ self.directions)[2] > math.log(self.centre.cycle.scene.mechanism.rod_length)

    def _dimensions(self, y: tuple[float, ...]) -> Dimensions:
        return dimensions_of(self.origin + np.array(y) @ self.directions, self.centre.cycle.scene)


@dataclass(frozen=True)
class CorrectionPolynomial:
    """Contribution of the corrections to the rows of strips near ``base``, (rows,), as returned by ``corrections_of``;
    at ``base`` it is ``at_base``."""

    stencil: Stencil
    corrections_of: CorrectionsOf
    base: FullStrip
    at_base: Array
    _slopes: dict[int, Array] = field(default_factory=dict)
    _values: dict[tuple[float, ...], Array] = field(default_factory=dict)
    _curvatures: dict[tuple[int, int], Array] = field(default_factory=dict)

    @staticmethod
    def near(base: FullStrip, stencil: Stencil, corrections_of: CorrectionsOf) -> CorrectionPolynomial:
        """The polynomial near a strip that was solved with its corrections."""
        return CorrectionPolynomial(stencil, corrections_of, base, corrections_of(base))

    def at(self, x: Array) -> Array:
        """Value at x = ln(b, h, l): the polynomial, shifted to agree with the solution at ``base``."""
        s = self.stencil
        y_base, y = s.coordinates(logarithms(self.base.dimensions)), s.coordinates(x)
        out = self.at_base.copy()
        for k in np.flatnonzero(y - y_base).tolist():
            out += (y[k] - y_base[k]) * self._slope(k)
        for v, w in s.curvature_pairs:
            change = y[v] * y[w] - y_base[v] * y_base[w]
            if change != 0.0:
                out += (0.5 if v == w else 1.0) * change * self._curvature(v, w)
        return out

    def slopes(self, x: Array, free: Index) -> Array:
        """Derivatives with respect to ln b, ln h, ln l, (rows, 3); only those of sizes of indices ``free`` are
        complete."""
        s, out = self.stencil, np.zeros((self.at_base.size, 3))
        y = s.coordinates(x)
        for k in np.flatnonzero(np.any(np.abs(s.directions[:, free]) > _ROUNDING, axis=1)).tolist():
            slope = self._slope(k).copy()
            for v, w in s.curvature_pairs:
                factor = y[w] * (v == k) + y[v] * (w == k and v != w)
                if factor != 0.0:
                    slope += factor * self._curvature(v, w)
            out += np.outer(slope, s.directions[k])
        return out

    @cached_property
    def jacobian_at_ratio(self) -> Array:
        """Derivatives with respect to ln(b, h, l) at the centre, projected onto constant frequency ratio, (rows, 3)."""
        slopes = self.slopes(self.stencil.origin, np.arange(3))
        steepest = log_frequency_ratio_gradient(self.stencil.centre.cycle)
        return slopes - np.outer(slopes @ steepest, steepest) / (steepest @ steepest)

    def _slope(self, k: int) -> Array:
        """Derivative with respect to y_k at the centre; one-sided at the maximum length."""
        if k not in self._slopes:
            ahead, behind = self._offset(k, 1.0), self._offset(k, -1.0)
            outside = self.stencil.exceeds_rod(ahead), self.stencil.exceeds_rod(behind)
            if (k, k) in self.stencil.curvature_pairs and not any(outside):
                slope = 0.5 * (self._value(ahead) - self._value(behind))
            else:
                side = -1.0 if outside[0] else 1.0
                slope = side * (self._value(behind if outside[0] else ahead) - self._value(_CENTRE))
            self._slopes[k] = slope / self.stencil.step
        return self._slopes[k]

    def _curvature(self, v: int, w: int) -> Array:
        """Second derivative with respect to y_v and y_w at the centre; zero at the maximum length."""
        if (v, w) not in self._curvatures:
            first, second = self._offset(v, 1.0), self._offset(w, -1.0 if v == w else 1.0)
            opposite = _CENTRE if v == w else tuple(np.add(first, second).tolist())
            if any(self.stencil.exceeds_rod(y) for y in (first, second, opposite)):
                curvature = np.zeros_like(self.at_base)
            else:
                curvature = self._value(opposite) + self._value(_CENTRE) - self._value(first) - self._value(second)
            self._curvatures[v, w] = (-curvature if v == w else curvature) / self.stencil.step**2
        return self._curvatures[v, w]

    def _offset(self, k: int, side: float) -> tuple[float, ...]:
        return tuple((side * self.stencil.step * np.eye(3)[k]).tolist())

    def _value(self, y: tuple[float, ...]) -> Array:
        if y not in self._values:
            self.stencil.solve(y)
            self._values[y] = self.corrections_of(self.stencil.solved[y])
        return self._values[y]


def _directions_by_frequency(cycle: Cycle, free: tuple[int, ...]) -> Array:
    """Orthonormal directions (rows): first those of the sizes of indices ``free``, and of these first the gradient of
    ln Omega."""
    axes = np.eye(3)[list(free or range(3))]
    steepest = axes.T @ (axes @ log_frequency_ratio_gradient(cycle))
    first = steepest / np.linalg.norm(steepest)
    others = axes if len(axes) > 1 else np.eye(3)
    orthogonal = others - np.outer(others @ first, first)
    lengths = np.linalg.norm(orthogonal, axis=1)
    second = orthogonal[np.argmax(lengths)] / np.max(lengths)
    return np.array([first, second, np.cross(first, second)])
