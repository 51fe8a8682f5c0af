"""The strip's periodic motion at one resolution, and what that leaves unknown.

Between two corners of the force slow modes, which anything may have set going, are followed by collocation and fast ones
follow them (``slow_modes``). What the fast modes would do on a corner's two sides differs; since amplitudes and speeds
are continuous, the difference rings on (``free_modes``), as much as closing the turn makes of it. Fast modes whose share
is too small to matter are left out; what they would ring with is known.

The state at a corner consists of amplitudes and speeds of the slow modes, then of the fast ones that ring; speeds are
times sqrt(mu), so that a free motion keeps its length. A panel's unknowns are the first states of its slow modes and the
real and imaginary parts of its ringing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau, radau
from solvers.rod.cycle.state import FORCE, MOMENT, ROWS, SIDE, Strip, fill_states
from solvers.rod.load.axial_force import Drive
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.free_modes import free_mode
from solvers.rod.vibration.slow_modes import Parts, carried, slow_motion
from solvers.rod.vibration.time_mesh import TURN, points, split

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RULE = radau(10)
_TERMS = 9
_RATES = 8
_UNKNOWN_CLOSING = 3.0
"""By which closing the turn is taken to enlarge the ringing of modes that are left out: their phases are not known."""

_ROUNDING = 1e-15


@dataclass(frozen=True)
class Excitation:
    """What drives a strip: ``corners`` of the force [rad] and ``edges`` of elements from the first of them on, between
    which it is a polynomial, with the states at ``RULE``'s points; ``inertia`` is rho A omega^2 [N/m^2]."""

    strip: Strip
    drive: Drive
    inertia: float
    corners: Array
    edges: Array
    states: Array

    @property
    def mean(self) -> float:
        """The mean axial force [N]."""
        weights = np.outer(np.diff(self.edges), RULE.integral[-1]).ravel() / TURN
        return float(weights @ self.states[FORCE])

    def at(self, angle: Array) -> Array:
        """The states at the angles, (rows, angles)."""
        return states_at(self.drive, self.strip, angle)

    def panels(self, edges: Array) -> NDArray[np.int64]:
        """The first elements behind the corners; without corners the first of the turn."""
        return np.searchsorted(edges, self.corners) if self.corners.size else np.zeros(1, dtype=np.int64)


def states_at(drive: Drive, strip: Strip, angle: Array) -> Array:
    """The states at the angles, (rows, angles)."""
    states = np.empty((ROWS, angle.size))
    fill_states(drive, strip, angle, states)
    return states


@dataclass(frozen=True)
class Resolution:
    """``polynomials`` along the strip, so many ``slow`` modes on elements in which the fastest of them turns by no more
    than ``step`` [rad], and at most so many ``ringing``."""

    polynomials: int
    slow: int
    step: float
    ringing: int


@dataclass(frozen=True)
class Ringing:
    """Free modes on the elements ``edges``: complex amplitudes at their first ends (elements, modes), the phases grown
    since then (elements, modes, points) and the shapes in amplitudes of the basis (elements, modes, points, basis)."""

    edges: Array
    start: Complex
    phase: Complex
    shape: Complex


@dataclass(frozen=True)
class Motion:
    """d, what inertia adds to the quasi-static shape: polynomials (elements, points, basis) on ``edges``, and ringing.

    ``errors`` holds, relative to the greatest V'' and V''' at the clamp, what the ``series`` of the fast modes, ``time``
    and ``space`` leave unknown, ``omitted`` ringing, and the phase of the other (``late``); ``amplification`` is that of
    closing the turn.
    """

    equation: StripEquation
    edges: Array
    samples: Array
    ringing: Ringing
    errors: dict[str, float]
    amplification: float

    @property
    def error(self) -> float:
        return sum(self.errors.values()) + _ROUNDING * self.amplification


def left_by_series(coefficients: Array) -> Array:
    """What a series leaves out, from the magnitudes of its last four terms (4, ...), after how pairs of them fall."""
    before, last = coefficients[:2].max(axis=0), coefficients[2:].max(axis=0)
    ratio = np.clip(last / np.maximum(before, 1e-300), 0.05, 0.9)
    return 2.0 * last * ratio / (1.0 - ratio)


def motion(excitation: Excitation, resolution: Resolution, wanted: float) -> Motion:
    """The periodic motion; more than ``wanted`` is not asked of series that could give more."""
    p, m = RULE.points.size, resolution.slow
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, resolution.polynomials)
    coarse, coarse_swing = excitation.edges, equation.swing(excitation.states).reshape(-1, p)
    edges = split(coarse, resolution.step / equation.fastest(m, coarse_swing.max(axis=1))) if m else coarse
    widths, first = np.diff(edges), excitation.panels(edges)
    states = excitation.at(points(edges, RULE))
    still = equation.still(states)
    parts, turned = _parts(equation, m)
    modes = equation.slowness.size
    right = (equation.right(states, still) @ turned).reshape(-1, p, modes)
    found = slow_motion(widths, equation.swing(states).reshape(-1, p), right, parts, RULE, 0.1 * wanted, _TERMS)
    columns, last, change, fell = found

    starts = np.zeros(widths.size, dtype=np.bool_)
    starts[first] = True
    maps = carried(last, starts)
    # Maps to states with the one in the last place that carries what is there by itself.
    onward = np.zeros((widths.size, 2 * m + 1, 2 * m + 1))
    onward[:, :, :-1], onward[:, -1, -1] = maps[:, 0], 1.0
    stop = np.append(first[1:], widths.size) - 1
    lefts = _states(columns[first], turned, widths[first], equation, 0)
    rights = onward[stop] @ _states(columns[stop], turned, widths[stop], equation, p - 1)
    lefts[:, :, : 2 * m], rights[:, :, : 2 * m] = np.eye(2 * m + 1, 2 * m), maps[stop, 1]

    static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / excitation.strip.stiffness
    share = np.max(np.abs(equation.clamp) / static[:, None], axis=0)
    slow, amplification = closed(lefts[:, :, : 2 * m], rights[:, :, : 2 * m])
    kicks = np.zeros(modes - m)
    if excitation.corners.size:
        state = np.concatenate([slow, np.ones((first.size, 1))], axis=1)[:, None]
        jump = (state @ lefts - np.roll(state @ rights, 1, axis=0))[:, 0]
        jump[:, : 2 * m] = 0.0
        at = equation.swing(states).reshape(-1, p)[first, 0]
        kicks = np.sum(np.max(_kicks(equation, at, jump) / static[:, None], axis=1), axis=0)[m:]
    ringing, omitted = _chosen(kicks, m, modes, resolution.ringing, wanted)
    ring, late = _no_ringing(p, modes), 0.0
    if ringing:
        slow, amplification, ring, late = _rung(
            excitation, equation, coarse_swing, lefts, rights, m, ringing, kicks, share, wanted
        )
    state = np.concatenate([slow, np.ones((first.size, 1))], axis=1)[np.cumsum(starts) - 1]
    begin = (state[:, None] @ onward)[:, 0]
    whole = (begin[:, None, None] @ columns)[:, :, 0] @ turned.T
    samples = whole - still.reshape(whole.shape)
    seen = samples @ equation.clamp.T
    greatest = np.maximum(static, 1e-300)
    changed = np.abs((begin[:, None, None] @ change)[:, :, 0]).max(axis=(0, 1))
    left = left_by_series(np.abs(np.einsum("tp,epq->teq", RULE.tail, seen))).max(axis=0)
    errors = {
        "series": float(np.max(changed / greatest)) * (fell / (1.0 - fell) if fell < 0.5 else 1.0),
        "time": float(np.max(left / greatest)),
        "space": _space(equation, samples, greatest),
        "omitted": omitted,
        "late": late,
    }
    samples = np.ascontiguousarray(samples @ equation.modes.T)
    return Motion(equation, edges, samples, ring, errors, amplification)


def _parts(equation: StripEquation, m: int) -> tuple[Parts, Array]:
    """The equation in coordinates of which the first m are modes and the rest makes G diagonal; these in modes."""
    rates, rest = np.linalg.eigh(equation.coupling[m:, m:])
    turned = np.eye(equation.slowness.size)
    turned[m:, m:] = rest
    parts = Parts(
        np.ascontiguousarray(equation.slowness[:m]),
        np.ascontiguousarray(equation.coupling[:m, :m]),
        np.ascontiguousarray(equation.coupling[:m, m:] @ rest),
        rates,
        (rest.T * equation.slowness[m:]) @ rest,
        np.ascontiguousarray(equation.clamp @ turned),
    )
    return parts, turned


def _states(columns: Array, turned: Array, widths: Array, equation: StripEquation, point: int) -> Array:
    """States of all modes at a point of elements: (elements, columns, 2 modes), those of slow modes left open."""
    m = (columns.shape[2] - 1) // 2
    out = np.empty((columns.shape[0], columns.shape[2], 2 * columns.shape[3]))
    fast = columns[..., m:] @ turned[m:, m:].T
    out[:, :, 2 * m :: 2] = fast[:, point]
    speed = np.tensordot(fast, RULE.first[point], axes=(1, 0)) / widths[:, None, None]
    out[:, :, 2 * m + 1 :: 2] = speed * np.sqrt(equation.slowness[m:])
    return out


def _kicks(equation: StripEquation, swing: Array, jump: Array) -> Array:
    """How much of V'' and V''' at the clamp rings in every mode of the strip as it is at the corners, from forces
    beside the mean (corners,) and jumps of the states of all modes there (corners, 2 modes): (corners, 2, modes)."""
    root = np.sqrt(equation.slowness)
    stiffness = np.eye(root.size) + swing[:, None, None] * equation.coupling
    square, own = np.linalg.eigh(stiffness / np.outer(root, root))
    shape = equation.clamp / root @ own
    amplitude = ((jump[:, ::2] * root)[:, None] @ own)[:, 0]
    speed = (jump[:, 1::2][:, None] @ own)[:, 0] / np.sqrt(square)
    return np.abs(shape) * np.hypot(amplitude, speed)[:, None]


def _chosen(kicks: Array, m: int, modes: int, most: int, wanted: float) -> tuple[int, float]:
    """How many fast modes are to ring, and what the others leave out.

    The faster half of the modes is not told well by so few polynomials; beyond the slower half kicks fall about as
    n^-6. Phases of many modes have nothing to do with each other, so that squares add up.
    """
    known = max(modes // 2 - m, 1)
    if not kicks.any():
        return 0, 0.0
    beyond = kicks[known - 1] ** 2 * (known + m) / 11.0
    left = _UNKNOWN_CLOSING * np.sqrt(np.append(np.cumsum(kicks[:known][::-1] ** 2)[::-1], 0.0) + beyond)
    enough = np.flatnonzero(left <= 0.3 * wanted)
    ringing = min(int(enough[0]) if enough.size else known, most)
    return ringing, float(left[ringing])


def _no_ringing(p: int, modes: int) -> Ringing:
    empty = np.zeros((1, 0, p), np.complex128)
    return Ringing(np.array([0.0, TURN]), empty[:, :, 0], empty, np.zeros((1, 0, p, modes), np.complex128))


def _rung(
    excitation: Excitation, equation: StripEquation, swing: Array, lefts: Array, rights: Array, m: int, ringing: int,
    kicks: Array, share: Array, wanted: float,
) -> tuple[Array, float, Ringing, float]:  # fmt: skip
    """The slow modes' first states of every panel and the ringing, closed together; what closing enlarges; what the
    phases of the ringing leave unknown."""
    widths, first = np.diff(excitation.edges), excitation.panels(excitation.edges)
    stop = np.append(first[1:], widths.size) - 1
    size = m + ringing
    left, right = np.zeros((2, first.size, 2 * size + 1, 2 * size))
    rows = np.append(np.arange(2 * m), 2 * size)
    left[:, rows], right[:, rows] = lefts[:, :, : 2 * size], rights[:, :, : 2 * size]
    root = np.sqrt(equation.slowness[:size])
    number = np.cumsum(np.isin(np.arange(widths.size), first)) - 1
    since, phases, shapes, misses = [], [], [], []
    for n in range(m, size):
        enough = min(1e-4 * wanted / max(kicks[n - m], 1e-300), 1e-3)
        shape, rate, phase, missed = free_mode(
            n, widths, swing, equation.slowness, equation.coupling, RULE, enough, _RATES
        )
        gone = np.cumsum(phase[:, -1]) - phase[:, -1]
        since.append(np.exp(gone - gone[first][number]))
        phases.append(phase)
        shapes.append(shape)
        misses.append(missed.sum())
        whole = since[-1][stop] * np.exp(phase[stop, -1])
        for into, e, point, factor in ((left, first, 0, np.ones(first.size)), (right, stop, -1, whole)):
            state = np.empty((first.size, 2 * size), np.complex128)
            # Slow modes have their amplitudes before their speeds.
            at = np.concatenate([np.arange(m), 2 * np.arange(m, size)])
            state[:, at] = shape[e, point, :size] * factor[:, None]
            at = np.concatenate([np.arange(m, 2 * m), 2 * np.arange(m, size) + 1])
            state[:, at] = rate[e, point, :size] * factor[:, None] * root
            into[:, 2 * n], into[:, 2 * n + 1] = state.real, -state.imag
    unknowns, amplification = closed(left, right)
    begun = unknowns[:, 2 * m :: 2] + 1j * unknowns[:, 2 * m + 1 :: 2]
    start = begun[number] * np.stack(since, axis=1)
    late = float(np.abs(begun).max(axis=0) * share[m:size] @ np.array(misses)) * max(amplification, 1.0)
    shape = np.stack(shapes, axis=1) @ equation.modes.T
    ring = Ringing(excitation.edges, start, np.stack(phases, axis=1), np.ascontiguousarray(shape))
    return unknowns[:, : 2 * m], amplification, ring, late


def closed(lefts: Array, rights: Array) -> tuple[Array, float]:
    """The unknowns of every panel (panels, unknowns), from the states at the panels' two ends for unit unknowns and,
    last, for none, (panels, unknowns + 1, unknowns) each; and the greatest factor by which closing the turn enlarges
    what one turn misses."""
    count, unknowns = lefts.shape[0], lefts.shape[2]
    if unknowns == 0:
        return np.empty((count, 0)), 1.0
    after = np.roll(lefts, -1, axis=0)
    rights = rights.copy()
    rights[:, -1] -= after[:, -1]
    steps = np.linalg.solve(after[:, :-1].transpose(0, 2, 1), rights.transpose(0, 2, 1)).transpose(0, 2, 1)
    whole = np.eye(unknowns + 1, unknowns)
    for step in steps:
        whole = whole @ step[:-1]
        whole[-1] += step[-1]
    closing = np.eye(unknowns) - whole[:-1]
    least = float(np.linalg.svd(closing, compute_uv=False)[-1])
    found = np.empty((count, unknowns))
    found[0] = np.linalg.solve(closing.T, whole[-1]) if least > 0.0 else np.inf
    for k, step in enumerate(steps[:-1]):
        found[k + 1] = found[k] @ step[:-1] + step[-1]
    return found, 1.0 / least if least > 0.0 else np.inf


def _space(equation: StripEquation, samples: Array, greatest: Array) -> float:
    """What the polynomials along the strip leave out of V'' or V''' at the clamp, whichever suffers more."""
    combined = equation.basis.combination @ equation.modes
    series = np.abs(samples.reshape(-1, samples.shape[2]) @ combined.T).max(axis=0)
    ends = np.stack([np.abs(equation.basis.polynomials(0.0, order)) * series for order in (2, 3)], axis=1)
    return float(np.max(left_by_series(ends[-4:]) / greatest))


@kernel
def amplitudes(
    edges: Array, samples: Array, coarse: Array, start: Complex, phase: Complex, shape: Complex, rule: Radau, angle: Array
) -> Array:
    """d in amplitudes of the basis at the angles: (basis, angles). The arguments are those of ``Motion``, ``Ringing``."""
    p, basis, modes = samples.shape[1], samples.shape[2], start.shape[1]
    out, share, row = np.zeros((basis, angle.size)), np.empty(p), np.empty(basis)
    for i in range(angle.size):
        turns = (angle[i] - edges[0]) / TURN
        place = edges[0] + (turns - np.floor(turns)) * TURN
        row[:] = 0.0
        e = _shares(edges, place, rule, share)
        for k in range(p):
            for b in range(basis):
                row[b] += share[k] * samples[e, k, b]
        if modes > 0:
            e = _shares(coarse, place, rule, share)
        for n in range(modes):
            grown = 0.0j
            for k in range(p):
                grown += share[k] * phase[e, n, k]
            grown = start[e, n] * np.exp(grown)
            for k in range(p):
                real, imag = share[k] * grown.real, share[k] * grown.imag
                for b in range(basis):
                    row[b] += real * shape[e, n, k, b].real - imag * shape[e, n, k, b].imag
        for b in range(basis):
            out[b, i] = row[b]
    return out


@kernel
def _shares(edges: Array, place: float, rule: Radau, share: Array) -> int:
    """The element that an angle lies in, and the shares that its points have in the polynomial there."""
    e = min(max(np.searchsorted(edges, place, side="right"), 1), edges.size - 1) - 1
    x, total = (place - edges[e]) / (edges[e + 1] - edges[e]), 0.0
    for k in range(share.size):
        apart = x - rule.points[k]
        if apart == 0.0:
            share[:] = 0.0
            share[k] = 1.0
            return e
        share[k] = rule.weights[k] / apart
        total += share[k]
    for k in range(share.size):
        share[k] /= total
    return e
