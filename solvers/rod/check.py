"""Evaluation of a given strip: stresses, fatigue, stability, and the piston's guide loads."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Choice, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.fatigue.kernels import Diagram
from solvers.outcome import Accuracy, Outcome, Status
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.corrected_sampling import SampledCycle
from solvers.rod.cycle.field_results import FIELD_RESULTS
from solvers.rod.cycle.peaks_along_strip import STRIP_RESULTS
from solvers.rod.effects import RodEffect, choose_for, compose
from solvers.rod.linear_check import (
    FIELD_COLUMNS,
    REFINEMENTS,
    ROUNDING,
    SAMPLING_FRACTION,
    Results,
    check_linear,
    stations_for,
)
from solvers.rod.piston.skirt import contact_load, pressure_per_load
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.steady_response import unknown_vibration

_SAFETY_FACTOR, _MIN_REDUCTION = 0.5, 0.7
"""Tolerances of a repeated sampling, relative to the previous one: ``_SAFETY_FACTOR`` reduces the target of the errors;
a new tolerance above ``_MIN_REDUCTION`` times the previous one is not worth its time."""
_MAX_TOLERANCE = 1e-2
_NO_DIGITS = 1.0
"""Error of a check with corrections from which on some result has no correct digit."""
_JAMMED = 1e100
"""Tension [N] beyond which the axial force has no equilibrium with friction."""
SMALL_DISPLACEMENT_LIMIT = 0.15
"""V/l and r/L up to which the paper found the small-displacement theory accurate to 5 %."""


@dataclass(frozen=True)
class Stresses:
    """Stresses [Pa] at the governing section and fibre, and the greatest anywhere: lengths in m, ``fibre`` +1 or -1."""

    fatigue_safety: float | None
    yield_safety: float | None
    max_stress: float
    stress_amplitude: float
    stress_mean: float
    worst_section: float
    worst_fibre: int
    side_force_max: float
    clamp_moment_max: float
    deflection_ratio: float
    contact_pressure_max: float | None
    friction_power: float | None


@dataclass(frozen=True)
class RodCheck:
    """The results of a check, SI units.

    A safety without a load that can cause failure is None: stability of a rod never compressed, fatigue of one never
    stressed. A strip that buckles by friction alone has the share of all axial forces that it would carry as its
    stability safety. ``stresses`` is None beyond the stability boundary, where the formulas are invalid.
    """

    dimensions: Dimensions
    stability_safety: float | None
    critical_force: float
    buckles_sideways: bool
    axial_force_min: float
    axial_force_max: float
    mass: float
    natural_frequency: float
    criterion: str
    stresses: Stresses | None
    warnings: tuple[str, ...]


def check(
    scene: Scene,
    dimensions: Dimensions,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    demands: tuple[Demand, ...] = (),
) -> Outcome[RodCheck]:
    """Evaluate a strip in its machine.

    ``accuracy`` is the requested relative numerical accuracy of every result, 1e-12 … 1e-1; ``criterion`` the fatigue
    criterion, by default Serensen's; ``demands`` are the effects that limits require.
    Raises InvalidInput for an invalid request, for a piston that jams, and for a speed too high, or pressures that
    change too quickly, for any digit of the stresses to be found; EffectConflict for an excluded effect required.
    """
    require_accuracy(accuracy)
    if dimensions.l > scene.mechanism.rod_length:
        raise InvalidInput("dimensions.l", "the free length exceeds the rod", "at most mechanism.rod_length")
    choice = choose_for(scene, dimensions, effects, effect_tolerance, demands)
    cycle = Cycle(scene, dimensions, compose(choice), tolerance_of(accuracy))
    outcome = check_chosen(cycle, choice, accuracy, criterion)
    if cycle.composition.corrections and outcome.accuracy.estimated >= _NO_DIGITS:
        if outcome.value.natural_frequency < scene.mechanism.speed:
            reason = "exceeds the strip's natural frequency by too much for its vibration to be found"
            raise InvalidInput("mechanism.speed", reason, "below the natural frequency, or no effect rod_inertia")
        if scene.load.corners().size:
            raise unknown_vibration()
    return outcome


def tolerance_of(accuracy: float) -> float:
    """Initial tolerance of the cycle for a check of this accuracy."""
    return _SAFETY_FACTOR * accuracy


def check_chosen(
    cycle: Cycle, choice: Choice[RodEffect], accuracy: float, criterion: FatigueCriterion | None = None,
    power: bool = True,
) -> Outcome[RodCheck]:  # fmt: skip
    """``check`` with effects already chosen, for a cycle composed of them with the tolerance
    ``tolerance_of(accuracy)``; with corrections and without ``power`` the friction power is None.

    The corrections are prepared in that cycle, so the caller can reuse them.
    """
    started = time.perf_counter()
    criterion = criterion or serensen(cycle.scene.material)
    diagram, contact = criterion.diagram(), choice.has("friction")
    found = check_linear(cycle, diagram, contact, accuracy)
    if found.tension > _JAMMED:
        reason = "makes the piston jam: friction grows by more than the force that pulls the rod"
        allowed = "less, or a longer skirt, a smaller clamp offset, or no effect friction_feedback"
        raise InvalidInput("piston.friction_coefficient", reason, allowed)
    if found.is_stable and cycle.composition.corrections:
        found = _with_corrections(cycle, diagram, contact, contact and power, accuracy, found)
    value = check_of(cycle, found, criterion, contact, choice.has("large_displacement"))
    settings = {"angles": int(found.angles), "stations": stations_for(accuracy), "tolerance": found.tolerance}
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, found.error, settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def check_of(cycle: Cycle, found: Results, criterion: FatigueCriterion, contact: bool, large: bool) -> RodCheck:
    """The check of a strip from its results; ``large``: large displacement is active."""
    scene, dimensions = cycle.scene, cycle.dimensions
    material, piston, stresses = scene.material, scene.piston, None
    safety = found.critical_force / found.compression if found.compression > 0.0 else None
    if found.is_stable:
        stresses = Stresses(
            fatigue_safety=1.0 / found.utilisation if found.utilisation > 0.0 else None,
            yield_safety=material.yield_strength / found.max_stress if found.max_stress > 0.0 else None,
            max_stress=found.max_stress,
            stress_amplitude=0.5 * (found.high - found.low),
            stress_mean=0.5 * (found.high + found.low),
            worst_section=found.section,
            worst_fibre=1 - 2 * int(found.layer),
            side_force_max=found.side,
            clamp_moment_max=found.moment,
            deflection_ratio=found.deflection / dimensions.l,
            contact_pressure_max=found.contact_load * pressure_per_load(piston.diameter, piston.skirt_length)
            if contact
            else None,
            friction_power=None if math.isnan(found.power) else found.power,
        )
    return RodCheck(
        dimensions=dimensions,
        stability_safety=safety,
        critical_force=found.critical_force,
        buckles_sideways=dimensions.b < dimensions.h and found.critical_force == cycle.strip.critical,
        axial_force_min=-found.compression,
        axial_force_max=found.tension,
        mass=material.density * dimensions.b * dimensions.h * dimensions.l,
        natural_frequency=found.natural_frequency,
        criterion=criterion.name,
        stresses=stresses,
        warnings=warnings_of(scene, stresses, found.by_friction != 0.0, large),
    )


def _with_corrections(
    cycle: Cycle, diagram: Diagram, contact: bool, with_power: bool, accuracy: float, found: Results
) -> Results:
    """Results of a strip with corrections, starting from the results ``found`` without them.

    Small differences of large quantities, such as an amplitude beside a large mean, need a finer discretisation.
    """
    tolerance, panels, stations = SAMPLING_FRACTION * accuracy, None, stations_for(accuracy)
    out = np.full(FIELD_RESULTS, np.nan)
    for _ in range(REFINEMENTS):
        # Sampling more accurately than the corrections' own error is futile.
        used_tolerance = max(tolerance, min(0.1 * cycle.refinement_error, _MAX_TOLERANCE))
        sampled = SampledCycle.of(cycle, used_tolerance, accuracy, panels)
        panels = sampled.panels
        power, error = sampled.evaluate(diagram, stations, contact, with_power, out)
        correction_error = cycle.refinement_error
        if contact and correction_error:
            correction_error = max(correction_error, _guide_error(cycle, *out[STRIP_RESULTS:].tolist(), power))
        # A correction error that did not decrease on request does not decrease by finer sampling either, and dominates
        # all others.
        refine_sampling = error > _SAFETY_FACTOR * max(accuracy, correction_error) and tolerance > ROUNDING
        refine_corrections = correction_error > _SAFETY_FACTOR * accuracy and cycle.refinement_error <= cycle.tolerance
        if error + correction_error <= accuracy or not (refine_sampling or refine_corrections):
            break
        if refine_sampling:
            tolerance = max(_SAFETY_FACTOR * tolerance * accuracy / error, ROUNDING)
            next_tolerance = max(tolerance, 0.1 * cycle.refinement_error)
            if not refine_corrections and next_tolerance > _MIN_REDUCTION * used_tolerance:
                break
        if refine_corrections:
            tolerance_of_series = _SAFETY_FACTOR * cycle.refinement_error * accuracy / correction_error
            finer = replace(cycle, tolerance=tolerance_of_series, prepared=None)
            if not finer.refinement_error < cycle.refinement_error:
                break
            cycle = finer
    results = dict(zip(FIELD_COLUMNS, out.tolist(), strict=True))
    error, angles = max(found.error, error + correction_error), sampled.field.states.shape[1]
    return found._replace(**results, power=power, error=error, angles=angles, tolerance=sampled.tolerance)


def _guide_error(cycle: Cycle, side: float, moment: float, load: float, power: float) -> float:
    """Relative error of contact load [N] and friction power [W], nan if not wanted, due to the corrections' errors,
    which are relative to the maximum side force [N] and clamp moment [N m]."""
    piston, mechanism = cycle.scene.piston, cycle.scene.mechanism
    couple = 6.0 * (moment + side * abs(piston.clamp_offset)) / piston.skirt_length
    # Both walls together carry at most the side force and the couple; the mean of |v| is two strokes per revolution.
    mean = piston.friction_coefficient * (4.0 / math.pi) * (side + couple) * 4.0 * mechanism.crank_radius
    mean *= mechanism.speed
    return max(
        cycle.refinement_error * contact_load(side, couple) / load if load else 0.0,
        cycle.lasting_error * mean / power if power > 0.0 else 0.0,
    )


def warnings_of(scene: Scene, stresses: Stresses | None, by_friction: bool, large: bool) -> tuple[str, ...]:
    out = []
    if stresses is None:
        cause = "what friction adds to its compression" if by_friction else "the greatest compression of the cycle"
        out.append(f"the strip buckles under {cause}; stresses have no meaning there")
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > SMALL_DISPLACEMENT_LIMIT:
        out.append("r/L exceeds 0.15: beyond what experiments confirm for the small-displacement theory")
    if stresses is not None and stresses.deflection_ratio > SMALL_DISPLACEMENT_LIMIT and not large:
        out.append("V/l exceeds 0.15: the small-displacement theory may be wrong by more than 5 %")
    return tuple(out)
