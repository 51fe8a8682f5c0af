"""Finding the lightest bushing: the form's best outside on stations refined until the mass is as exact as asked."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.outcome import Accuracy, Certificate, Outcome, Shortfall, Status
from solvers.pin.bushing.check import BushingCheck, assess, check
from solvers.pin.bushing.effects import choose_for
from solvers.pin.bushing.forms import Constant, Stepped, Turned, lightest_constant
from solvers.pin.bushing.program import BushingProgram, assemble, gap_floor, opening_stations, refined
from solvers.pin.bushing.scene import BushingScene
from solvers.pin.effects import Physics, compose
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.dual_bound import told_apart
from solvers.pin.optimum.found import Found
from solvers.pin.ring import ovalization
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.contour import Cubic, contour
from solvers.pin.shapes.given import Profile

_MOST_STATIONS = 4000
_PASSES = 40
TURNED = Turned()


@dataclass(frozen=True)
class BushingProblem:
    """A scene, the limits that the bushing must keep, the form of its outside, and the criterion."""

    scene: BushingScene
    limits: Limits = NO_LIMITS
    form: Turned | Constant | Stepped = TURNED
    criterion: Criterion = CRITERIA["tresca_paper"]


@dataclass(frozen=True)
class BushingDesign:
    """The bushing found, as a check sees it, and what the free outside weighs under the same limits [kg].

    ``corners`` are the outside's points where it is made of straight lines, ``contour`` it as cubics where not.
    """

    check: BushingCheck
    form: str
    free_mass: float
    corners: tuple[tuple[float, float], ...] | None
    contour: tuple[Cubic, ...] | None


def design(
    problem: BushingProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[BushingDesign]:
    """The lightest bushing of a form, with its certificate.

    Only an ovalization limit can be out of reach: that of a solid bar does not depend on its diameter. Raises
    InvalidInput where the request makes no sense, EffectConflict for an excluded effect that a limit needs.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    scene, limits = problem.scene, problem.limits
    choice = choose_for(scene, limits, effects, effect_tolerance)
    physics = compose(choice)
    if math.isinf(gap_floor(scene, limits)):
        return Outcome(
            Status.INFEASIBLE, None, choice.manifest, Accuracy(accuracy, accuracy, {}),
            diagnosis=(_too_soft_a_ring(scene, limits),), timing={"solve_s": time.perf_counter() - started},
        )  # fmt: skip
    program, best, doubt = _on_refined_stations(problem, physics, accuracy)
    curve = None
    constant = lightest_constant(program, physics, accuracy).volume * program.mass_unit
    mass = program.mass_unit * best.volume
    free = TURNED.find(replace(program, limits=replace(limits, max_slope=None)), accuracy)
    if best.corners is None:
        gap = program.gap_of(best.solidity)
        value = assess(program, gap, physics, limits, mass, constant)
        curve = contour(program.stations, scene.geometry.bore + gap, scene.geometry.length)
    else:
        outside = Profile(*(tuple(column) for column in zip(*best.corners, strict=True)))
        value = check(scene, outside, problem.criterion, limits, effects, effect_tolerance, accuracy).value
    evidence = dict(best.evidence)
    if limits.max_deflection is not None:
        evidence.setdefault("deflection_as_constrained_um", 1e6 * program.deflection(best.solidity))
    apart = told_apart(value.deflection, evidence.get("deflection_as_constrained_um"), accuracy)
    # The mass told is the check's own: what it is above the one searched with widens the gap.
    bound = best.bound - best.volume * apart
    volume = max(best.volume, value.mass / program.mass_unit)
    gap = (volume - bound) / bound if bound > 0 else (0.0 if volume == 0 else 1.0)
    return Outcome(
        Status.SUCCEEDED,
        BushingDesign(value, problem.form.name, free.volume * program.mass_unit, best.corners, curve),
        choice.manifest,
        Accuracy(accuracy, doubt + ROUNDING, {"stations": int(best.solidity.size)}),
        certificate=Certificate(best.method, program.mass_unit * max(bound, 0.0), gap, evidence),
        timing={"solve_s": time.perf_counter() - started},
    )


def _too_soft_a_ring(scene: BushingScene, limits: Limits) -> Shortfall:
    g, m = scene.geometry, scene.material
    solid = ovalization.ring(scene.force, 1.0, g.length, 0.0, m.elastic_modulus, m.poisson).ovalization
    return Shortfall("max_ovalization", limits.max_ovalization, solid, "a longer or stiffer bushing, or less force")


def _on_refined_stations(
    problem: BushingProblem, physics: Physics, accuracy: float
) -> tuple[BushingProgram, Found, float]:
    """(program, best outside, doubt of its mass): panels are halved where quadrature demands it."""
    stations, wanted = opening_stations(problem.scene), 0.05 * accuracy
    for _ in range(_PASSES):
        program = assemble(problem.scene, problem.limits, problem.criterion, physics, stations)
        doubt, volume = stations.doubt(program.lower), program.volume(program.lower)
        enough = doubt.sum() <= wanted * volume or stations.x.size > _MOST_STATIONS
        if enough:
            best = problem.form.find(program, accuracy)
            volume = best.volume
            if best.doubt is not None:
                doubt = np.maximum(doubt, best.doubt)
            if doubt.sum() <= wanted * volume or stations.x.size > _MOST_STATIONS:
                break
        stations = refined(program, doubt > 0.5 * wanted * volume / stations.left.size)
    else:
        best = problem.form.find(program, accuracy)
    return program, best, float(doubt.sum()) / volume if volume > 0 else 0.0
