"""What the search for steps needs to know of a bar, pin or bushing: one half of it, places as shares t of its length.

u stands for the material of a section (the pin's u, the bushing's y); the mass is the integral of u over t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.pin.load.macaulay import LoadCase, breakpoints
from solvers.pin.load.piston_pin import DeflectionReference
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Law:
    """How u holds: kappa (-1: the pin's bore inside a given outside; 0, 1: ``solvers.pin.section.tube``), and Cowper's
    constants."""

    kappa: float
    a: float
    b: float


@dataclass(frozen=True)
class Walls:
    """u of every step, rising, for given break points; the mass; the deflection limit's multiplier, per relative
    deflection (0: it is no limit, inf: only the solid section keeps it)."""

    levels: Array
    volume: float
    multiplier: float


class Bar(Protocol):
    """Half a bar.

    edges   shares at which something has a kink, 0 and 1 among them
    """

    law: Law
    edges: Array

    def least(self, t: Array) -> Array:
        """The greatest least u from the end up to places that rise."""

    def sums(self) -> Sums | None:
        """The deflection's two coefficients; None without a limit."""

    def weigh(self, places: Array) -> Walls | None:
        """The lightest walls for steps that end at these places, the last at 1; None where none is stiff enough."""


@dataclass(frozen=True)
class Sums:
    """The deflection's coefficients, bending and shear over the limit, summed up from the end to any place.

    Given at the stations, they go on between them as the polynomials through the nodes of each panel: exact for
    Macaulay's loads.
    """

    stations: Stations
    bending: Array
    shear: Array

    @cached_property
    def _series(self) -> tuple[Array, Array, Array, Array]:
        """Left ends and widths of the panels as shares; Legendre series of densities and of their integrals."""
        s, legendre = self.stations, np.polynomial.legendre
        left, wide = (s.left - s.left[0]) / s.span, (s.right - s.left) / s.span
        nodes = (s.x.reshape(-1, NODES)[0] - s.left[0]) / (s.right[0] - s.left[0]) * 2.0 - 1.0
        values = np.stack([self.bending.reshape(-1, NODES), self.shear.reshape(-1, NODES)])
        series = values @ np.linalg.inv(legendre.legvander(nodes, NODES - 1)).T
        sums = legendre.legint(series, lbnd=-1.0, axis=2) * (0.5 * wide)[None, :, None]
        total = np.concatenate([np.zeros((2, 1)), np.cumsum(sums.sum(axis=2), axis=1)[:, :-1]], axis=1)
        sums[:, :, 0] += total
        return left, wide, series, sums

    def _at(self, t: Array) -> tuple[NDArray[np.int64], Array]:
        left, wide = self._series[:2]
        panel = np.clip(np.searchsorted(left, t, side="right") - 1, 0, left.size - 1)
        return panel, np.clip((t - left[panel]) / wide[panel], 0.0, 1.0) * 2.0 - 1.0

    def upto(self, t: Array) -> Array:
        """Both sums up to places t, shape (2, n)."""
        panel, at = self._at(t)
        return np.sum(self._series[3][:, panel] * np.polynomial.legendre.legvander(at, NODES), axis=2)

    def density(self, t: Array) -> Array:
        """Both densities at places t, shape (2, n)."""
        panel, at = self._at(t)
        return np.sum(self._series[2][:, panel] * np.polynomial.legendre.legvander(at, NODES - 1), axis=2)


def kinks(cases: Sequence[LoadCase], length: float, reference: DeflectionReference) -> Array:
    """Shares of the half where a load of either half begins or the deflection's reference lies; 0 and 1 as well."""
    places = np.array([*breakpoints(cases, length), reference.left, reference.right])
    shares = np.minimum(places, length - places) / (0.5 * length)
    return np.unique(np.clip(np.concatenate([[0.0, 1.0], shares]), 0.0, 1.0))
