"""How fast modes ring behind corners of the force.

What a fast mode would do on the two sides of a corner without ringing (``slow_modes``) differs, and since its amplitude
and speed are continuous the difference rings on (``free_modes``), as much as closing the turn makes of it. States hold
amplitudes and speeds, the latter times sqrt(mu), so that a free motion keeps its length; first the amplitudes of the
slow modes, then their speeds, then amplitude and speed of every fast mode.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.numerics.ripple import Ripple, ripple_of
from solvers.rod.cycle.state import FORCE
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import TURN
from solvers.rod.vibration.free_modes import free_mode
from solvers.rod.vibration.turn import Turn

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MOST_TIMES = 8
_CLOSING = 3.0
"""By which closing the turn is taken to enlarge the ringing of modes whose phases are not worth knowing."""
_PHASED = 8
"""So many of the fast modes have phases worth knowing."""


@kernel
def rung(
    equation: StripEquation, turn: Turn, begun: Array, rule: Radau, edges: Array, panels: NDArray[np.int64],
    states: Array, forces: Array, greatest: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """By which closing the turn enlarges what every fast mode rings with (fast,); what each rings with beside every
    corner, as shares of V'' and V''' at the clamp, (2, corners, fast); and what it is given by all corners together, as
    a share of the one that suffers more (fast,).

    At a corner a mode of the strip as it is there is given what differs between the two sides; on its way to the next
    one it turns and is damped. Modes whose phases are not known are taken to ring in step with every corner. From the
    panels' first states (panels, 2 m), states at the rule's points between ``edges``, of which ``panels`` begin panels,
    the ``forces`` [N] behind the corners, and the greatest V'' and V'''.
    """
    m, n, corners, slowness = turn.slow, equation.slowness.size, panels.size, equation.slowness
    fast, root, damping = n - m, np.sqrt(slowness), equation.loss * np.sqrt(slowness)
    phase = _phases(equation, rule, edges, states, m)
    phased, enlarged = phase.shape[1], np.full(fast, _CLOSING)
    for k in range(phased):
        kept, angle = math.exp(-0.5 * TURN * damping[m + k] / slowness[m + k]), 0.0
        for e in range(phase.shape[0]):
            angle += phase[e, k]
        left = math.hypot(1.0 - kept, 2.0 * math.sqrt(kept) * math.sin(0.5 * angle))
        enlarged[k] = 1.0 / min(max(left, 1e-300), 1.0)
    given, kept = np.zeros((corners, fast), np.complex128), np.empty((corners, fast), np.complex128)
    share, total, matrix, jump = np.empty((2, corners, fast)), np.zeros(fast), np.empty((n, n)), np.empty((2, fast))
    for c in range(corners):
        jump[:] = 0.0
        for row in range(2 * m + 1):
            here, before = (begun[c, row], begun[c - 1, row]) if row < 2 * m else (1.0, 1.0)
            for k in range(fast):
                for q in range(2):
                    at = 2 * (m + k) + q
                    jump[q, k] += here * turn.lefts[c, row, at] - before * turn.rights[c - 1, row, at]
        swing = equation.strip.couples * forces[c] - equation.mean
        for i in range(n):
            for j in range(n):
                matrix[i, j] = ((1.0 if i == j else 0.0) + swing * equation.coupling[i, j]) / (root[i] * root[j])
        square, own = np.linalg.eigh(matrix)
        for k in range(fast):
            # A mode has the same sign at every corner.
            sign, amplitude, speed = 1.0 if own[m + k, m + k] >= 0.0 else -1.0, 0.0, 0.0
            for j in range(fast):
                amplitude += jump[0, j] * root[m + j] * own[m + j, m + k] * sign
                speed += jump[1, j] * own[m + j, m + k] * sign
            given[c, k] = amplitude - 1j * speed / math.sqrt(square[m + k])
            for q in range(2):
                seen = 0.0
                for j in range(n):
                    seen += equation.clamp[q, j] / root[j] * own[j, m + k]
                share[q, c, k] = abs(seen) / greatest[q]
            total[k] += abs(given[c, k]) * max(share[0, c, k], share[1, c, k])
            if k >= phased:
                given[c, k] = abs(given[c, k])
            rate = 0.0j
            for e in range(panels[c], panels[c + 1] if c + 1 < corners else edges.size - 1):
                rate -= 0.5 * (edges[e + 1] - edges[e]) * damping[m + k] / slowness[m + k]
                if k < phased:
                    rate += 1j * phase[e, k]
            kept[c, k] = np.exp(rate)
    amplitudes = _repeating(given, kept)
    for c in range(corners):
        for k in range(fast):
            for q in range(2):
                share[q, c, k] *= amplitudes[c, k]
    return enlarged, share, total


@kernel
def _phases(equation: StripEquation, rule: Radau, edges: Array, states: Array, slow: int) -> Array:
    """By how much the first fast modes turn in every element [rad], to the leading order: (elements, modes), from the
    states at the rule's points."""
    n, p, count = equation.slowness.size, rule.points.size, edges.size - 1
    phase = np.zeros((count, min(_PHASED, n - slow)))
    for e in range(count):
        for i in range(p):
            swing = equation.strip.couples * states[FORCE, e * p + i] - equation.mean
            for m in range(phase.shape[1]):
                mode = slow + m
                stiffness = 1.0 + swing * equation.coupling[mode, mode]
                own = stiffness
                # What the other modes do in step with one, as they are by themselves.
                for k in range(n):
                    if k != mode:
                        away = 1.0 + swing * equation.coupling[k, k]
                        away -= own * equation.slowness[k] / equation.slowness[mode]
                        stiffness -= (swing * equation.coupling[mode, k]) ** 2 / away
                rate = math.sqrt(max(stiffness, 0.01) / equation.slowness[mode])
                phase[e, m] += (edges[e + 1] - edges[e]) * rule.integral[p - 1, i] * rate
    return phase


@kernel
def _repeating(given: Complex, kept: Complex) -> Array:
    """The greater of the amplitudes before and behind every corner of a turn, (corners, modes), that repeat themselves,
    from what is given there and by which factor it goes on to the next corner."""
    count, modes = given.shape
    out = np.empty((count, modes))
    for n in range(modes):
        total, left = 0.0j, 1.0 + 0.0j
        for k in range(count):
            total = (total + given[k, n]) * kept[k, n]
            left *= kept[k, n]
        missing = 1.0 - left
        total = total / (missing if abs(missing) > 1e-300 else 1e-300 + 0.0j)
        for k in range(count):
            out[k, n] = max(abs(total), abs(total + given[k, n]))
            total = (total + given[k, n]) * kept[k, n]
    return out


class FreeModes(NamedTuple):
    """Fast modes that may ring, from the ``first`` on, on elements between ``edges`` (elements + 1,) of which those of
    ``panels`` lie behind corners: ``shape`` (modes, elements, points, all modes) of a free motion that grows as
    exp(``phase``) (modes, elements, points) from the element's first end, and by ``since`` (modes, elements) from the
    last corner to there; ``missed`` (modes,) are errors of the phase over the turn [rad]. States ``behind`` corners and
    ``before`` the next ones, of the modes up to the last one that rings, are for the real and the imaginary part of
    each one's amplitude behind the corner: (panels, 2 modes, states)."""

    edges: Array
    panels: NDArray[np.int64]
    shape: Complex
    phase: Complex
    since: Complex
    missed: Array
    behind: Array
    before: Array


@kernel
def free_modes(
    equation: StripEquation, rule: Radau, edges: Array, panels: NDArray[np.int64], states: Array, first: int,
    enough: Array,
) -> FreeModes:  # fmt: skip
    """With errors of the phases that are ``enough`` on every element, (modes,), from states (rows, elements points) at
    the points of the ``rule``."""
    m, n, ringing, p, count = first, equation.slowness.size, enough.size, rule.points.size, edges.size - 1
    last, swing, widths = first + ringing, np.empty((count, p)), np.diff(edges)
    for e in range(count):
        for i in range(p):
            swing[e, i] = equation.strip.couples * states[FORCE, e * p + i] - equation.mean
    damping, missed = equation.loss * np.sqrt(equation.slowness), np.zeros(ringing)
    shapes = np.empty((ringing, count, p, n), np.complex128)
    phases = np.empty((ringing, count, p), np.complex128)
    since = np.empty((ringing, count), np.complex128)
    behind, before = np.empty((panels.size, 2 * ringing, 2 * last)), np.empty((panels.size, 2 * ringing, 2 * last))
    for r in range(ringing):
        shape, rate, phase, error = free_mode(
            m + r, widths, swing, equation.slowness, damping, equation.coupling, rule, enough[r], _MOST_TIMES
        )
        panel, gone = 0, 0.0j
        for e in range(count):
            missed[r] += error[e]
            if panel < panels.size and panels[panel] == e:
                panel, gone = panel + 1, 0.0j
            since[r, e] = np.exp(gone)
            gone += phase[e, p - 1]
            for i in range(p):
                phases[r, e, i] = phase[e, i]
                for a in range(n):
                    shapes[r, e, i, a] = shape[e, i, a]
        for k in range(panels.size):
            stop = (panels[k + 1] if k + 1 < panels.size else count) - 1
            for out, e, i in ((behind, panels[k], 0), (before, stop, p - 1)):
                grown = since[r, e] * np.exp(phase[e, i])
                for a in range(last):
                    # Slow modes' amplitudes, then their speeds; fast modes' by turns.
                    place, speed = (a, m + a) if a < m else (2 * a, 2 * a + 1)
                    one, other = shape[e, i, a] * grown, rate[e, i, a] * grown * np.sqrt(equation.slowness[a])
                    out[k, 2 * r, place], out[k, 2 * r + 1, place] = one.real, -one.imag
                    out[k, 2 * r, speed], out[k, 2 * r + 1, speed] = other.real, -other.imag
    return FreeModes(edges, panels, shapes, phases, since, missed, behind, before)


@kernel
def ringing_of(free: FreeModes, modes: Array, begun: Complex, rule: Radau) -> Ripple:
    """With the amplitudes behind the corners (panels, modes) and the equation's ``modes``; parts of the ripple are
    amplitudes of the basis."""
    ringing, count, p, n = free.shape.shape
    start, phase = np.empty((count, ringing), np.complex128), np.empty((count, ringing, p), np.complex128)
    parts, panel = np.empty((count, ringing, p, 2, n)), -1
    for e in range(count):
        if panel + 1 < free.panels.size and free.panels[panel + 1] == e:
            panel += 1
        for r in range(ringing):
            start[e, r] = begun[panel, r] * free.since[r, e]
            for i in range(p):
                phase[e, r, i] = free.phase[r, e, i]
                for a in range(n):
                    parts[e, r, i, 0, a], parts[e, r, i, 1, a] = (
                        free.shape[r, e, i, a].real,
                        free.shape[r, e, i, a].imag,
                    )
    shape = np.dot(parts.reshape(count * ringing * p * 2, n), modes.T)
    return ripple_of(free.edges, start, phase, shape.reshape(count, ringing, p, 2, modes.shape[0]), rule)
