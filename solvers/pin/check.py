"""Evaluating a given pin: strength along its length, deflection, the ring, pressures, mass."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Accuracy, Outcome, Status
from solvers.pin.effects import Physics, choose_for, compose, demands_of
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.capacity import force_limit
from solvers.pin.optimum.discretised import Program, assemble, refined
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.section.flexibility import ShearFlexibility, cowper, flexibility_values, product
from solvers.pin.section.variables import solidity_of
from solvers.pin.shapes.constant import lightest_constant
from solvers.pin.shapes.given import Profile, WholeProfile
from solvers.pin.stations.between_nodes import risen
from solvers.pin.stations.opening import opening_stations

Array = NDArray[np.float64]
_MOST_STATIONS = 20_000
_PASSES = 40
_LEAST_RING_WALL = 1e-5
"""Walls thinner than this share of the radius are no ring that anything could be said of."""


@dataclass(frozen=True)
class RingResult:
    """The ring in the middle of the pin, and over its length: None where the wall runs out."""

    ovalization: float
    ovalization_max: float | None
    stresses: ovalization.RingStresses
    stress_max: float | None
    model: str


@dataclass(frozen=True)
class Pressures:
    """Mean pressure in the rod's small end, mean and peak in the bosses [Pa]."""

    small_end: float
    boss_mean: float
    boss_peak: float


@dataclass(frozen=True)
class Stress:
    """Along the whole pin: places, bores [m], moment [N m], shear [N], equivalent stress [Pa], each (n,)."""

    x: Array
    bore: Array
    moment: Array
    shear: Array
    equivalent: Array


@dataclass(frozen=True)
class PinCheck:
    """The results of a check, SI units; None where a result does not exist (an effect that did not run, no wall).

    ``along`` is None of a pin checked among many.
    """

    mass: float
    solid_mass: float
    constant_bore_mass: float | None
    along: Stress | None
    min_bore: float
    bore_mid: float
    least_wall: float
    max_moment: float
    max_shear: float
    equivalent_stress_max: float | None
    worst_section: float
    shear_stress_max: float | None
    strength_utilisation: float | None
    deflection: float | None
    ring: RingResult | None
    pressures: Pressures | None
    force_limit: float
    warnings: tuple[str, ...]


def check(
    scene: Scene,
    profile: Profile,
    criterion: Criterion = CRITERIA["tresca_paper"],
    limits: Limits = NO_LIMITS,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[PinCheck]:
    """Evaluate a pin with a given bore.

    ``limits`` do not change a result; what the pin breaks is said in its warnings. Raises InvalidInput where the
    request makes no sense, EffectConflict for an excluded effect that a limit needs.
    """
    started = time.perf_counter()
    if not 1e-12 <= accuracy <= 1e-1:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")
    profile.require_inside(scene.geometry)
    choice = choose_for(scene, effects, effect_tolerance, demands_of(limits))
    physics = compose(choice)
    whole = profile.along(scene.geometry.length)
    if not whole.is_symmetric(scene.geometry.length, whole.walls(scene.geometry.outer_diameter)):
        scene = replace(scene, mirrored=False)
    program, wall, doubt = on_profile(scene, whole, criterion, physics, cowper(scene.material.poisson), accuracy)
    # What a constant bore under the same limits would weigh, where there is one.
    constant = lightest_constant(assemble(scene, limits, criterion, physics, program.stations), accuracy)
    value = assess(
        program, wall, criterion, physics, limits, whole.volume_share(scene.geometry),
        None if constant is None else constant.volume, whole.places,
    )  # fmt: skip
    return Outcome(
        Status.SUCCEEDED,
        value,
        choice.manifest,
        Accuracy(
            accuracy,
            max(doubt, 0.0 if constant is None else constant.doubted) + ROUNDING,
            {"stations": int(wall.size)},
        ),
        timing={"solve_s": time.perf_counter() - started},
    )


def on_profile(
    scene: Scene, whole: WholeProfile, criterion: Criterion, physics: Physics, law: ShearFlexibility, accuracy: float
) -> tuple[Program, Array, float]:
    """A program on stations that suit this bore, walls there, and what the deflection and the greatest use of the
    strength may be off, relative.

    Panels are halved where the deflection asks for it, and where the strength is used most between two stations.
    """
    stations = opening_stations(scene, whole.places)
    for _ in range(_PASSES):
        program = assemble(scene, Limits(), criterion, physics, stations, law)
        wall = whole.wall(stations.x, stations.side, scene.geometry.outer_diameter)
        doubt = deflection_doubt(program, solidity_of(wall))
        rough = doubt.sum() > 0.1 * accuracy
        rise = risen(stations, program.uses(wall))
        between = rise > 0.1 * accuracy
        if not (rough or between.any()) or stations.x.size > _MOST_STATIONS:
            break
        stations = refined(program, between | (rough & (doubt > 0.05 * accuracy / stations.left.size)))
    return program, wall, max(float(doubt.sum()), float(rise.max()))


def deflection_doubt(program: Program, solidity: Array) -> Array:
    """Per panel, quadrature's doubt of the deflection, relative."""
    total = program.deflection(solidity)
    if not math.isfinite(total) or total == 0.0:
        return np.zeros(program.stations.left.size)
    bend, shear = flexibility_values(solidity, program.law)
    return program.stations.doubt(product(program.bending, bend) + product(program.shear, shear)) / total


def assess(
    program: Program, wall: Array, criterion: Criterion, physics: Physics, limits: Limits,
    volume: float, constant_volume: float | None, places: tuple[float, ...] = (),
) -> PinCheck:  # fmt: skip
    """Everything that can be said of walls at a program's stations; ``volume`` is their mass over the solid pin's."""
    scene, g = program.scene, program.scene.geometry
    uses, allowable_shear = program.uses(wall), scene.material.allowable_shear
    equivalent, use = scene.material.allowable_stress * uses[0], uses.max(axis=0)
    along = _along(program, wall, equivalent, places)
    forces = forces_at(scene.cases[0], program.stations.x, program.stations.side, program.stations.rest)
    worst = int(np.argmax(equivalent))
    bore = g.outer_diameter * (1.0 - wall)
    deflection = program.deflection(solidity_of(wall))
    found_ring = _ring(scene, bore) if physics.ovalization else None
    warnings = _warnings(scene, program, limits, wall, use, deflection, found_ring)
    return PinCheck(
        mass=program.solid_mass * volume,
        solid_mass=program.solid_mass,
        constant_bore_mass=None if constant_volume is None else program.solid_mass * constant_volume,
        along=along,
        min_bore=float(bore.min()),
        bore_mid=float(np.interp(0.5 * g.length, program.stations.x, bore)),
        least_wall=0.5 * g.outer_diameter * float(wall.min()),
        max_moment=float(forces.moment_total.max()),
        max_shear=float(forces.shear_total.max()),
        equivalent_stress_max=_finite(equivalent[worst]),
        worst_section=float(program.stations.x[worst]),
        shear_stress_max=None if allowable_shear is None else _finite(allowable_shear * uses[1].max()),
        strength_utilisation=_finite(use.max()),
        deflection=_finite(deflection),
        ring=found_ring,
        pressures=_pressures(scene) if physics.contact_pressure else None,
        force_limit=force_limit(scene, criterion),
        warnings=warnings,
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _along(program: Program, wall: Array, equivalent: Array, places: tuple[float, ...]) -> Stress:
    """Stations of the whole pin, thinned to some four hundred; places where a load or a shape begins stay."""
    scene, g, x = program.scene, program.scene.geometry, program.stations.x
    forces = forces_at(scene.cases[0], x, program.stations.side, program.stations.rest)
    bore = g.outer_diameter * (1.0 - wall)
    table = np.stack([x, bore, forces.moment_total, forces.shear[0], equivalent])
    starts = {0.0, g.boss_length, g.boss_length + g.gap, 0.5 * g.length, *places}
    fixed = np.isin(x, list(starts)) | (x == x[-1]) | (x == x[0])
    same = np.zeros(x.size, dtype=bool)
    same[1:] = (x[1:] == x[:-1]) & (np.abs(np.diff(bore)) <= 1e-12 * bore[:-1])
    keep: list[int] = []
    step, last = g.length / 400.0, -math.inf
    for i, (place, must, again) in enumerate(zip(x.tolist(), fixed.tolist(), same.tolist(), strict=True)):
        repeated = again and keep and keep[-1] == i - 1
        if (must and not repeated) or (place - last >= step and not again):
            keep.append(i)
            last = place
    table = table[:, keep]
    if scene.symmetric:
        mirrored = table[:, ::-1].copy()
        mirrored[0] = g.length - mirrored[0]
        mirrored[3] = -mirrored[3]
        table = np.concatenate([table, mirrored[:, 1:]], axis=1)
    return Stress(*table)


def _ring(scene: Scene, bore: Array) -> RingResult:
    """The ring in the middle, and where the bore is widest, which ovals and stresses it most."""
    g, m = scene.geometry, scene.material

    def at(diameter: float) -> ovalization.Ring:
        return ovalization.ring(
            scene.force, g.outer_diameter, g.length, diameter / g.outer_diameter, m.elastic_modulus, m.poisson
        )

    middle, widest = float(bore[bore.size - 1 if scene.symmetric else bore.size // 2]), float(bore.max())
    own = at(min(middle, g.outer_diameter * (1.0 - _LEAST_RING_WALL)))
    if widest > g.outer_diameter * (1.0 - _LEAST_RING_WALL):
        return RingResult(own.ovalization, None, own.stresses, None, own.model)
    stress = ovalization.greatest_stress(
        scene.force, g.outer_diameter, g.length, widest / g.outer_diameter, m.elastic_modulus, m.poisson
    )
    return RingResult(own.ovalization, at(widest).ovalization, own.stresses, stress, own.model)


def _pressures(scene: Scene) -> Pressures:
    """P/(D b), P/(2 a D), and the triangle's peak P/(a D)."""
    g, d = scene.geometry, scene.geometry.outer_diameter
    boss = scene.force / (2.0 * g.boss_length * d)
    return Pressures(scene.force / (d * g.small_end_length), boss, 2.0 * boss)


def _warnings(
    scene: Scene, program: Program, limits: Limits, wall: Array, use: Array, deflection: float, found: RingResult | None
) -> tuple[str, ...]:
    g, said = scene.geometry, []
    x = program.stations.x
    over = use > 1.0 + 1e-9
    if over.any():
        said.append(exceeded(x[over], float(use.max())))
    said += _shape_warnings(limits, 0.5 * g.outer_diameter * float(wall.min()), deflection)
    if found is not None and scene.force > 0:
        said += _ring_warnings(scene, limits, x, wall, found)
    return tuple(said)


def exceeded(x: Array, use: float) -> str:
    """At which places [m] the strength is exceeded, and by how much."""
    by = f"by {100.0 * (use - 1.0):.2g} %" if math.isfinite(use) else "where there is no wall"
    return f"the strength is exceeded {span(x)}, {by}"


def _shape_warnings(limits: Limits, least: float, deflection: float) -> list[str]:
    """Least wall [m] and deflection [m] beyond their limits."""
    said = []
    if least < limits.min_wall * (1.0 - 1e-9):
        said.append(f"the wall is {least * 1e3:.4g} mm at its thinnest, not the {limits.min_wall * 1e3:.4g} asked")
    if limits.max_deflection is not None and deflection > limits.max_deflection * (1.0 + 1e-9):
        said.append(f"the deflection of {deflection * 1e6:.4g} um exceeds its limit")
    return said


def span(x: Array) -> str:
    """Where, in words: from the first to the last of places [m]."""
    first, last = f"{x.min() * 1e3:.4g}", f"{x.max() * 1e3:.4g}"
    return f"at {first} mm" if first == last else f"between {first} and {last} mm"


def _ring_warnings(scene: Scene, limits: Limits, x: Array, wall: Array, found: RingResult) -> list[str]:
    """Whether the ring, of which the beam knows nothing, is what the pin breaks of."""
    g, m, said = scene.geometry, scene.material, []
    if limits.max_ovalization is not None and (
        found.ovalization_max is None or found.ovalization_max > limits.max_ovalization * (1.0 + 1e-9)
    ):
        said.append("the ovalization exceeds its limit")
    allowable = m.allowable_stress if limits.max_ring_stress is None else limits.max_ring_stress
    if found.stress_max is None or found.stress_max > allowable * (1.0 + 1e-9):
        ratio = ovalization.ratio_at_stress(
            allowable, scene.force, g.outer_diameter, g.length, m.elastic_modulus, m.poisson
        )
        thin = x[1.0 - wall > ratio]
        if thin.size:
            said.append(
                f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where the bore is wider than "
                f"{ratio * g.outer_diameter * 1e3:.4g} mm, {span(thin)}"
                + (" (and mirrored)" if scene.symmetric else "")
            )
    return said
