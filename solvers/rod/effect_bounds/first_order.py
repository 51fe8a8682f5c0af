"""Influence of each effect: the change of the main results over one revolution without it, times a margin.

The revolution contains every effect: gas and inertia, coupling, shear and friction feedback in closed form
(``situation``), large displacement and the strip's inertia to first order (``corrected``). Each is removed in turn; what
is small beside all others, alone.

The margins are based on tests over random machines, not on proof (``bench.influences``, docs/benchmarks.md): the
changes themselves are accurate to some percent in most of them, and those of inertia with many ringing modes to a
factor of a few.
"""

from __future__ import annotations

import math

from solvers.rod.effect_bounds.main_results import COUPLES, FRICTION, MASS, SHEARING
from solvers.rod.effect_bounds.situation import Situation

_EXACT_MARGIN = 1.02
"""Margin on a change of the axial force and of P_cr, which no correction changes: only their sampling is inexact."""

_MARGIN, _RINGING_MARGIN = 1.2, 1.5
"""Margin on a change; margin on a change by inertia dominated by ringing."""

_STILL_MARGIN, _STILL = 1.1, 0.01
"""Margin on a change known in closed form if inertia has no influence, and the influence of inertia from which the full
margin applies."""

_BESIDE_MARGIN, _MAX_BESIDE_MARGIN = 1.0, 4.0

_RINGING_WEIGHT = 3.0
"""Weight of the share of ringing in the margin, which reaches that of pure ringing at a share of the inverse."""

_SERIES_RATIO = 1.2
"""Factor on the first iterate's influence for the ratio of successive iterates of inertia."""


def reciprocating_inertia(situation: Situation) -> float:
    """Influence of the reciprocating mass."""
    return _in_closed_form(situation, MASS)


def beam_column(situation: Situation) -> float:
    """Influence of the axial force's contribution to bending."""
    return _in_closed_form(situation, COUPLES)


def shear(situation: Situation) -> float:
    """Influence of shear flexibility."""
    return _in_closed_form(situation, SHEARING)


def friction_feedback(situation: Situation) -> float:
    """Influence of the friction feedback to the axial force."""
    return _in_closed_form(situation, FRICTION)


def large_displacement(situation: Situation) -> float:
    """Influence of the third order of the strip's slope; 0 if the strip buckles: it has no shape then."""
    if situation.corrected is None:
        return 0.0
    _, found = situation.corrected
    return _beside(found.by_large, found.by_inertia)


def rod_inertia(situation: Situation) -> float:
    """Influence of the strip's own inertia; 0 if the strip buckles: it has no shape then."""
    if situation.corrected is None:
        return 0.0
    turn, found = situation.corrected
    ringing = min(_RINGING_WEIGHT * found.motion.share, 1.0)
    change = found.by_inertia * (_MARGIN + (_RINGING_MARGIN - _MARGIN) * ringing)
    # After jumps, ringing is overestimated by enough to cover the iterates beyond the first.
    left = 1.0 - _SERIES_RATIO * change if turn.smooth or change >= 1.0 else max(1.0 - change, 0.5)
    return change / left if left > 0.0 else math.inf


def _in_closed_form(situation: Situation, part: int) -> float:
    """The margin on the change without a part, more of it beside a large inertia of the strip."""
    forces, shape = situation.changes_without(part)
    by_inertia = situation.corrected[1].by_inertia if situation.corrected else 0.0
    return max(_EXACT_MARGIN * float(forces), _beside(float(shape), by_inertia))


def _beside(change: float, by_inertia: float) -> float:
    margin = _STILL_MARGIN + (_MARGIN - _STILL_MARGIN) * min(by_inertia / _STILL, 1.0)
    return min(margin + _BESIDE_MARGIN * by_inertia, _MAX_BESIDE_MARGIN) * change
