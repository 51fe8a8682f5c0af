"""The bent strip at given crank angles, evaluable at any section."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.legendre import legendre_at
from solvers.rod.cycle.state import ANGLE, FORCE, MOMENT, SHEAR, SIDE, SOFTENING, Strip, bend_states
from solvers.rod.strip.shear import slope_of


class BentStrip(NamedTuple):
    """A table of states (``state.ROWS``, angles), and the corrections to the linear strip.

    ``curvature_series`` and ``deflection_series`` are Legendre series over the strip of the corrections to V'' [1/m]
    and V [m], (terms, angles); ``side_correction`` and ``moment_correction`` those to T [N] and M0 [N m]. ``inclined``:
    N is tangential to the deflected strip. Methods that take stations [m] return arrays of shape (stations, angles).
    """

    strip: Strip
    states: Array
    curvature_series: Array
    deflection_series: Array
    side_correction: Array
    moment_correction: Array
    inclined: bool

    @property
    def angle(self) -> Array:
        """The crank angles [rad], (angles,)."""
        return self.states[ANGLE]

    @property
    def force(self) -> Array:
        """The axial force P [N], (angles,)."""
        return self.states[FORCE]

    @staticmethod
    def linear(strip: Strip, states: Array) -> BentStrip:
        """The strip without corrections."""
        none, zero = np.zeros((0, states.shape[1])), np.zeros(states.shape[1])
        return BentStrip(strip, states, none, none, zero, zero, False)

    def _linear(self, stations: ArrayLike) -> tuple[Array, Array, Array]:
        """psi', V' and V of the linear strip."""
        z = np.atleast_1d(np.asarray(stations, dtype=float))
        out = np.empty((3, z.size, self.states.shape[1]))
        for j, station in enumerate(z.tolist()):
            linear_shape(self.strip, self.states, station, out[0, j], out[1, j], out[2, j])
        return out[0], out[1], out[2]

    def _series(self, stations: ArrayLike, series: Array) -> Array:
        if not series.size:
            return np.zeros((1, 1))
        x = 2.0 * np.atleast_1d(np.asarray(stations, dtype=float)) / self.strip.length - 1.0
        return legendre_at(x, max(series.shape[0] - 1, 1))[:, : series.shape[0]] @ series

    def curvature(self, stations: ArrayLike) -> Array:
        """V''(z) [1/m]; with shear psi', which determines the bending stress."""
        return self._linear(stations)[0] + self._series(stations, self.curvature_series)

    def slope(self, stations: ArrayLike) -> Array:
        """V'(z) of the linear strip."""
        return self._linear(stations)[1]

    def deflection(self, stations: ArrayLike) -> Array:
        """V(z) [m]."""
        return self._linear(stations)[2] + self._series(stations, self.deflection_series)

    def fibre_stresses(self, stations: ArrayLike) -> Array:
        """sigma = N/(b h) +- E h/2 V'' [Pa] of the two fibres, shape (2, stations, angles)."""
        z = np.atleast_1d(np.asarray(stations, dtype=float))
        return fibre_stresses(self.strip, self.states, z, self.curvature_correction(z), self.inclined)

    def curvature_correction(self, stations: Array) -> Array:
        """The corrections to V'' [1/m], (stations, angles), or of shape (0, 0) without any."""
        return self._series(stations, self.curvature_series) if self.curvature_series.size else np.empty((0, 0))

    def side_force(self) -> Array:
        """T on the piston [N], shape (angles,)."""
        return self.states[SIDE] + self.side_correction

    def clamp_moment(self) -> Array:
        """M0 on the piston [N m], shape (angles,)."""
        return self.states[MOMENT] + self.moment_correction


@kernel
def linear_shape(strip: Strip, states: Array, z: float, curvature: Array, slope: Array, deflection: Array) -> None:
    """Write psi' [1/m], V' and V [m] of the linear strip at a section to arrays of shape (angles,)."""
    bend_states(states, strip.length, z, curvature, slope, deflection)
    compliance = strip.compliance
    if compliance != 0.0:
        for i in range(states.shape[1]):
            slope[i] = slope_of(slope[i], states[SOFTENING, i], compliance, states[SHEAR, i])
            deflection[i] = deflection[i] / states[SOFTENING, i] - compliance * states[SHEAR, i] * z


@kernel
def tangential_force(force: float, side: float, slope: float) -> float:
    """N = P (1 - V'^2/2) + T V' [N], along the deflected strip."""
    return force * (1.0 - 0.5 * slope * slope) + side * slope


@kernel
def fibre_stresses(strip: Strip, states: Array, stations: Array, correction: Array, inclined: bool) -> Array:
    """Kernel of ``BentStrip.fibre_stresses``; ``correction`` to V'' has the shape (stations, angles) or size 0."""
    angles, direct, bending = states.shape[1], strip.direct, strip.bending
    out, rotation, integral = np.empty((2, stations.size, angles)), np.empty(angles), np.empty(angles)
    for j in range(stations.size):
        bent = out[1, j]
        bend_states(states, strip.length, stations[j], bent, rotation, integral)
        for i in range(angles):
            curvature, force = bent[i], states[FORCE, i]
            if correction.size > 0:
                curvature += correction[j, i]
            if inclined:
                slope = slope_of(rotation[i], states[SOFTENING, i], strip.compliance, states[SHEAR, i])
                force = tangential_force(force, states[SIDE, i], slope)
            out[0, j, i], out[1, j, i] = direct * force + bending * curvature, direct * force - bending * curvature
    return out
