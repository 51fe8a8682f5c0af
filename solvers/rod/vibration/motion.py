"""The strip's periodic motion at one resolution, and what that leaves unknown.

A panel lies between two corners of the force. There slow modes, which anything may have set going, are followed by
collocation, and fast ones follow them (``slow_modes``); where it matters fast modes ring behind corners (``ringing``).
A panel's unknowns are the first states of its slow modes and the real and imaginary parts of its ringing; states that
are equal on both sides of every corner determine them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau, shares_of
from solvers.numerics.ripple import Ripple, no_ripple, parts_at
from solvers.rod.cycle.state import MOMENT, SIDE
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import RULE, TURN, Excitation, points, split, states_at
from solvers.rod.vibration.ringing import FreeModes, chosen, closing, kicks
from solvers.rod.vibration.slow_modes import Parts, carried, slow_motion

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TERMS = 9

MOST_RINGING = 16
"""No more modes are made to ring."""

_ALGEBRAIC = 2.0
"""Times what the last terms along the strip tell: with damping mode by mode they fall like a power of their number."""
_ROUNDING = 1e-15
_EXPONENT = 1.5
_LOOSEST = 1e-4


@dataclass(frozen=True)
class Errors:
    """What a motion leaves unknown, as shares of the greatest V'' or V''' at the clamp, whichever suffers more.

    ``series``  of the fast modes ends; ``space``  polynomials along the strip do; ``omitted``  ringing of faster modes;
    ``phase``  of the other ringing; ``excited``  what the smooth force excites of it; ``time``  elements, of each,
    ``mean_time``  on the average over the turn; ``closing``  rounding, as closing the turn enlarges it.
    """

    series: float
    space: float
    omitted: float
    phase: float
    excited: float
    time: Array
    mean_time: float
    closing: float

    @property
    def elements(self) -> float:
        """What all elements leave unknown: errors of one add to those of another as squares do."""
        return float(np.sqrt(np.sum(self.time**2)))

    @property
    def total(self) -> float:
        return self.series + self.space + self.closing + self.oscillating

    @property
    def oscillating(self) -> float:
        """What oscillates, at the pace of the slowest mode at the least."""
        return self.omitted + self.phase + self.excited + self.elements

    def lasting(self, oscillating: float) -> float:
        """What remains of a mean, to which so much is left of what oscillates."""
        return self.series + self.space + self.closing + self.mean_time + oscillating * self.oscillating


@dataclass(frozen=True)
class Motion:
    """d, what inertia adds to the quasi-static shape: polynomials (elements, points, basis) on ``edges``, and ringing;
    ``amplification`` is by which closing the turn enlarges what one turn misses."""

    equation: StripEquation
    edges: Array
    samples: Array
    ringing: Ripple
    errors: Errors
    amplification: float

    @property
    def quiet(self) -> Motion:
        """The same without what rings: it jumps at corners."""
        return replace(self, ringing=no_ripple(self.samples.shape[2], RULE))

    def at(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        angle = np.ascontiguousarray(angle)
        return amplitudes(self.edges, self.samples, RULE, angle) + parts_at(self.ringing, angle)


def motion(equation: StripEquation, excitation: Excitation, slow: int, step: float, wanted: float) -> Motion:
    """The periodic motion with so many slow modes, on elements in which the fastest of them turns by no more than
    ``step`` [rad]; series that could give more than ``wanted`` are not asked to."""
    m, modes, p = slow, equation.slowness.size, RULE.points.size
    edges = excitation.edges
    if m:
        most = equation.swing(excitation.states).reshape(-1, p).max(axis=1)
        edges = split(edges, step / equation.fastest(m, most))
    widths, first = np.diff(edges), excitation.panels(edges)
    states = states_at(excitation.drive, excitation.strip, points(edges))
    swing, still = equation.swing(states).reshape(-1, p), equation.still(states)
    parts, turned = _parts(equation, m)
    right = equation.right(states, still).reshape(-1, p, modes)
    if equation.loss:
        # What follows the force is not damped.
        moved = np.einsum("ij,ejn->ein", RULE.first, still.reshape(-1, p, modes)) / widths[:, None, None]
        right += equation.damping * moved
    right = right @ turned
    columns, last, speeds, change, fell = slow_motion(
        widths, swing, right, parts, RULE, 0.1 * min(wanted, _LOOSEST), _TERMS
    )

    starts = np.zeros(widths.size, dtype=np.bool_)
    starts[first] = True
    stop, number = np.append(first[1:], widths.size) - 1, np.cumsum(starts) - 1
    maps = carried(last, starts)
    onward = np.zeros((widths.size, 2 * m + 1, 2 * m + 1))
    onward[:, :, :-1], onward[:, -1, -1] = maps[:, 0], 1.0
    root = np.sqrt(equation.slowness[m:])
    lefts, rights = np.zeros((2, first.size, 2 * m + 1, 2 * modes))
    for state, e, end in ((lefts, first, 0), (rights, stop, -1)):
        state[:, :, 2 * m :: 2] = columns[e, end, :, m:] @ turned[m:, m:].T
        state[:, :, 2 * m + 1 :: 2] = speeds[e, end] @ turned[m:, m:].T * root
    rights = onward[stop] @ rights
    lefts[:, :, : 2 * m], rights[:, :, : 2 * m] = np.eye(2 * m + 1, 2 * m), maps[stop, 1]
    begun, amplification = closed(lefts[:, :, : 2 * m], rights[:, :, : 2 * m])

    static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
    ringing, omitted, phase = no_ripple(modes, RULE), 0.0, 0.0
    if excitation.corners.size:
        here = _with_one(begun)[:, None]
        jump = (here @ lefts - np.roll(here @ rights, 1, axis=0))[:, 0]
        jump[:, : 2 * m] = 0.0
        enlarged = closing(equation, excitation, m)
        kicked = kicks(equation, swing[first, 0], jump, static)[m:]
        count, omitted = chosen(kicked * enlarged, m, MOST_RINGING, wanted)
        if count:
            enough = 1e-2 * wanted / np.maximum(kicked * enlarged**2, 1e-300)[:count] / widths.size
            free = FreeModes.of(equation, excitation, m, np.minimum(enough, 1e-3))
            begun, amplification, ringing, phase = _ringing(equation, excitation, free, lefts, rights, static)

    begin = (_with_one(begun)[number][:, None] @ onward)[:, 0]
    whole = np.einsum("ec,epcn->epn", begin, columns) @ turned.T
    speed = np.einsum("ec,eicn->ien", begin, speeds) @ turned[m:, m:].T * root
    d = whole - still.reshape(whole.shape)
    seen = d @ equation.clamp.T
    greatest = np.stack([states[MOMENT], -states[SIDE]], axis=1) / equation.strip.stiffness + seen.reshape(-1, 2)
    greatest = np.maximum(np.abs(greatest).max(axis=0), 1e-300)
    left = np.max(left_by_series(np.einsum("tp,epq->teq", RULE.tail, seen)) / greatest, axis=1)
    changed = np.abs(np.einsum("ec,epcq->epq", begin, change)).max(axis=(0, 1)) / greatest
    parted = _parted(whole, speed) * np.max(np.abs(equation.clamp[:, m:]) / greatest[:, None], axis=0)
    if excitation.corners.size:
        parted[stop] = 0.0
        # What is wrong beside a corner as it is at the next ends of elements, that rings.
        parted[first] *= enlarged
        parted[stop - 1] *= enlarged
    time = left + parted.sum(axis=1)
    errors = Errors(
        series=float(changed.max()) * (fell / (1.0 - fell) if fell < 0.5 else 1.0),
        space=_space(equation, d, greatest),
        omitted=omitted,
        phase=phase,
        excited=excited(equation, excitation, m + 1) if m < modes else 0.0,
        time=time,
        mean_time=float(time @ widths) / TURN,
        closing=_ROUNDING * amplification,
    )
    return Motion(equation, edges, np.ascontiguousarray(d @ equation.modes.T), ringing, errors, amplification)


def excited(equation: StripEquation, excitation: Excitation, n: int) -> float:
    """What the force excites of the n-th mode's ringing between corners, by how fast it changes there: about
    exp(-omega y) (``excitation``), with a margin on the exponent."""
    swing = equation.swing(excitation.states).reshape(excitation.edges.size - 1, -1).min(axis=1)
    return float(np.exp(-np.min(equation.fastest(n, swing) * excitation.analytic) / _EXPONENT))


def left_by_series(last: Array) -> Array:
    """What series leave out, from their last four terms (4, ...), after how pairs of them fall."""
    before, last = np.abs(last[:2]).max(axis=0), np.abs(last[2:]).max(axis=0)
    ratio = np.clip(last / np.maximum(before, 1e-300), 0.05, 0.9)
    return 2.0 * last * ratio / (1.0 - ratio)


def _with_one(unknowns: Array) -> Array:
    return np.concatenate([unknowns, np.ones((unknowns.shape[0], 1))], axis=1)


def _parts(equation: StripEquation, m: int) -> tuple[Parts, Array]:
    """The equation in coordinates of which the first m are modes and the rest makes G diagonal; these in modes."""
    rates, rest = np.linalg.eigh(equation.coupling[m:, m:])
    turned = np.eye(equation.slowness.size)
    turned[m:, m:] = rest
    parts = Parts(
        np.ascontiguousarray(equation.slowness[:m]),
        np.ascontiguousarray(equation.damping[:m]),
        np.ascontiguousarray(equation.coupling[:m, :m]),
        np.ascontiguousarray(equation.coupling[:m, m:] @ rest),
        rates,
        (rest.T * equation.slowness[m:]) @ rest,
        (rest.T * equation.damping[m:]) @ rest,
        np.ascontiguousarray(equation.clamp @ turned),
    )
    return parts, turned


def _ringing(
    equation: StripEquation, excitation: Excitation, free: FreeModes, lefts: Array, rights: Array, static: Array
) -> tuple[Array, float, Ripple, float]:
    """The slow modes' first states in every panel, with fast modes that ring; what closing the turn enlarges; the
    ringing; and what its phases leave unknown."""
    m, count = free.first, free.missed.size
    first = excitation.panels(excitation.edges)
    stop = np.append(first[1:], excitation.edges.size - 1) - 1
    both = []
    for slow, rung in zip(
        (lefts, rights), (free.states(equation, first, 0), free.states(equation, stop, -1)), strict=True
    ):
        slow = slow[:, :, : rung.shape[2]]
        both.append(np.concatenate([slow[:, :-1], rung, slow[:, -1:]], axis=1))
    unknowns, amplification = closed(*both)
    begun = unknowns[:, 2 * m :: 2] + 1j * unknowns[:, 2 * m + 1 :: 2]
    share = np.max(np.abs(equation.clamp[:, m : m + count]) / static[:, None], axis=0)
    missed = float(np.abs(begun).max(axis=0) * share @ free.missed) * max(amplification, 1.0)
    return unknowns[:, : 2 * m], amplification, free.ringing(equation, excitation, begun), missed


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
    steps = np.linalg.solve(after[:, :-1].swapaxes(1, 2), rights.swapaxes(1, 2)).swapaxes(1, 2)
    whole = np.eye(unknowns + 1, unknowns)
    for step in steps:
        whole = whole @ step[:-1]
        whole[-1] += step[-1]
    missing = np.eye(unknowns) - whole[:-1]
    least = float(np.linalg.svd(missing, compute_uv=False)[-1])
    found = np.empty((count, unknowns))
    found[0] = np.linalg.solve(missing.T, whole[-1]) if least > 0.0 else np.inf
    for k, step in enumerate(steps[:-1]):
        found[k + 1] = found[k] @ step[:-1] + step[-1]
    return found, 1.0 / least if least > 0.0 else np.inf


def _space(equation: StripEquation, d: Array, greatest: Array) -> float:
    """What the polynomials along the strip leave out."""
    combined = equation.basis.combination @ equation.modes
    series = np.abs(d.reshape(-1, d.shape[2]) @ combined.T).max(axis=0)
    ends = np.stack([equation.basis.polynomials(0.0, order) * series for order in (2, 3)], axis=1)
    margin = _ALGEBRAIC if equation.loss else 1.0
    return margin * float(np.max(left_by_series(ends[-4:]) / greatest))


def _parted(whole: Array, speed: Array) -> Array:
    """By how much the fast modes disagree at the ends of elements: of every element with the next, (elements, fast).
    From speeds at their first and last ends, (2, elements, fast), times sqrt(mu)."""
    fast = whole[..., whole.shape[2] - speed.shape[2] :]
    return np.hypot(np.roll(fast[:, 0], -1, axis=0) - fast[:, -1], np.roll(speed[0], -1, axis=0) - speed[1])


@kernel
def amplitudes(edges: Array, samples: Array, rule: Radau, angle: Array) -> Array:
    """What polynomials (elements, points, basis) on elements of the turn make at the angles, (basis, angles)."""
    p, basis = samples.shape[1], samples.shape[2]
    out, share, row = np.zeros((basis, angle.size)), np.empty(p), np.empty(basis)
    for i in range(angle.size):
        turns = (angle[i] - edges[0]) / TURN
        place = edges[0] + (turns - np.floor(turns)) * TURN
        e = min(max(np.searchsorted(edges, place, side="right"), 1), edges.size - 1) - 1
        shares_of(rule.points, rule.weights, (place - edges[e]) / (edges[e + 1] - edges[e]), share)
        row[:] = 0.0
        for k in range(p):
            for b in range(basis):
                row[b] += share[k] * samples[e, k, b]
        for b in range(basis):
            out[b, i] = row[b]
    return out
