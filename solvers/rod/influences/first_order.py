"""Influence of each effect: the change of the main results over one revolution without it, times a margin.

The revolution contains every effect: gas and inertia, coupling, shear and friction feedback in closed form
(``situation``), large displacement and the strip's inertia to first order (``corrected``). They are removed one by one.

The margins are based on tests over random machines, not on proof (``bench.influences``, docs/benchmarks.md): the
changes themselves are accurate to some percent in most of them, and those of inertia with many ringing modes to a
factor of a few.
"""

from __future__ import annotations

import math

from solvers.rod.influences.corrected import CorrectedRevolution
from solvers.rod.influences.situation import Situation

_EXACT_MARGIN = 1.02
"""Margin on a change of the axial force and of P_cr, which are exact apart from sampling, as no correction changes
them."""

_SHAPE_MARGIN, _FULL_INCREMENT_CHANGE = 1.17, 0.01
"""Margin on a change of the shape if inertia has no influence; and the change by inertia at which this margin has grown
by 0.1."""

_INTERACTION_MARGIN, _MAX_INTERACTION_MARGIN = 2.0, 10.0
"""Increase of the margin per change by inertia, which is less certain than the effects in closed form; and the limit of
the margin."""

_LOW_FREQUENCY, _MAX_LOW_FREQUENCY_MARGIN = 2.1, 100.0
"""Natural frequency of the first mode [1/rad] below which the first two harmonics of the crank's motion reach it: the
more inertia changes, the less certain are the small remainders of results that it cancels, and the distance from
resonance. And the limit of the margin then."""

_MAX_INFLUENCE = 2.0
"""Influence above which no tolerance leaves an effect out; larger margins are of no use."""

_INERTIA_MARGIN, _RINGING_MARGIN = 1.2, 1.5
"""Margin on a change by inertia, and on a small one dominated by ringing."""

_RINGING_WEIGHT, _MAX_RINGING_CHANGE = 300.0, 0.02
"""Weight of the share of ringing in the margin, so that the margin is that of pure ringing from a share of the inverse
on; and the change by inertia from which ringing has no weight, as the first mode then dominates."""


def in_closed_form(situation: Situation, part: int) -> float:
    """Influence of an effect that the revolution contains in closed form (``main_results.PARTS``)."""
    forces, shape = situation.changes_without(part)
    return max(_EXACT_MARGIN * forces, _with_margin(situation, shape))


def large_displacement(situation: Situation) -> float:
    """Influence of the third order of the strip's slope; 0 if the strip buckles, as it then has no shape."""
    if situation.corrected is None:
        return 0.0
    return _with_margin(situation, situation.corrected.by_large)


def rod_inertia(situation: Situation) -> float:
    """Influence of the strip's own inertia; 0 if the strip buckles, as it then has no shape. Infinite if the change
    exceeds the results themselves, as it is known to first order only."""
    found = situation.corrected
    if found is None:
        return 0.0
    ringing = min(_RINGING_WEIGHT * found.ringing_share, 1.0) * max(1.0 - found.by_inertia / _MAX_RINGING_CHANGE, 0.0)
    margin = _INERTIA_MARGIN + (_RINGING_MARGIN - _INERTIA_MARGIN) * ringing
    return max(margin, _low_frequency_margin(found)) * found.by_inertia if found.by_inertia < 1.0 else math.inf


def always(_: Situation) -> float:
    """Influence of an effect whose results would not exist without it."""
    return 1.0


def _with_margin(situation: Situation, change: float) -> float:
    """A change of the shape with its margin, which depends on the influence of inertia."""
    found, margin = situation.corrected, _SHAPE_MARGIN
    if found is not None:
        by_inertia = found.by_inertia
        increment = 0.1 * min(by_inertia / _FULL_INCREMENT_CHANGE, 1.0)
        margin = min(margin + increment + _INTERACTION_MARGIN * by_inertia, _MAX_INTERACTION_MARGIN)
        margin = max(margin, _low_frequency_margin(found))
    return max(_SHAPE_MARGIN * change, min(margin * change, _MAX_INFLUENCE))


def _low_frequency_margin(found: CorrectedRevolution) -> float:
    """Minimum margin if the strip's first natural frequency is low, else 1."""
    return min((1.0 + found.by_inertia) ** 3, _MAX_LOW_FREQUENCY_MARGIN) if found.frequency < _LOW_FREQUENCY else 1.0
