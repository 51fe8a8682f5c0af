"""Steady vibration of the strip due to its own transverse inertia, excited by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``natural_frequencies``, periodic over the revolution (``motion``). In the strip's modes it obeys an ordinary
differential equation (``equation``) between the corners of the force (``excitation``). The first resolution follows
from the frequencies of the modes and from how fast the force changes; it is refined where the estimated error is
largest until the tolerance is met, refinement no longer helps, or the work exceeds its limit. The dynamic part d is
damped mode by mode with the material's loss factor (``equation``). Without damping there is no finite solution exactly
at a resonance, and such a speed is refused.

Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Array, Cycle
from solvers.rod.cycle.section import RingingShape
from solvers.rod.cycle.state import ANGLE
from solvers.rod.vibration.equation import StripEquation, quasi_static
from solvers.rod.vibration.excitation import RULE, TURN, Excitation, off_jumps, states_at
from solvers.rod.vibration.motion import (
    EXPONENT,
    MOST_RINGING,
    NARROW,
    Errors,
    Motion,
    least_phases,
    motion,
    neighbouring_motion,
)

LEAST_ERROR = 3e-11
"""Smallest tolerance: rounding errors of V''' with many polynomials."""

POLYNOMIAL_COUNTS = (9, 11, 13, 16, 20, 26, 34)
"""Numbers of polynomials along the strip, by level of resolution."""
_LEVELS, _LEVELS_WITH_CORNERS = (3e-6, 5e-8, 5e-10), (3e-6, 2e-7, 5e-9, 5e-9, 5e-10, 5e-10)
"""Tolerances below which a level has hardly ever sufficed, without and with corners; the latter need more modes."""

MOST_WORK, ENOUGH_WORK = 12_000_000, 6_000_000
"""Largest work of one motion, and of all but the last, as measured by ``_work``: 6 000 000 take about a tenth of a
second."""

FEW_CORNERS, _ENOUGH_WORK_MANY_CORNERS, _ENOUGH_WORK_LOW_ACCURACY, _LOW_ACCURACY = 32, 1_850_000, 500_000, 1e-6
"""Number of corners above which they are those of a table; the largest work then, and if the tolerance is no smaller
than the last of these."""
_DECAY, _DECAY_BEHIND_JUMPS, _DECAY_UNDAMPED = 4.0, 10.0, 1.0
"""Exponents with which the error of omitted ringing decreases with the number of known modes: behind corners; and in
greatest values behind jumps of the force, with damping, which shortens the ringing, and without."""

_MAX_ATTEMPTS, _MAX_FRUITLESS = 8, 2
"""Motions computed, and those in succession without a smaller error."""
_LARGE_ERROR, _STEP_REDUCTION = 0.03, 0.75
"""Elements with at least this fraction of the worst element's error are halved with it; factor on the step then."""

_LEAST_WIDTH_PHASE, _LEAST_HALF_PHASE, _LEAST_CHANGE_PHASE = 2.0, 9.0, 5.0
"""Phases of the slowest fast mode [rad]: least over the narrowest element with many corners at low accuracy; least over
half an element for it to be halved; and, in a narrow element, over the scale on which the force changes, below which
the mode must be slow."""

_QUICKLY_INTEGRATED = 600.0
"""Phase of a mode over the revolution [rad] up to which integrating it takes less time than its ringing."""

_FREQUENCY_MARGIN = 1.2
"""Mean frequency of a mode over that under the mean force, assumed."""

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
    remains in a mean over the revolution.
    """

    motion: Motion
    error: float
    lasting_error: float
    excitation: Excitation

    inclines = False

    @property
    def highest_frequency(self) -> float:
        """Highest frequency [1/rad] of the slow modes."""
        return self.motion.highest_frequency

    @property
    def terms(self) -> int:
        """Number of Legendre coefficients of V'' and of V."""
        return self._unit_curvature.shape[0]

    @cached_property
    def without_ringing(self) -> SteadyVibration:
        return replace(self, motion=self.motion.without_ringing) if self.motion.ringing.modes else self

    @cached_property
    def ringing(self) -> RingingShape:
        """V'', V, T and M0 of the ringing."""
        side, moment = self._unit_reactions
        begins = self.excitation.corners.size
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
        """Add d to the series of V'' and V at the states' angles; return its contribution to T [N] and M0 [N m]
        there."""
        amplitudes, (side, moment) = self._amplitudes(states), self._unit_reactions
        curvature_series[: self.terms] += self._unit_curvature @ amplitudes
        deflection_series[: self.terms] += self._unit_deflection @ amplitudes
        return side @ amplitudes, moment @ amplitudes

    def _amplitudes(self, states: Array) -> Array:
        """d at the states' angles, (basis, angles).

        Within a step that replaces a jump of the force the total deflection stays at its value outside, so that d
        changes by the opposite of the quasi-static shape.
        """
        angle, excitation = np.ascontiguousarray(states[ANGLE]), self.excitation
        outside = off_jumps(angle, excitation.jumps)
        amplitudes, within = self.motion.at(outside), outside != angle
        if within.any():
            sides = states_at(excitation.drive, excitation.strip, outside[within])
            equation, inside = self._equation, np.ascontiguousarray(states[:, within])
            static, outside_static = (quasi_static(equation, states)[1] for states in (inside, sides))
            amplitudes[:, within] += equation.modes @ (outside_static - static).T
        return amplitudes

    @cached_property
    def _equation(self) -> StripEquation:
        e, polynomials = self.excitation, self.motion.basis.polynomials
        return StripEquation.of(e.strip, e.inertia, e.mean, polynomials, 0.0)


def _vibration(cycle: Cycle) -> SteadyVibration:
    """Compute to half the cycle's tolerance; if that requires elements too narrow for series, to the least error found
    with larger tolerances."""
    tolerance, best = max(0.5 * cycle.tolerance, LEAST_ERROR), None
    while best is None or (
        best.error > _FAR_FROM_TOLERANCE * tolerance
        and tolerance < _LARGEST_TOLERANCE
        and best.excitation.corners.size <= FEW_CORNERS
    ):
        vibration = _resolved(cycle, tolerance, optional=tolerance < _LARGEST_TOLERANCE)
        known = (each for each in (best, vibration) if each is not None)
        best = min(known, key=lambda each: each.error, default=None)
        tolerance *= _RELAXATION
    if best.motion.amplification > _RESONANT_AMPLIFICATION and not best.error < _LARGEST_ERROR:
        if best.motion.errors.excited > _LARGEST_ERROR:
            raise unknown_vibration()
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        )
    return best


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


def _equation(cycle: Cycle, excitation: Excitation, level: int) -> StripEquation:
    loss = cycle.scene.material.loss_factor
    return StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, POLYNOMIAL_COUNTS[level], loss)


def _vibration_of(found: Motion, excitation: Excitation, frequency: float) -> SteadyVibration:
    remainder = (excitation.corners.size + _DISCONTINUITIES) / (0.5 * TURN * frequency)
    return SteadyVibration(found, found.errors.total, found.errors.of_mean(min(remainder, 1.0)), excitation)


def _resolved(cycle: Cycle, tolerance: float, *, optional: bool) -> SteadyVibration | None:
    """Compute motions of increasing resolution, refined where the error is largest, until the tolerance is met or
    refinement no longer helps. None, if ``optional``, where more slow modes are required than are affordable, as under
    steep rises of the pressure."""
    excitation = Excitation.of(cycle, 0.1 * tolerance)
    level = sum(tolerance < bound for bound in (_LEVELS_WITH_CORNERS if excitation.corners.size else _LEVELS))
    equation, step = _equation(cycle, excitation, level), _largest_step(excitation, tolerance)
    slow, many = _slow_modes(equation, excitation, tolerance), excitation.corners.size > FEW_CORNERS
    # Enough polynomials to represent the slow modes, except under a table, where fewer of them are better than fewer
    # slow modes.
    while not many and _known_modes(level) < slow and level + 1 < len(POLYNOMIAL_COUNTS):
        level += 1
        equation = _equation(cycle, excitation, level)
        slow = _slow_modes(equation, excitation, tolerance)
    for lower in range(level, -1, -1):
        candidate = _equation(cycle, excitation, lower) if lower < level else equation
        represents = many or lower == level or _known_modes(lower) >= slow
        if represents and _affordable(candidate, excitation, slow, step, MOST_WORK) >= slow:
            level, equation = lower, candidate
            break
    if not many and _affordable(equation, excitation, slow, step, MOST_WORK) < slow - 1:
        if optional:
            return None
        affordable_work = ENOUGH_WORK if cycle.tolerance < _LOW_ACCURACY else _ENOUGH_WORK_MANY_CORNERS
        level, known = -1, -1
        while known < slow:
            level += 1
            equation = _equation(cycle, excitation, level)
            known, slow = _known_modes(level), _affordable(equation, excitation, slow, step, affordable_work)
    work_limit = (
        (_ENOUGH_WORK_LOW_ACCURACY if tolerance > _LOW_ACCURACY else _ENOUGH_WORK_MANY_CORNERS) if many else ENOUGH_WORK
    )
    best, fruitless, previous, work = None, 0, np.inf, 0.0
    for _ in range(_MAX_ATTEMPTS):
        slow = _affordable(equation, excitation, slow, step, MOST_WORK)
        found = motion(equation, excitation, slow, step, tolerance)
        errors, fruitless = found.errors, fruitless + 1
        work += _work_with_corners(found, level) if many else _work(found.edges.size - 1, slow, equation.masses.size)
        if best is None or errors.total < best.error:
            best, fruitless = _vibration_of(found, excitation, float(equation.frequencies[0])), 0
        if errors.total <= cycle.tolerance or fruitless == _MAX_FRUITLESS or work > work_limit:
            break
        other_errors = max(errors.series, errors.phase, errors.excited)
        if max(errors.space, errors.omitted) > max(errors.elements, other_errors):
            all_ring = errors.omitted > errors.space and found.ringing.modes == MOST_RINGING
            if all_ring or level == len(POLYNOMIAL_COUNTS) - 1:
                break
            if many or excitation.jumps.size:
                behind_jumps = _DECAY_BEHIND_JUMPS if equation.loss else _DECAY_UNDAMPED
                decay = behind_jumps if excitation.jumps.size else _DECAY
                level = _sufficient_level(level, errors, tolerance, decay)
            else:
                level += 1
            if level == len(POLYNOMIAL_COUNTS) or (many and work + _work_with_corners(found, level) > work_limit):
                break
            equation = _equation(cycle, excitation, level)
            continue
        worst = _worst_elements(equation, excitation, slow, found)
        # Provided that halving elements reduced the error the last time.
        if errors.elements > other_errors and errors.elements < 0.5 * previous and worst.any():
            previous, excitation, step = errors.elements, excitation.refined(worst), _STEP_REDUCTION * step
        elif work + _expected_work(equation, excitation, slow + 1, step) > work_limit:
            break
        else:
            slow, previous = slow + 1, np.inf
    return best


def _sufficient_level(level: int, errors: Errors, tolerance: float, decay: float) -> int:
    """Level expected to suffice by the decrease of the error; beyond the last one if none does, as with noise, where a
    further attempt is not worth its time."""
    required = _known_modes(level) * (2.0 * max(errors.omitted, errors.space) / tolerance) ** (1.0 / decay)
    higher = range(level + 1, len(POLYNOMIAL_COUNTS))
    return next((number for number in higher if _known_modes(number) >= required), len(POLYNOMIAL_COUNTS))


def _known_modes(level: int) -> int:
    """Number of modes that the polynomials of a level represent (``omitted.known_modes``)."""
    return (POLYNOMIAL_COUNTS[level] - 1) // 2 - 1


def _largest_step(excitation: Excitation, tolerance: float) -> float:
    """Phase of the fastest slow mode over an element [rad]: larger steps have never sufficed. With corners that mode
    rings and needs smaller ones."""
    if not excitation.corners.size:
        return 8.0 if tolerance > 1e-6 else 6.0 if tolerance > 1e-10 else 4.5
    return 8.0 if tolerance > 1e-6 else 6.0 if tolerance > 1e-8 else 4.0 if tolerance > 1e-9 else 3.0


def _slow_modes(equation: StripEquation, excitation: Excitation, tolerance: float) -> int:
    """Number of slow modes: those that the force excites because it changes fast, or for which elements between many
    corners are too narrow for series. With few corners at least one that does not turn too often, as integrating it
    takes less time than its ringing."""
    analytic, width_phase, change_phase = least_phases(equation, excitation.edges, excitation.smoothness)
    many = excitation.corners.size > FEW_CORNERS
    least_width = _LEAST_WIDTH_PHASE if tolerance > _LOW_ACCURACY else NARROW
    sufficient = width_phase > least_width if many else change_phase > _LEAST_CHANGE_PHASE
    follows = (np.exp(-analytic / EXPONENT) < tolerance) & sufficient
    least = int(excitation.corners.size > 0 and TURN * equation.frequencies[0] < _QUICKLY_INTEGRATED)
    return max(int(np.argmax(np.append(follows[:-1], True))), least)


def _worst_elements(equation: StripEquation, excitation: Excitation, slow: int, found: Motion) -> NDArray[np.bool_]:
    """Mask of the excitation's elements whose errors are large and whose halves are not too narrow."""
    time = found.errors.time
    places = 0.5 * (found.edges[:-1] + found.edges[1:])[time > _LARGE_ERROR * time.max()]
    where = np.zeros(excitation.edges.size - 1, dtype=np.bool_)
    where[np.searchsorted(excitation.edges, places) - 1] = True
    half_phase = 0.5 * equation.frequencies[min(slow, equation.masses.size - 1)] * np.diff(excitation.edges)
    return where & (half_phase > _LEAST_HALF_PHASE)


def _affordable(equation: StripEquation, excitation: Excitation, slow: int, step: float, work_limit: float) -> int:
    """Number of slow modes within the limit of the work, at most ``slow``."""
    for m in range(min(slow, equation.masses.size), 0, -1):
        if _expected_work(equation, excitation, m, step) <= work_limit:
            return m
    return 0


def _expected_work(equation: StripEquation, excitation: Excitation, slow: int, step: float) -> float:
    """Expected work with a number of slow modes."""
    frequency = equation.frequencies[min(slow, equation.masses.size) - 1]
    elements = np.sum(np.ceil(np.diff(excitation.edges) * _FREQUENCY_MARGIN * frequency / step))
    return _work(elements, slow, equation.masses.size)


def _work_with_corners(found: Motion, level: int) -> float:
    """Work of a motion with many corners at a level of resolution, where much is due to ringing."""
    modes, slow, ringing = POLYNOMIAL_COUNTS[level] - 1, found.slow, found.ringing
    slow_work = (2 * slow + 1) * (found.edges.size - 1)
    ringing_work = max(ringing.modes, modes // 2 - 1 - slow) * (ringing.edges.size - 1)
    return (slow_work + ringing.points.size / RULE.points.size * ringing_work) * (modes + 5 * slow) ** 2


def _work(elements: float, slow: int, modes: int) -> float:
    """Work of a motion, approximately proportional to its computing time."""
    return elements * (2 * slow + 1) * (modes + 5 * slow) ** 2
