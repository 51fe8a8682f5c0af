"""The strip's periodic motion at one resolution, and what that leaves unknown (``turn`` for how it comes about)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau, radau, shares_of
from solvers.numerics.ripple import Ripple, no_ripple, parts_at
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.vibration.equation import SOFTEST, StripEquation, quasi_static
from solvers.rod.vibration.excitation import MANY, RULE, TURN, Excitation, Smoothness, split
from solvers.rod.vibration.natural_frequencies import StripBasis
from solvers.rod.vibration.omitted import chosen, in_means, left_behind
from solvers.rod.vibration.ringing import free_modes, ringing_of, rung
from solvers.rod.vibration.turn import Turn, close, turn_of

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MOST_RINGING = 16
"""No more modes are made to ring."""

NARROW = 3.0
"""Radians of a mode in an element in which a series in derivatives costs digits."""
_ALGEBRAIC = 2.0
"""Times what the last terms along the strip tell: with damping mode by mode they fall like a power of their number."""
_ROUNDING = 1e-15
EXPONENT = 1.5
_OF_RINGING_IN_MANY = radau(5)
"""Phases and shapes of what rings change with the force alone: in many narrow elements six points always have been
enough."""
_FALLS, _FALLS_BEHIND_JUMPS = 4.0, 2.0
"""Behind corners, and behind jumps of the force, shares of V''' fall about like this power of the modes' number."""
_NONE_RINGS = np.empty((0, 0, 0))


@dataclass(frozen=True)
class Errors:
    """What a motion leaves unknown, as shares of the greatest V'' or V''' at the clamp, whichever suffers more.

    ``series``  of the fast modes ends; ``space``  polynomials along the strip do; ``omitted``  ringing of faster modes,
    as greatest values and, ``mean_omitted``, means suffer from it; ``phase``  of the other ringing; ``excited``  what
    the smooth force excites of it; ``time``  elements, of each, ``mean_time``  on the average over the turn;
    ``closing``  rounding, as closing the turn enlarges it.
    """

    series: float
    space: float
    omitted: float
    mean_omitted: float
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
        return self.series + self.space + self.closing + self.omitted + self._oscillating

    @property
    def _oscillating(self) -> float:
        """What oscillates, at the pace of the slowest mode at the least."""
        return self.phase + self.excited + self.elements

    def lasting(self, oscillating: float) -> float:
        """What remains of a mean, to which so much is left of what oscillates."""
        lasting = self.series + self.space + self.closing + self.mean_time + self.mean_omitted
        return lasting + oscillating * self._oscillating


@dataclass(frozen=True)
class Motion:
    """d, what inertia adds to the quasi-static shape: polynomials (elements, points, basis) on ``edges`` at the points
    of ``RULE``, and ringing; ``amplification`` is by which closing the turn enlarges what one turn misses. So many
    modes are ``slow``, the last of them oscillating at up to ``pace`` [1/rad], and the phases of those that ring were
    to be as good as ``phases`` (ringing,) on every element."""

    strip: Strip
    basis: StripBasis
    edges: Array
    samples: Array
    ringing: Ripple
    errors: Errors
    amplification: float
    slow: int
    pace: float
    phases: Array

    @property
    def quiet(self) -> Motion:
        """The same without what rings: it jumps at corners."""
        return replace(self, ringing=no_ripple(self.samples.shape[2], RULE))

    def at(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        return amplitudes(self.edges, self.samples, RULE, self.ringing, angle)


def motion(equation: StripEquation, excitation: Excitation, slow: int, step: float, wanted: float) -> Motion:
    """The periodic motion with so many slow modes, on elements in which the fastest of them turns by no more than
    ``step`` [rad]; series that could give more than ``wanted`` are not asked to."""
    m, modes, corners = slow, equation.slowness.size, excitation.corners.size > 0
    edges, pace = _elements(equation, excitation, m, step)
    states = excitation.states_on(edges, RULE)
    turn = turn_of(equation, RULE, *quasi_static(equation, states), edges, excitation.panels(edges), m, wanted)
    begun, _, amplification = close(turn, _NONE_RINGS, _NONE_RINGS)

    ringing, missed, enlarged, enough = no_ripple(modes, RULE), 0.0, np.ones(modes - m), np.empty(0)
    omitted = mean_omitted = 0.0
    if corners:
        static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
        coarse = excitation.edges
        few = _OF_RINGING_IN_MANY if coarse.size > MANY else RULE
        states_of_few, panels = excitation.states_on(coarse, few), excitation.panels(coarse)
        forces = excitation.states[FORCE, panels * RULE.points.size]
        enlarged, rings, given = rung(equation, turn, begun, few, coarse, panels, states_of_few, forces, static)
        falls = _FALLS_BEHIND_JUMPS if excitation.jumps.size else _FALLS
        count, omitted = chosen(rings.max(axis=(0, 1)), m, falls, MOST_RINGING, wanted)
        mean_omitted = in_means(equation, rings, m, falls, count) if omitted else 0.0
        if count:
            enough = 1e-1 * wanted / np.maximum(given * enlarged**2, 1e-300)[:count] / turn.widths.size
            enough = np.minimum(enough, 1e-3)
            free = free_modes(equation, few, coarse, panels, states_of_few, m, enough)
            begun, ringed, amplification = close(turn, free.behind, free.before)
            ringing = ringing_of(free, equation.modes, ringed, few)
            share = np.max(np.abs(equation.clamp[:, m : m + count]) / static[:, None], axis=0)
            missed = float(np.abs(ringed).max(axis=0) * share @ free.missed) * max(amplification, 1.0)

    samples, series, space, time = read(turn, equation, RULE, states, begun, enlarged, corners)
    if omitted > 0.5 * wanted and excitation.corners.size < MANY:
        omitted, mean_omitted = left_behind(
            equation, excitation, RULE, edges, states, samples, rings, static, m, falls, count
        )
    errors = Errors(
        series=series,
        space=space,
        omitted=omitted,
        mean_omitted=mean_omitted,
        phase=missed,
        excited=excited(equation, excitation, m + 1) if m < modes else 0.0,
        time=time,
        mean_time=float(time @ turn.widths) / TURN,
        closing=_ROUNDING * amplification,
    )
    return Motion(equation.strip, equation.basis, edges, samples, ringing, errors, amplification, m, pace, enough)


def _elements(equation: StripEquation, excitation: Excitation, slow: int, step: float) -> tuple[Array, float]:
    """Edges of elements in which the fastest slow mode turns by no more than ``step`` [rad], and the highest natural
    frequency of that mode [1/rad]."""
    if not slow:
        return excitation.edges, 0.0
    pace = equation.fastest(slow, equation.strip.couples * excitation.smoothness.greatest - equation.mean)
    return split(excitation.edges, step / pace), float(pace.max())


def motion_beside(found: Motion, around: Excitation, beside: Excitation, loss: float, wanted: float) -> Motion:
    """The motion of a strip next to one that was ``found`` with the excitation ``around``, as well resolved: with as
    many modes, on elements that go with the corners (``Excitation.beside``). What it leaves unknown is taken to be the
    same."""
    m = found.slow
    equation = StripEquation.of(beside.strip, beside.inertia, beside.mean, found.basis.polynomials, loss)
    edges = np.interp(found.edges, around.anchors, beside.anchors)
    states = beside.states_on(edges, RULE)
    turn = turn_of(equation, RULE, *quasi_static(equation, states), edges, around.panels(found.edges), m, wanted)
    ringing, behind, before = found.ringing, _NONE_RINGS, _NONE_RINGS
    if found.phases.size:
        few, panels = radau(ringing.points.size - 1), around.panels(around.edges)
        free = free_modes(equation, few, beside.edges, panels, beside.states_on(beside.edges, few), m, found.phases)
        behind, before = free.behind, free.before
    begun, ringed, amplification = close(turn, behind, before)
    if found.phases.size:
        ringing = ringing_of(free, equation.modes, ringed, few)
    return replace(
        found, strip=beside.strip, basis=equation.basis, edges=edges, samples=followed(turn, equation, begun)[0],
        ringing=ringing, amplification=amplification,
    )  # fmt: skip


def excited(equation: StripEquation, excitation: Excitation, n: int) -> float:
    """What the force excites of the n-th mode's ringing between corners, by how fast it changes there: about
    exp(-omega y) (``excitation``), with a margin on the exponent."""
    analytic, _, _ = least_turned(equation, excitation.edges, excitation.smoothness)
    return math.exp(-analytic[n - 1] / EXPONENT)


@kernel
def least_turned(equation: StripEquation, edges: Array, force: Smoothness) -> tuple[Array, Array, Array]:
    """The least angles [rad] by which every mode by itself turns where the force is greatest compression: within the
    distance from the real axis up to which the motion is analytic; within an element; and, where that is less than
    ``NARROW``, while what drives it changes, by its second derivative, by its greatest value."""
    n = equation.slowness.size
    analytic, narrow, changing = np.full(n, np.inf), np.full(n, np.inf), np.full(n, np.inf)
    for k in range(n):
        for e in range(force.least.size):
            swing = equation.strip.couples * force.least[e] - equation.mean
            stiffness = max(1.0 + swing * equation.coupling[k, k], SOFTEST)
            pace = math.sqrt(stiffness / equation.slowness[k])
            analytic[k] = min(analytic[k], pace * force.analytic[e])
            turned = pace * (edges[e + 1] - edges[e])
            narrow[k] = min(narrow[k], turned)
            if turned < NARROW:
                changing[k] = min(changing[k], pace / math.sqrt(max(force.curvature[e], 1e-300)))
    return analytic, narrow, changing


@kernel
def followed(turn: Turn, equation: StripEquation, begun: Array) -> tuple[Array, Array, Array, Array]:
    """d in amplitudes of the basis (elements, points, basis), from the panels' first states (panels, 2 m); and, in the
    modes, the amplitudes of the motion as a whole, the fast ones' speeds at an element's two ends, sqrt(mu) a'
    (2 elements, fast), and the elements' first states, and 1, (elements, 2 m + 1)."""
    m, n, count, p = turn.slow, equation.slowness.size, turn.widths.size, turn.still.shape[1]
    fast, columns = n - m, 2 * m + 1
    begin, panel = np.zeros((count, columns)), -1
    coordinates, speeds = np.zeros((count * p, n)), np.zeros((count * 2, fast))
    for e in range(count):
        if panel + 1 < turn.first.size and turn.first[panel + 1] == e:
            panel += 1
        begin[e, 2 * m] = 1.0
        for c in range(columns):
            share = begun[panel, c] if c < 2 * m else 1.0
            for a in range(2 * m):
                begin[e, a] += share * turn.onward[e, c, a]
        for c in range(columns):
            share = begin[e, c]
            for i in range(p):
                for a in range(n):
                    coordinates[e * p + i, a] += share * turn.columns[e, i, c, a]
            for end in range(2):
                for k in range(fast):
                    speeds[2 * e + end, k] += share * turn.speeds[e, end, c, k]
    if fast > 0:
        moved, run = np.dot(np.ascontiguousarray(coordinates[:, m:]), turn.rest.T), np.dot(speeds, turn.rest.T)
        for i in range(count * p):
            for k in range(fast):
                coordinates[i, m + k] = moved[i, k]
        for i in range(2 * count):
            for k in range(fast):
                speeds[i, k] = run[i, k] * math.sqrt(equation.slowness[m + k])
    whole = coordinates.reshape(count, p, n)
    samples = np.dot((whole - turn.still).reshape(count * p, n), equation.modes.T)
    return samples.reshape(count, p, n), whole, speeds, begin


@kernel
def read(
    turn: Turn, equation: StripEquation, rule: Radau, states: Array, begun: Array, enlarged: Array, corners: bool
) -> tuple[Array, float, float, Array]:
    """d as ``followed``, what the series and the polynomials along the strip leave unknown (``Errors``), and what every
    element does, from the panels' first states (panels, 2 m) and by which closing the turn enlarges what every fast
    mode rings with."""
    m, n, p, count = turn.slow, equation.slowness.size, rule.points.size, turn.widths.size
    fast, columns = n - m, 2 * m + 1
    samples, whole, speeds, begin = followed(turn, equation, begun)
    d, seen, greatest = whole - turn.still, np.zeros((count, p, 2)), np.full(2, 1e-300)
    for e in range(count):
        for i in range(p):
            for q in range(2):
                for a in range(n):
                    seen[e, i, q] += equation.clamp[q, a] * d[e, i, a]
                still = states[MOMENT if q == 0 else SIDE, e * p + i] * (1.0 - 2.0 * q) / equation.strip.stiffness
                greatest[q] = max(greatest[q], abs(still + seen[e, i, q]))
    # What is wrong behind a corner or before one rings.
    rings = np.ones(count)
    for k in range(turn.first.size if corners and fast > 0 else 0):
        rings[turn.first[k]], rings[turn.stop[k]] = enlarged[0], enlarged[0]
    time, changed, last = np.zeros(count), 0.0, np.zeros((2, rule.tail.shape[0]))
    for e in range(count):
        last[:] = 0.0
        for q in range(2):
            for t in range(rule.tail.shape[0]):
                for i in range(p):
                    last[q, t] += rule.tail[t, i] * seen[e, i, q]
            time[e] = max(time[e], _left_by_series(last[q]) / greatest[q])
            for i in range(p):
                change = 0.0
                for c in range(columns):
                    change += begin[e, c] * turn.change[e, i, c, q]
                changed = max(changed, abs(change) / greatest[q] * (rings[e] if i == 0 or i == p - 1 else 1.0))
    # By how much the fast modes disagree where an element ends and the next one begins. What is wrong beside a corner
    # as it is at the next ends of elements, that rings.
    margin = np.ones((count, fast))
    for k in range(turn.first.size if corners else 0):
        for a in range(fast):
            margin[turn.stop[k], a] = 0.0
            margin[turn.first[k], a] *= enlarged[a]
    for k in range(turn.first.size if corners else 0):
        for a in range(fast):
            margin[turn.stop[k] - 1, a] *= enlarged[a]
    for e in range(count):
        after = (e + 1) % count
        for k in range(fast):
            share = max(abs(equation.clamp[0, m + k]) / greatest[0], abs(equation.clamp[1, m + k]) / greatest[1])
            parted = math.hypot(
                whole[after, 0, m + k] - whole[e, p - 1, m + k], speeds[2 * after, k] - speeds[2 * e + 1, k]
            )
            time[e] += margin[e, k] * parted * share
    fell, space = turn.fell, _space(equation, samples.reshape(count * p, n), greatest)
    return samples, changed * (fell / (1.0 - fell) if fell < 0.5 else 1.0), space, time


@kernel
def _space(equation: StripEquation, samples: Array, greatest: Array) -> float:
    """What the polynomials along the strip leave out, from amplitudes of the basis (points, basis)."""
    n, space, last = samples.shape[1], 0.0, np.empty(4)
    most = np.zeros(n)
    for i in range(samples.shape[0]):
        for a in range(n):
            most[a] = max(most[a], abs(samples[i, a]))
    for q in range(2):
        for t in range(4):
            last[t] = equation.last[q, t] * most[max(n - 4 + t, 0)]
        space = max(space, _left_by_series(last) / greatest[q])
    return space * (_ALGEBRAIC if equation.loss != 0.0 else 1.0)


@kernel
def _left_by_series(last: Array) -> float:
    """What a series leaves out, from its last four terms, after how pairs of them fall."""
    before, behind = max(abs(last[0]), abs(last[1])), max(abs(last[2]), abs(last[3]))
    ratio = min(max(behind / max(before, 1e-300), 0.05), 0.9)
    return 2.0 * behind * ratio / (1.0 - ratio)


@kernel
def amplitudes(edges: Array, samples: Array, rule: Radau, ringing: Ripple, angle: Array) -> Array:
    """What polynomials (elements, points, basis) on elements of the turn, and what rings, make at the angles, (basis,
    angles)."""
    p, basis = samples.shape[1], samples.shape[2]
    out, share, row = parts_at(ringing, angle), np.empty(p), np.empty(basis)
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
            out[b, i] += row[b]
    return out
