"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

The stroke is one harmonic, but the periodic force couples all of them. V is split into the quasi-static shape, known in
closed form, and a remainder d in the constrained basis of ``vibration``:

    rho A omega^2 Mass d'' + (EI Bending + P(phi) Geometric) d = -rho A omega^2 int psi V_static,phiphi dz

In the modes of the mean force the left side is diag(1 - mu_n k^2) for every mode n and harmonic k, and what the rest of
the force couples; GMRES with the diagonal as its preconditioner solves it, with products in the angle and derivatives
in the harmonics; where slow modes meet low harmonics the preconditioner is the exact inverse. Harmonics and polynomials
are added until both series' tails are below the cycle's tolerance, or as many as ``MOST_ANGLES`` and ``LADDER`` allow;
what is left is the refinement's ``error``. Near k omega = omega_1 the remainder grows as it must. There is no damping,
so exactly at a resonance the answer is not finite, and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014); G. W. Hill's method of harmonic balance; Y. Saad,
M. H. Schultz (1986) for GMRES.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import grid
from solvers.numerics.threads import one_thread
from solvers.rod.cycle import Array, Cycle, Shape, bending_stiffness
from solvers.rod.vibration import StripBasis, strip_basis

LEAST_TAIL = 3e-11
"""Below it lies the rounding of V''' from forty polynomials."""

FEWEST_ANGLES, MOST_ANGLES = 64, 1024
LADDER = (14, 20, 28, 40)
_MOST_ITERATIONS = 100
_EXACT_MODES, _EXACT_HARMONICS = 4, 31
_RESIDUAL = 0.03
_DROPPED = 1e-3
_RESONANT = 1e-2
_MOST_REPEATS = 3
_NEAR = 0.05


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
        with one_thread():
            return self._prepare(cycle)

    def _prepare(self, cycle: Cycle) -> SteadyVibration:
        angles, step, wanted = FEWEST_ANGLES, 0, max(0.25 * cycle.tolerance, LEAST_TAIL)
        found, enough, again = None, wanted, 0
        while True:
            basis = strip_basis(cycle.dimensions.l, cycle.scene.mechanism.rod_length, LADDER[step])
            found = _balance(_Vibration.of(cycle, basis, angles), wanted, enough, found)
            coarse_angle = found.angle_tail > wanted and angles < MOST_ANGLES
            coarse_strip = found.strip_tail > wanted and step < len(LADDER) - 1
            if found.residual > enough and again < _MOST_REPEATS:
                # What the last polynomials and harmonics hold says nothing before they are solved for.
                again += 1
            elif not found.residual <= _RESONANT:
                raise InvalidInput(
                    "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
                )
            elif coarse_angle or coarse_strip:
                angles, step, again = angles * (2 if coarse_angle else 1), step + (1 if coarse_strip else 0), 0
                # What the next resolution will hardly reach need not be solved for.
                enough = max(wanted, min(max(found.angle_tail, found.strip_tail) / 64.0, 1e-3))
            elif found.residual > wanted and enough > wanted:
                enough, again = wanted, 0
            else:
                break
        lasting = found.strip_tail + found.residual
        harmonics = basis.combination.T @ found.series
        count = 8 << max(harmonics.shape[1] - 1, 7).bit_length()
        samples = np.ascontiguousarray(np.fft.irfft(harmonics, count, axis=1).T) * count
        return SteadyVibration(
            basis, bending_stiffness(cycle.scene, cycle.dimensions), samples, lasting + found.angle_tail, lasting
        )


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle at evenly spaced angles, shape (angles, basis), eight or more to its last harmonic.

    ``error`` estimates what truncation leaves out, relative to the greatest bending; ``lasting_error`` the part of it
    that is no matter of high harmonics.
    """

    basis: StripBasis
    stiffness: float
    samples: Array
    error: float
    lasting_error: float

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        return VibratingShape(shape, self.basis, self.stiffness, _interpolate(self.samples, _WEIGHTS, angle))


_WEIGHTS = np.array([(-1.0) ** j * math.comb(11, j) for j in range(12)])
"""Barycentric weights of twelve evenly spaced points (J.-P. Berrut, L. N. Trefethen, 2004)."""


@kernel
def _interpolate(samples: Array, weights: Array, angle: Array) -> Array:
    """The polynomial through the twelve samples around every angle, shape (basis, angles).

    At eight samples to a wave it misses 3e-6 of that wave, and of one four times as long 2e-13.
    """
    count, basis = samples.shape
    out, row = np.zeros((basis, angle.size)), np.empty(basis)
    for i in range(angle.size):
        turns = angle[i] / (2.0 * math.pi)
        place = (turns - math.floor(turns)) * count
        first = int(place)
        share = place - first
        if share == 0.0:
            out[:, i] = samples[first % count]
            continue
        total = 0.0
        row[:] = 0.0
        for m in range(weights.size):
            weight = weights[m] / (share + 5.0 - m)
            total += weight
            at = (first + m - 5) % count
            for j in range(basis):
                row[j] += weight * samples[at, j]
        for j in range(basis):
            out[j, i] = row[j] / total
    return out


@dataclass(frozen=True)
class _Vibration:
    """The strip's equation at evenly spaced angles, in its modes under the mean force (which have unit stiffness).

    ``diagonal`` is 1 - mu_n k^2, shape (modes, harmonics); ``swing`` the force less its mean; ``right`` the inertia of
    the still shape, shape (modes, angles); ``curvature`` and ``shear`` that shape's V'' and V''' at the clamp.
    """

    basis: StripBasis
    modes: Array
    back: Array
    geometric: Array
    diagonal: Array
    swing: Array
    right: Array
    curvature: Array
    shear: Array

    @staticmethod
    def of(cycle: Cycle, basis: StripBasis, angles: int) -> _Vibration:
        from scipy.linalg import LinAlgError, eigh

        scene, dimensions = cycle.scene, cycle.dimensions
        inertia = scene.material.density * dimensions.b * dimensions.h * scene.mechanism.angular_speed**2
        at = grid(angles)
        axial = cycle.axial_force(at)
        force = axial * cycle.composition.beam.couples
        bent = cycle.composition.beam.bend(scene, dimensions, axial, scene.mechanism.crank_radius * np.sin(at))
        mean = float(np.mean(force))
        stations, weights = basis.quadrature()
        stiffness = bending_stiffness(scene, dimensions)
        system = stiffness * basis.bending + mean * basis.geometric
        try:
            slowness, modes = eigh(inertia * basis.mass, system)
        except LinAlgError:
            raise InvalidInput(
                "dimensions.h", "the strip buckles under the mean force of the cycle", "thicker"
            ) from None
        slowness, modes = slowness[::-1], modes[:, ::-1]
        order = np.arange(angles // 2 + 1)
        square = np.where(order == angles // 2, 0.0, order.astype(float) ** 2)
        projected = modes.T @ basis.values(stations, 0).T @ (weights[:, None] * bent.deflection(stations))
        return _Vibration(
            basis=basis,
            modes=modes,
            back=modes.T @ system,
            geometric=modes.T @ basis.geometric @ modes,
            diagonal=1.0 - slowness[:, None] * square,
            swing=force - mean,
            right=np.fft.irfft(inertia * square * np.fft.rfft(projected, axis=1), angles, axis=1),
            curvature=bent.clamp_moment() / stiffness,
            shear=-bent.side_force() / stiffness,
        )

    def apply(self, motion: Array) -> Array:
        """The left side for the modes' amplitudes at the angles."""
        held = np.fft.irfft(self.diagonal * np.fft.rfft(motion, axis=1), self.swing.size, axis=1)
        return held + (self.geometric @ motion) * self.swing

    def conditioner(self) -> Callable[[Array], Array]:
        """An approximate inverse: exact where slow modes meet low harmonics, the diagonal elsewhere.

        A preconditioner need not be exact, and next to a resonance above the exact part it must not be.
        """
        from scipy.linalg import LinAlgWarning, lu_factor, lu_solve

        angles, slow = self.swing.size, min(_EXACT_MODES, self.modes.shape[1])
        order = np.arange(1, min(_EXACT_HARMONICS, angles // 2 - 1) + 1)
        turned = np.outer(order, grid(angles))
        waves = np.concatenate([np.full((1, angles), math.sqrt(0.5)), np.cos(turned), np.sin(turned)])
        waves *= math.sqrt(2.0 / angles)
        each = self.diagonal[:slow, np.concatenate([[0], order, order])]
        block = np.kron(self.geometric[:slow, :slow], (waves * self.swing) @ waves.T) + np.diag(each.ravel())
        with warnings.catch_warnings():
            # Exactly at a resonance the residual says so.
            warnings.simplefilter("ignore", LinAlgWarning)
            factors = lu_factor(block, check_finite=False)
        inverse = 1.0 / np.where(np.abs(self.diagonal) < _NEAR, _NEAR, self.diagonal)

        def condition(motion: Array) -> Array:
            low = motion[:slow] @ waves.T
            rest = motion.copy()
            rest[:slow] -= low @ waves
            out = np.fft.irfft(inverse * np.fft.rfft(rest, axis=1), angles, axis=1)
            out[:slow] += lu_solve(factors, low.ravel(), check_finite=False).reshape(low.shape) @ waves
            return out

        return condition

    def solve(self, start: Array, tolerance: float) -> tuple[Array, Array, float]:
        """The modes' amplitudes at the angles, about what they miss, and the residual's share of the right side."""
        from scipy.sparse.linalg import LinearOperator, gmres

        size, shape = float(np.linalg.norm(self.right)), self.right.shape
        if size == 0.0:
            return np.zeros(shape), np.zeros(shape), 0.0
        condition = self.conditioner()
        missing = self.right - self.apply(start)
        operator = LinearOperator(
            (missing.size, missing.size),
            matvec=lambda flat: self.apply(condition(flat.reshape(shape))).ravel(),
            dtype=float,
        )
        flat, _ = gmres(operator, missing.ravel(), rtol=0.0, atol=tolerance * size, restart=_MOST_ITERATIONS, maxiter=1)
        motion = start + condition(flat.reshape(shape))
        residual = self.right - self.apply(motion)
        return motion, condition(residual), float(np.linalg.norm(residual)) / size


@dataclass(frozen=True)
class _Balance:
    """One resolution's answer: harmonics of the polynomials' amplitudes, and what is missing from it, relative to the
    clamp's greatest V'' or V''', whichever suffers more: the tails of the two series, and the equation's residual.
    ``weight`` is what a residual of 1, as a share of the equation's right side, makes of that."""

    series: Array
    angle_tail: float
    strip_tail: float
    residual: float
    weight: float


def _balance(vibration: _Vibration, wanted: float, enough: float, coarser: _Balance | None) -> _Balance:
    basis, angles = vibration.basis, vibration.swing.size
    start, weight = np.zeros(vibration.right.shape), 1.0
    if coarser is not None:
        weight = coarser.weight
        known = np.zeros((basis.combination.shape[0], angles // 2 + 1), dtype=complex)
        known[: coarser.series.shape[0], : coarser.series.shape[1]] = coarser.series
        start = vibration.back @ basis.combination.T @ np.fft.irfft(known * angles, angles, axis=1)
    motion, missing, residual = vibration.solve(start, _RESIDUAL * enough / weight)
    amplitude = vibration.modes @ motion
    series = basis.combination @ np.fft.rfft(amplitude, axis=1) / angles
    unsolved = basis.combination @ np.fft.rfft(vibration.modes @ missing, axis=1) / angles
    share, unsolved_share = np.zeros(series.shape), np.zeros(series.shape)
    for order, still in ((2, vibration.curvature), (3, vibration.shear)):
        at_clamp = basis.polynomials(0.0, order)
        whole = float(np.max(np.abs(still + at_clamp @ basis.combination @ amplitude)))
        share = np.maximum(share, 2.0 * np.abs(at_clamp[:, None] * series) / whole)
        unsolved_share = np.maximum(unsolved_share, 2.0 * np.abs(at_clamp[:, None] * unsolved) / whole)
    left = 4.0 * float(np.sum(unsolved_share))
    # A series that falls like k^-3, as it does behind a table's points, has less beyond its end than thrice its last
    # quarter; one that falls geometrically has far less. The last polynomials also move those before them.
    rows, columns = share.shape[0] // 8 + 2, share.shape[1] // 4 + 1
    beyond = np.cumsum(np.sum(share, axis=0)[::-1])[::-1]
    kept = int(np.count_nonzero(beyond > _DROPPED * wanted))
    return _Balance(
        series=series[:, : max(kept, 1)],
        angle_tail=3.0 * float(np.sum(share[:, -columns:])),
        strip_tail=8.0 * float(np.sum(share[-rows:])),
        residual=left,
        weight=max(left / residual, 1e-6) if residual > 0.0 else 1.0,
    )
