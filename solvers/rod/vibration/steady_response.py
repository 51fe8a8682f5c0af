"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``natural_frequencies``, periodic with the turn (``motion``).
There is no damping, so exactly at a resonance the answer is not finite, and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Array, Cycle, Shape
from solvers.rod.cycle.sampled import strip_of
from solvers.rod.cycle.state import ANGLE
from solvers.rod.vibration import old_response
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.motion import RULE, Excitation, Motion, Resolution, amplitudes, motion, states_at
from solvers.rod.vibration.natural_frequencies import StripBasis
from solvers.rod.vibration.time_mesh import corners, pieces, points

LEAST_ERROR = 3e-11
LADDER = (9, 11, 13, 16, 20, 26, 34)
_MOST_TRIES = 6


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
            return _vibration(cycle)


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle.

    ``error`` estimates what truncation leaves out, relative to the greatest bending; none of it is trusted to average
    out.
    """

    motion: Motion
    error: float
    lasting_error: float

    inclines = False

    @property
    def basis(self) -> StripBasis:
        return self.motion.equation.basis

    @property
    def bent_terms(self) -> int:
        """Legendre coefficients of V''."""
        return self.basis.series(2).shape[0]

    @property
    def sunk_terms(self) -> int:
        """Legendre coefficients of V."""
        return self.basis.series(0).shape[0]

    def amplitudes(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        ring, angle = self.motion.ringing, np.ascontiguousarray(angle)
        parts = self.motion.edges, self.motion.samples, ring.edges, ring.start, ring.phase, ring.shape
        return amplitudes(*parts, RULE, angle)

    def add(self, states: Array, bent: Array, sunk: Array) -> tuple[Array, Array]:
        """Add d to the series of V'' and V at the states' angles; what it adds to T [N] and M0 [N m] there."""
        amplitude, stiffness = self.amplitudes(states[ANGLE]), self.motion.equation.strip.stiffness
        bent[: self.bent_terms] += self.basis.series(2) @ amplitude
        sunk[: self.sunk_terms] += self.basis.series(0) @ amplitude
        side, moment = (stiffness * self.basis.values(np.zeros(1), order)[0] @ amplitude for order in (3, 2))
        return -side, moment

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        return VibratingShape(shape, self.basis, self.motion.equation.strip.stiffness, self.amplitudes(angle))


def excitation_of(cycle: Cycle, wanted: float) -> Excitation:
    strip, drive, d = strip_of(cycle), cycle.drive, cycle.dimensions
    ends = corners(drive, strip)
    sharp = np.empty(0) if drive.breaks.size else cycle.scene.load.sharp_angles()
    edges = pieces(drive, strip, ends, sharp, RULE.points.size, wanted, 2000)
    inertia = cycle.scene.material.density * d.b * d.h * cycle.scene.mechanism.angular_speed**2
    return Excitation(strip, drive, inertia, ends, edges, states_at(drive, strip, points(edges, RULE)))


def _vibration(cycle: Cycle, log=None):
    wanted = max(0.25 * cycle.tolerance, LEAST_ERROR)
    excitation = excitation_of(cycle, 0.1 * wanted)
    rung = 0 if wanted > 1e-5 else 1 if wanted > 1e-7 else 2 if wanted > 1e-8 else 3
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, LADDER[rung])
    swing = equation.swing(excitation.states)
    narrow = float(np.diff(excitation.edges).min())
    pace = [float(equation.fastest(n + 1, swing.min())) for n in range(equation.slowness.size)]
    slow = next((m for m in range(len(pace)) if pace[m] * narrow > 6.0 and pace[m] > 60.0), len(pace) - 1)
    step = 8.0 if wanted > 1e-6 else 6.0 if wanted > 1e-8 else 4.5
    resolution, best = Resolution(LADDER[rung], slow, step, 12), None
    for _ in range(_MOST_TRIES):
        elements = np.sum(np.ceil(np.diff(excitation.edges) * pace[max(resolution.slow - 1, 0)] * 1.3 / resolution.step)) if resolution.slow else excitation.edges.size
        if elements * (resolution.slow * 10 + 10) ** 3 > 3e8 or resolution.slow > 5:
            break
        found = motion(excitation, resolution, wanted)
        if log is not None:
            log.append((resolution, found))
        if best is None or found.error < best.error:
            best = found
        if found.error <= wanted:
            break
        worst = max(found.errors, key=found.errors.get)
        more = {
            "series": lambda r: replace(r, slow=r.slow + 1),
            "time": lambda r: replace(r, step=0.7 * r.step),
            "space": lambda r: replace(r, polynomials=LADDER[min(LADDER.index(r.polynomials) + 1, len(LADDER) - 1)]),
            "omitted": lambda r: replace(r, polynomials=LADDER[min(LADDER.index(r.polynomials) + 1, len(LADDER) - 1)]),
            "late": lambda r: replace(r, slow=r.slow + 1),
        }[worst](resolution)
        if more == resolution:
            break
        resolution = more
    if best is None or best.error > cycle.tolerance:
        if log is not None:
            log.append("fallback")
            return best
        return old_response._vibration(cycle)
    return SteadyVibration(best, best.error, best.error)
