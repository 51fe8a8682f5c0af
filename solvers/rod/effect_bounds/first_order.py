"""How much each effect matters: the main results of one turn with it and without it, times a margin.

The turn has every effect in closed form - gas and inertia, coupling, shear, friction that acts back - and each of them
is taken away in turn (``situation``). Large displacement and the strip's inertia are added to it, to first order
(``cycle.large_displacement``, ``inertia``). So what an effect changes is seen beside all others but these two; where
the strip's inertia is large it magnifies what others change, and the phase of what rings they may change altogether.

The margins are by test over random machines, not by proof (docs/campaign.md): the changes themselves are right to some
percent in most of them, and those of inertia where many modes ring to a factor of a few.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.large_displacement import add_third_order
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.effect_bounds.inertia import FOLLOWED, NODES, motion_of
from solvers.rod.effect_bounds.main_results import COUPLES, FRICTION, MASS, SHEARING, Judged, Judging, change, judge
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.strip.elastica_kernels import Collocation, collocation, nodes_for

Array = NDArray[np.float64]

_MARGIN, _OF_RINGING = 1.2, 1.5
"""Times a change; times that by inertia where it rings."""

_RINGING, _JUMPING_SIDE = 2.0, 8.0
"""Times the first mode's ringing: that of all modes, and in the side force behind jumps of the load, which all of them
feel and of which fast ones have most."""

_LOUD = 5.0
"""Share of ringing from whose inverse on inertia has the margin of what rings."""

_MOVED, _MOVED_FAR = 0.5, 1.2
"""Times what rings and the phase that a change moves: what that makes, to first and second order of the phase."""

_QUIET = 1e-3
"""Share of ringing below which it does not matter whether it adds or takes away."""

_FEWER_NODES = 12
"""Large displacement is smooth: fewer nodes than for the last digits serve."""

_STRUCK = 25.0
"""Times the turn's sharpness: a faster first mode is not struck by what is smooth."""

_NEXT = 1.5
"""Times the first iterate's influence: how much smaller every iterate of inertia is than the one before."""

_OF_JUMPS = 3.0
"""How much more than what rings behind jumps of the load its own bound is, in the middle."""

_LIVELY, _LIVELIEST, _NEAR_BUCKLING, _UNBOUNDED = 2.0, 1.2, 0.2, 2.0
"""How much inertia that changes the results by a share of themselves magnifies what others change, per share; up to
which share, how much more per 1/(1 - P/P_cr), and how many times that where nothing bounds inertia itself."""

_SLOW, _RESONANT, _MOVED_LITTLE = 8.0, 0.2, 0.5
"""Where nothing bounds inertia, and the first mode is slower than that and as far from the harmonics by |sin| of half
its phase: it magnifies no more than where it is bounded, and so much less of the phase counts."""

_STRONG, _OVERTHROWN = 0.25, 3.0
"""Influence of inertia from which on it may multiply a change that is greater than the results, and by how much."""


def reciprocating_inertia(situation: Situation) -> float:
    """Without the reciprocating mass."""
    return _beside_inertia(situation, situation.without[MASS])


def beam_column(situation: Situation) -> float:
    """Without the axial force's part in bending."""
    return _beside_inertia(situation, situation.without[COUPLES])


def shear(situation: Situation) -> float:
    """Rigid in shear."""
    return _beside_inertia(situation, situation.without[SHEARING])


def friction_feedback(situation: Situation) -> float:
    """Without friction in the axial force."""
    return _beside_inertia(situation, situation.without[FRICTION])


def large_displacement(situation: Situation) -> float:
    """Without the third order of the strip's slope; nothing where the strip buckles under the gas alone."""
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
    """The change of the main results by large displacement."""
    n, terms, head = states.shape[1], tables.nodes.size + 1, strip.rod_length - strip.length
    bent, sunk, side, moment = np.zeros((terms, n)), np.zeros((terms, n)), np.empty(n), np.empty(n)
    add_third_order(
        states, strip.stiffness, strip.length, head, 1.0, strip.compliance, tables, bent, sunk, side, moment
    )
    for i in range(n):
        side[i], moment[i] = side[i] + states[SIDE, i], moment[i] + states[MOMENT, i]
    return change(j, judged, judge(j, strip, states, side, moment, bent, True, judged.critical))


def rod_inertia(situation: Situation) -> float:
    """Without the strip's own inertia; nothing where the strip buckles under the gas alone."""
    return _by_inertia(situation)[0]


def _by_inertia(situation: Situation) -> tuple[float, float, float]:
    """The influence of the strip's inertia, the share of ringing in it, and the mean pace of the first mode."""
    turn = situation.upright
    if turn is None:
        return 0.0, 0.0, 0.0
    if "inertia" not in situation.known:
        d, m, material = situation.dimensions, situation.scene.mechanism, situation.scene.material
        line_mass = material.density * d.b * d.h * m.angular_speed**2
        while True:
            sampling, seen = turn.sampling, turn.even
            change, share, pace = _change_by_motion(
                seen.judging, turn.strip, seen.states, seen.judged, turn.states, sampling.order, sampling.angle,
                sampling.even, line_mass, situation.in_plane, situation.softer, collocation(NODES),
            )  # fmt: skip
            if not turn.smooth or pace * TURN < FOLLOWED * sampling.even or pace > _STRUCK * turn.sharpness:
                break
            finer = situation.finer(turn)
            if finer is turn:
                break
            turn = finer
        change *= _MARGIN + (_OF_RINGING - _MARGIN) * min(_LOUD * share, 1.0)
        # Behind jumps more is told of ringing than there is, enough for what follows the first iterate.
        left = max(1.0 - change, 0.5) if situation.sharp.size and change < 1.0 else 1.0 - _NEXT * change
        situation.known["inertia"] = change / left if left > 0.0 else math.inf, share, pace
    return situation.known["inertia"]


@kernel
def _change_by_motion(
    j: Judging, strip: Strip, seen: Array, judged: Judged, states: Array, order: NDArray[np.intp], angle: Array,
    even: int, line_mass: float, critical: float, softer: float, tables: Collocation,
) -> tuple[float, float, float]:  # fmt: skip
    """The greatest relative change of the main results by the strip's motion; the last two of ``Motion``.

    ``seen`` are the states that results are judged at: every so many of the even ones.
    """
    n = seen.shape[1]
    motion = motion_of(states, order, angle, even, even // n, strip, line_mass, critical, softer, tables)
    worst, of_side = 0.0, _JUMPING_SIDE if motion.either and order.size > even else _RINGING
    side, moment, series = np.empty(n), np.empty(n), np.empty((motion.series.shape[0], n))
    for turned in range(2 if motion.either and motion.share > _QUIET else 1):
        sign = 1.0 - 2.0 * turned
        for i in range(n):
            side[i] = seen[SIDE, i] + motion.side[i] + sign * of_side * motion.rings_side[i]
            moment[i] = seen[MOMENT, i] + motion.moment[i] + sign * _RINGING * motion.rings_moment[i]
            for m in range(series.shape[0]):
                series[m, i] = motion.series[m, i] + sign * _RINGING * motion.rings_series[m, i]
        moved = judge(j, strip, seen, side, moment, series, False, judged.critical)
        worst = max(worst, change(j, judged, moved))
    return worst, motion.share, motion.pace


def _beside_inertia(situation: Situation, change: float, stiffens: bool = True) -> float:
    """The margin on a change of the turn without the strip's inertia, for what inertia makes of it.

    A change that ``stiffens`` the strip moves the phase of what rings.
    """
    change = float(change)
    if not change or not math.isfinite(change) or situation.upright is None:
        return change
    influence, share, pace = _by_inertia(situation)
    left = max(1.0 - situation.turn.compression / situation.critical, 1e-3)
    own = influence / (_OF_JUMPS if situation.sharp.size else 1.0)
    own = min(own, _LIVELIEST + _NEAR_BUCKLING / left)
    lively, phase = _LIVELY * own, min(1.0, change * pace)
    moved = (own * share if stiffens else 0.0) * phase * (_MOVED + _MOVED_FAR * phase)
    if math.isinf(influence):
        if pace < _SLOW and abs(math.sin(math.pi * pace)) > _RESONANT:
            moved *= _MOVED_LITTLE
        else:
            lively *= _UNBOUNDED
    found = _MARGIN * change * (1.0 + lively) + moved
    if found <= 1.0 or not stiffens:
        return found
    # What is larger than the results themselves is not told by one turn beside the others.
    if math.isinf(influence):
        return math.inf
    return found * min(found, _OVERTHROWN) if own > _STRONG else found
