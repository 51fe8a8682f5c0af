"""Solution for the strip's periodic motion at a given resolution (see ``revolution`` for the method)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import split
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import radau
from solvers.numerics.ripple import no_ripple
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE
from solvers.rod.vibration.equation import SOFTEST, StripEquation, quasi_static
from solvers.rod.vibration.excitation import MANY, RULE, Excitation, Smoothness
from solvers.rod.vibration.motion import Errors, Motion
from solvers.rod.vibration.omitted import choose_ringing, error_of_means, omission_errors
from solvers.rod.vibration.revolution import assemble, periodic_solution
from solvers.rod.vibration.ringing import (
    estimate_ringing,
    free_modes,
    periodic_amplification,
    phases_of,
    ringing_of,
)
from solvers.rod.vibration.superposition import evaluate, superpose

MOST_RINGING = 16
"""Largest number of ringing modes."""
NARROW = 3.0
"""Phase advance of a mode over an element [rad] below which a series in derivatives loses digits."""
EXPONENT = 1.5
"""Safety factor on the exponent of ``excited_ringing``."""
_RULE_FOR_MANY = radau(5)
"""Rule for the phases and shapes of ringing modes on many narrow elements: they vary with the force only, and six
points have always been enough."""
_ROUNDING = 1e-15
_DECAY, _DECAY_BEHIND_JUMPS = 4.0, 2.0
"""Exponents with which ringing amplitudes in V''' decrease with the mode number, behind corners and behind jumps of the
force."""
_NO_FREE_STATES = np.empty((0, 0, 0))


def motion(equation: StripEquation, excitation: Excitation, slow: int, step: float, tolerance: float) -> Motion:
    """Compute the periodic motion with a number of ``slow`` modes, on elements over which the phase of the fastest of
    them advances by at most ``step`` [rad]. Series and ringing are truncated according to ``tolerance``."""
    m, modes, corners = slow, equation.masses.size, excitation.corners.size > 0
    edges, frequency = _elements(equation, excitation, m, step)
    states = excitation.states_on(edges, RULE)
    revolution = assemble(
        equation, RULE, *quasi_static(equation, states), edges, excitation.panels(edges), m, tolerance
    )
    initial, _, amplification = periodic_solution(revolution, _NO_FREE_STATES, _NO_FREE_STATES)

    ringing, mode_amplification, phase_tolerances = no_ripple(modes, RULE), np.ones(modes - m), np.empty(0)
    omitted = mean_omitted = phase_error = 0.0
    excited_smoothly = excited_ringing(equation, excitation, m + 1) if m < modes else 0.0
    if m < modes and not corners:
        excited_smoothly *= periodic_amplification(equation, phases_of(equation, RULE, edges, states, m), m)[0]
    if corners:
        static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
        coarse_edges = excitation.edges
        ringing_rule = _RULE_FOR_MANY if coarse_edges.size > MANY else RULE
        coarse_states, panels = excitation.states_on(coarse_edges, ringing_rule), excitation.panels(coarse_edges)
        forces = excitation.states[FORCE, panels * RULE.points.size]
        mode_amplification, ringing_shares, excited = estimate_ringing(
            equation, revolution, initial, ringing_rule, coarse_edges, panels, coarse_states, forces, static
        )
        decay = _DECAY_BEHIND_JUMPS if excitation.jumps.size else _DECAY
        count, omitted = choose_ringing(ringing_shares.max(axis=(0, 1)), m, decay, MOST_RINGING, tolerance)
        mean_omitted = error_of_means(equation, ringing_shares, m, decay, count) if omitted else 0.0
        if count:
            sensitivity = np.maximum(excited * mode_amplification**2, 1e-300)[:count]
            phase_tolerances = np.minimum(1e-1 * tolerance / sensitivity / revolution.widths.size, 1e-3)
            free = free_modes(equation, ringing_rule, coarse_edges, panels, coarse_states, m, phase_tolerances)
            initial, complex_amplitudes, amplification = periodic_solution(revolution, free.start, free.end)
            ringing = ringing_of(free, equation.modes, complex_amplitudes, ringing_rule)
            share = np.max(np.abs(equation.clamp[:, m : m + count]) / static[:, None], axis=0)
            largest = np.abs(complex_amplitudes).max(axis=0)
            phase_error = float(largest * share @ free.phase_errors) * max(amplification, 1.0)

    samples, series, space, time = evaluate(revolution, equation, RULE, states, initial, mode_amplification, corners)
    if omitted > 0.5 * tolerance and excitation.corners.size < MANY:
        omitted, mean_omitted = omission_errors(
            equation, excitation, RULE, edges, states, samples, ringing_shares, static, m, decay, count
        )
    errors = Errors(
        series=series,
        space=space,
        omitted=omitted,
        mean_omitted=mean_omitted,
        phase=phase_error,
        excited=excited_smoothly,
        time=time,
        mean_time=float(time @ revolution.widths) / TURN,
        rounding=_ROUNDING * amplification,
    )
    return Motion(
        equation.strip, equation.basis, edges, samples, ringing, errors, amplification, m, frequency, phase_tolerances
    )


def _elements(equation: StripEquation, excitation: Excitation, slow: int, step: float) -> tuple[Array, float]:
    """Edges of elements over which the phase of the fastest slow mode advances by at most ``step`` [rad], and the
    highest natural frequency of that mode [1/rad]."""
    if not slow:
        return excitation.edges, 0.0
    frequency = equation.frequency_of(slow, equation.strip.couples * excitation.smoothness.greatest - equation.mean)
    return split(excitation.edges, step / frequency), float(frequency.max())


def neighbouring_motion(
    found: Motion, found_excitation: Excitation, excitation: Excitation, loss: float, tolerance: float
) -> Motion:
    """The motion of a neighbouring strip at the resolution of one that was ``found`` with ``found_excitation``: the
    same numbers of modes, on elements that move with the corners (``Excitation.neighbour``). Its errors are assumed to
    be the same."""
    m = found.slow
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, found.basis.polynomials, loss)
    edges = np.interp(found.edges, found_excitation.anchors, excitation.anchors)
    states = excitation.states_on(edges, RULE)
    revolution = assemble(
        equation, RULE, *quasi_static(equation, states), edges, found_excitation.panels(found.edges), m, tolerance
    )
    ringing, free_start, free_end = found.ringing, _NO_FREE_STATES, _NO_FREE_STATES
    if found.phase_tolerances.size:
        ringing_rule, panels = radau(ringing.points.size - 1), found_excitation.panels(found_excitation.edges)
        coarse_edges, coarse_states = excitation.edges, excitation.states_on(excitation.edges, ringing_rule)
        free = free_modes(equation, ringing_rule, coarse_edges, panels, coarse_states, m, found.phase_tolerances)
        free_start, free_end = free.start, free.end
    initial, complex_amplitudes, amplification = periodic_solution(revolution, free_start, free_end)
    if found.phase_tolerances.size:
        ringing = ringing_of(free, equation.modes, complex_amplitudes, ringing_rule)
    return replace(
        found, strip=excitation.strip, basis=equation.basis, edges=edges, ringing=ringing, amplification=amplification,
        samples=superpose(revolution, equation, initial)[0],
    )  # fmt: skip


def excited_ringing(equation: StripEquation, excitation: Excitation, n: int) -> float:
    """Ringing of mode number n excited between corners, relative to a corner's and before it is amplified by the
    periodicity condition: about exp(-omega y) with y the distance of analyticity (``excitation``), with a safety factor
    on the exponent."""
    analytic, _, _ = least_phases(equation, excitation.edges, excitation.smoothness)
    return math.exp(-analytic[n - 1] / EXPONENT)


@kernel
def least_phases(equation: StripEquation, edges: Array, force: Smoothness) -> tuple[Array, Array, Array]:
    """Least phase advances [rad] of every mode, uncoupled, under the greatest compression of each element: within the
    distance of analyticity from the real axis; over the element's width; and, if the latter is less than ``NARROW``,
    over the scale on which the excitation changes, the square root of its greatest value over its second derivative."""
    n = equation.masses.size
    analytic, narrow, changing = np.full(n, np.inf), np.full(n, np.inf), np.full(n, np.inf)
    for k in range(n):
        for e in range(force.least.size):
            fluctuation = equation.strip.couples * force.least[e] - equation.mean
            stiffness = max(1.0 + fluctuation * equation.geometric[k, k], SOFTEST)
            frequency = math.sqrt(stiffness / equation.masses[k])
            analytic[k] = min(analytic[k], frequency * force.analytic[e])
            phase = frequency * (edges[e + 1] - edges[e])
            narrow[k] = min(narrow[k], phase)
            if phase < NARROW:
                changing[k] = min(changing[k], frequency / math.sqrt(max(force.curvature[e], 1e-300)))
    return analytic, narrow, changing
