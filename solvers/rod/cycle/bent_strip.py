"""The bent strip at given crank angles, evaluable at any section."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.numerics.legendre import legendre_at
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, MOMENT, SHEAR, SIDE, SOFTENING, Strip
from solvers.rod.strip.shape import bend

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BentStrip:
    """A table of states (``state.ROWS``, angles), and the corrections to the linear strip.

    ``bent`` and ``sunk`` are Legendre series over the strip of the corrections to V'' [1/m] and V [m], (terms, angles);
    ``more_side`` and ``more_moment`` those to T [N] and M0 [N m]. ``inclined``: N is tangential to the deflected strip.
    Methods that take stations [m] return arrays of shape (stations, angles).
    """

    strip: Strip
    states: Array
    bent: Array
    sunk: Array
    more_side: Array
    more_moment: Array
    inclined: bool

    @staticmethod
    def linear(strip: Strip, states: Array) -> BentStrip:
        """The strip without corrections."""
        none, zero = np.zeros((0, states.shape[1])), np.zeros(states.shape[1])
        return BentStrip(strip, states, none, none, zero, zero, False)

    def _linear(self, stations: ArrayLike) -> tuple[Array, Array, Array]:
        """psi', V' and V of the linear strip."""
        z = np.atleast_1d(np.asarray(stations, dtype=float))
        out = np.empty((3, z.size, self.states.shape[1]))
        rows = tuple(np.ascontiguousarray(self.states[row]) for row in (COUPLING, CLAMP, SHEAR, HEAD))
        for j, station in enumerate(z.tolist()):
            bend(*rows, self.strip.length, station, out[0, j], out[1, j], out[2, j])
        if self.strip.compliance:
            sheared = self.strip.compliance * self.states[SHEAR]
            out[1] = out[1] / self.states[SOFTENING] - sheared
            out[2] = out[2] / self.states[SOFTENING] - sheared * z[:, None]
        return out[0], out[1], out[2]

    def _series(self, stations: ArrayLike, series: Array) -> Array:
        if not series.size:
            return np.zeros((1, 1))
        x = 2.0 * np.atleast_1d(np.asarray(stations, dtype=float)) / self.strip.length - 1.0
        return legendre_at(x, max(series.shape[0] - 1, 1))[:, : series.shape[0]] @ series

    def curvature(self, stations: ArrayLike) -> Array:
        """V''(z) [1/m]; with shear psi', which determines the bending stress."""
        return self._linear(stations)[0] + self._series(stations, self.bent)

    def slope(self, stations: ArrayLike) -> Array:
        """V'(z) of the linear strip."""
        return self._linear(stations)[1]

    def deflection(self, stations: ArrayLike) -> Array:
        """V(z) [m]."""
        return self._linear(stations)[2] + self._series(stations, self.sunk)

    def axial_force(self, stations: ArrayLike) -> Array:
        """N along the strip's tangent [N]: P, or P (1 - V'^2/2) + T V' in large displacement."""
        if not self.inclined:
            return np.broadcast_to(self.states[FORCE], (np.size(stations), self.states.shape[1]))
        return self._tangential(self.slope(stations))

    def force_and_curvature(self, stations: ArrayLike) -> tuple[Array, Array]:
        """``axial_force`` and ``curvature``, which determine the stresses."""
        curvature, slope, _ = self._linear(stations)
        force = self._tangential(slope) if self.inclined else self.states[FORCE][None]
        return force, curvature + self._series(stations, self.bent)

    def _tangential(self, slope: Array) -> Array:
        return self.states[FORCE] * (1.0 - 0.5 * slope**2) + self.states[SIDE] * slope

    def side_force(self) -> Array:
        """T on the piston [N], shape (angles,)."""
        return self.states[SIDE] + self.more_side

    def clamp_moment(self) -> Array:
        """M0 on the piston [N m], shape (angles,)."""
        return self.states[MOMENT] + self.more_moment
