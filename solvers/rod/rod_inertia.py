"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

The stroke is one harmonic, but the periodic force couples all of them. V is split into the quasi-static shape, known in
closed form, and a remainder d in the constrained basis of ``vibration``:

    rho A omega^2 Mass d'' + (EI Bending + P(phi) Geometric) d = -rho A omega^2 int psi V_static,phiphi dz

solved by harmonic balance with every harmonic of P kept up to the truncation; near k omega = omega_1 the remainder
grows as it must. There is no damping, so exactly at a resonance the answer is not finite, and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014); G. W. Hill's method of harmonic balance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.errors import InvalidInput
from solvers.numerics.periodic import grid
from solvers.rod.cycle import Array, Cycle, Shape, bending_stiffness
from solvers.rod.vibration import StripBasis, strip_basis

HARMONICS = 16
MODES = 10


@dataclass(frozen=True)
class VibratingShape:
    """The quasi-static shape and the vibration beside it: ``amplitude`` holds d at the angles, (basis, angles)."""

    base: Shape
    basis: StripBasis
    stiffness: float
    amplitude: Array

    def _part(self, stations: ArrayLike, order: int) -> Array:
        return self.basis.values(np.atleast_1d(np.asarray(stations, dtype=float)), order) @ self.amplitude

    def curvature(self, stations: ArrayLike) -> Array:
        return self.base.curvature(stations) + self._part(stations, 2)

    def slope(self, stations: ArrayLike) -> Array:
        return self.base.slope(stations) + self._part(stations, 1)

    def deflection(self, stations: ArrayLike) -> Array:
        return self.base.deflection(stations) + self._part(stations, 0)

    def axial_force(self, stations: ArrayLike) -> Array:
        return self.base.axial_force(stations)

    def side_force(self) -> Array:
        return self.base.side_force() - self.stiffness * self._part([0.0], 3)[0]

    def clamp_moment(self) -> Array:
        return self.base.clamp_moment() + self.stiffness * self._part([0.0], 2)[0]


@dataclass(frozen=True)
class RodInertia:
    """Adds the steady vibration of the strip to whatever quasi-static shape it is given."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        basis = strip_basis(cycle.dimensions.l, cycle.scene.mechanism.rod_length)
        return SteadyVibration(basis, bending_stiffness(cycle.scene, cycle.dimensions), _harmonics(cycle, basis))


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle by its complex harmonics, shape (basis, HARMONICS + 1)."""

    basis: StripBasis
    stiffness: float
    harmonics: Array

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        phase = np.exp(1j * np.outer(np.arange(self.harmonics.shape[1]), angle))
        amplitude = np.real(self.harmonics[:, :1] @ phase[:1] + 2.0 * self.harmonics[:, 1:] @ phase[1:])
        return VibratingShape(shape, self.basis, self.stiffness, amplitude)


def _harmonics(cycle: Cycle, basis: StripBasis) -> Array:
    """Complex harmonics 0 … HARMONICS of d over the basis, shape (basis, HARMONICS + 1)."""
    from scipy.linalg import eigh

    scene, dimensions = cycle.scene, cycle.dimensions
    stiffness = bending_stiffness(scene, dimensions)
    inertia = scene.material.density * dimensions.b * dimensions.h * scene.mechanism.angular_speed**2
    angles = grid(4 * HARMONICS)
    force = cycle.axial_force(angles) * cycle.composition.beam.couples
    stroke = scene.mechanism.crank_radius * np.sin(angles)
    still = cycle.composition.beam.bend(scene, dimensions, cycle.axial_force(angles), stroke)

    points, weights = np.polynomial.legendre.leggauss(24)
    z, w = 0.5 * dimensions.l * (points + 1.0), 0.5 * dimensions.l * weights
    projected = basis.values(z, 0).T @ (w[:, None] * still.deflection(z))
    mean = float(np.mean(force))
    _, modes = eigh(stiffness * basis.bending + mean * basis.geometric, basis.mass)
    modes = modes[:, :MODES]

    bending = modes.T @ basis.bending @ modes * stiffness
    geometric, mass = modes.T @ basis.geometric @ modes, modes.T @ basis.mass @ modes
    force_harmonics = np.fft.fft(force) / force.size
    shape_harmonics = np.fft.fft(modes.T @ projected, axis=1) / force.size
    order = np.arange(-HARMONICS, HARMONICS + 1)
    coupling = force_harmonics[order[:, None] - order[None, :]]
    coupling[np.abs(order[:, None] - order[None, :]) > HARMONICS] = 0.0
    system = np.kron(coupling, geometric) + np.kron(np.eye(order.size), bending)
    system -= np.kron(np.diag(inertia * order.astype(float) ** 2), mass)
    right = (inertia * order**2 * shape_harmonics[:, order]).T.ravel()
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError:
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        ) from None
    return modes @ solution.reshape(order.size, MODES)[HARMONICS:].T
