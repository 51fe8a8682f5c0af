"""Interface of the step search to a pin or bushing: one half of it, positions as fractions t of its length.

u is the material of a section (the pin's u, the bushing's y); the mass is the integral of u over t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.pieces import piece_at
from solvers.pin.load.macaulay import LoadCase, breakpoints
from solvers.pin.load.piston_pin import DeflectionReference
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES, Stations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Law:
    """Flexibility law of u: kappa (-1: pin bore in a given outer diameter; 0, 1: ``solvers.pin.section.tube``), and
    Cowper's constants."""

    kappa: float
    a: float
    b: float


@dataclass(frozen=True)
class Walls:
    """The walls for given break points: u of every step, non-decreasing, the mass, and the deflection's multiplier.

    The multiplier is per relative deflection; 0: the limit is not binding, inf: only the solid section satisfies it.
    """

    levels: Array
    volume: float
    multiplier: float


class Bar(Protocol):
    """Half a bar; ``edges`` are the fractions with kinks, including 0 and 1."""

    law: Law
    edges: Array

    def least(self, t: Array) -> Array:
        """Return the running maximum of the lower bound of u from the end to increasing positions."""

    def sums(self) -> Sums | None:
        """Return the cumulative deflection coefficients; None without a limit."""

    def weigh(self, places: Array) -> Walls | None:
        """Return the lightest walls for steps that end at these positions, the last at 1; None if none is stiff
        enough."""


@dataclass(frozen=True)
class Sums:
    """The deflection coefficients, bending and shear over the limit, integrated from the end to any position.

    Between the stations they are the interpolating polynomials of each panel: exact for Macaulay loads.
    """

    stations: Stations
    bending: Array
    shear: Array

    @cached_property
    def _series(self) -> tuple[Array, Array, Array, Array]:
        """Left ends and widths of the panels as fractions; Legendre series (panels, 2, NODES + 1) of the densities and
        of their integrals."""
        s, legendre = self.stations, np.polynomial.legendre
        left, wide = (s.left - s.left[0]) / s.span, (s.right - s.left) / s.span
        values = np.stack([self.bending.reshape(-1, NODES), self.shear.reshape(-1, NODES)], axis=1)
        series = values @ np.linalg.inv(legendre.legvander(NODE_PLACES, NODES - 1)).T
        sums = legendre.legint(series, lbnd=-1.0, axis=2) * (0.5 * wide)[:, None, None]
        sums[1:, :, 0] += np.cumsum(sums.sum(axis=2), axis=0)[:-1]
        padded = np.concatenate([series, np.zeros((left.size, 2, 1))], axis=2)
        return left, wide, np.ascontiguousarray(padded), np.ascontiguousarray(sums)

    def upto(self, t: Array) -> Array:
        """Return both integrals up to positions t, shape (2, n)."""
        left, wide, _, sums = self._series
        found = np.empty((2, t.size))
        _evaluate(left, wide, sums, t, found)
        return found

    def density(self, t: Array) -> Array:
        """Return both densities at positions t, shape (2, n)."""
        left, wide, series, _ = self._series
        found = np.empty((2, t.size))
        _evaluate(left, wide, series, t, found)
        return found


@kernel
def _evaluate(left: Array, wide: Array, series: Array, t: Array, found: Array) -> None:
    """Evaluate panelwise Legendre series at positions by Clenshaw's recurrence."""
    panel = 0
    for i in range(t.size):
        panel = piece_at(left, t[i], panel)
        x = min(max((t[i] - left[panel]) / wide[panel], 0.0), 1.0) * 2.0 - 1.0
        for kind in range(2):
            c, one, two = series[panel, kind], 0.0, 0.0
            for n in range(c.size - 1, 0, -1):
                one, two = c[n] + (2.0 * n + 1.0) / (n + 1.0) * x * one - (n + 1.0) / (n + 2.0) * two, one
            found[kind, i] = c[0] + x * one - 0.5 * two


def kinks(cases: Sequence[LoadCase], length: float, reference: DeflectionReference) -> Array:
    """Return the fractions of the half with a load boundary or deflection reference of either half, including 0 and
    1."""
    places = np.array([*breakpoints(cases, length), reference.left, reference.right])
    shares = np.minimum(places, length - places) / (0.5 * length)
    return np.unique(np.clip(np.concatenate([[0.0, 1.0], shares]), 0.0, 1.0))
