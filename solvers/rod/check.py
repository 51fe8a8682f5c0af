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
from solvers.numerics import periodic
from solvers.outcome import Accuracy, Outcome, Status
from solvers.rod.cycle.composition import Array, Cycle, bending_stiffness
from solvers.rod.cycle.extremes_in_time import Turn
from solvers.rod.cycle.plain_extremes import PlainTurn, turn_of
from solvers.rod.cycle.quantities import CURVATURE, DEFLECTION, FORCE, MOMENT, SIDE, TANGENT, Gauges, weights
from solvers.rod.cycle.worst_section import STATIONS, Contest, Extreme, greatest, worst
from solvers.rod.effects import choose_for, compose
from solvers.rod.piston import friction
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling, shear
from solvers.rod.vibration.natural_frequencies import natural_frequency

_FEW = periodic.grid(256)
_ROUNDING = 1e-14
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
    if dimensions.l > scene.mechanism.rod_length:
        raise InvalidInput("dimensions.l", "the free length exceeds the rod", "at most mechanism.rod_length")
    choice = choose_for(scene, dimensions, effects, effect_tolerance, demands)
    composition = compose(choice)
    criterion = criterion or serensen(scene.material)

    critical = _critical_force(scene, dimensions, choice.has("shear"))
    # Corrections of the shape have no part in the axial force, and beyond buckling there is no shape to correct.
    plain = Cycle(scene, dimensions, replace(composition, corrections=()))
    turn, pushed, pulled = _forces(plain, critical, 0.1 * accuracy)
    compression = max(pushed.value, 0.0)
    safety = critical / compression if compression > 0 else None
    stresses, error = None, max(pushed.relative_error, pulled.relative_error)
    if safety is None or safety > 1:
        if composition.corrections:
            cycle = Cycle(scene, dimensions, composition, turn.tolerance)
            # What the corrections themselves do not know is not worth being looked for.
            turn = turn_of(cycle, max(turn.tolerance, min(0.1 * cycle.refinement_error, _COARSEST)))
        stresses, further = _stresses(turn, criterion, choice.has("friction"))
        error = max(error, further)
        if safety is not None:
            # Near buckling the last digits of load and strip decide over the first ones of the stresses.
            error = max(error, _LAST_DIGITS / (1.0 - 1.0 / safety))
    error = max(error, _ROUNDING)
    mean_force = 0.5 * (pulled.value - pushed.value)
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
        warnings=_warnings(scene, stresses, safety, choice.has("large_displacement")),
    )
    settings = {"angles": turn.instants.angle.size, "stations": STATIONS, "tolerance": turn.tolerance}
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, error, settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def _forces(cycle: Cycle, critical: float, tolerance: float) -> tuple[Turn, Extreme, Extreme]:
    """The turn, and the greatest compression and tension [N] in it.

    Beyond buckling there is no shape that would tell the friction: these are the forces without it. Where it takes
    friction to buckle the strip, the compression is the critical force, at which shapes end.
    """
    if cycle.composition.feedback is None:
        return _extremes(cycle, tolerance)
    # A buckled strip is mostly known from a few angles, and a force that ends there is dear to follow.
    if np.min(cycle.axial_force(_FEW)) > -critical:
        turn, pushed, pulled = _extremes(cycle, tolerance)
        if pushed.value < critical:
            return turn, pushed, pulled
    composition = replace(cycle.composition, feedback=None)
    turn, pushed, pulled = _extremes(replace(cycle, composition=composition), tolerance)
    return turn, (pushed if pushed.value >= critical else Extreme(critical, 0.0)), pulled


def _extremes(cycle: Cycle, tolerance: float) -> tuple[Turn, Extreme, Extreme]:
    turn = turn_of(cycle, tolerance)
    pushed, pulled = greatest(turn, weights({FORCE: -1.0}, {FORCE: 1.0}))
    return turn, pushed, pulled


def _critical_force(scene: Scene, dimensions: Dimensions, with_shear: bool) -> float:
    """P_cr [N] about the weaker axis, with shear where that effect runs (bending in the crank's plane)."""
    material, length = scene.material, scene.mechanism.rod_length
    plain = float(buckling.critical_force(material.elastic_modulus, dimensions.b, dimensions.h, dimensions.l, length))
    if not with_shear:
        return plain
    stiffness = bending_stiffness(scene, dimensions)
    compliance = stiffness / shear.shear_stiffness(scene, dimensions)
    return min(plain, -stiffness * shear.critical_coupling(dimensions.l, length, compliance))


def _layers(turn: Turn) -> tuple[Array, float]:
    """What is read along the strip: sigma = N/(b h) +- (E h/2) V'' [Pa], first the fibre at +h/2, and V [m].

    With it the mean that the stresses come without: a force that nothing changes would hide a small amplitude.
    """
    d = turn.cycle.dimensions
    direct, bending = 1.0 / (d.b * d.h), 0.5 * turn.cycle.scene.material.elastic_modulus * d.h
    force = turn.instants.force
    if isinstance(turn, PlainTurn) and np.ptp(force) == 0.0:
        return weights({CURVATURE: bending}, {CURVATURE: -bending}, {DEFLECTION: 1.0}), direct * float(force[0])
    fibres = {TANGENT: direct, CURVATURE: bending}, {TANGENT: direct, CURVATURE: -bending}
    return weights(*fibres, {DEFLECTION: 1.0}), 0.0


def _stresses(turn: Turn, criterion: FatigueCriterion, contact: bool) -> tuple[Stresses, float]:
    scene, length = turn.cycle.scene, turn.cycle.dimensions.l

    layers, mean = _layers(turn)
    diagram, magnitude = criterion.diagram().with_mean(mean), GREATEST.with_mean(mean)
    contests = Contest(diagram, (0, 1), located=True), Contest(magnitude, (0, 1)), Contest(GREATEST, (2,))
    fatigue, strength, bent = worst(turn, layers, contests)
    amplitude, mean = 0.5 * (fatigue.high - fatigue.low), mean + 0.5 * (fatigue.high + fatigue.low)
    side, moment, pressure = _guide(turn, contact)
    errors = [x.relative_error for x in (fatigue, strength, bent, side, moment, *([pressure] if pressure else []))]
    # The amplitude is judged by itself, however great the mean beside it; a mean as small as it likes is not.
    errors.append(fatigue.extremes_error / amplitude if amplitude else 0.0)
    power = None
    if contact:
        corners = np.concatenate([turn.cycle.corners(), _second_wall(turn)])
        average = periodic.mean_by_pieces(lambda angle: friction.power(turn.cycle, angle), turn.tolerance, corners)
        power = average.value
        errors.append(average.error / average.value if average.value else 0.0)
    refined = turn.cycle.refinement_error
    if contact and refined:
        refined = max(refined, _guide_error(turn.cycle, side.value, moment.value, pressure.value, power))
    value = Stresses(
        fatigue_safety=1.0 / fatigue.value if fatigue.value > 0 else None,
        yield_safety=scene.material.yield_strength / strength.value if strength.value > 0 else None,
        stress_amplitude=amplitude,
        stress_mean=mean,
        worst_section=fatigue.station,
        worst_fibre=1 - 2 * fatigue.layer,
        side_force_max=side.value,
        clamp_moment_max=moment.value,
        deflection_ratio=bent.value / length,
        contact_pressure_max=pressure.value if pressure else None,
        friction_power=power,
    )
    return value, max(errors) + refined


def _guide_error(cycle: Cycle, side: float, moment: float, pressure: float, power: float) -> float:
    """What the corrections' errors, shares of the greatest side force and moment, may make in their sum and mean."""
    piston, mechanism = cycle.scene.piston, cycle.scene.mechanism
    couple = 6.0 * (moment + side * abs(piston.clamp_offset)) / piston.skirt_length
    most = 4.0 / (math.pi * piston.diameter * piston.skirt_length) * (side + couple)
    # Both walls together carry at most the side force and the couple; the mean of |v| is two strokes a turn.
    mean = piston.friction_coefficient * (4.0 / math.pi) * (side + couple) * 4.0 * mechanism.crank_radius
    mean *= mechanism.speed
    return max(
        cycle.refinement_error * most / pressure if pressure else 0.0,
        cycle.lasting_error * mean / power if power else 0.0,
    )


def _second_wall(turn: Turn) -> Array:
    """Angles at which the piston begins or ceases to bear on both walls, where the friction force has corners."""
    piston = turn.cycle.scene.piston
    lever = 6.0 / piston.skirt_length
    skew = lever * piston.clamp_offset
    return turn.crossings(
        Gauges.at_piston(weights({SIDE: skew - 1.0, MOMENT: lever}, {SIDE: skew + 1.0, MOMENT: lever}))
    )


def _guide(turn: Turn, contact: bool) -> tuple[Extreme, Extreme, Extreme | None]:
    """Greatest side force, clamp moment and contact pressure.

    A magnitude has corners where its argument changes sign, so each is climbed as the greatest of smooth quantities:
    |T| of T and -T, |T| + |W| of the four sums of +-T and +-W.
    """
    piston = turn.cycle.scene.piston
    lever = 6.0 / piston.skirt_length
    skew = lever * piston.clamp_offset
    gauges = weights({SIDE: 1.0}, {SIDE: -1.0}, {MOMENT: 1.0}, {MOMENT: -1.0})
    if contact:
        sums = weights({SIDE: 1.0 + skew, MOMENT: lever}, {SIDE: 1.0 - skew, MOMENT: -lever})
        gauges = np.concatenate([gauges, sums, -sums])
    found = greatest(turn, gauges)
    side, moment = _top(found[:2]), _top(found[2:4])
    if not contact:
        return side, moment, None
    sums, per_force = _top(found[4:]), 4.0 / (math.pi * piston.diameter * piston.skirt_length)
    return side, moment, Extreme(sums.value * per_force, sums.error * per_force)


def _top(parts: list[Extreme]) -> Extreme:
    value = max(part.value for part in parts)
    return Extreme(value, max(part.value + part.error - value for part in parts))


def _warnings(scene: Scene, stresses: Stresses | None, safety: float | None, large: bool) -> tuple[str, ...]:
    out = []
    if stresses is None:
        cause = "the greatest compression of the cycle" if safety < 1 else "what friction adds to its compression"
        out.append(f"the strip buckles under {cause}; stresses have no meaning there")
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > SMALL_DISPLACEMENT_LIMIT:
        out.append("r/L exceeds 0.15: beyond what experiments confirm for the small-displacement theory")
    if stresses is not None and stresses.deflection_ratio > SMALL_DISPLACEMENT_LIMIT and not large:
        out.append("V/l exceeds 0.15: the small-displacement theory may be wrong by more than 5 %")
    return tuple(out)
