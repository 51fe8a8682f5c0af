"""Cumulative deflection coefficients of half a bar, at positions given as fractions t of the half."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.pieces import piece_at
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES, Stations


@dataclass(frozen=True)
class Sums:
    """Integrals of the deflection coefficients (bending and shear, over the limit) from the end to any position.

    Within each panel the coefficients are their interpolating polynomials: exact for Macaulay loads.
    """

    stations: Stations
    bending: Array
    shear: Array

    @cached_property
    def _series(self) -> tuple[Array, Array, Array, Array]:
        """Left ends and widths of the panels; Legendre series (panels, 2, NODES + 1) of densities and integrals."""
        s, legendre = self.stations, np.polynomial.legendre
        left, wide = (s.left - s.left[0]) / s.span, (s.right - s.left) / s.span
        values = np.stack([self.bending.reshape(-1, NODES), self.shear.reshape(-1, NODES)], axis=1)
        series = values @ np.linalg.inv(legendre.legvander(NODE_PLACES, NODES - 1)).T
        sums = legendre.legint(series, lbnd=-1.0, axis=2) * (0.5 * wide)[:, None, None]
        sums[1:, :, 0] += np.cumsum(sums.sum(axis=2), axis=0)[:-1]
        padded = np.concatenate([series, np.zeros((left.size, 2, 1))], axis=2)
        return left, wide, np.ascontiguousarray(padded), np.ascontiguousarray(sums)

    def integrals(self, t: Array) -> Array:
        """Return both integrals from 0 to positions t, shape (2, n)."""
        left, wide, _, sums = self._series
        return _evaluate(left, wide, sums, t)

    def density(self, t: Array) -> Array:
        """Return both densities at positions t, shape (2, n)."""
        left, wide, series, _ = self._series
        return _evaluate(left, wide, series, t)


@kernel
def _evaluate(left: Array, wide: Array, series: Array, t: Array) -> Array:
    """Evaluate panelwise Legendre series at positions by Clenshaw's recurrence."""
    found, panel = np.empty((2, t.size)), 0
    for i in range(t.size):
        panel = piece_at(left, t[i], panel)
        x = min(max((t[i] - left[panel]) / wide[panel], 0.0), 1.0) * 2.0 - 1.0
        for kind in range(2):
            c, one, two = series[panel, kind], 0.0, 0.0
            for n in range(c.size - 1, 0, -1):
                one, two = c[n] + (2.0 * n + 1.0) / (n + 1.0) * x * one - (n + 1.0) / (n + 2.0) * two, one
            found[kind, i] = c[0] + x * one - 0.5 * two
    return found
