"""The strip's periodic motion at one resolution, and what that leaves unknown (``turn`` for how it comes about)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau, radau, shares_of
from solvers.numerics.ripple import Ripple, no_ripple, parts_at
from solvers.rod.cycle.state import MOMENT, SIDE, Strip
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import MANY, RULE, TURN, Excitation, split
from solvers.rod.vibration.natural_frequencies import StripBasis
from solvers.rod.vibration.ringing import FreeModes, chosen, closing, phases, rung
from solvers.rod.vibration.turn import Turn, with_one

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MOST_RINGING = 16
"""No more modes are made to ring."""

_ALGEBRAIC = 2.0
"""Times what the last terms along the strip tell: with damping mode by mode they fall like a power of their number."""
_ROUNDING = 1e-15
_EXPONENT = 1.5
_SMALLER, _DEARER = (radau(7), radau(5)), 1.5
"""Rules of fewer points; how an element's time grows with its points."""
_OSCILLATION = 8.0
"""Times the error wanted: what may be left out of a mode's oscillation, which is not all of the bending."""
_PHASE_SHARE = 0.1


def _missed_by(rule: Radau) -> Array:
    """What a polynomial through the values at a rule's points misses at those of ``RULE``, from values there."""
    few, most = rule.points.size, RULE.points.size
    through = legendre.legvander(2.0 * rule.points - 1.0, most - 1)
    whole = legendre.legvander(2.0 * RULE.points - 1.0, most - 1)
    known = np.linalg.solve(through[:, :few], through @ np.linalg.inv(whole))
    return np.eye(most) - whole[:, :few] @ known


_OF_RINGING = tuple((rule, _missed_by(rule)) for rule in (radau(3), radau(5), radau(7)))


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
    """d, what inertia adds to the quasi-static shape: polynomials (elements, points, basis) on ``edges`` at the points
    of a ``rule``, and ringing;
    ``amplification`` is by which closing the turn enlarges what one turn misses. So many modes are ``slow``, and the
    phases of those that ring were to be as good as ``phases`` (ringing,) on every element."""

    strip: Strip
    basis: StripBasis
    rule: Radau
    edges: Array
    samples: Array
    ringing: Ripple
    errors: Errors
    amplification: float
    slow: int
    phases: Array

    @property
    def quiet(self) -> Motion:
        """The same without what rings: it jumps at corners."""
        return replace(self, ringing=no_ripple(self.samples.shape[2], self.rule))

    def at(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        angle = np.ascontiguousarray(angle)
        return amplitudes(self.edges, self.samples, self.rule, angle) + parts_at(self.ringing, angle)


def motion(equation: StripEquation, excitation: Excitation, slow: int, step: float, wanted: float) -> Motion:
    """The periodic motion with so many slow modes, on elements in which the fastest of them turns by no more than
    ``step`` [rad]; series that could give more than ``wanted`` are not asked to."""
    m, modes = slow, equation.slowness.size
    rule, edges = _elements(equation, excitation, m, step, wanted)
    states = excitation.states_on(edges, rule)
    turn = Turn.of(equation, rule, states, edges, excitation.panels(edges), m, wanted)
    begun, _, amplification = turn.closed()

    static = np.abs(states[[MOMENT, SIDE]]).max(axis=1) / equation.strip.stiffness
    ringing, omitted, missed, enlarged, enough = no_ripple(modes, rule), 0.0, 0.0, 1.0, np.empty(0)
    if excitation.corners.size:
        lefts, rights = turn.sides
        here = with_one(begun)[:, None]
        jump = (here @ lefts - np.roll(here @ rights, 1, axis=0))[:, 0]
        jump[:, : 2 * m] = 0.0
        coarse, few = excitation.edges, rule_of_ringing(equation, excitation, m, wanted)
        states_of_few = excitation.states_on(coarse, few)
        phase = phases(equation, few, coarse, states_of_few, m)
        enlarged = closing(equation, phase, m)
        shares, given = rung(equation, excitation, phase, m, jump, static)
        count, omitted = chosen(shares, m, MOST_RINGING, wanted)
        if count:
            enough = 1e-1 * wanted / np.maximum(given * enlarged**2, 1e-300)[:count] / turn.widths.size
            enough = np.minimum(enough, 1e-3)
            free = FreeModes.of(equation, few, coarse, excitation.panels(coarse), states_of_few, m, enough)
            begun, ringed, amplification = turn.closed(free)
            (ringing,) = free.ringing(equation, ringed)
            share = np.max(np.abs(equation.clamp[:, m : m + count]) / static[:, None], axis=0)
            missed = float(np.abs(ringed).max(axis=0) * share @ free.missed) * max(float(amplification), 1.0)

    begin = turn.begin(begun)
    whole, speed = turn.amplitudes(begin), turn.fast_speeds(begin)
    d = whole - turn.still
    seen = d @ equation.clamp.T
    greatest = np.stack([states[MOMENT], -states[SIDE]], axis=1) / equation.strip.stiffness + seen.reshape(-1, 2)
    greatest = np.maximum(np.abs(greatest).max(axis=0), 1e-300)
    left = np.max(left_by_series(np.einsum("tp,epq->teq", rule.tail, seen)) / greatest, axis=1)
    changed = np.abs(np.einsum("ec,epcq->epq", begin, turn.change)).max(axis=(0, 1)) / greatest
    parted = _parted(whole, speed) * np.max(np.abs(equation.clamp[:, m:]) / greatest[:, None], axis=0)
    if excitation.corners.size:
        parted[turn.stop] = 0.0
        # What is wrong beside a corner as it is at the next ends of elements, that rings.
        parted[turn.first] *= enlarged
        parted[turn.stop - 1] *= enlarged
    time, fell = left + parted.sum(axis=1), turn.fell
    errors = Errors(
        series=float(changed.max()) * (fell / (1.0 - fell) if fell < 0.5 else 1.0),
        space=_space(equation, d, greatest),
        omitted=omitted,
        phase=missed,
        excited=excited(equation, excitation, m + 1) if m < modes else 0.0,
        time=time,
        mean_time=float(time @ turn.widths) / TURN,
        closing=_ROUNDING * float(amplification),
    )
    samples, strip = np.ascontiguousarray(d @ equation.modes.T), equation.strip
    return Motion(strip, equation.basis, rule, edges, samples, ringing, errors, float(amplification), m, enough)


def _elements(
    equation: StripEquation, excitation: Excitation, slow: int, step: float, wanted: float
) -> tuple[Radau, Array]:
    """Edges of elements in which the fastest slow mode turns by no more than ``step`` [rad], and their rule: of many
    narrow elements one of fewer points, and of smaller steps, where that takes less time."""
    count = excitation.edges.size - 1
    pace = _fastest(equation, excitation, slow) if slow else np.full(count, 1e-300)
    ways = [(RULE, split(excitation.edges, step / pace))]
    for rule in _SMALLER if count >= MANY else ():
        most = min(_longest_step(rule, _OSCILLATION * wanted / math.sqrt(count)), step)
        ways.append((rule, split(excitation.edges, most / pace)))
    return min(ways, key=lambda way: way[1].size * way[0].points.size ** _DEARER)


def _longest_step(rule: Radau, wanted: float) -> float:
    """Radians of an oscillation in an element of s stages: interpolation leaves out 2 (x/4)^(s + 1)/(s + 1)! of it."""
    order = rule.points.size
    return 4.0 * (0.5 * math.factorial(order) * wanted) ** (1.0 / order)


def rule_of_ringing(equation: StripEquation, excitation: Excitation, slow: int, wanted: float) -> Radau:
    """For phases and shapes of what rings, which change with the force alone: of few points where it changes little.

    What a polynomial through fewer points misses of the slowest such mode's frequency, times an element's width, is
    what its phase misses there; a share of ``wanted`` of a radian in the turn is enough. In many narrow elements six
    points always have been."""
    n, widths = min(slow, equation.slowness.size - 1), np.diff(excitation.edges)
    swing = equation.swing(excitation.states).reshape(widths.size, -1)
    pace = equation.pace[n] * np.sqrt(np.maximum(1.0 + swing * equation.coupling[n, n], 0.1))
    most = _SMALLER[-1] if widths.size >= MANY else RULE
    for rule, missed in _OF_RINGING:
        if rule.points.size >= most.points.size:
            break
        if widths @ np.abs(pace @ missed.T).max(axis=1) <= _PHASE_SHARE * wanted:
            return rule
    return most


def _fastest(equation: StripEquation, excitation: Excitation, slow: int) -> Array:
    """The greatest frequency [1/rad] of the last slow mode in every element."""
    return equation.fastest(slow, equation.swing(excitation.states).reshape(-1, RULE.points.size).max(axis=1))


def motions_beside(
    found: Motion, around: Excitation, beside: Sequence[Excitation], loss: float, wanted: float
) -> list[Motion]:
    """The motions of strips next to one that was ``found`` with the excitation ``around``, as well resolved: with as
    many modes, on elements that go with the corners (``Excitation.beside``). What they leave unknown is taken to be the
    same."""
    strips = Strip(*np.array([one.strip for one in beside]).T)
    rule, coarse = found.rule, np.stack([one.edges for one in beside])
    inertia, mean = np.array([one.inertia for one in beside]), np.array([one.mean for one in beside])
    equation = StripEquation.of(strips, inertia, mean, found.basis.polynomials, loss)
    edges = np.stack([np.interp(found.edges, around.anchors, one.anchors) for one in beside])
    fine = np.stack([one.states_on(own, rule) for one, own in zip(beside, edges, strict=True)], axis=1)
    turn = Turn.of(equation, rule, fine, edges, around.panels(found.edges), found.slow, wanted)
    free = None
    if found.phases.size:
        few = radau(found.ringing.points.size - 1)
        states = np.stack([one.states_on(one.edges, few) for one in beside], axis=1)
        free = FreeModes.of(equation, few, coarse, around.panels(around.edges), states, found.slow, found.phases)
    begun, ringed, amplification = turn.closed(free)
    d = turn.amplitudes(turn.begin(begun)) - turn.still
    samples = np.ascontiguousarray(d @ equation.modes[..., None, :, :].mT)
    ringing = [found.ringing] * len(beside) if free is None else free.ringing(equation, ringed)
    return [
        replace(
            found,
            strip=one.strip,
            basis=equation.basis.of_strip(k),
            edges=edges[k],
            samples=samples[k],
            ringing=ringing[k],
            amplification=float(amplification[k]),
        )
        for k, one in enumerate(beside)
    ]


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


def _space(equation: StripEquation, d: Array, greatest: Array) -> float:
    """What the polynomials along the strip leave out."""
    combined = equation.basis.combination @ equation.modes
    series = np.abs(d.reshape(-1, d.shape[2]) @ combined.T).max(axis=0)
    ends = np.stack([equation.basis.uncombined(0.0, order) * series for order in (2, 3)], axis=1)
    margin = _ALGEBRAIC if equation.loss else 1.0
    return margin * float(np.max(left_by_series(ends[-4:]) / greatest))


def _parted(whole: Array, speed: Array) -> Array:
    """By how much the fast modes disagree at the ends of elements: of every element with the next, (elements, fast).
    From speeds at their first and last ends, (elements, 2, fast), times sqrt(mu)."""
    fast = whole[..., whole.shape[2] - speed.shape[2] :]
    return np.hypot(np.roll(fast[:, 0], -1, axis=0) - fast[:, -1], np.roll(speed[:, 0], -1, axis=0) - speed[:, 1])


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
