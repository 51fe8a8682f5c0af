"""Design of the lightest pin or bushing of a given form, on stations refined to the requested accuracy."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.numerics.cubics import Cubic
from solvers.outcome import Accuracy, Certificate, Outcome, Status
from solvers.pin.check import assess, on_profile
from solvers.pin.effects import Physics, choose_for, compose
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.capacity import Diagnosis, diagnose
from solvers.pin.optimum.conic import slope_limited_walls
from solvers.pin.optimum.program import Evaluation, Program, ShapeResult, assemble
from solvers.pin.problem import PinProblem
from solvers.pin.result import PinCheck
from solvers.pin.scene import Limits
from solvers.pin.shapes.contour import Contour
from solvers.pin.shapes.delivered import contour_excess, contour_of
from solvers.pin.shapes.free import FREE
from solvers.pin.shapes.given import Profile
from solvers.pin.stations.lobatto_panels import Stations, initial_stations
from solvers.verdict import per_cent

_MASS_ERROR_FRACTION = 0.5
"""Tolerated mass error as a fraction of the accuracy; the errors of deflection and stresses are a few times larger."""
_MAX_PASSES = 40
_NEGLIGIBLE_GAP = 1e-7
"""Largest relative gap reported without a warning whatever the accuracy: most forms close theirs to it."""
_Designed = tuple[ShapeResult, Evaluation]
"""The best shape on stations, and its walls there."""


@dataclass(frozen=True)
class PinDesign:
    """Optimum, its check, and the mass of the free form under the same limits [kg].

    ``corners``: vertices of the designed diameter if it is piecewise linear, else None; ``evaluation``: its walls;
    ``shape``: function that computes its diameter along the part.
    """

    check: PinCheck
    form: str
    free_mass: float
    corners: tuple[tuple[float, float], ...] | None
    evaluation: Evaluation
    shape: Callable[[], Contour] = field(compare=False, repr=False)

    @cached_property
    def contour(self) -> tuple[Cubic, ...] | None:
        """A curved diameter as cubics over the whole part, made and verified between the stations on first access; None
        if it is piecewise linear."""
        return None if self.corners else self.shape().pieces


def design(
    problem: PinProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[PinDesign]:
    """Find the lightest pin or bushing of a form, with its certificate, or the diagnosis if there is none.

    Raises InvalidInput for an invalid request, EffectConflict if an excluded effect is required by a limit.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    scene, limits = problem.scene, problem.limits
    choice = choose_for(scene, limits, effects, effect_tolerance)
    physics = compose(choice)
    found = _on_refined_stations(problem, physics, accuracy)
    if found is None:
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            Accuracy(accuracy, accuracy, {}),
            diagnosis=diagnose(scene, limits, problem.criterion, physics).shortfalls,
            timing={"solve_s": time.perf_counter() - started},
        )
    designed, error_estimate = found
    best, evaluation = designed
    program = evaluation.program
    if best.corners is None:
        shape = cache(partial(_delivered, problem, designed, accuracy))
    else:
        # As ``check`` does, on stations that include its corners.
        given = Profile(*(tuple(column) for column in zip(*best.corners, strict=True))).along(scene.geometry.length)
        evaluation, further = on_profile(scene, given, problem.criterion, physics, accuracy)
        shape, error_estimate = partial(given.contour, scene), max(error_estimate, further)
    free_volume = best.volume
    if problem.form != FREE or limits.max_slope is not None:
        free_volume, further = _volume_of_free_form(program, accuracy)
        error_estimate = max(error_estimate, further)
    unit, bound = program.mass_unit, max(best.bound, 0.0)
    gap = (best.volume - bound) / bound if bound > 0 else (0.0 if best.volume == 0 else 1.0)
    cautions: tuple[str, ...] = ()
    if gap > max(accuracy, _NEGLIGIBLE_GAP):
        # The gap is not an error of the reported values.
        cautions = (f"a lighter pin of this form is excluded only to {per_cent(gap)} % of the mass",)
    check = assess(evaluation, limits, unit * best.volume, accuracy, shape, cautions)
    value = PinDesign(check, problem.form.name, unit * free_volume, best.corners, evaluation, shape)
    return Outcome(
        Status.SUCCEEDED,
        value,
        choice.manifest,
        Accuracy(accuracy, error_estimate + ROUNDING, {"stations": int(best.solidity.size)}),
        certificate=Certificate(best.method, unit * bound, gap, best.evidence),
        timing={"solve_s": time.perf_counter() - started},
    )


def _volume_of_free_form(program: Program, accuracy: float) -> tuple[float, float]:
    """Return the volume of the free form without a slope limit, and its relative error estimate, on the program's
    stations refined where that form requires it: it may jump where the designed one is smooth."""
    if program.limits.max_slope is not None:
        program = replace(program, limits=replace(program.limits, max_slope=None))
    for _ in range(_MAX_PASSES):
        free, error_estimate = FREE.find(program, accuracy), program.stations.error_estimate(program.lower)
        if free.error_estimate is not None:
            error_estimate = np.maximum(error_estimate, free.error_estimate)
        tolerance = _MASS_ERROR_FRACTION * accuracy * free.volume
        if error_estimate.sum() <= tolerance or program.stations.x.size > _most_stations(program.limits):
            break
        stations = program.stations.refined(error_estimate * (error_estimate.size / (0.5 * tolerance)), free.solidity)
        program = assemble(program.scene, program.limits, program.criterion, program.physics, stations)
    return free.volume, float(error_estimate.sum()) / max(free.volume, 1e-300)


def explain(problem: PinProblem, effects: EffectSelection = AUTO, effect_tolerance: float = 1e-2) -> Diagnosis:
    """Return the full diagnosis of an infeasible problem."""
    choice = choose_for(problem.scene, problem.limits, effects, effect_tolerance)
    return diagnose(problem.scene, problem.limits, problem.criterion, compose(choice))


def _designed(problem: PinProblem, program: Program, accuracy: float, former: _Designed | None) -> _Designed | None:
    """Return the best shape on a program's stations, sought from a former one, and its evaluation; None: no shape."""
    if former is not None:
        best, evaluation = former
        program = replace(program, initial=np.interp(program.stations.x, evaluation.program.stations.x, best.solidity))
    best = problem.form.find(program, accuracy)
    # Near the solid section u does not keep all digits of the bore: the slope of the walls is limited once more.
    return best and (
        best, Evaluation(program, slope_limited_walls(program, program.variable.wall_of(best.solidity)))
    )  # fmt: skip


def _most_stations(limits: Limits) -> int:
    """Return the maximum number of stations: fewer if slope and deflection limits couple them in a cone program, whose
    solver error does not decrease with further stations."""
    return 4000 if limits.max_slope is None or limits.max_deflection is None else 1000


def _delivered(problem: PinProblem, found: _Designed, accuracy: float) -> Contour:
    """Return the contour of a curved shape, designed on stations refined until it meets its limits between them; it may
    miss them only where the design's own error estimate exceeds the accuracy."""
    for _ in range(_MAX_PASSES):
        best, evaluation = found
        program, excess = evaluation.program, contour_excess(evaluation, accuracy)
        if excess.max() <= 1.0 or program.stations.x.size > _most_stations(problem.limits):
            break
        stations = program.stations.refined(excess, best.solidity)
        refined = assemble(program.scene, program.limits, program.criterion, program.physics, stations)
        finer = _designed(problem, refined, accuracy, found)
        if finer is None:
            break
        found = finer
    return contour_of(found[1], accuracy)


def _on_refined_stations(problem: PinProblem, physics: Physics, accuracy: float) -> tuple[_Designed, float] | None:
    """Return the best shape and an error estimate; panels are refined where quadrature or kinks require it."""
    scene = problem.scene
    stations: Stations = initial_stations(scene)
    mass_tolerance = _MASS_ERROR_FRACTION * accuracy
    found, reached = None, 1.0
    for left in reversed(range(_MAX_PASSES)):
        program = assemble(scene, problem.limits, problem.criterion, physics, stations)
        volume = program.volume(program.lower)
        if not math.isfinite(volume):
            return None
        error_estimate, refinement_values = program.stations.error_estimate(program.lower), program.lower
        coarse = error_estimate.sum() > mass_tolerance * volume
        last = left == 0 or stations.x.size > _most_stations(problem.limits)
        if not coarse or last:
            found = _designed(problem, program, accuracy, found)
            if found is None:
                return None
            best, evaluation = found
            volume, refinement_values = best.volume, best.solidity
            if best.error_estimate is not None:
                error_estimate = np.maximum(error_estimate, best.error_estimate)
            reached = float(error_estimate.sum()) / volume if volume > 0 else 0.0
            if reached <= mass_tolerance:
                if best.corners is not None:
                    break
                of_deflection = evaluation.deflection_error
                error_estimate, reached = volume * of_deflection, max(reached, float(of_deflection.sum()))
                if volume == 0.0 or of_deflection.sum() <= 0.5 * accuracy:
                    break
        if last:
            break
        excess = error_estimate * (stations.left.size / (0.5 * mass_tolerance * max(volume, 1e-300)))
        stations = stations.refined(excess, refinement_values)
    return found and (found, reached)
