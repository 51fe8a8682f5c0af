"""Steady vibration of the strip due to its own transverse inertia, excited by the crank's lateral displacement.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``natural_frequencies``, periodic over the revolution (``motion``). In the strip's modes it obeys an ordinary
differential equation (``equation``) between the corners of the force (``excitation``), at a ``resolution`` that meets
a tolerance. The dynamic part d is damped mode by mode with the material's loss factor (``equation``). Without damping
there is no finite solution exactly at a resonance, and such a speed is refused.

Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.periodic import TURN
from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.section import RingingShape
from solvers.rod.cycle.state import ANGLE
from solvers.rod.vibration.excitation import FEW_CORNERS, Excitation
from solvers.rod.vibration.motion import Motion
from solvers.rod.vibration.periodic_motion import neighbouring_motion
from solvers.rod.vibration.resolution import Resolved, resolved_motion

LEAST_ERROR = 3e-11
"""Smallest tolerance: rounding errors of V''' with many polynomials."""

_DISCONTINUITIES = 8
"""Assumed number of angles at which the weights of a mean jump or have a kink: there oscillating errors contribute."""

_FAR_FROM_TOLERANCE, _RELAXATION, _LARGEST_TOLERANCE = 1e3, 30.0, 1e-4
"""Error over tolerance from which on another start is made; factor on the tolerance then, and the largest tolerance
from which it is."""

_RESONANT_AMPLIFICATION = 1e5
_LARGEST_ERROR = 0.1
"""Amplification that means resonance, and error at which a motion is unknown."""


@dataclass(frozen=True)
class RodInertia:
    """Correction that adds the strip's steady vibration to the quasi-static shape."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        with one_thread():
            return _vibration(cycle)

    def neighbours(self, found: SteadyVibration, cycles: Sequence[Cycle]) -> list[SteadyVibration | None]:
        """The vibrations of neighbouring strips at the resolution of one that was found; None where corners appear or
        vanish."""
        with one_thread():
            return [_neighbour(found, cycle) for cycle in cycles]


@dataclass(frozen=True)
class SteadyVibration:
    """The dynamic part d of the deflection in one cycle.

    ``error`` estimates the numerical error, relative to the greatest bending; ``lasting_error`` the part of it that
    remains in a mean over the revolution. In such a mean, contributions of ringing that all corners excite are assumed
    to add up if it is ``coherent``, otherwise only its square counts.
    """

    motion: Motion
    error: float
    lasting_error: float
    excitation: Excitation
    coherent: bool = True

    inclines = False

    @property
    def highest_frequency(self) -> float:
        """Highest frequency [1/rad] of the slow modes."""
        return self.motion.highest_frequency

    @property
    def terms(self) -> int:
        return self._unit_curvature.shape[0]

    @cached_property
    def without_ringing(self) -> SteadyVibration:
        return replace(self, motion=self.motion.without_ringing) if self.motion.ringing.modes else self

    @cached_property
    def ringing(self) -> RingingShape:
        """V'', V, T and M0 of the ringing."""
        side, moment = self._unit_reactions
        begins = self.excitation.corners.size if self.coherent else 0
        return RingingShape(self.motion.ringing, self._unit_curvature, self._unit_deflection, side, moment, begins)

    @cached_property
    def _unit_curvature(self) -> Array:
        """Legendre series of V'' for unit amplitudes of the basis."""
        return self.motion.basis.series(2)

    @cached_property
    def _unit_deflection(self) -> Array:
        """Legendre series of V for unit amplitudes of the basis."""
        return self.motion.basis.series(0)

    @cached_property
    def _unit_reactions(self) -> tuple[Array, Array]:
        """T [N] and M0 [N m] for unit amplitudes of the basis."""
        stiffness, basis, clamp = self.motion.strip.stiffness, self.motion.basis, np.zeros(1)
        return -stiffness * basis.values(clamp, 3)[0], stiffness * basis.values(clamp, 2)[0]

    def add(self, states: Array, curvature_series: Array, deflection_series: Array) -> tuple[Array, Array]:
        amplitudes, (side, moment) = self.motion.at(np.ascontiguousarray(states[ANGLE])), self._unit_reactions
        curvature_series[: self.terms] += self._unit_curvature @ amplitudes
        deflection_series[: self.terms] += self._unit_deflection @ amplitudes
        return side @ amplitudes, moment @ amplitudes


def _vibration(cycle: Cycle) -> SteadyVibration:
    """Compute to half the cycle's tolerance; if that requires elements too narrow for series, to the least error found
    with larger tolerances."""
    tolerance, best = max(0.5 * cycle.tolerance, LEAST_ERROR), None
    while best is None or (
        best.error > _FAR_FROM_TOLERANCE * tolerance
        and tolerance < _LARGEST_TOLERANCE
        and best.excitation.corners.size <= FEW_CORNERS
    ):
        resolved = resolved_motion(cycle, tolerance, optional=tolerance < _LARGEST_TOLERANCE)
        known = (each for each in (best, resolved and _vibration_of(resolved)) if each is not None)
        best = min(known, key=lambda each: each.error, default=None)
        tolerance *= _RELAXATION
    if best.motion.amplification > _RESONANT_AMPLIFICATION and not best.error < _LARGEST_ERROR:
        if best.motion.errors.excited > _LARGEST_ERROR:
            raise unknown_vibration()
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        )
    return best


def _vibration_of(resolved: Resolved) -> SteadyVibration:
    found, excitation, frequency = resolved
    remainder = (excitation.corners.size + _DISCONTINUITIES) / (0.5 * TURN * frequency)
    return SteadyVibration(found, found.errors.total, found.errors.of_mean(min(remainder, 1.0)), excitation)


def unknown_vibration() -> InvalidInput:
    """Error for a load whose every change excites too many modes of the strip."""
    return InvalidInput(
        "load",
        "the pressure changes within too small an angle for the strip's vibration to be found",
        "points farther apart or less noise, or no effect rod_inertia",
    )


def _neighbour(found: SteadyVibration, cycle: Cycle) -> SteadyVibration | None:
    """The vibration of a strip next to the one found, at the same resolution whatever its error; None if corners appear
    or vanish."""
    excitation = found.excitation.neighbour(cycle)
    if excitation is None:
        return None
    loss, tolerance = cycle.scene.material.loss_factor, max(0.5 * cycle.tolerance, LEAST_ERROR)
    found_motion = neighbouring_motion(found.motion, found.excitation, excitation, loss, tolerance)
    return replace(found, motion=found_motion, excitation=excitation)
