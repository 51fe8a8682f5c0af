"""Design of the lightest pin or bushing of a given form, on stations refined to the requested accuracy."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.numerics.arrays import Array
from solvers.outcome import Accuracy, Certificate, Outcome, Status
from solvers.pin.check import assess, deflection_error, on_profile
from solvers.pin.effects import Physics, choose_for, compose
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.capacity import Diagnosis, diagnose
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.program import Program, ShapeResult, assemble
from solvers.pin.problem import PinProblem
from solvers.pin.result import PinCheck
from solvers.pin.shapes.contour import Cubic, contour
from solvers.pin.shapes.free import FREE
from solvers.pin.shapes.given import Profile
from solvers.pin.stations.between_nodes import maximum_excess
from solvers.pin.stations.lobatto_panels import Stations, initial_stations
from solvers.verdict import per_cent

_MAX_STATIONS, _MAX_COUPLED_STATIONS = 4000, 1000
"""Maximum number of stations, and the same if slope and deflection limits couple them in a cone program, whose
solver error does not decrease with further stations."""
_MASS_ERROR_FRACTION = 0.5
"""Tolerated mass error as a fraction of the accuracy; the errors of deflection and stresses are a few times larger."""
_MAX_PASSES = 40
_NEGLIGIBLE_GAP = 1e-6
"""Largest relative gap reported without a warning."""


@dataclass(frozen=True)
class PinDesign:
    """Optimum, its check, and the mass of the free form under the same limits [kg].

    ``corners``: vertices of the designed diameter if it is piecewise linear, else None; ``sizes``: that diameter [m] at
    ``stations``; ``length`` [m] of the part.
    """

    check: PinCheck
    form: str
    free_mass: float
    corners: tuple[tuple[float, float], ...] | None
    stations: Stations
    sizes: Array
    length: float

    @cached_property
    def contour(self) -> tuple[Cubic, ...] | None:
        """The designed diameter as cubics over the whole part; None if it is piecewise linear."""
        return None if self.corners else contour(self.stations, self.sizes, self.length)


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
    found = None
    if math.isfinite(design_variable_of(scene).floor(scene, limits)):
        found = _on_refined_stations(problem, physics, accuracy)
    if found is None:
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            Accuracy(accuracy, accuracy, {}),
            certificate=None,
            diagnosis=diagnose(scene, limits, problem.criterion, physics).shortfalls,
            timing={"solve_s": time.perf_counter() - started},
        )
    program, best, error_estimate = found
    checked, walls, places, evaluation = _evaluated(problem, physics, program, best, accuracy)
    relaxed = program if limits.max_slope is None else replace(program, limits=replace(limits, max_slope=None))
    free = best if problem.form == FREE and limits.max_slope is None else FREE.find(relaxed, accuracy)
    unit, bound = program.mass_unit, max(best.bound, 0.0)
    gap = (best.volume - bound) / bound if bound > 0 else (0.0 if best.volume == 0 else 1.0)
    cautions: tuple[str, ...] = ()
    if gap > max(accuracy, _NEGLIGIBLE_GAP):
        # The gap is not an error of the reported values.
        cautions = (f"a lighter pin of this form is excluded only to {per_cent(gap)} % of the mass",)
    value = PinDesign(
        check=assess(checked, walls, limits, unit * best.volume, accuracy, places, cautions),
        form=problem.form.name,
        free_mass=unit * free.volume,
        corners=best.corners,
        stations=checked.stations,
        sizes=checked.variable.sizes(walls),
        length=scene.geometry.length,
    )
    return Outcome(
        Status.SUCCEEDED,
        value,
        choice.manifest,
        Accuracy(accuracy, max(error_estimate, evaluation) + ROUNDING, {"stations": int(best.solidity.size)}),
        certificate=Certificate(best.method, unit * bound, gap, best.evidence),
        timing={"solve_s": time.perf_counter() - started},
    )


def _evaluated(
    problem: PinProblem, physics: Physics, program: Program, best: ShapeResult, accuracy: float
) -> tuple[Program, Array, tuple[float, ...], float]:
    """Evaluate the shape as ``check`` does, on stations that include its corners; the last item is the error."""
    if best.corners is None:
        return program, program.variable.wall_of(best.solidity), (), 0.0
    given = Profile(*(tuple(column) for column in zip(*best.corners, strict=True)))
    whole = given.along(problem.scene.geometry.length)
    checked, walls, error_estimate = on_profile(problem.scene, whole, problem.criterion, physics, accuracy)
    return checked, walls, whole.places, error_estimate


def explain(problem: PinProblem, effects: EffectSelection = AUTO, effect_tolerance: float = 1e-2) -> Diagnosis:
    """Return the full diagnosis of an infeasible problem."""
    choice = choose_for(problem.scene, problem.limits, effects, effect_tolerance)
    return diagnose(problem.scene, problem.limits, problem.criterion, compose(choice))


def _result_error(program: Program, best: ShapeResult) -> Array:
    """Relative error of deflection and utilisation per panel; 0 with corners, which have stations of their own."""
    if best.corners is not None:
        return np.zeros(program.stations.left.size)
    error_estimate = deflection_error(program, best.solidity)
    utilisations = program.utilisations(program.variable.wall_of(best.solidity))
    # The design's utilisation is at most 1.
    return np.maximum(error_estimate, maximum_excess(program.stations, utilisations, most=1.0))


def _on_refined_stations(
    problem: PinProblem, physics: Physics, accuracy: float
) -> tuple[Program, ShapeResult, float] | None:
    """Return (program, best profile, error estimate); panels are refined where quadrature or kinks require it."""
    scene = problem.scene
    stations: Stations = initial_stations(scene)
    coupled = problem.limits.max_slope is not None and problem.limits.max_deflection is not None
    most = _MAX_COUPLED_STATIONS if coupled else _MAX_STATIONS
    mass_tolerance = _MASS_ERROR_FRACTION * accuracy
    result = None
    for _ in range(_MAX_PASSES):
        program = assemble(scene, problem.limits, problem.criterion, physics, stations)
        volume = program.volume(program.lower)
        if math.isnan(volume):
            return None
        error_estimate, refinement_values = program.stations.error_estimate(program.lower), program.lower
        coarse = error_estimate.sum() > mass_tolerance * volume
        if not coarse:
            if coupled and result is not None:
                former, answer, _ = result
                program = replace(program, initial=np.interp(stations.x, former.stations.x, answer.solidity))
            best = problem.form.find(program, accuracy)
            if best is None:
                return None
            volume, refinement_values = best.volume, best.solidity
            if best.error_estimate is not None:
                error_estimate = np.maximum(error_estimate, best.error_estimate)
            mass_error = float(error_estimate.sum()) / volume if volume > 0 else 0.0
            result = (program, best, mass_error)
            if mass_error <= mass_tolerance:
                result_errors = _result_error(program, best)
                result_error = float(result_errors.sum())
                result = (program, best, max(mass_error, result_error))
                if result_error <= 0.5 * accuracy:
                    break
                error_estimate = volume * result_errors
        if stations.x.size > most:
            break
        excess = error_estimate * (stations.left.size / (0.5 * mass_tolerance * max(volume, 1e-300)))
        stations = stations.refined(excess, refinement_values)
    if result is None:
        best = problem.form.find(program, accuracy)
        result = None if best is None else (program, best, float(error_estimate.sum()) / max(volume, 1e-300))
    return result
