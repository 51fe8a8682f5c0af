"""Checks of stepped-bore pins in closed form: batch evaluation, results as ``PinCheck``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.closed_form.kernel import Pins, Results, evaluated, material_rows
from solvers.pin.effects import Physics
from solvers.pin.optimum.capacity import force_limit, span_over
from solvers.pin.result import PinCheck, Stress, finite
from solvers.pin.ring.along_the_part import ring_of
from solvers.pin.ring.bearing_pressure import pressures_of_pin
from solvers.pin.scene import BushingGeometry, Limits, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.shapes.constant import lightest_constant_mass
from solvers.pin.shapes.given import Profile
from solvers.pin.warnings import warnings_of


def steps_of(profile: Profile, length: float) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Return the ends [m] and the diameters of the steps of the first half if a profile is purely stepped and
    symmetric; else None."""
    half, bore = 0.5 * length, profile.bore
    if all(d == bore[0] for d in bore):
        return (half,), bore[:1]
    if profile.x[-1] > half * (1.0 + 1e-12):
        return None
    # The bore is constant before the first point and after the last one.
    places = [0.0, *profile.x, half]
    diameters = [bore[0], *bore, bore[-1]]
    ends, bores = [], []
    for (start, ahead), (end, behind) in pairwise(zip(places, diameters, strict=True)):
        if start < min(end, half):
            if ahead != behind:
                return None
            ends.append(min(end, half))
            bores.append(ahead)
    return tuple(ends), tuple(bores)


@dataclass(frozen=True)
class SteppedBore:
    """A stepped-bore pin with the data its check needs: diameters ``bores`` of the first half up to ``ends`` [m]."""

    scene: Scene
    ends: tuple[float, ...]
    bores: tuple[float, ...]
    criterion: Criterion
    limits: Limits
    physics: Physics


def stepped_bore(
    scene: Scene, profile: Profile, criterion: Criterion, limits: Limits, physics: Physics
) -> SteppedBore | None:
    """Return the pin if the kernel applies (symmetric, rod force alone, stepped bore); else None."""
    if not scene.symmetric or scene.further_cases or isinstance(scene.geometry, BushingGeometry):
        return None
    steps = steps_of(profile, scene.geometry.length)
    return None if steps is None else SteppedBore(scene, *steps, criterion, limits, physics)


def evaluate_all(pins: Sequence[SteppedBore]) -> Results:
    """Evaluate all pins, one result row each; shorter step lists are padded with their last step."""
    most = max((len(pin.ends) for pin in pins), default=1)
    ends, bores = np.empty((len(pins), most)), np.empty((len(pins), most))
    sizes, elastic = np.empty((len(pins), 5)), np.empty((len(pins), 4))
    constraints, laws = np.empty((len(pins), 3, 3)), np.empty((len(pins), 3))
    for k, pin in enumerate(pins):
        g, m, short = pin.scene.geometry, pin.scene.material, most - len(pin.ends)
        ends[k], bores[k] = pin.ends + pin.ends[-1:] * short, pin.bores + pin.bores[-1:] * short
        sizes[k] = g.outer_diameter, g.boss_length, g.small_end_length, g.gap, pin.scene.force
        elastic[k], constraints[k], laws[k] = material_rows(pin.criterion, m, pin.physics.shear_deflection)
    return evaluated(
        Pins(sizes, elastic, constraints, laws), ends, np.maximum(sizes[:, :1] - bores, 0.0) / sizes[:, :1]
    )


def result(pin: SteppedBore, results: Results, row: int, sections: Callable[[float], Stress]) -> PinCheck:
    """Return one row as a check; ``sections`` computes the distributions along the pin, given the worst section."""
    scene, bores = pin.scene, pin.bores
    g, m = scene.geometry, scene.material
    found = Results(*(float(column[row]) for column in results))
    walls = np.maximum(g.outer_diameter - np.array(bores), 0.0)
    outer = np.full(len(bores), g.outer_diameter)
    solid_mass = m.density * g.area * g.length
    return PinCheck(
        mass=solid_mass * found.volume,
        solid_mass=solid_mass,
        lightest_constant=partial(lightest_constant_mass, scene, pin.limits, pin.criterion, pin.physics, 1.0),
        capacity=partial(_capacity, pin, found.solid),
        sections=partial(sections, found.worst),
        messages=partial(_warnings, pin, walls / g.outer_diameter),
        rings=partial(ring_of, scene, np.array(bores), outer) if pin.physics.ovalization else None,
        min_bore=min(bores),
        bore_mid=bores[-1],
        max_outer=g.outer_diameter,
        outer_mid=g.outer_diameter,
        least_wall=0.5 * float(walls.min()),
        max_moment=found.moment,
        max_shear=found.force,
        equivalent_stress_max=finite(m.allowable_stress * found.criterion),
        worst_section=found.worst,
        shear_stress_max=None if m.allowable_shear is None else finite(m.allowable_shear * found.shear),
        strength_utilisation=finite(max(found.criterion, found.shear)),
        deflection=finite(found.deflection),
        pressures=pressures_of_pin(scene) if pin.physics.contact_pressure else None,
    )


def _warnings(pin: SteppedBore, walls: Array, check: PinCheck) -> tuple[str, ...]:
    def wall_at(side: Array) -> Array:
        return walls[np.searchsorted(pin.ends[:-1], side)]

    over, x = partial(span_over, pin.scene, pin.criterion, wall_at, pin.ends), np.repeat((0.0, *pin.ends), 2)[1:-1]
    return warnings_of(check, pin.scene, pin.limits, over, x, np.repeat(walls, 2))


def _capacity(pin: SteppedBore, solid: float) -> float:
    return pin.scene.force / solid if pin.scene.force > 0.0 else force_limit(pin.scene, pin.criterion)
