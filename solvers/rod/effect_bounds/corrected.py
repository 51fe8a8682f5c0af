"""One revolution with the corrections of the shape, large displacement and the strip's inertia, to first order, and
what each effect changes there.

Corrections add up: each follows from the strip without them (``cycle.composition``). Where they are small, every effect
changes the results as if it were alone. Where they are not, an effect that is left out takes its share of the
corrections along, and what changes is found from a second revolution, corrected likewise, without the effect: a clamp
moment that inertia or large displacement nearly cancels, a vibration near its resonance, or another section or angle
that governs.

How much the strip rings is the least certain part (``inertia``): results are compared with all of it, and with less of
it or its opposite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.large_displacement import add_third_order
from solvers.rod.cycle.state import FORCE, ROWS, Strip, fill_states
from solvers.rod.effect_bounds.inertia import Inert, Motion, motion_of
from solvers.rod.effect_bounds.main_results import (
    Added,
    Judged,
    Judging,
    both_added,
    change_of_forces,
    change_of_shape,
    judge,
)
from solvers.rod.effect_bounds.sampling import Sampling
from solvers.rod.load.axial_force import Drive
from solvers.rod.strip.elastica_kernels import Collocation

Array = NDArray[np.float64]

_ALL_MODES, _ALL_MODES_SIDE_FORCE = 1.5, 3.0
"""Ringing of all modes relative to the first one's: in general, and in the side force after jumps of the load, which
excite all modes and appear most in the fast ones."""

_BY_ITSELF = -1.0
"""For ``Motion.nearer``."""

_LESS_RINGING, _MIN_RINGING_SHARE = 0.3, 1e-3
"""The less of the ringing that is compared too, and the share of it below which it is irrelevant."""


class Corrected(NamedTuple):
    """Relative changes of the main results without large displacement and without the strip's inertia; whether effects
    are judged beside these corrections; ``share``, ``pace``, ``sine`` and ``nearer`` of the motion; and, to judge
    beside them, the results with all of its ringing and with less of it."""

    by_large: float
    by_inertia: float
    interact: bool
    share: float
    pace: float
    sine: float
    nearer: float
    loud: Judged
    quiet: Judged


@kernel
def corrected(
    j: Judging, strip: Strip, seen: Array, judged: Judged, states: Array, sampling: Sampling,
    every: int, inert: Inert, tables: Collocation, of_large: Collocation, apart: float,
) -> Corrected:  # fmt: skip
    """The corrections of a revolution from its ``states`` at all angles, judged at those ``seen``.

    ``apart``: the change up to which the corrections and other effects are judged one by one.
    """
    motion = motion_of(states, sampling, every, strip, inert, tables, _BY_ITSELF)
    large = _in_large(strip, seen, of_large)
    in_large, loud, quiet = judge(j, strip, seen, large, judged.critical), judged, judged
    by_large, by_inertia = change_of_shape(judged, in_large), 0.0
    for k in range(_ringings(motion.share)):
        moved = judge(j, strip, seen, _moved(j, sampling, motion, _ringing(motion, k)), judged.critical)
        by_inertia = max(by_inertia, change_of_shape(judged, moved))
    interact = not max(by_large, by_inertia) <= apart
    if interact:
        for k in range(_ringings(motion.share)):
            by_motion = _moved(j, sampling, motion, _ringing(motion, k))
            moved = judge(j, strip, seen, by_motion, judged.critical)
            quiet = judge(j, strip, seen, both_added(by_motion, large), judged.critical)
            if k == 0:
                loud = quiet
            by_large = max(by_large, change_of_shape(moved, quiet))
            by_inertia = max(by_inertia, change_of_shape(in_large, quiet))
    return Corrected(
        by_large, by_inertia, interact, motion.share, motion.pace, motion.sine, motion.nearer, loud, quiet
    )  # fmt: skip


@kernel
def change_beside(
    j: Judging, sampling: Sampling, every: int, inert: Inert, tables: Collocation, of_large: Collocation,
    whole: Corrected, left_drive: Drive, left: Strip, left_critical: float,
) -> tuple[float, float]:  # fmt: skip
    """Relative changes of the forces and of the shape beside the corrections of the whole, of what is ``left`` without
    an effect: the drive, the strip, and P_cr [N]."""
    states, seen = np.empty((ROWS, sampling.angle.size)), np.empty((ROWS, j.angle.size))
    fill_states(left_drive, left, sampling.angle, states)
    if not states[FORCE].min() > -left_critical:
        return np.inf, np.inf
    for row in range(ROWS):
        for i in range(seen.shape[1]):
            seen[row, i] = states[row, i * every]
    motion = motion_of(states, sampling, every, left, inert, tables, whole.nearer)
    large = _in_large(left, seen, of_large)
    # A resonance that is neared without the effect may be one that is left: its side is as uncertain as the phase.
    detuned = min(motion.detuning * abs(motion.sine - whole.sine), 1.0)
    forces, shape, count = 0.0, 0.0, _ringings(whole.share)
    for k in range(count if count == 1 else 4):
        rings = _ringing(motion, 1) if k == 1 else 1.0 + detuned if k == 2 else 1.0 - detuned if k == 3 else 1.0
        by_motion = _moved(j, sampling, motion, rings)
        found = judge(j, left, seen, both_added(by_motion, large), left_critical)
        exact = whole.quiet if k == 1 else whole.loud
        forces, shape = change_of_forces(j, found, exact), max(shape, change_of_shape(found, exact))
    return forces, shape


@kernel
def _ringing(motion: Motion, which: int) -> float:
    """By which the ringing is multiplied in each of the motions compared."""
    return 1.0 if which == 0 else -1.0 if motion.either else _LESS_RINGING


@kernel
def _ringings(share: float) -> int:
    """How many motions are compared."""
    return 2 if share > _MIN_RINGING_SHARE else 1


@kernel
def _moved(j: Judging, sampling: Sampling, motion: Motion, rings: float) -> Added:
    """What the motion adds at the judged angles; what follows the load, that at the nearest uniform angle."""
    n, terms, known = j.angle.size, motion.series.shape[0], motion.side.size
    of_side = _ALL_MODES_SIDE_FORCE if motion.either and sampling.angle.size > sampling.even else _ALL_MODES
    side, moment, series = np.empty(n), np.empty(n), np.empty((terms, n))
    for i in range(n):
        k = round(j.angle[i] / TURN * known) % known
        mode = motion.steeper[i] + rings * _ALL_MODES * motion.rings[i]
        side[i] = motion.side[k] + motion.mode_side * (motion.steeper[i] + rings * of_side * motion.rings[i])
        moment[i] = motion.moment[k] + motion.mode_moment * mode
        for m in range(terms):
            series[m, i] = motion.series[m, k] + motion.mode_series[m] * mode
    return Added(side, moment, series, False)


@kernel
def _in_large(strip: Strip, states: Array, tables: Collocation) -> Added:
    """What large displacement adds."""
    n, terms = states.shape[1], tables.nodes.size + 1
    bent, sunk, side, moment = np.zeros((terms, n)), np.zeros((terms, n)), np.empty(n), np.empty(n)
    add_third_order(states, strip, tables, bent, sunk, side, moment)
    return Added(side, moment, bent, True)
