"""One revolution with first-order corrections of the shape, large displacement and the strip's inertia, and the changes
of its results without each effect.

Corrections add up: each follows from the strip without them (``cycle.composition``). If they are small, the influences
of effects are independent. Otherwise an effect that is left out also changes the corrections, and its influence follows
from a second revolution without the effect, corrected likewise: inertia or large displacement may nearly cancel a clamp
moment, a vibration may be near resonance, or another section or angle may govern.

The ringing of the strip is the least certain part (``inertia``): results are compared with the full ringing, and with
less of it or its opposite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import extremes
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.large_displacement import add_third_order
from solvers.rod.cycle.state import FORCE, ROWS, Strip, states_of
from solvers.rod.influences.first_mode import Phase
from solvers.rod.influences.inertia import InertiaParameters, Motion, first_order_motion
from solvers.rod.influences.main_results import (
    MainResults,
    ResultParameters,
    ShapeCorrection,
    change_of_forces,
    change_of_shape,
    evaluate,
    sum_of_corrections,
)
from solvers.rod.influences.sampled_angles import Sampling
from solvers.rod.load.axial_force import Drive
from solvers.rod.strip.elastica_kernels import Collocation

_ALL_MODES_FACTOR = 1.5
"""Ringing of all modes relative to the first one."""

_REDUCED_RINGING, _MIN_RINGING_SHARE = 0.3, 1e-3
"""Fraction of the ringing that is compared too, and the share of ringing below which it is irrelevant."""


class CorrectedRevolution(NamedTuple):
    """Relative changes of the main results without large displacement and without the strip's inertia; whether other
    effects interact with these corrections; ``ringing_share``, ``frequency`` and ``phase`` of the motion; and, for
    effects that interact, the results with full and with reduced ringing."""

    by_large: float
    by_inertia: float
    interact: bool
    ringing_share: float
    frequency: float
    phase: Phase
    full_ringing: MainResults
    reduced_ringing: MainResults


@kernel
def corrected_revolution(
    parameters: ResultParameters, strip: Strip, result_states: Array, linear: MainResults, states: Array,
    sampling: Sampling, every: int, inertia: InertiaParameters, tables: Collocation, elastica_tables: Collocation,
    max_independent: float,
) -> CorrectedRevolution:  # fmt: skip
    """Correct a revolution, from its ``states`` at all angles, and evaluate it at ``result_states``, a subset of them.

    ``max_independent`` is the change by corrections up to which their influence and that of other effects are
    independent.
    """
    motion = first_order_motion(states, sampling, every, strip, inertia, tables)
    large = _large_displacement_correction(strip, result_states, elastica_tables)
    critical, full_ringing, reduced_ringing = linear.critical, linear, linear
    with_large = evaluate(parameters, strip, result_states, large, critical)
    by_large, by_inertia = change_of_shape(linear, with_large), 0.0
    for k in range(_variants(motion.ringing_share)):
        by_motion = _inertia_correction(parameters, motion, _ringing_factor(motion, k))
        with_inertia = evaluate(parameters, strip, result_states, by_motion, critical)
        by_inertia = max(by_inertia, change_of_shape(linear, with_inertia))
    interact = not max(by_large, by_inertia) <= max_independent
    if interact:
        for k in range(_variants(motion.ringing_share)):
            by_motion = _inertia_correction(parameters, motion, _ringing_factor(motion, k))
            with_inertia = evaluate(parameters, strip, result_states, by_motion, critical)
            reduced_ringing = evaluate(parameters, strip, result_states, sum_of_corrections(by_motion, large), critical)
            if k == 0:
                full_ringing = reduced_ringing
            by_large = max(by_large, change_of_shape(with_inertia, reduced_ringing))
            by_inertia = max(by_inertia, change_of_shape(with_large, reduced_ringing))
    return CorrectedRevolution(
        by_large, by_inertia, interact, motion.ringing_share, motion.frequency, motion.phase, full_ringing,
        reduced_ringing,
    )  # fmt: skip


@kernel
def change_with_corrections(
    parameters: ResultParameters, sampling: Sampling, every: int, inertia: InertiaParameters, tables: Collocation,
    elastica_tables: Collocation, full: CorrectedRevolution, drive: Drive, strip: Strip, critical: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the relative changes of the forces and of the shape between the ``full`` corrected revolution and one
    without an effect, corrected likewise, which has the given drive, strip and P_cr [N]."""
    states, result_states = states_of(drive, strip, sampling.angle), np.empty((ROWS, parameters.angle.size))
    if not extremes(states[FORCE])[1] > -critical:
        return np.inf, np.inf
    for row in range(ROWS):
        for i in range(result_states.shape[1]):
            result_states[row, i] = states[row, i * every]
    motion = first_order_motion(states, sampling, every, strip, inertia, tables)
    large = _large_displacement_correction(strip, result_states, elastica_tables)
    # As the phase is uncertain, a resonance that seems closer without the effect may be farther, and conversely.
    uncertainty = min(motion.phase.sine_sensitivity * abs(motion.phase.sine - full.phase.sine), 1.0)
    forces, shape, variants = 0.0, 0.0, _variants(full.ringing_share)
    for k in range(variants if variants == 1 else 4):
        factor = 1.0 + uncertainty if k == 2 else 1.0 - uncertainty if k == 3 else 1.0
        factor = _ringing_factor(motion, 1) if k == 1 else factor
        by_motion = _inertia_correction(parameters, motion, factor)
        found = evaluate(parameters, strip, result_states, sum_of_corrections(by_motion, large), critical)
        exact = full.reduced_ringing if k == 1 else full.full_ringing
        forces, shape = change_of_forces(parameters, found, exact), max(shape, change_of_shape(found, exact))
    return forces, shape


@kernel
def _ringing_factor(motion: Motion, which: int) -> float:
    """Factor on the ringing in variant number ``which``."""
    return 1.0 if which == 0 else -1.0 if motion.sign_unknown else _REDUCED_RINGING


@kernel
def _variants(ringing_share: float) -> int:
    """Number of variants of the motion that are compared."""
    return 2 if ringing_share > _MIN_RINGING_SHARE else 1


@kernel
def _inertia_correction(parameters: ResultParameters, motion: Motion, factor: float) -> ShapeCorrection:
    """Return the correction by the motion at the angles of the results; its response without ringing is taken at the
    nearest uniform angle."""
    n, terms, uniform = parameters.angle.size, motion.series.shape[0], motion.side.size
    side, moment, series = np.empty(n), np.empty(n), np.empty((terms, n))
    for i in range(n):
        k = round(parameters.angle[i] / TURN * uniform) % uniform
        amplitude = factor * _ALL_MODES_FACTOR * motion.ringing[i]
        side[i] = motion.side[k] + motion.mode_side * amplitude
        moment[i] = motion.moment[k] + motion.mode_moment * amplitude
        for m in range(terms):
            series[m, i] = motion.series[m, k] + motion.mode_series[m] * amplitude
    return ShapeCorrection(side, moment, series, False)


@kernel
def _large_displacement_correction(strip: Strip, states: Array, tables: Collocation) -> ShapeCorrection:
    """Return the correction by large displacement."""
    n, terms = states.shape[1], tables.nodes.size + 1
    series, deflection_series, side, moment = np.zeros((terms, n)), np.zeros((terms, n)), np.empty(n), np.empty(n)
    add_third_order(states, strip, tables, series, deflection_series, side, moment)
    return ShapeCorrection(side, moment, series, True)
