"""One cycle, sampled finely enough for everything asked of it, and the greatest values of gauges over it.

All gauges are sampled at the same angles and climbed in the same batches (``solvers.numerics.brackets``), so that one
evaluation of the cycle serves them all. A cycle that is nothing but a beam-column under its load has a turn of its own,
compiled (``solvers.rod.cycle.plain_extremes``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.numerics import brackets, periodic
from solvers.numerics.jit import kernel
from solvers.rod.cycle.composition import Array, Cycle, Instants
from solvers.rod.cycle.quantities import CURVATURE, DEFLECTION, TANGENT, Gauges

RESOLVED = 1e-2
"""What the samples foretell of their midpoints, relative to the greatest magnitude."""


class Turn(Protocol):
    """A cycle over one turn; ``tolerance`` is the relative one its extremes are wanted to."""

    @property
    def cycle(self) -> Cycle: ...

    @property
    def tolerance(self) -> float: ...

    @property
    def instants(self) -> Instants:
        """The cycle at angles that resolve it."""

    def sampled(self, gauges: Gauges) -> tuple[Array, Array, Array, Array]:
        """Greatest and least value of every gauge at the sampled angles, and those that parabolas foretell.

        Where a gauge is greatest close to a dead centre, at which the strip is straight, the samples do not tell how it
        goes along the strip; the parabolas do. At a corner it is the other way about.
        """

    def greatest(self, gauges: Gauges, relative: float, floor: float) -> tuple[Array, Array]:
        """Greatest value of every gauge over the continuous turn, and its error.

        Wanted to ``relative`` times the value's magnitude, but never finer than ``floor`` times that of the gauge.
        """

    def extremes(self, gauges: Gauges, relative: float) -> tuple[Array, Array, Array, Array]:
        """Greatest and least value of every gauge over the continuous turn, and their errors.

        Wanted to ``relative`` times the gauge's greatest magnitude.
        """

    def crossings(self, gauges: Gauges) -> Array:
        """Angles [rad] at which a gauge changes its sign between two sampled angles."""


def resolving(cycle: Cycle, guide: periodic.Periodic) -> Array:
    """Angles that resolve a cycle's axial force, clamp moment and side force, which ``guide`` gives: (3, angles)."""
    sharp = cycle.scene.load.sharp_angles()
    return periodic.resolve_from(guide, RESOLVED, sharp) if sharp.size else periodic.resolve(guide, RESOLVED)


@dataclass(frozen=True)
class ComposedTurn:
    """A turn of any cycle, whatever it is composed of."""

    cycle: Cycle
    tolerance: float

    @cached_property
    def instants(self) -> Instants:
        def guide(angle: Array) -> Array:
            now = self.cycle.at(angle)
            return np.array([now.force, now.shape.clamp_moment(), now.shape.side_force()])

        return self.cycle.at(resolving(self.cycle, guide))

    def sampled(self, gauges: Gauges) -> tuple[Array, Array, Array, Array]:
        return _ranges(self.instants.angle, _everywhere(self.instants, gauges))

    def greatest(self, gauges: Gauges, relative: float, floor: float) -> tuple[Array, Array]:
        samples, angle = _everywhere(self.instants, gauges), self.instants.angle
        wanted = relative * np.maximum(np.abs(samples.max(axis=1)), floor * np.abs(samples).max(axis=1))
        owner, at = brackets.humps(samples, RESOLVED, closed=True)
        count = angle.size
        before = angle[at - 1] - np.where(at == 0, periodic.TURN, 0.0)
        after = angle[(at + 1) % count] + np.where(at == count - 1, periodic.TURN, 0.0)
        places = np.stack([before, angle[at], after], axis=1)
        values = np.stack([samples[owner, (at + shift) % count] for shift in (-1, 0, 1)], axis=1)

        def evaluate(angle: Array, todo: NDArray[np.intp]) -> Array:
            mine = owner[todo]
            part = Gauges(gauges.weights[mine], gauges.stations[mine])
            return _along(self.cycle.at(angle.ravel()), part, angle.shape)

        found = brackets.climb(evaluate, places, values, wanted[owner])
        best, error = np.full(samples.shape[0], -np.inf), np.zeros(samples.shape[0])
        np.maximum.at(best, owner, found.value)
        # A lower hump matters as far as its own error lets it reach above the highest.
        np.maximum.at(error, owner, found.value + found.error - best[owner])
        return best, np.maximum(error, 0.0)

    def extremes(self, gauges: Gauges, relative: float) -> tuple[Array, Array, Array, Array]:
        both = Gauges(np.concatenate([gauges.weights, -gauges.weights]), np.tile(gauges.stations, 2))
        (high, low), (high_error, low_error) = (x.reshape(2, -1) for x in self.greatest(both, relative, 1.0))
        return high, -low, high_error, low_error

    def crossings(self, gauges: Gauges) -> Array:
        samples = _everywhere(self.instants, gauges)
        return periodic.crossings(lambda angle: _everywhere(self.cycle.at(angle), gauges), self.instants.angle, samples)


@kernel
def _ranges(angle: Array, samples: Array) -> tuple[Array, Array, Array, Array]:
    """As ``Turn.sampled``, of samples of the shape (gauges, angles)."""
    found = np.empty((4, samples.shape[0]))
    for row in range(samples.shape[0]):
        found[1, row], found[0, row] = periodic.sampled_range(samples[row])
        found[3, row], found[2, row] = periodic.foretold_range(angle, samples[row])
    return found[0], found[1], found[2], found[3]


def _everywhere(now: Instants, gauges: Gauges) -> Array:
    """Every gauge at every instant, shape (gauges, instants)."""
    distinct, index = np.unique(gauges.stations, return_inverse=True)
    w = gauges.weights
    out = w[:, :3] @ np.array([now.force, now.shape.side_force(), now.shape.clamp_moment()])
    for column, field in _fields(now):
        if w[:, column].any():
            out += w[:, column, None] * field(distinct)[index]
    return out


def _along(now: Instants, gauges: Gauges, shape: tuple[int, ...]) -> Array:
    """Every gauge at angles of its own: ``now`` holds them one gauge after the other, ``shape`` is (gauges, angles)."""
    distinct, index = np.unique(gauges.stations, return_inverse=True)
    row, w = np.arange(shape[0]), gauges.weights
    guide = (now.force, now.shape.side_force(), now.shape.clamp_moment())
    out = sum(w[:, column, None] * part.reshape(shape) for column, part in enumerate(guide))
    for column, field in _fields(now):
        if w[:, column].any():
            out += w[:, column, None] * field(distinct).reshape(distinct.size, *shape)[index, row]
    return out


def _fields(now: Instants) -> tuple[tuple[int, Callable[[Array], Array]], ...]:
    """The columns that depend on the section, and what gives them at (sections, instants)."""
    return (TANGENT, now.shape.axial_force), (CURVATURE, now.shape.curvature), (DEFLECTION, now.shape.deflection)
