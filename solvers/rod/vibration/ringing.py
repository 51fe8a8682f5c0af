"""How fast modes ring behind corners of the force.

What a fast mode would do on the two sides of a corner without ringing (``slow_modes``) differs, and since its amplitude
and speed are continuous the difference rings on (``free_modes``), as much as closing the turn makes of it. States hold
amplitudes and speeds, the latter times sqrt(mu), so that a free motion keeps its length; first the amplitudes of the
slow modes, then their speeds, then amplitude and speed of every fast mode.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.numerics.ripple import Ripple, ripple_of
from solvers.rod.cycle.state import FORCE
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import RULE, TURN, Excitation
from solvers.rod.vibration.free_modes import free_mode

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MOST_TIMES = 8
_CLOSING = 3.0
"""By which closing the turn is taken to enlarge the ringing of modes whose phases are not worth knowing."""
_PHASED = 8
"""So many of the fast modes have phases worth knowing."""

_MARGIN = 2.0
"""On the ringing of what is left out."""


def phases(equation: StripEquation, rule: Radau, edges: Array, states: Array, slow: int) -> Array:
    """By how much the first fast modes turn in every element [rad], to the leading order: (elements, modes), from the
    states at the rule's points."""
    swing, count = equation.swing(states)[:, None, None], equation.slowness.size
    own, n = np.diag(equation.coupling), np.arange(slow, min(slow + _PHASED, count))
    stiffness = 1.0 + swing[:, 0] * own[n]
    # What the other modes do in step with one, as they are by themselves.
    away = 1.0 + swing * own - stiffness[..., None] * (equation.slowness / equation.slowness[n, None])
    away[:, np.arange(n.size), n] = np.inf
    stiffness -= np.sum((swing * equation.coupling[n]) ** 2 / away, axis=2)
    rate, widths = np.sqrt(np.maximum(stiffness, 0.01) / equation.slowness[n]), np.diff(edges)
    return widths[:, None] * (rule.integral[-1] @ rate.reshape(widths.size, rule.points.size, n.size))


def closing(equation: StripEquation, phase: Array, slow: int) -> Array:
    """By which closing the turn enlarges what every fast mode rings with, from its ``phases``."""
    n = np.arange(slow, slow + phase.shape[1])
    out = np.full(equation.slowness.size - slow, _CLOSING)
    kept = np.exp(-0.5 * TURN * equation.damping[n] / equation.slowness[n])
    left = np.hypot(1.0 - kept, 2.0 * np.sqrt(kept) * np.sin(0.5 * phase.sum(axis=0)))
    out[: n.size] = 1.0 / np.clip(left, 1e-300, 1.0)
    return out


def rung(
    equation: StripEquation, excitation: Excitation, phase: Array, slow: int, jump: Array, greatest: Array
) -> tuple[Array, Array]:
    """What every fast mode rings with, and what it is given by all corners together, as shares of V'' or V''' at the
    clamp, whichever suffers more: (fast,) each.

    At a corner a mode of the strip as it is there is given what differs between the two sides; on its way to the next
    one it turns and is damped. Modes whose ``phases`` are not known are taken to ring in step with every corner. From
    jumps of the states of all modes (corners, 2 modes), amplitude and speed by turns, and the greatest V'' and V'''.
    """
    panels, phased = excitation.panels(excitation.edges), phase.shape[1]
    swing = equation.swing(excitation.states)[panels * RULE.points.size]
    root, n = np.sqrt(equation.slowness), np.arange(slow, equation.slowness.size)
    stiffness = np.eye(root.size) + swing[:, None, None] * equation.coupling
    square, own = np.linalg.eigh(stiffness / np.outer(root, root))
    # A mode has the same sign at every corner.
    own *= np.sign(np.einsum("cnn->cn", own))[:, None]
    share = np.max(np.abs(equation.clamp / root @ own) / greatest[:, None], axis=1)
    amplitude = ((jump[:, ::2] * root)[:, None] @ own)[:, 0]
    speed = (jump[:, 1::2][:, None] @ own)[:, 0] / np.sqrt(square)
    given, share = amplitude[:, slow:] - 1j * speed[:, slow:], share[:, slow:]
    total = np.sum(np.abs(given) * share, axis=0)
    given[:, phased:] = np.abs(given[:, phased:])
    rate = np.outer(np.diff(excitation.edges), -0.5 * equation.damping[n] / equation.slowness[n]).astype(np.complex128)
    rate[:, :phased] += 1j * phase
    amplitudes = _repeating(given, np.exp(np.add.reduceat(rate, panels)))
    return np.max(amplitudes * share, axis=0), total


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


def chosen(shares: Array, slow: int, most: int, wanted: float) -> tuple[int, float]:
    """How many fast modes are to ring, and what the others leave out, from what each would ring with.

    Of fewer than the slower half of all modes so few polynomials tell the frequencies to a hundredth of a radian in a
    turn; beyond these shares are taken to fall as n^-4. Behind a corner modes ring in step: their shares add up.
    """
    if not shares.size:
        # All modes are followed.
        return 0, 0.0
    known = max((shares.size + slow) // 2 - 1 - slow, 1)
    beyond = shares[known - 1] * (known + slow) / 3.0
    left = _MARGIN * (np.append(np.cumsum(shares[:known][::-1])[::-1], 0.0) + beyond)
    enough = np.flatnonzero(left <= 0.5 * wanted)
    ringing = min(int(enough[0]) if enough.size else known, most)
    return ringing, float(left[ringing])


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
