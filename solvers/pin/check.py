"""Evaluating a given pin or bushing: strength along its length, deflection, the ring, pressures, mass."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.outcome import Accuracy, Outcome, Status
from solvers.pin.effects import Physics, choose_for, compose, demands_of
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.capacity import force_limit_of
from solvers.pin.optimum.discretised import assemble, sought_in
from solvers.pin.optimum.program import Program, Sought, refined
from solvers.pin.ring import ovalization
from solvers.pin.ring.bearing_pressure import Pressures, bearing_pressures
from solvers.pin.scene import BushingGeometry, Geometry, Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.section.flexibility import cowper
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
    """The ring in the middle of the part, and over its length: None where the wall runs out."""

    ovalization: float
    ovalization_max: float | None
    stresses: ovalization.RingStresses
    stress_max: float | None
    model: str


@dataclass(frozen=True)
class Stress:
    """Along the whole part: places, bores, outer diameters [m], moment [N m], shear [N], equivalent stress [Pa], each
    (n,)."""

    x: Array
    bore: Array
    outer: Array
    moment: Array
    shear: Array
    equivalent: Array


@dataclass(frozen=True)
class Sections:
    """What ``Stress`` has, (6, n), at a program's stations; places where a shape begins; whether the stations of one
    half stand for both."""

    table: Array
    places: tuple[float, ...]
    geometry: Geometry | BushingGeometry
    symmetric: bool

    def along(self) -> Stress:
        """Stations of the whole part, thinned to some four hundred; places where a load or a shape begins stay."""
        table, g, (x, bore, outer) = self.table, self.geometry, self.table[:3]
        starts = {0.0, g.boss_length, g.boss_length + g.gap, 0.5 * g.length, *self.places}
        fixed = np.isin(x, list(starts)) | (x == x[-1]) | (x == x[0])
        same = np.zeros(x.size, dtype=bool)
        same[1:] = (x[1:] == x[:-1]) & (np.abs(np.diff(bore)) <= 1e-12 * bore[:-1])
        same[1:] &= np.abs(np.diff(outer)) <= 1e-12 * outer[:-1]
        keep: list[int] = []
        step, last = g.length / 400.0, -math.inf
        for i, (place, must, again) in enumerate(zip(x.tolist(), fixed.tolist(), same.tolist(), strict=True)):
            repeated = again and keep and keep[-1] == i - 1
            if (must and not repeated) or (place - last >= step and not again):
                keep.append(i)
                last = place
        table = table[:, keep]
        if self.symmetric:
            mirrored = table[:, ::-1].copy()
            mirrored[0] = g.length - mirrored[0]
            mirrored[4] = -mirrored[4]
            table = np.concatenate([table, mirrored[:, 1:]], axis=1)
        return Stress(*table)


@dataclass(frozen=True)
class PinCheck:
    """The results of a check of a pin or a bushing, SI units; None where a result does not exist (an effect that did
    not run, no wall, what only a pin has).

    ``constant_mass`` is what one diameter all along would weigh under the same limits, ``force_limit`` the greatest
    force that a solid pin carries.
    """

    mass: float
    solid_mass: float | None
    constant_mass: float | None
    sections: Sections | None
    min_bore: float
    bore_mid: float
    max_outer: float
    outer_mid: float
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
    force_limit: float | None
    warnings: tuple[str, ...]

    @cached_property
    def along(self) -> Stress | None:
        """The part from end to end, at some four hundred places; None of a pin checked among many."""
        return None if self.sections is None else self.sections.along()


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

    ``limits`` do not change a result; what the part breaks is said in its warnings. Raises InvalidInput where the
    request makes no sense, EffectConflict for an excluded effect that a limit needs.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    profile.require_inside(scene.geometry)
    choice = choose_for(scene, effects, effect_tolerance, demands_of(limits))
    physics = compose(choice)
    length, sought = scene.geometry.length, sought_in(scene)
    whole = profile.along(length)
    if not halves_alike(scene, whole):
        scene = replace(scene, mirrored=False)
    program, walls, doubt = on_profile(scene, whole, criterion, physics, accuracy, limits)
    # What one diameter under the same limits would weigh, where there is one.
    constant, constant_doubt = lightest_constant(program, accuracy) or (None, 0.0)
    value = assess(
        program, walls, limits, sought.mass_of(scene, np.array(whole.x), np.array(whole.bore)),
        None if constant is None else program.mass_unit * constant, whole.places,
    )  # fmt: skip
    return Outcome(
        Status.SUCCEEDED,
        value,
        choice.manifest,
        Accuracy(
            accuracy,
            max(doubt, constant_doubt) + ROUNDING,
            {"stations": int(walls.size)},
        ),
        timing={"solve_s": time.perf_counter() - started},
    )


def halves_alike(scene: Scene, whole: WholeProfile) -> bool:
    """Whether one half of a profile mirrors the other, to rounding of its walls."""
    return whole.is_symmetric(scene.geometry.length, sought_in(scene).points(np.array(whole.bore)))


def on_profile(
    scene: Scene,
    whole: WholeProfile,
    criterion: Criterion,
    physics: Physics,
    accuracy: float,
    limits: Limits = NO_LIMITS,
) -> tuple[Program, Array, float]:
    """A program on stations that suit this profile, walls there, and what the deflection and the greatest use of the
    strength may be off, relative.

    Panels are halved where the deflection asks for it, and where the strength is used most between two stations.
    """
    stations = opening_stations(scene, whole.places)
    points = sought_in(scene).points(np.array(whole.bore))
    for _ in range(_PASSES):
        program = assemble(scene, limits, criterion, physics, stations, cowper(scene.material.poisson))
        walls = program.sought.relative(whole.between(points, stations.x, stations.side))
        doubt = deflection_doubt(program, walls)
        rough = doubt.sum() > 0.1 * accuracy
        rise = risen(stations, program.uses(walls))
        between = rise > 0.1 * accuracy
        if not (rough or between.any()) or stations.x.size > _MOST_STATIONS:
            break
        stations = refined(program, between | (rough & (doubt > 0.05 * accuracy / stations.left.size)))
    return program, walls, max(float(doubt.sum()), float(rise.max()))


def deflection_doubt(program: Program, walls: Array) -> Array:
    """Per panel, quadrature's doubt of the deflection, relative."""
    density = program.densities(program.sought.solidity_of(walls))
    total = float(program.share @ density)
    if not math.isfinite(total) or total == 0.0:
        return np.zeros(program.stations.left.size)
    return program.stations.doubt(density) / total


def assess(
    program: Program, walls: Array, limits: Limits, mass: float, constant_mass: float | None,
    places: tuple[float, ...] = (),
) -> PinCheck:  # fmt: skip
    """Everything that can be said of walls at a program's stations; masses [kg]."""
    scene, sought, physics, stations = program.scene, program.sought, program.physics, program.stations
    is_pin, x = not isinstance(scene.geometry, BushingGeometry), stations.x
    uses, allowable_shear = program.uses(walls), scene.material.allowable_shear
    equivalent, use = scene.material.allowable_stress * uses[0], uses.max(axis=0)
    forces = program.forces
    worst = int(np.argmax(equivalent))
    sizes = sought.sizes(walls)
    bore, outer = sought.diameters(sizes)
    deflection = program.deflection(sought.solidity_of(walls))
    found_ring = ring_of(scene, sought, sizes) if physics.ovalization else None
    middle = 0.5 * scene.geometry.length
    return PinCheck(
        mass=mass,
        solid_mass=program.mass_unit if is_pin else None,
        constant_mass=constant_mass,
        sections=Sections(
            np.stack([x, bore, outer, forces.moment_total, forces.shear[0], equivalent]),
            places,
            scene.geometry,
            scene.symmetric,
        ),
        min_bore=float(bore.min()),
        bore_mid=float(np.interp(middle, x, bore)),
        max_outer=float(outer.max()),
        outer_mid=float(np.interp(middle, x, outer)),
        least_wall=0.5 * sought.thickness(float(walls.min())),
        max_moment=float(forces.moment_total.max()),
        max_shear=float(forces.shear_total.max()),
        equivalent_stress_max=_finite(equivalent[worst]),
        worst_section=float(x[worst]),
        shear_stress_max=None if allowable_shear is None else _finite(allowable_shear * uses[1].max()),
        strength_utilisation=_finite(use.max()),
        deflection=_finite(deflection),
        ring=found_ring,
        pressures=bearing_pressures(scene, stations, outer) if physics.contact_pressure else None,
        force_limit=force_limit_of(program) if is_pin else None,
        warnings=_warnings(program, limits, walls, use, deflection, found_ring),
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def ring_of(scene: Scene, sought: Sought, sizes: Array) -> RingResult:
    """The ring in the middle, and where the wall is thinnest, which ovals and stresses it most; ``sizes`` [m] along the
    part, of a symmetric one from its end to the middle."""
    m = scene.material

    def like(size: float) -> tuple[float, ...]:
        bore, outer = sought.pair(size)
        return scene.force, outer, scene.geometry.length, bore / outer, m.elastic_modulus, m.poisson

    middle, thinnest = float(sizes[sizes.size - 1 if scene.symmetric else sizes.size // 2]), sought.thinnest(sizes)
    own = ovalization.ring(*like(sought.with_wall(middle, _LEAST_RING_WALL)))
    if thinnest != sought.with_wall(thinnest, _LEAST_RING_WALL):
        return RingResult(own.ovalization, None, own.stresses, None, own.model)
    most = own if thinnest == middle else ovalization.ring(*like(thinnest))
    stress = ovalization.greatest_stress(*like(thinnest))
    return RingResult(own.ovalization, most.ovalization, own.stresses, stress, own.model)


def _warnings(
    program: Program, limits: Limits, walls: Array, use: Array, deflection: float, found: RingResult | None
) -> tuple[str, ...]:
    said, x = [], program.stations.x
    over = use > 1.0 + 1e-9
    if over.any():
        said.append(exceeded(x[over], float(use.max())))
    said += shape_warnings(limits, 0.5 * program.sought.thickness(float(walls.min())), deflection)
    if found is not None:
        said += ring_warnings(program.scene, program.sought, limits, x, walls, found)
    return tuple(said)


def exceeded(x: Array, use: float) -> str:
    """At which places [m] the strength is exceeded, and by how much."""
    by = f"by {100.0 * (use - 1.0):.2g} %" if math.isfinite(use) else "where there is no wall"
    return f"the strength is exceeded {_span(x)}, {by}"


def shape_warnings(limits: Limits, least: float, deflection: float) -> list[str]:
    """Least wall [m] and deflection [m] beyond their limits."""
    said = []
    if least < limits.min_wall * (1.0 - 1e-9):
        said.append(f"the wall is {least * 1e3:.4g} mm at its thinnest, not the {limits.min_wall * 1e3:.4g} asked")
    if limits.max_deflection is not None and deflection > limits.max_deflection * (1.0 + 1e-9):
        said.append(f"the deflection of {deflection * 1e6:.4g} um exceeds its limit")
    return said


def _span(x: Array) -> str:
    """Where, in words: from the first to the last of places [m]."""
    first, last = f"{x.min() * 1e3:.4g}", f"{x.max() * 1e3:.4g}"
    return f"at {first} mm" if first == last else f"between {first} and {last} mm"


def ring_warnings(scene: Scene, sought: Sought, limits: Limits, x: Array, walls: Array, found: RingResult) -> list[str]:
    """Whether the ring, of which the beam knows nothing, is what the part breaks of; walls at places x [m]."""
    said: list[str] = []
    if scene.force == 0.0:
        return said
    if limits.max_ovalization is not None and (
        found.ovalization_max is None or found.ovalization_max > limits.max_ovalization * (1.0 + 1e-9)
    ):
        said.append("the ovalization exceeds its limit")
    allowable = scene.material.allowable_stress if limits.max_ring_stress is None else limits.max_ring_stress
    if found.stress_max is None or found.stress_max > allowable * (1.0 + 1e-9):
        thin, where = sought.over_ring_stress(scene, allowable, walls)
        if thin.any():
            said.append(
                f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where {where}, "
                + _span(x[thin])
                + (" (and mirrored)" if scene.symmetric else "")
            )
    return said
