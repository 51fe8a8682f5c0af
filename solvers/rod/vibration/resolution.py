"""The resolution of a motion: numbers of polynomials along the strip and of slow modes, and elements of the revolution.

The first one follows from the frequencies of the modes and from how fast the force changes. It is refined where the
estimated error is largest until the tolerance is met, refinement no longer helps, or the work exceeds its limit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.periodic import TURN
from solvers.rod.cycle.composition import Cycle
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import FEW_CORNERS, RULE, Excitation
from solvers.rod.vibration.motion import Errors, Motion
from solvers.rod.vibration.periodic_motion import EXPONENT, MOST_RINGING, NARROW, least_phases, motion

POLYNOMIAL_COUNTS = (9, 11, 13, 16, 20, 26, 34)
"""Numbers of polynomials along the strip, by level of resolution."""
_LEVELS, _LEVELS_WITH_CORNERS = (3e-6, 5e-8, 5e-10), (3e-6, 2e-7, 5e-9, 5e-9, 5e-10, 5e-10)
"""Tolerances below which a level has hardly ever sufficed, without and with corners; the latter need more modes."""

MOST_WORK, ENOUGH_WORK = 12_000_000, 6_000_000
"""Largest work of one motion, and of all but the last, as measured by ``_work``: 6 000 000 take about a tenth of a
second."""

_ENOUGH_WORK_MANY_CORNERS, _ENOUGH_WORK_LOW_ACCURACY, _LOW_ACCURACY = 1_850_000, 500_000, 1e-6
"""Largest work with more than ``FEW_CORNERS``, and if the tolerance is no smaller than the last of these."""
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


class Resolved(NamedTuple):
    """A motion, its excitation, and the lowest natural frequency [1/rad] under the mean force."""

    motion: Motion
    excitation: Excitation
    lowest_frequency: float


def resolved_motion(cycle: Cycle, tolerance: float, *, optional: bool) -> Resolved | None:
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
        if best is None or errors.total < best.motion.errors.total:
            best, fruitless = Resolved(found, excitation, float(equation.frequencies[0])), 0
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


def _equation(cycle: Cycle, excitation: Excitation, level: int) -> StripEquation:
    loss = cycle.scene.material.loss_factor
    return StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, POLYNOMIAL_COUNTS[level], loss)


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
