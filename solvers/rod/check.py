"""Evaluating a given strip: stresses, fatigue, stability, and what the piston feels."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.fatigue.kernels import GREATEST
from solvers.numerics.panels import Panels
from solvers.outcome import Accuracy, Outcome, Status
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.guide_loads import friction_power, guide_loads
from solvers.rod.cycle.sampled import Extreme, SampledCycle
from solvers.rod.cycle.section import DEFLECTION, FIBRES, STATIONS, station_table, worst
from solvers.rod.effects import choose_for, compose
from solvers.rod.piston.skirt import contact_load, pressure_per_load
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling, shear
from solvers.rod.strip.stiffness import bending_stiffness, shear_stiffness
from solvers.rod.vibration.natural_frequencies import natural_frequency

_ROUNDING = 1e-14
_SHARE, _HALF = 0.1, 0.5
"""Of the accuracy, that the turn is sampled to."""
_REFINEMENTS = 4
_COARSEST = 1e-2
_LAST_DIGITS = 4.0 * float(np.finfo(float).eps)
SMALL_DISPLACEMENT_LIMIT = 0.15
"""V/l and r/L up to which the paper found the small-displacement theory good to 5 %."""


@dataclass(frozen=True)
class Stresses:
    """What the fibres see at the section and fibre that govern: lengths in m, stresses in Pa, ``fibre`` +1 or -1."""

    fatigue_safety: float | None
    yield_safety: float | None
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

    A safety without a load to fail under is None: stability of a rod never compressed, fatigue of one never
    stressed. ``stresses`` is None beyond the stability boundary, where the formulas no longer mean anything.
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

    ``accuracy`` is the relative numerical accuracy wanted of every result, 1e-12 … 1e-1; ``criterion`` the fatigue
    convention, Serensen's unless another is given; ``demands`` are effects that somebody's limits call for.
    Raises InvalidInput where the request makes no sense, EffectConflict for an excluded effect in demand.
    """
    started = time.perf_counter()
    if not 1e-12 <= accuracy <= 1e-1:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")
    require_within_rod(scene, dimensions)
    choice = choose_for(scene, dimensions, effects, effect_tolerance, demands)
    composition = compose(choice)
    criterion = criterion or serensen(scene.material)
    critical = _critical_force(scene, dimensions, choice.has("shear"))
    cycle = Cycle(scene, dimensions, composition)
    # Beyond buckling there is no shape to correct.
    linear = SampledCycle.of(cycle.without_corrections(), _SHARE * accuracy)
    pushed, pulled = _forces(linear, critical)
    compression = max(pushed.value, 0.0)
    safety = critical / compression if compression > 0 else None
    stresses, error, sampled = None, max(pushed.relative_error, pulled.relative_error), linear
    if safety is None or safety > 1:
        stresses, further, sampled = _stresses(cycle, linear, criterion, choice.has("friction"), accuracy)
        error = max(error, further)
        if safety is not None:
            # Near buckling the last digits of load and strip decide over the first ones of the stresses.
            error = max(error, _LAST_DIGITS / (1.0 - 1.0 / safety))
    mean_force = 0.5 * (pulled.value - pushed.value)
    if critical + mean_force > 0.0:
        # The frequency goes with the root of what the mean force leaves of the critical one.
        error = max(error, 0.5 * (pulled.error + pushed.error) / (critical + mean_force))
    error = max(error, _ROUNDING)
    value = RodCheck(
        dimensions=dimensions,
        stability_safety=safety,
        critical_force=critical,
        buckles_sideways=dimensions.b < dimensions.h,
        axial_force_min=-pushed.value,
        axial_force_max=pulled.value,
        mass=scene.material.density * dimensions.b * dimensions.h * dimensions.l,
        natural_frequency=natural_frequency(scene, dimensions, mean_force),
        criterion=criterion.name,
        stresses=stresses,
        warnings=warnings_of(scene, stresses, safety, choice.has("large_displacement")),
    )
    settings = {"angles": sampled.force.size, "stations": STATIONS, "tolerance": sampled.tolerance}
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, error, settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def require_within_rod(scene: Scene, dimensions: Dimensions) -> None:
    """Raise InvalidInput for a strip longer than its rod."""
    if dimensions.l > scene.mechanism.rod_length:
        raise InvalidInput("dimensions.l", "the free length exceeds the rod", "at most mechanism.rod_length")


def _forces(linear: SampledCycle, critical: float) -> tuple[Extreme, Extreme]:
    """The greatest compression and tension [N] of the turn.

    Where it takes friction to buckle the strip, the compression is the critical force, at which shapes end.
    """
    pushed, pulled = linear.greatest(-linear.force), linear.greatest(linear.force)
    if linear.cycle.composition.feedback and pushed.value >= critical:
        # Only between the sampled angles: beyond buckling there is no shape that would tell the friction.
        linear = SampledCycle.of(linear.cycle.without_feedback(), linear.tolerance)
        pushed, pulled = linear.greatest(-linear.force), linear.greatest(linear.force)
        return (pushed if pushed.value >= critical else Extreme(critical, 0.0, pushed.angle)), pulled
    if linear.buckles and pushed.value < critical:
        pushed = Extreme(critical, 0.0, pushed.angle)
    return pushed, pulled


def _critical_force(scene: Scene, dimensions: Dimensions, with_shear: bool) -> float:
    """P_cr [N] about the weaker axis, with shear where that effect runs (bending in the crank's plane)."""
    material, length = scene.material, scene.mechanism.rod_length
    plain = float(buckling.critical_force(material.elastic_modulus, dimensions.b, dimensions.h, dimensions.l, length))
    if not with_shear:
        return plain
    stiffness = bending_stiffness(scene, dimensions)
    compliance = stiffness / shear_stiffness(scene, dimensions)
    return min(plain, -stiffness * shear.critical_coupling(dimensions.l, length, compliance))


def _stresses(
    cycle: Cycle, linear: SampledCycle, criterion: FatigueCriterion, contact: bool, accuracy: float
) -> tuple[Stresses, float, SampledCycle]:
    """The stresses, their greatest relative error, and the turn that they were read from.

    What is small beside what it is the difference of needs a finer turn than the rest: an amplitude beside its mean.
    """
    cycle, tolerance = replace(cycle, tolerance=_HALF * accuracy), linear.tolerance
    sampled = _with_corrections(cycle, tolerance, linear.panels) if cycle.composition.corrections else linear
    for _ in range(_REFINEMENTS):
        value, error, refined = _read_stresses(sampled, criterion, contact)
        # What corrections do not know although they were asked to, no finer turn tells.
        finer_turn = error > _HALF * accuracy and tolerance > _ROUNDING
        finer_corrections = refined > _HALF * accuracy and cycle.refinement_error <= cycle.tolerance
        if error + refined <= accuracy or not (finer_turn or finer_corrections):
            break
        if finer_turn:
            tolerance = max(_HALF * tolerance * accuracy / error, _ROUNDING)
        if finer_corrections:
            cycle = replace(cycle, tolerance=_HALF * cycle.refinement_error * accuracy / refined)
        sampled = _with_corrections(cycle, tolerance, sampled.panels)
    return value, error + refined, sampled


def _with_corrections(cycle: Cycle, tolerance: float, begin: Panels) -> SampledCycle:
    # What the corrections themselves do not know is not worth being looked for.
    return SampledCycle.of(cycle, max(tolerance, min(0.1 * cycle.refinement_error, _COARSEST)), begin)


def _read_stresses(sampled: SampledCycle, criterion: FatigueCriterion, contact: bool) -> tuple[Stresses, float, float]:
    """The stresses of a sampled turn, their greatest relative error, and what the corrections' errors add to it."""
    scene, length, tolerance = sampled.cycle.scene, sampled.cycle.dimensions.l, sampled.tolerance
    field, mean, force = sampled.field, 0.0, sampled.force
    if not field.inclined and np.ptp(force) == 0.0:
        # A force that nothing changes would hide a small amplitude: the criterion counts its stress by itself.
        field, mean = field._replace(direct=0.0), field.direct * float(force[0])
    diagram, magnitude = criterion.diagram().with_mean(mean), GREATEST.with_mean(mean)
    table = station_table(field, STATIONS, tolerance)
    fatigue = worst(field, table, FIBRES, diagram, tolerance, located=True)
    strength = worst(field, table, FIBRES, magnitude, tolerance)
    bent = worst(field, table, DEFLECTION, GREATEST, tolerance)
    amplitude, mean = 0.5 * (fatigue.high - fatigue.low), mean + 0.5 * (fatigue.high + fatigue.low)
    side, moment, pressure = guide_loads(sampled, contact)
    errors = [x.relative_error for x in (fatigue, strength, bent, side, moment, *([pressure] if pressure else []))]
    # The amplitude is judged by itself, however great the mean beside it; a mean as small as it likes is not.
    errors.append(fatigue.extremes_error / amplitude if amplitude else 0.0)
    power = None
    if contact:
        power, power_error = friction_power(sampled)
        errors.append(power_error)
    refined = sampled.cycle.refinement_error
    if contact and refined:
        refined = max(refined, _guide_error(sampled.cycle, side.value, moment.value, pressure.value, power))
    value = Stresses(
        fatigue_safety=1.0 / fatigue.value if fatigue.value > 0 else None,
        yield_safety=scene.material.yield_strength / strength.value if strength.value > 0 else None,
        stress_amplitude=amplitude,
        stress_mean=mean,
        worst_section=fatigue.section,
        worst_fibre=1 - 2 * fatigue.layer,
        side_force_max=side.value,
        clamp_moment_max=moment.value,
        deflection_ratio=bent.value / length,
        contact_pressure_max=pressure.value if pressure else None,
        friction_power=power,
    )
    return value, max(errors), refined


def _guide_error(cycle: Cycle, side: float, moment: float, pressure: float, power: float) -> float:
    """What the corrections' errors, shares of the greatest side force and moment, may make in their sum and mean."""
    piston, mechanism = cycle.scene.piston, cycle.scene.mechanism
    couple = 6.0 * (moment + side * abs(piston.clamp_offset)) / piston.skirt_length
    most = pressure_per_load(piston.diameter, piston.skirt_length) * contact_load(side, couple)
    # Both walls together carry at most the side force and the couple; the mean of |v| is two strokes a turn.
    mean = piston.friction_coefficient * (4.0 / math.pi) * (side + couple) * 4.0 * mechanism.crank_radius
    mean *= mechanism.speed
    return max(
        cycle.refinement_error * most / pressure if pressure else 0.0,
        cycle.lasting_error * mean / power if power else 0.0,
    )


def warnings_of(scene: Scene, stresses: Stresses | None, safety: float | None, large: bool) -> tuple[str, ...]:
    out = []
    if stresses is None:
        cause = "the greatest compression of the cycle" if safety < 1 else "what friction adds to its compression"
        out.append(f"the strip buckles under {cause}; stresses have no meaning there")
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > SMALL_DISPLACEMENT_LIMIT:
        out.append("r/L exceeds 0.15: beyond what experiments confirm for the small-displacement theory")
    if stresses is not None and stresses.deflection_ratio > SMALL_DISPLACEMENT_LIMIT and not large:
        out.append("V/l exceeds 0.15: the small-displacement theory may be wrong by more than 5 %")
    return tuple(out)
