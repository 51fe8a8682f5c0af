"""How much each effect matters: the main results of one turn with it and without it, times a margin.

The turn has every effect in closed form - gas and inertia, coupling, shear, friction that acts back - and each of them
is taken away in turn (``situation``). Large displacement and the strip's inertia are added to it, to first order
(``strip.elastica``, ``inertia``). So what an effect changes is seen beside all others but these two; where the strip's
inertia is large it magnifies what others change, and the phase of what rings they may change altogether.

The margins are by test over random machines, not by proof (docs/campaign.md): the changes themselves are right to some
percent in most of them, and those of inertia where many modes ring to a factor of a few.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.rod.cycle.state import FORCE, MOMENT, SIDE
from solvers.rod.effect_bounds.inertia import Motion
from solvers.rod.effect_bounds.main_results import change, judge
from solvers.rod.effect_bounds.situation import Situation, Turn
from solvers.rod.load.axial_force import drive_of
from solvers.rod.strip.elastica import ElasticaExpansion
from solvers.rod.strip.elastica_kernels import nodes_for

_MARGIN, _OF_RINGING = 1.2, 1.4
"""Times a change; times that by inertia where it rings."""

_RINGING, _JUMPING_SIDE = 2.0, 8.0
"""Times the first mode's ringing: that of all modes, and in the side force behind jumps of the load, which all of them
feel and of which fast ones have most."""

_LOUD = 5.0
"""Share of ringing from whose inverse on inertia has the margin of what rings."""

_QUIET = 0.05
"""Share of ringing below which it does not matter whether it adds or takes away."""

_THINNED, _FEWER_NODES = 2, 8
"""Large displacement is smooth: every other angle serves, and fewer nodes than for the last digits."""

_OF_JUMPS = 3.0
"""How much more than what rings behind jumps of the load its own bound is, in the middle."""

_LIVELY, _LIVELIEST, _NEAR_BUCKLING = 2.0, 1.2, 0.2
"""How much inertia that changes the results by a share of themselves magnifies what others change, per share; up to
which share, and how much more per 1/(1 - P/P_cr)."""


def reciprocating_inertia(situation: Situation) -> float:
    """Without the reciprocating mass."""
    if not situation.scene.piston.reciprocating_mass:
        return 0.0
    drive, critical = drive_of(situation.scene, 0.0), situation.critical_with_shear
    return _beside_inertia(situation, situation.change_without(drive, situation.strip, critical))


def beam_column(situation: Situation) -> float:
    """Without the axial force's part in bending."""
    return _taken_away(situation, situation.critical_with_shear, couples=0.0)


def shear(situation: Situation) -> float:
    """Rigid in shear."""
    return _taken_away(situation, situation.critical, compliance=0.0)


def friction_feedback(situation: Situation) -> float:
    """Without friction in the axial force."""
    if not situation.scene.piston.friction_coefficient:
        return 0.0
    return _taken_away(situation, situation.critical_with_shear, friction=0.0)


def large_displacement(situation: Situation) -> float:
    """Without the third order of the strip's slope; nothing where the strip buckles under the gas alone."""
    turn, l = situation.upright, situation.dimensions.l
    if turn is None:
        return 0.0
    strip, part = turn.strip, turn.part(_THINNED)
    states, judging = part.states, part.judging
    q = states[FORCE] * (l * l / strip.stiffness)
    nodes = nodes_for(float(q.min()), float(q.max())) - _FEWER_NODES
    expansion = ElasticaExpansion(strip.stiffness, l, strip.rod_length - l, 1.0, strip.compliance, nodes)
    series, unused = np.zeros((expansion.bent_terms, q.size)), np.zeros((expansion.sunk_terms, q.size))
    side, moment = expansion.add(states, series, unused)
    critical = part.judged.critical
    bent = judge(judging, strip, states, states[SIDE] + side, states[MOMENT] + moment, series, True, critical)
    return _MARGIN * change(judging, part.judged, bent)


def rod_inertia(situation: Situation) -> float:
    """Without the strip's own inertia; nothing where the strip buckles under the gas alone."""
    turn, motion = situation.upright, situation.motion
    if turn is None or motion is None:
        return 0.0
    if "inertia" not in situation.known:
        change = (_MARGIN + (_OF_RINGING - _MARGIN) * min(_LOUD * motion.share, 1.0)) * _change_by(turn, motion)
        # What follows the first iterate is as much smaller as that is small.
        situation.known["inertia"] = change / max(1.0 - change, 0.5)
    return situation.known["inertia"]


def _change_by(turn: Turn, motion: Motion) -> float:
    """The greatest relative change of the main results by a motion."""
    part, strip, critical = turn.part(1), turn.strip, turn.judged.critical
    judging, states = part.judging, part.states
    jumps, found = motion.either and part is not turn, 0.0
    for sign in (1.0, -1.0) if motion.either and motion.share > _QUIET else (1.0,):
        of_side = _JUMPING_SIDE if jumps else _RINGING
        side = states[SIDE] + motion.side + sign * of_side * motion.rings_side
        moment = states[MOMENT] + motion.moment + sign * _RINGING * motion.rings_moment
        series = motion.series + sign * _RINGING * motion.rings_series
        moved = judge(judging, strip, states, side, moment, series, False, critical)
        found = max(found, change(judging, part.judged, moved))
    return found


def _taken_away(situation: Situation, critical: float, **parts: float) -> float:
    strip = situation.strip._replace(**parts)
    return _beside_inertia(situation, situation.change_without(situation.driven.drive, strip, critical))


def _beside_inertia(situation: Situation, change: float) -> float:
    """The margin on a change of the turn without the strip's inertia, for what inertia makes of it."""
    motion = situation.motion
    if not change or not math.isfinite(change) or motion is None:
        return change
    left = max(1.0 - situation.compression / situation.critical, 1e-3)
    own = rod_inertia(situation) / (_OF_JUMPS if situation.driven.sharp.size else 1.0)
    own = min(own, _LIVELIEST + _NEAR_BUCKLING / left)
    # A change of the stiffness moves the phase of what rings by so much times its radians in half a turn.
    moved = 0.5 * own * motion.share * min(1.0, change * motion.pace)
    return _MARGIN * change * (1.0 + _LIVELY * own) + moved
