"""The strip's equation in its modes under the mean force, and its periodic motion on elements of the turn.

With g the mean force's shape per unit stroke s, and mu_n c_n = int rho A omega^2 psi_n (V_static - s g) dz, the
amplitudes a = c + d of the modes, which have unit stiffness and masses mu_n, obey

    mu_n a_n'' + a_n + swing sum_m G_nm (a_m - c_m) = c_n + s int rho A omega^2 psi_n g dz

without any derivative of the force: a is smooth enough where the force has corners, d has corners with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.periodic_radau import STAGES, steady_motion
from solvers.rod.cycle.composition import Array, Cycle
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.natural_frequencies import StripBasis, strip_basis
from solvers.rod.vibration.ringing import PLACES, ringing
from solvers.rod.vibration.time_mesh import POINTS, interpolate, points

_SOFTEST = 0.02
"""Of a mode's stiffness: no pace is taken for slower than under that."""

_NEAREST = 0.9
"""Of two modes' paces squared: neighbours' bounds are those of modes so far apart."""


@dataclass(frozen=True)
class Driven:
    """The force beside its mean, the stroke, the modes' quasi-static amplitudes c and the strip's quasi-static V'' and
    V''' at the clamp, all at the same points of the elements, one element after the other."""

    edges: Array
    swing: Array
    stroke: Array
    still: Array
    clamp: Array


@dataclass(frozen=True)
class Motion:
    """d of every mode at the points of the elements, shape (elements, points, modes).

    ``whole`` holds the greatest V'' and V''' at the clamp with the quasi-static ones, ``amplification`` is that of
    closing the turn.
    """

    edges: Array
    amplitudes: Array
    whole: Array
    amplification: float


@dataclass(frozen=True)
class StripModes:
    """The strip's equation in its modes under the mean force.

    ``modes`` takes amplitudes of the modes to those of the basis; ``projection`` V at the stations to int rho A omega^2
    psi_n V dz, ``slopes`` V' there and at the end to int psi_n' V' dz + e psi_n'(l) V'(l). ``unit`` is g at the
    stations, ``clamp`` V'' and V''' of the modes at the clamp, shape (2, modes).
    """

    cycle: Cycle
    basis: StripBasis
    stations: Array
    mean: float
    slowness: Array
    modes: Array
    coupling: Array
    projection: Array
    slopes: Array
    unit: Array
    clamp: Array

    @staticmethod
    def of(cycle: Cycle, polynomials: int, mean: float) -> StripModes:
        from scipy.linalg import LinAlgError, eigh

        scene, dimensions, beam = cycle.scene, cycle.dimensions, cycle.composition.beam
        basis = strip_basis(dimensions.l, scene.mechanism.rod_length, polynomials)
        inertia = scene.material.density * dimensions.b * dimensions.h * scene.mechanism.angular_speed**2
        system = bending_stiffness(scene, dimensions) * basis.bending + mean * beam.couples * basis.geometric
        try:
            slowness, modes = eigh(inertia * basis.mass, system)
        except LinAlgError:
            raise InvalidInput(
                "dimensions.h", "the strip buckles under the mean force of the cycle", "thicker"
            ) from None
        slowness, modes = slowness[::-1], modes[:, ::-1]
        stations, weights = basis.quadrature()
        return StripModes(
            cycle=cycle,
            basis=basis,
            stations=stations,
            mean=mean,
            slowness=slowness,
            modes=modes,
            coupling=modes.T @ basis.geometric @ modes * beam.couples,
            projection=inertia * (modes.T @ basis.values(stations, 0).T) * weights,
            slopes=np.append(weights, scene.mechanism.rod_length - dimensions.l)[:, None]
            * (basis.values(np.append(stations, dimensions.l), 1) @ modes)
            * beam.couples,
            unit=beam.bend(scene, dimensions, np.array([mean]), np.array([1.0])).deflection(stations)[:, 0],
            clamp=np.stack([basis.values(np.zeros(1), order)[0] @ modes for order in (2, 3)]),
        )

    @property
    def pace(self) -> Array:
        """The modes' natural frequencies under the mean force [1/rad], the slowest first."""
        return 1.0 / np.sqrt(self.slowness)

    def driven(self, edges: Array, places: Array = POINTS) -> Driven:
        """What drives the modes at the points, or other places, of the elements."""
        angle, scene = points(edges, places), self.cycle.scene
        force, stroke = self.cycle.axial_force(angle), scene.mechanism.crank_radius * np.sin(angle)
        bent = self.cycle.composition.beam.bend(scene, self.cycle.dimensions, force, stroke)
        moved = self.projection @ (bent.deflection(self.stations) - self.unit[:, None] * stroke)
        clamp = np.stack([bent.clamp_moment(), -bent.side_force()], axis=-1)
        clamp /= bending_stiffness(scene, self.cycle.dimensions)
        return Driven(edges, force - self.mean, stroke, (moved / self.slowness[:, None]).T, clamp)

    def solve(self, driven: Driven, modes: int) -> Motion:
        """d where as many of the slowest modes have mass; the others follow them without delay."""
        edges, stroke, part = driven.edges, driven.stroke, slice(0, modes)
        followed, held = self._condensed(driven.swing, modes)
        still = driven.still[:, part]
        right = np.einsum("pnm,pm->pn", held, still) + stroke[:, None] * (self.projection[part] @ self.unit)
        shape = (edges.size - 1, 1 + STAGES, modes)
        stages = held.reshape(*shape, modes)[:, 1:], right.reshape(shape)[:, 1:]
        amplitude, amplification = steady_motion(np.diff(edges), self.slowness[part], *stages)
        found = amplitude.reshape(-1, modes) - still
        if followed.size:
            found = np.concatenate([found, np.einsum("pnm,pm->pn", followed, found)], axis=1)
        whole = np.abs(found @ self.clamp.T + driven.clamp).max(axis=0)
        return Motion(edges, found.reshape(*shape[:2], -1), whole, amplification)

    def _condensed(self, swing: Array, modes: int) -> tuple[Array, Array]:
        """What the other modes make of the slowest ones' amplitudes, and the stiffness that leaves to these."""
        rate, turned = np.linalg.eigh(self.coupling[modes:, modes:])
        across = turned.T @ self.coupling[modes:, :modes]
        yielding = swing[:, None] / (1.0 + swing[:, None] * rate)
        followed = -np.einsum("hk,pk,km->phm", turned, yielding, across, optimize=True)
        held = np.eye(modes) + swing[:, None, None] * self.coupling[:modes, :modes]
        held -= swing[:, None, None] * np.einsum("kn,pk,km->pnm", across, yielding, across, optimize=True)
        return followed, held

    def change(self, found: Motion, finer: Motion) -> float:
        """By what share of V'' or V''' at the clamp, whichever suffers more, the two motions differ."""
        known = interpolate(found.edges, found.amplitudes, points(finer.edges)).T
        differ = finer.amplitudes.reshape(known.shape) - known
        return float(np.max(np.abs(differ @ self.clamp.T).max(axis=0) / found.whole))

    def ringing(self, edges: Array, whole: Array) -> tuple[Array, Array]:
        """What a turn adds to each mode's ringing, as a share of V'' or V''' at the clamp, whichever suffers more, and
        the factor by which closing the turn enlarges it."""
        angle, cycle = points(edges, PLACES), self.cycle
        force, stroke = cycle.axial_force(angle), cycle.scene.mechanism.crank_radius * np.sin(angle)
        swing = force - self.mean
        slope = cycle.composition.beam.bend(cycle.scene, cycle.dimensions, force, stroke).slope(
            np.append(self.stations, cycle.dimensions.l)
        )
        # The weak form of the static problems, with no division by small masses; without shear it is exact.
        still = -swing[:, None] * (slope.T @ self.slopes)
        stiffness = np.maximum(1.0 + swing[:, None] * np.diag(self.coupling), _SOFTEST)
        shape = (edges.size - 1, PLACES.size, -1)
        pace = (self.pace * np.sqrt(stiffness)).reshape(shape)
        added, closing = ringing(np.diff(edges), still.reshape(shape), pace)
        return added * np.max(np.abs(self.clamp) / whole[:, None], axis=0), closing

    def across(self, driven: Driven) -> Array:
        """How far a mode's ringing moves each faster one beyond what that one would do without mass, (slow, fast).

        Relative to the share of the slower one's own in V'' or V''' at the clamp.
        """
        ratio = np.minimum(self.slowness[None, :] / self.slowness[:, None], _NEAREST)
        size = np.abs(self.clamp)
        share = np.max(size[:, None, :] / size[:, :, None], axis=0)
        return np.abs(driven.swing).max() * np.abs(self.coupling) * share * ratio / (1.0 - ratio)

    def dephasing(self, driven: Driven) -> Array:
        """By how much of a turn's phase [rad] a mode is wrong for every faster one that has no mass, (slow, fast).

        The faster one takes part in the motion by swing G_nm; its mass slows the mode by half that share of the two's
        squared (R. J. Guyan, 1965).
        """
        swings = np.diff(driven.edges) @ np.mean(driven.swing.reshape(-1, 1 + STAGES) ** 2, axis=1)
        return 0.5 * swings * self.pace[:, None] ** 3 * self.coupling**2 * self.slowness

    def tail(self, motion: Motion) -> float:
        """What the last polynomials hold of V'' or V''' at the clamp, whichever suffers more; they also move others."""
        combined = self.basis.combination @ self.modes
        series = np.abs(motion.amplitudes.reshape(-1, self.slowness.size) @ combined.T).max(axis=0)
        last = slice(-(series.size // 8 + 2), None)
        shares = [np.sum(np.abs(self.basis.polynomials(0.0, order) * series)[last]) for order in (2, 3)]
        return 4.0 * float(np.max(shares / motion.whole))
