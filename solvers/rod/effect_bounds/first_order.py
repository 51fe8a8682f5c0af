"""Influence of each effect: the change of the main results over one revolution without it, times a margin.

The revolution contains every effect: gas and inertia, coupling, shear and friction feedback in closed form
(``situation``), large displacement and the strip's inertia to first order (``corrected``). Each is removed in turn.

The margins are based on tests over random machines, not on proof (``bench.influences``, docs/benchmarks.md): the
changes themselves are accurate to some percent in most of them, and those of inertia with many ringing modes to a
factor of a few.
"""

from __future__ import annotations

import math

from solvers.rod.effect_bounds.corrected import Corrected
from solvers.rod.effect_bounds.situation import Situation

_EXACT_MARGIN = 1.02
"""Margin on a change of the axial force and of P_cr, which no correction changes: only their sampling is inexact."""

_ALONE_MARGIN, _APART = 1.17, 0.01
"""Margin on a change of the shape if inertia has no influence; the change by inertia at which it has reached 0.1 more,
and from which the shape is judged beside inertia (``situation``)."""

_BESIDE_MARGIN, _MAX_BESIDE_MARGIN = 2.0, 10.0
"""Increment of the margin per change by inertia, which is less certain than what is known in closed form; its limit."""

_SLOW, _MAX_SLOW_MARGIN = 2.1, 100.0
"""Pace of the first mode below which the crank's own two harmonics reach it: the small remainder of results that
inertia cancels, and the distance from a resonance, are less known the more inertia changes; limit of the margin then.
"""

_ALWAYS = 2.0
"""An influence that no tolerance leaves out: more of a margin has no use."""

_INERTIA_MARGIN, _RINGING_MARGIN = 1.2, 1.5
"""Margin on a change by inertia; margin on a small one dominated by ringing."""

_RINGING_WEIGHT, _SMALL = 300.0, 0.02
"""Weight of the share of ringing in the margin, which reaches that of pure ringing at a share of the inverse; the
change by inertia from which it has no weight, since the first mode then dominates."""


def in_closed_form(situation: Situation, part: int) -> float:
    """Influence of a part of what the revolution contains in closed form (``main_results.PARTS``)."""
    forces, shape = situation.changes_without(part)
    return max(_EXACT_MARGIN * forces, _with_margin(situation, shape))


def large_displacement(situation: Situation) -> float:
    """Influence of the third order of the strip's slope; 0 if the strip buckles: it has no shape then."""
    if situation.corrected is None:
        return 0.0
    return _with_margin(situation, situation.corrected.by_large)


def rod_inertia(situation: Situation) -> float:
    """Influence of the strip's own inertia; 0 if the strip buckles: it has no shape then. Unbounded beyond the results
    themselves: it is known to first order only."""
    found = situation.corrected
    if found is None:
        return 0.0
    ringing = min(_RINGING_WEIGHT * found.share, 1.0) * max(1.0 - found.by_inertia / _SMALL, 0.0)
    margin = _INERTIA_MARGIN + (_RINGING_MARGIN - _INERTIA_MARGIN) * ringing
    return max(margin, _slow_margin(found)) * found.by_inertia if found.by_inertia < 1.0 else math.inf


def always(_: Situation) -> float:
    """Influence of what adds results that would not exist without it."""
    return 1.0


def _with_margin(situation: Situation, change: float) -> float:
    """A change of the shape beside the strip's inertia, with its margin."""
    found, margin = situation.corrected, _ALONE_MARGIN
    if found is not None:
        beside = found.by_inertia
        margin = min(margin + 0.1 * min(beside / _APART, 1.0) + _BESIDE_MARGIN * beside, _MAX_BESIDE_MARGIN)
        margin = max(margin, _slow_margin(found))
    return max(_ALONE_MARGIN * change, min(margin * change, _ALWAYS))


def _slow_margin(found: Corrected) -> float:
    """The least margin where the strip is slow."""
    return min((1.0 + found.by_inertia) ** 3, _MAX_SLOW_MARGIN) if found.pace < _SLOW else 1.0
