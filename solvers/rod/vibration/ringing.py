"""Ringing: free vibration of fast modes excited at corners of the force.

At a corner the quasi-static motions of a fast mode (``slow_modes``) on the two sides differ. Since its amplitude and
speed are continuous, the difference continues as a free vibration (``free_modes``), whose amplitude follows from the
periodicity condition (``revolution``). Speeds in states are scaled by sqrt(mu), so that a free vibration preserves the
norm. A state holds the amplitudes of the slow modes, then their speeds, then amplitude and speed of each fast mode.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.arrays import Array, Complex
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import Radau
from solvers.numerics.ripple import Ripple, ripple_of
from solvers.rod.cycle.state import FORCE
from solvers.rod.vibration.equation import StripEquation, damping_of
from solvers.rod.vibration.free_modes import free_mode
from solvers.rod.vibration.revolution import Revolution

_MAX_ITERATIONS = 8
_UNPHASED_AMPLIFICATION = 3.0
"""Assumed amplification by the periodicity condition for modes whose phases are not computed."""
_MOST_PHASED = 8
"""Number of fast modes whose phases are computed."""


@kernel
def estimate_ringing(
    equation: StripEquation, revolution: Revolution, initial: Array, rule: Radau, edges: Array,
    panels: NDArray[np.int64], states: Array, forces: Array, greatest: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Estimate the ringing of all fast modes: its amplification by the periodicity condition (fast,); its amplitude
    next to every corner, as fractions of V'' and V''' at the clamp (2, corners, fast); and the total amplitude excited
    per revolution, as a fraction of whichever of the two it affects more (fast,).

    At a corner a mode, that of the strip under the force there, receives the difference between the two sides; towards
    the next corner its phase advances and it decays. Modes whose phases are not computed are assumed to be excited in
    phase at all corners. Inputs: the panels' initial states (panels, 2 m), states at the rule's points between
    ``edges``, the ``panels``' first elements, the ``forces`` [N] just behind the corners, and the greatest V'' and
    V'''.
    """
    m, n, corners, masses = revolution.slow, equation.masses.size, panels.size, equation.masses
    fast, root, damping = n - m, np.sqrt(masses), damping_of(equation)
    phases = phases_of(equation, rule, edges, states, m)
    phased, amplification = phases.shape[1], periodic_amplification(equation, phases, m)
    excited, propagation = np.zeros((corners, fast), np.complex128), np.empty((corners, fast), np.complex128)
    amplitude_share, total, matrix = np.empty((2, corners, fast)), np.zeros(fast), np.empty((n, n))
    jump = np.empty((2, fast))
    for c in range(corners):
        jump[:] = 0.0
        for row in range(2 * m + 1):
            after, before = (initial[c, row], initial[c - 1, row]) if row < 2 * m else (1.0, 1.0)
            for k in range(fast):
                for q in range(2):
                    index = 2 * (m + k) + q
                    jump[q, k] += after * revolution.start[c, row, index] - before * revolution.end[c - 1, row, index]
        fluctuation = equation.strip.couples * forces[c] - equation.mean
        for i in range(n):
            for j in range(n):
                matrix[i, j] = ((1.0 if i == j else 0.0) + fluctuation * equation.geometric[i, j]) / (root[i] * root[j])
        squares, vectors = np.linalg.eigh(matrix)
        for k in range(fast):
            # Eigenvectors with the same sign at every corner.
            sign, amplitude, speed = 1.0 if vectors[m + k, m + k] >= 0.0 else -1.0, 0.0, 0.0
            for j in range(fast):
                amplitude += jump[0, j] * root[m + j] * vectors[m + j, m + k] * sign
                speed += jump[1, j] * vectors[m + j, m + k] * sign
            excited[c, k] = amplitude - 1j * speed / math.sqrt(squares[m + k])
            for q in range(2):
                output = 0.0
                for j in range(n):
                    output += equation.clamp[q, j] / root[j] * vectors[j, m + k]
                amplitude_share[q, c, k] = abs(output) / greatest[q]
            total[k] += abs(excited[c, k]) * max(amplitude_share[0, c, k], amplitude_share[1, c, k])
            if k >= phased:
                excited[c, k] = abs(excited[c, k])
            exponent = 0.0j
            for e in range(panels[c], panels[c + 1] if c + 1 < corners else edges.size - 1):
                exponent -= 0.5 * (edges[e + 1] - edges[e]) * damping[m + k] / masses[m + k]
                if k < phased:
                    exponent += 1j * phases[e, k]
            propagation[c, k] = np.exp(exponent)
    amplitudes = _periodic_amplitudes(excited, propagation)
    for c in range(corners):
        for k in range(fast):
            for q in range(2):
                amplitude_share[q, c, k] *= amplitudes[c, k]
    return amplification, amplitude_share, total


@kernel
def periodic_amplification(equation: StripEquation, phases: Array, slow: int) -> Array:
    """Amplification of the fast modes' ringing by the periodicity condition (fast,), at least 1.

    1/|1 - exp(i psi - d)| for a phase advance psi and a decay d over the revolution, from the ``phases`` (elements,
    modes) of the first modes.
    """
    amplification = np.full(equation.masses.size - slow, _UNPHASED_AMPLIFICATION)
    for k in range(phases.shape[1]):
        decay, angle = math.exp(-0.5 * TURN * equation.loss / math.sqrt(equation.masses[slow + k])), 0.0
        for e in range(phases.shape[0]):
            angle += phases[e, k]
        distance = math.hypot(1.0 - decay, 2.0 * math.sqrt(decay) * math.sin(0.5 * angle))
        amplification[k] = 1.0 / min(max(distance, 1e-300), 1.0)
    return amplification


@kernel
def phases_of(equation: StripEquation, rule: Radau, edges: Array, states: Array, slow: int) -> Array:
    """Phase advance of the first fast modes over every element [rad], to leading order: (elements, modes), from the
    states at the rule's points."""
    n, p, count = equation.masses.size, rule.points.size, edges.size - 1
    phases = np.zeros((count, min(_MOST_PHASED, n - slow)))
    for e in range(count):
        for i in range(p):
            fluctuation = equation.strip.couples * states[FORCE, e * p + i] - equation.mean
            for m in range(phases.shape[1]):
                mode = slow + m
                stiffness = 1.0 + fluctuation * equation.geometric[mode, mode]
                uncoupled = stiffness
                # Second-order perturbation by the other modes, each uncoupled.
                for k in range(n):
                    if k != mode:
                        gap = 1.0 + fluctuation * equation.geometric[k, k]
                        gap -= uncoupled * equation.masses[k] / equation.masses[mode]
                        stiffness -= (fluctuation * equation.geometric[mode, k]) ** 2 / gap
                rate = math.sqrt(max(stiffness, 0.01) / equation.masses[mode])
                phases[e, m] += (edges[e + 1] - edges[e]) * rule.integral[p - 1, i] * rate
    return phases


@kernel
def _periodic_amplitudes(excited: Complex, propagation: Complex) -> Array:
    """Periodic amplitudes (corners, modes), the larger of those before and behind each corner, from the amplitude
    excited there and its propagation factor to the next corner."""
    count, modes = excited.shape
    largest = np.empty((count, modes))
    for n in range(modes):
        total, monodromy = 0.0j, 1.0 + 0.0j
        for k in range(count):
            total = (total + excited[k, n]) * propagation[k, n]
            monodromy *= propagation[k, n]
        gap = 1.0 - monodromy
        total = total / (gap if abs(gap) > 1e-300 else 1e-300 + 0.0j)
        for k in range(count):
            largest[k, n] = max(abs(total), abs(total + excited[k, n]))
            total = (total + excited[k, n]) * propagation[k, n]
    return largest


class FreeModes(NamedTuple):
    """Free vibration of the fast modes from ``first`` on.

    edges         of the elements, (elements + 1,); those of ``panels`` lie just behind corners
    shape         y of ``free_modes`` (modes, elements, points, all modes)
    phase         int x dphi from the element's start (modes, elements, points)
    from_corner   factor of growth from the panel's corner to the element's start (modes, elements)
    phase_errors  over the revolution [rad], (modes,)
    start, end    states at the panels' two ends, of the modes up to the last that rings, for unit real and imaginary
                  parts of each amplitude behind the corner (panels, 2 modes, states)
    """

    edges: Array
    panels: NDArray[np.int64]
    shape: Complex
    phase: Complex
    from_corner: Complex
    phase_errors: Array
    start: Array
    end: Array


@kernel
def free_modes(
    equation: StripEquation, rule: Radau, edges: Array, panels: NDArray[np.int64], states: Array, first: int,
    phase_tolerance: Array,
) -> FreeModes:  # fmt: skip
    """Compute the free vibration of modes, with ``phase_tolerance`` (modes,) per element, from states (rows, elements
    points) at the points of the ``rule``."""
    m, n, ringing, p, count = first, equation.masses.size, phase_tolerance.size, rule.points.size, edges.size - 1
    last, fluctuation, widths = first + ringing, np.empty((count, p)), np.diff(edges)
    for e in range(count):
        for i in range(p):
            fluctuation[e, i] = equation.strip.couples * states[FORCE, e * p + i] - equation.mean
    damping, phase_errors = damping_of(equation), np.zeros(ringing)
    shapes = np.empty((ringing, count, p, n), np.complex128)
    phases = np.empty((ringing, count, p), np.complex128)
    from_corner = np.empty((ringing, count), np.complex128)
    start, end = np.empty((panels.size, 2 * ringing, 2 * last)), np.empty((panels.size, 2 * ringing, 2 * last))
    for r in range(ringing):
        shape, rate, phase, error = free_mode(
            m + r, widths, fluctuation, equation.masses, damping, equation.geometric, rule, phase_tolerance[r],
            _MAX_ITERATIONS,
        )  # fmt: skip
        panel, exponent = 0, 0.0j
        for e in range(count):
            phase_errors[r] += error[e]
            if panel < panels.size and panels[panel] == e:
                panel, exponent = panel + 1, 0.0j
            from_corner[r, e] = np.exp(exponent)
            exponent += phase[e, p - 1]
            for i in range(p):
                phases[r, e, i] = phase[e, i]
                for a in range(n):
                    shapes[r, e, i, a] = shape[e, i, a]
        for k in range(panels.size):
            last_element = (panels[k + 1] if k + 1 < panels.size else count) - 1
            for states_out, e, i in ((start, panels[k], 0), (end, last_element, p - 1)):
                factor = from_corner[r, e] * np.exp(phase[e, i])
                for a in range(last):
                    # Slow modes: amplitudes, then speeds; fast modes: amplitude and speed in turn.
                    row, speed_row = (a, m + a) if a < m else (2 * a, 2 * a + 1)
                    amplitude, velocity = shape[e, i, a] * factor, rate[e, i, a] * factor * np.sqrt(equation.masses[a])
                    states_out[k, 2 * r, row], states_out[k, 2 * r + 1, row] = amplitude.real, -amplitude.imag
                    states_out[k, 2 * r, speed_row], states_out[k, 2 * r + 1, speed_row] = velocity.real, -velocity.imag
    return FreeModes(edges, panels, shapes, phases, from_corner, phase_errors, start, end)


@kernel
def ringing_of(free: FreeModes, modes: Array, initial: Complex, rule: Radau) -> Ripple:
    """The ripple of free modes with given complex amplitudes behind the corners (panels, modes). Its parts are
    amplitudes of the basis, to which the equation's ``modes`` map those of the modes."""
    ringing, count, p, n = free.shape.shape
    amplitude, phase = np.empty((count, ringing), np.complex128), np.empty((count, ringing, p), np.complex128)
    parts, panel = np.empty((count, ringing, p, 2, n)), -1
    for e in range(count):
        if panel + 1 < free.panels.size and free.panels[panel + 1] == e:
            panel += 1
        for r in range(ringing):
            amplitude[e, r] = initial[panel, r] * free.from_corner[r, e]
            for i in range(p):
                phase[e, r, i] = free.phase[r, e, i]
                for a in range(n):
                    parts[e, r, i, 0, a] = free.shape[r, e, i, a].real
                    parts[e, r, i, 1, a] = free.shape[r, e, i, a].imag
    shape = np.dot(parts.reshape(count * ringing * p * 2, n), modes.T)
    return ripple_of(free.edges, amplitude, phase, shape.reshape(count, ringing, p, 2, modes.shape[0]), rule)
