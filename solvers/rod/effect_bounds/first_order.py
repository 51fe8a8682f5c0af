"""Influence of each effect: the change of the main results over one revolution without it, times a margin.

The revolution contains every closed-form effect - gas and inertia, coupling, shear, friction feedback - and each is
removed in turn (``situation``). Large displacement and the strip's inertia are added to it, to first order
(``cycle.large_displacement``, ``inertia``). So each effect is evaluated together with all others except these two; a
large inertia of the strip amplifies changes due to others, and these may shift the phase of its ringing arbitrarily.

The margins are based on tests over random machines, not on proof (``bench.influences``, docs/benchmarks.md): the
changes themselves are accurate to some percent in most of them, and those of inertia with many ringing modes to a
factor of a few.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.large_displacement import add_third_order
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.effect_bounds.inertia import FOLLOWED, NODES, SIGNED, motion_of
from solvers.rod.effect_bounds.main_results import COUPLES, FRICTION, MASS, SHEARING, Judged, Judging, change, judge
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.strip.elastica_kernels import Collocation, collocation, nodes_for

Array = NDArray[np.float64]

_MARGIN, _RINGING_MARGIN = 1.2, 1.5
"""Margin on a change; margin on a change by inertia dominated by ringing."""

_STILL_MARGIN, _STILL = 1.1, 0.01
"""Margin on a change known in closed form if inertia has no influence, and the influence of inertia from which the full
margin applies."""

_ALL_MODES, _ALL_MODES_SIDE_FORCE = 1.5, 3.0
"""Ringing of all modes relative to the first one's: in general, and in the side force after jumps of the load, which
excite all modes and appear most in the fast ones."""

_RINGING_WEIGHT = 3.0
"""Weight of the share of ringing in the margin, which reaches that of pure ringing at a share of the inverse."""

_PHASE_FIRST_ORDER, _PHASE_SECOND_ORDER = 0.35, 1.1
"""Coefficients of the change by a phase shift of the ringing, to first and second order of the shift."""

_MIN_RINGING_SHARE = 1e-3
"""Share of ringing below which its sign is irrelevant."""

_FEWER_NODES = 12
"""Large displacement is smooth: fewer nodes suffice than for full precision."""

_MAX_EXCITED = 25.0
"""Pace of the first mode, relative to the revolution's sharpness, above which smooth loads do not excite it."""

_SERIES_RATIO = 1.2
"""Factor on the first iterate's influence for the ratio of successive iterates of inertia."""

_JUMP_EXCESS = 4.0
"""Typical overestimation of the ringing after jumps of the load by its bound."""

_AMPLIFICATION, _MAX_AMPLIFYING, _NEAR_BUCKLING = 2.0, 1.2, 0.2
"""Amplification of other effects' changes per relative influence of inertia; the influence up to which it grows, and
its increment per 1/(1 - P/P_cr)."""

_MIN_DETUNING = 1e-2
"""Minimum |1 - m| with m the multiplier of a free motion after a revolution: resonance is never met exactly."""

_MEMORY = 16.0
"""Decay rate of the influence of a phase shift, relative to that of the vibration: maxima occur soon after their
excitation."""

_STRONG_INERTIA, _MAX_MULTIPLIER = 0.25, 3.0
"""Influence of inertia above which it may multiply a change larger than the results, and the maximum multiplier."""


def reciprocating_inertia(situation: Situation) -> float:
    """Influence of the reciprocating mass."""
    return _beside_inertia(situation, situation.without[MASS])


def beam_column(situation: Situation) -> float:
    """Influence of the axial force's contribution to bending."""
    return _beside_inertia(situation, situation.without[COUPLES])


def shear(situation: Situation) -> float:
    """Influence of shear flexibility."""
    return _beside_inertia(situation, situation.without[SHEARING])


def friction_feedback(situation: Situation) -> float:
    """Influence of the friction feedback to the axial force."""
    return _beside_inertia(situation, situation.without[FRICTION])


def large_displacement(situation: Situation) -> float:
    """Influence of the third order of the strip's slope; 0 if the strip buckles: it has no shape then."""
    turn, l = situation.upright, situation.dimensions.l
    if turn is None:
        return 0.0
    seen, per_force = turn.thinned, l * l / turn.strip.stiffness
    force = seen.states[FORCE]
    nodes = nodes_for(float(force.min()) * per_force, float(force.max()) * per_force) - _FEWER_NODES
    change = _change_in_large(seen.judging, turn.strip, seen.states, seen.judged, collocation(nodes))
    return _beside_inertia(situation, change, stiffens=False)


@kernel
def _change_in_large(j: Judging, strip: Strip, states: Array, judged: Judged, tables: Collocation) -> float:
    """Relative change of the main results by large displacement."""
    n, terms, head = states.shape[1], tables.nodes.size + 1, strip.rod_length - strip.length
    bent, sunk, side, moment = np.zeros((terms, n)), np.zeros((terms, n)), np.empty(n), np.empty(n)
    add_third_order(
        states, strip.stiffness, strip.length, head, 1.0, strip.compliance, tables, bent, sunk, side, moment
    )
    for i in range(n):
        side[i], moment[i] = side[i] + states[SIDE, i], moment[i] + states[MOMENT, i]
    return change(j, judged, judge(j, strip, states, side, moment, bent, True, judged.critical))


def rod_inertia(situation: Situation) -> float:
    """Influence of the strip's own inertia; 0 if the strip buckles: it has no shape then."""
    return _by_inertia(situation)[0]


def _by_inertia(situation: Situation) -> tuple[float, float, float, float]:
    """The influence of the strip's inertia, its share of ringing, the mean pace of the first mode, and the change to
    first order if the samples resolve the mode, otherwise 0."""
    turn = situation.upright
    if turn is None:
        return 0.0, 0.0, 0.0, 0.0
    if "inertia" not in situation.known:
        d, m, material = situation.dimensions, situation.scene.mechanism, situation.scene.material
        line_mass = material.density * d.b * d.h * m.angular_speed**2
        while True:
            sampling, seen = turn.sampling, turn.seen
            change, share, pace = _change_by_motion(
                seen.judging, turn.strip, seen.states, seen.judged, turn.states, sampling.order, sampling.angle,
                sampling.ends, sampling.even, turn.step, line_mass, material.loss_factor, situation.in_plane,
                situation.softer, collocation(NODES),
            )  # fmt: skip
            if not turn.smooth or pace * TURN < FOLLOWED * sampling.even or pace > _MAX_EXCITED * turn.sharpness:
                break
            finer = situation.finer(turn)
            if finer is turn:
                break
            turn = finer
        change *= _MARGIN + (_RINGING_MARGIN - _MARGIN) * min(_RINGING_WEIGHT * share, 1.0)
        # After jumps, ringing is overestimated by enough to cover the iterates beyond the first.
        left = max(1.0 - change, 0.5) if situation.is_sharp and change < 1.0 else 1.0 - _SERIES_RATIO * change
        influence, resolved = change / left if left > 0.0 else math.inf, pace * TURN < SIGNED * turn.sampling.even
        situation.known["inertia"] = influence, share, pace, change if turn.smooth and resolved else 0.0
    return situation.known["inertia"]


@kernel
def _change_by_motion(
    j: Judging, strip: Strip, seen: Array, judged: Judged, states: Array, order: NDArray[np.intp], angle: Array,
    ends: NDArray[np.bool_], even: int, every: int, line_mass: float, loss: float, critical: float, softer: float,
    tables: Collocation,
) -> tuple[float, float, float]:  # fmt: skip
    """Maximum relative change of the main results by the strip's motion; then ``share`` and ``pace`` of ``Motion``.

    ``seen`` are the states at the judged angles; the motion there is that at the nearest uniform angle, of which every
    ``every``-th one is used.
    """
    n = seen.shape[1]
    motion = motion_of(states, order, angle, ends, even, every, strip, line_mass, loss, critical, softer, tables)
    worst, of_side = 0.0, _ALL_MODES_SIDE_FORCE if motion.either and order.size > even else _ALL_MODES
    side, moment, series = np.empty(n), np.empty(n), np.empty((motion.series.shape[0], n))
    for turned in range(2 if motion.either and motion.share > _MIN_RINGING_SHARE else 1):
        sign = 1.0 - 2.0 * turned
        for i in range(n):
            k = round(j.angle[i] / TURN * motion.side.size) % motion.side.size
            side[i] = seen[SIDE, i] + motion.side[k] + sign * of_side * motion.rings_side[k]
            moment[i] = seen[MOMENT, i] + motion.moment[k] + sign * _ALL_MODES * motion.rings_moment[k]
            for m in range(series.shape[0]):
                series[m, i] = motion.series[m, k] + sign * _ALL_MODES * motion.rings_series[m, k]
        moved = judge(j, strip, seen, side, moment, series, False, judged.critical)
        worst = max(worst, change(j, judged, moved))
    return worst, motion.share, motion.pace


def _beside_inertia(situation: Situation, change: float, stiffens: bool = True) -> float:
    """The margin on a change evaluated without the strip's inertia, including the amplification by it.

    A change that ``stiffens`` the strip shifts the phase of the ringing.
    """
    change = float(change)
    if not change or not math.isfinite(change):
        return change
    influence, share, pace, alone = _by_inertia(situation)
    left = max(1.0 - situation.turn.compression / situation.critical, 1e-3)
    own = influence / (_JUMP_EXCESS if situation.is_sharp else 1.0)
    own = min(own, _MAX_AMPLIFYING + _NEAR_BUCKLING / left)
    decay = math.pi * situation.scene.material.loss_factor * pace
    phase = min(1.0, change * pace / max(1.0, _MEMORY * decay))
    lively, moved = _AMPLIFICATION * own, 0.0
    if math.isinf(influence):
        # Results that inertia nearly cancels change by a larger share of themselves.
        lively = max(_AMPLIFICATION, alone) * own
        # Near a resonance, almost all of a free motion remains after a revolution.
        lively /= min(1.0, max(abs(1.0 - cmath.exp(complex(-decay, TURN * pace))), _MIN_DETUNING))
    if stiffens:
        moved = own * share * phase * (_PHASE_FIRST_ORDER + _PHASE_SECOND_ORDER * phase)
    # Coupling, shear and forces are exact in closed form, large displacement is to first order.
    margin = _STILL_MARGIN + (_MARGIN - _STILL_MARGIN) * min(own / _STILL, 1.0) if stiffens else _MARGIN
    found = margin * change * (1.0 + lively) + moved
    if found <= 1.0 or not stiffens:
        return found
    # A change larger than the results themselves cannot be judged separately from the other effects.
    if math.isinf(influence):
        return math.inf
    return found * min(found, _MAX_MULTIPLIER) if own > _STRONG_INERTIA else found
