"""Evaluation of a given pin or bushing: strength along its length, deflection, ring stresses, pressures, mass."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Choice, EffectSelection
from solvers.outcome import Accuracy, Outcome, Status
from solvers.pin.closed_form.kernel import Results
from solvers.pin.closed_form.stepped_bore import SteppedBore, evaluate_all, result, stepped_bore
from solvers.pin.effects import Physics, PinEffect, choose_for, compose
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.capacity import force_limit
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.program import Evaluation, assemble
from solvers.pin.result import PinCheck, finite, sections_of
from solvers.pin.ring.along_the_part import ring_of
from solvers.pin.ring.bearing_pressure import bearing_pressures
from solvers.pin.scene import NO_LIMITS, BushingGeometry, Limits, Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.section.strength import where_over
from solvers.pin.shapes.constant import CONSTANT_TOLERANCE, lightest_constant_mass
from solvers.pin.shapes.contour import Contour
from solvers.pin.shapes.given import Profile, WholeProfile
from solvers.pin.stations.between_nodes import maximum_excess
from solvers.pin.stations.lobatto_panels import initial_stations
from solvers.pin.warnings import warnings_of

_MAX_STATIONS = 20_000
_MAX_PASSES = 40
_EQUAL = 1e-9
"""Relative difference up to which two stresses count as equal."""


def check(
    scene: Scene,
    profile: Profile,
    criterion: Criterion = CRITERIA["tresca_paper"],
    limits: Limits = NO_LIMITS,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[PinCheck]:
    """Evaluate a pin with a given bore, or a bushing with given outer diameters.

    ``limits`` do not change a result; violations are reported as warnings. Raises InvalidInput for an invalid
    request, EffectConflict if an excluded effect is required by a limit.
    """
    return Case(scene, profile, criterion, limits, effects, effect_tolerance, accuracy).evaluate()


class Case(NamedTuple):
    """The arguments of one ``check``."""

    scene: Scene
    profile: Profile
    criterion: Criterion = CRITERIA["tresca_paper"]
    limits: Limits = NO_LIMITS
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6

    def prepared(self) -> Prepared:
        """Return the check with its effects selected. Raises as ``check`` does."""
        require_accuracy(self.accuracy)
        scene, profile, limits = self.scene, self.profile, self.limits
        profile.require_inside(scene.geometry)
        choice = choose_for(scene, limits, self.effects, self.effect_tolerance)
        whole = profile.along(scene.geometry.length)
        if not halves_alike(scene, whole):
            scene = replace(scene, symmetric=False)
        physics = compose(choice)
        pin = stepped_bore(scene, profile, self.criterion, limits, physics)
        return Prepared(scene, whole, self.criterion, limits, physics, self.accuracy, choice, pin)

    def evaluate(self) -> Outcome[PinCheck]:
        """Run this check on its own."""
        started = time.perf_counter()
        prepared = self.prepared()
        if prepared.stepped is None:
            return prepared.on_stations()
        results = evaluate_all([prepared.stepped])
        return prepared.in_closed_form(results, 0, time.perf_counter() - started)


@dataclass(frozen=True)
class Prepared:
    """A check with its effects selected; ``stepped`` is None if it needs stations along the part."""

    scene: Scene
    whole: WholeProfile
    criterion: Criterion
    limits: Limits
    physics: Physics
    accuracy: float
    choice: Choice[PinEffect]
    stepped: SteppedBore | None

    def in_closed_form(self, results: Results, row: int, seconds: float) -> Outcome[PinCheck]:
        """Return the outcome from one row of ``evaluate_all``'s results."""
        along = partial(
            sections_of, self.scene, self.criterion, partial(self.whole.contour, self.scene), accuracy=self.accuracy
        )
        value = result(self.stepped, results, row, along)
        return self._outcome(value, ROUNDING, {"sections": len(self.stepped.bores)}, seconds)

    def on_stations(self) -> Outcome[PinCheck]:
        """Evaluate the check by quadrature on stations."""
        started = time.perf_counter()
        variable, whole = design_variable_of(self.scene), self.whole
        found, error_estimate = on_profile(self.scene, whole, self.criterion, self.physics, self.accuracy, self.limits)
        mass = variable.mass_of(self.scene, np.array(whole.x), np.array(whole.bore))
        value = assess(found, self.limits, mass, self.accuracy, partial(whole.contour, self.scene))
        settings = {"stations": int(found.walls.size)}
        return self._outcome(
            value,
            max(error_estimate, CONSTANT_TOLERANCE * self.accuracy) + ROUNDING,
            settings,
            time.perf_counter() - started,
        )

    def _outcome(
        self, value: PinCheck, estimated: float, settings: dict[str, int], seconds: float
    ) -> Outcome[PinCheck]:
        accuracy = Accuracy(self.accuracy, estimated, settings)
        return Outcome(Status.SUCCEEDED, value, self.choice.manifest, accuracy, timing={"solve_s": seconds})


def halves_alike(scene: Scene, whole: WholeProfile) -> bool:
    """Return whether a profile is symmetric about the middle, to rounding of its walls."""
    return whole.is_symmetric(scene.geometry.length, design_variable_of(scene).thickness(np.array(whole.bore)))


def on_profile(
    scene: Scene,
    whole: WholeProfile,
    criterion: Criterion,
    physics: Physics,
    accuracy: float,
    limits: Limits = NO_LIMITS,
) -> tuple[Evaluation, float]:
    """Return the evaluation of a profile on stations adapted to it, and an error estimate.

    The estimate is the larger of the relative errors of the deflection and the maximum strength utilisation. Panels
    are refined where the deflection quadrature or a utilisation maximum between stations requires it.
    """
    stations = initial_stations(scene, whole.x)
    points = design_variable_of(scene).thickness(np.array(whole.bore))
    for _ in range(_MAX_PASSES):
        program = assemble(scene, limits, criterion, physics, stations)
        walls = whole.between(points, stations.x, stations.side) / program.variable.unit_diameter
        found = Evaluation(program, walls)
        error_estimate, peak_excess = found.deflection_error, maximum_excess(stations.x, found.utilisations)
        coarse = error_estimate.sum() > 0.1 * accuracy
        if not (coarse or peak_excess.max() > 0.1 * accuracy) or stations.x.size > _MAX_STATIONS:
            break
        excess = error_estimate * (stations.left.size / (0.05 * accuracy)) if coarse else np.zeros_like(error_estimate)
        stations = stations.refined(np.maximum(excess, peak_excess / (0.1 * accuracy)), walls)
    return found, max(float(error_estimate.sum()), float(peak_excess.max()))


def assess(
    found: Evaluation, limits: Limits, mass: float, accuracy: float, shape: Callable[[], Contour],
    cautions: tuple[str, ...] = (),
) -> PinCheck:  # fmt: skip
    """Return all results of a part; ``mass`` [kg], ``shape``: function that computes its varying diameter,
    ``cautions``: further warnings."""
    program, walls, deflection = found.program, found.walls, found.deflection
    scene, variable, physics, stations = program.scene, program.variable, program.physics, program.stations
    is_pin, allowable_shear = not isinstance(scene.geometry, BushingGeometry), scene.material.allowable_shear
    x, (bore, outer) = stations.x, variable.diameters(walls)
    criterion, shear = found.utilisations.max(axis=1).tolist()
    # Of several equally stressed sections report the last one; otherwise rounding errors would decide.
    worst_section = float(x[np.flatnonzero(found.utilisations[0] >= (1.0 - _EQUAL) * criterion)[-1]])
    middle = x.size - 1 if scene.symmetric else int(np.searchsorted(stations.side, 0.5 * scene.geometry.length))
    return PinCheck(
        mass=mass,
        solid_mass=program.mass_unit if is_pin else None,
        lightest_constant=partial(lightest_constant_mass, scene, limits, program.criterion, physics, accuracy),
        capacity=partial(force_limit, scene, program.criterion) if is_pin else None,
        sections=partial(sections_of, scene, program.criterion, shape, worst_section, accuracy),
        messages=partial(_warnings, found, limits, cautions),
        rings=partial(ring_of, scene, bore, outer, middle) if physics.ovalization else None,
        min_bore=float(bore.min()),
        bore_mid=float(bore[middle]),
        max_outer=float(outer.max()),
        outer_mid=float(outer[middle]),
        least_wall=0.5 * variable.unit_diameter * float(walls.min()),
        max_moment=float(program.moment.max()),
        max_shear=float(program.shear_force.max()),
        equivalent_stress_max=finite(scene.material.allowable_stress * criterion),
        worst_section=worst_section,
        shear_stress_max=None if allowable_shear is None else finite(allowable_shear * shear),
        strength_utilisation=finite(max(criterion, shear)),
        deflection=finite(deflection),
        pressures=bearing_pressures(scene, stations, outer) if physics.contact_pressure else None,
    )


def _warnings(found: Evaluation, limits: Limits, cautions: tuple[str, ...], check: PinCheck) -> tuple[str, ...]:
    x = found.program.stations.x
    over = partial(where_over, x, found.utilisations)
    return *warnings_of(check, found.program.scene, limits, over, x, found.walls), *cautions
