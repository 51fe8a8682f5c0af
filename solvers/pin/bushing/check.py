"""Evaluating a given bushing: strength along its length, deflection, the ring, pressures, mass."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Accuracy, Outcome, Status
from solvers.pin.bushing.effects import choose_for
from solvers.pin.bushing.forms import lightest_constant
from solvers.pin.bushing.program import BushingProgram, assemble, opening_stations, refined
from solvers.pin.bushing.scene import BushingScene
from solvers.pin.check import Pressures, RingResult, span
from solvers.pin.effects import Physics, compose
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.ring import ovalization
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.given import Profile, WholeProfile
from solvers.pin.stations.between_nodes import risen

Array = NDArray[np.float64]
_MOST_STATIONS = 20_000
_PASSES = 40
_LEAST_RING_WALL = 1e-5


@dataclass(frozen=True)
class OutsideAlong:
    """Along the whole bushing: places, outer diameters [m], moment [N m], shear [N], equivalent stress [Pa]."""

    x: Array
    outer: Array
    moment: Array
    shear: Array
    equivalent: Array


@dataclass(frozen=True)
class BushingCheck:
    """The results of a check, SI units; None where a result does not exist (an effect that did not run, no wall)."""

    mass: float
    constant_mass: float | None
    along: OutsideAlong
    bore: float
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
    warnings: tuple[str, ...]


def check(
    scene: BushingScene,
    outside: Profile,
    criterion: Criterion = CRITERIA["tresca_paper"],
    limits: Limits = NO_LIMITS,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
) -> Outcome[BushingCheck]:
    """Evaluate a bushing; ``outside`` gives outer diameters in the place of a pin's bores.

    Raises InvalidInput where the request makes no sense, EffectConflict for an excluded effect that a limit needs.
    """
    started = time.perf_counter()
    require_accuracy(accuracy)
    g = scene.geometry
    for k, (place, outer) in enumerate(zip(outside.x, outside.bore, strict=True)):
        if place > g.length * (1.0 + 1e-9):
            raise InvalidInput(f"profile.{k}.x", "lies beyond the bushing's end", "at most its length")
        if outer < g.bore * (1.0 - 1e-12):
            raise InvalidInput(f"profile.{k}.outer_diameter", "is narrower than the bore", "at least the bore")
    choice = choose_for(scene, limits, effects, effect_tolerance)
    physics = compose(choice)
    whole = outside.along(g.length)
    if not whole.is_symmetric(g.length, _walls(scene, whole)):
        scene = replace(scene, mirrored=False)
    program, gap, doubt = _on_outside(scene, whole, criterion, physics, accuracy)
    own = assemble(scene, limits, criterion, physics, program.stations)
    constant = lightest_constant(own, physics, accuracy) if np.isfinite(own.lower).all() else None
    constant_mass, constant_doubt = (
        (None, 0.0) if constant is None else (constant.volume * own.mass_unit, constant.doubted)
    )
    value = assess(program, gap, physics, limits, _mass(scene, whole), constant_mass)
    return Outcome(
        Status.SUCCEEDED,
        value,
        choice.manifest,
        Accuracy(accuracy, max(doubt, constant_doubt) + ROUNDING, {"stations": int(gap.size)}),
        timing={"solve_s": time.perf_counter() - started},
    )


def _walls(scene: BushingScene, whole: WholeProfile) -> Array:
    """t = D - d [m] at the points."""
    return np.maximum(np.array(whole.bore) - scene.geometry.bore, 0.0)


def _gap(scene: BushingScene, whole: WholeProfile, program: BushingProgram) -> Array:
    """t = D - d at the stations."""
    return whole.between(_walls(scene, whole), program.stations.x, program.stations.side)


def _on_outside(
    scene: BushingScene, whole: WholeProfile, criterion: Criterion, physics: Physics, accuracy: float
) -> tuple[BushingProgram, Array, float]:
    """A program on stations that suit this outside, t there, and what the deflection and the greatest use of the
    strength may be off, relative.

    Panels are halved where the deflection asks for it, and where the strength is used most between two stations.
    """
    stations = opening_stations(scene, whole.places)
    for _ in range(_PASSES):
        program = assemble(scene, Limits(), criterion, physics, stations)
        gap = _gap(scene, whole, program)
        density = program.densities(program.y_of(gap))
        total = float(program.share @ density)
        doubt = np.zeros(stations.left.size)
        if math.isfinite(total) and total > 0.0:
            doubt = stations.doubt(density) / total
        rise = risen(stations, program.uses(gap))
        rough, between = doubt.sum() > 0.1 * accuracy, rise > 0.1 * accuracy
        if not (rough or between.any()) or stations.x.size > _MOST_STATIONS:
            break
        stations = refined(program, between | (rough & (doubt > 0.05 * accuracy / stations.left.size)))
    return program, gap, max(float(doubt.sum()), float(rise.max()))


def _mass(scene: BushingScene, whole: WholeProfile) -> float:
    """Frustums less the bore: D^2 - d^2 over straight segments, in t = D - d so that thin walls keep their digits."""
    d, t = scene.geometry.bore, _walls(scene, whole)
    a, b = t[:-1], t[1:]
    mean = d * (a + b) + (a * a + a * b + b * b) / 3.0
    return scene.material.density * math.pi / 4.0 * float(np.diff(np.array(whole.x)) @ mean)


def assess(
    program: BushingProgram, gap: Array, physics: Physics, limits: Limits, mass: float, constant_mass: float | None
) -> BushingCheck:
    """Everything that can be said of t = D - d at a program's stations."""
    scene, g = program.scene, program.scene.geometry
    x, outer = program.stations.x, g.bore + gap
    uses, allowable_shear = program.uses(gap), scene.material.allowable_shear
    equivalent, use = scene.material.allowable_stress * uses[0], uses.max(axis=0)
    forces = forces_at(scene.cases[0], x, program.stations.side, program.stations.rest)
    worst = int(np.argmax(equivalent))
    deflection = program.deflection(program.y_of(gap))
    found = _ring(scene, outer) if physics.ovalization else None
    return BushingCheck(
        mass=mass,
        constant_mass=constant_mass,
        along=_along(program, outer, equivalent),
        bore=g.bore,
        max_outer=float(outer.max()),
        outer_mid=float(np.interp(0.5 * g.length, x, outer)),
        least_wall=0.5 * float(gap.min()),
        max_moment=float(forces.moment_total.max()),
        max_shear=float(forces.shear_total.max()),
        equivalent_stress_max=_finite(equivalent[worst]),
        worst_section=float(x[worst]),
        shear_stress_max=None if allowable_shear is None else _finite(allowable_shear * uses[1].max()),
        strength_utilisation=_finite(use.max()),
        deflection=_finite(deflection),
        ring=found,
        pressures=_pressures(program, outer) if physics.contact_pressure else None,
        warnings=_warnings(program, limits, gap, use, deflection, found),
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _along(program: BushingProgram, outer: Array, equivalent: Array) -> OutsideAlong:
    """Stations of the whole bushing, thinned to some four hundred, ends of panels first."""
    scene, x = program.scene, program.stations.x
    forces = forces_at(scene.cases[0], x, program.stations.side, program.stations.rest)
    table = np.stack([x, outer, forces.moment_total, forces.shear[0], equivalent])
    length, keep, last = scene.geometry.length, [], -math.inf
    edges = set(program.stations.left) | {float(x[-1])}
    jumps = {float(a) for a, b, c, d in zip(x[:-1], x[1:], outer[:-1], outer[1:], strict=True) if a == b and c != d}
    for i in range(x.size):
        fresh = i == 0 or x[i] > x[i - 1]
        if x[i] in jumps or (fresh and (x[i] - last >= length / 400.0 or (x[i] in edges and len(edges) < 100))):
            keep.append(i)
            last = x[i]
    if keep[-1] != x.size - 1:
        keep.append(x.size - 1)
    table = table[:, keep]
    if scene.symmetric:
        mirrored = table[:, ::-1].copy()
        mirrored[0] = length - mirrored[0]
        mirrored[3] = -mirrored[3]
        table = np.concatenate([table, mirrored[:, 1:]], axis=1)
    return OutsideAlong(*table)


def _ring(scene: BushingScene, outer: Array) -> RingResult:
    """The ring in the middle, and where the wall is thinnest, which ovals and stresses it most."""
    g, m = scene.geometry, scene.material

    def at(diameter: float) -> ovalization.Ring:
        return ovalization.ring(scene.force, diameter, g.length, g.bore / diameter, m.elastic_modulus, m.poisson)

    middle = float(outer[outer.size - 1 if scene.symmetric else outer.size // 2])
    thinnest = float(outer.min())
    least = g.bore / (1.0 - _LEAST_RING_WALL)
    own = at(max(middle, least, 1e-9))
    if thinnest < max(least, 1e-9):
        return RingResult(own.ovalization, None, own.stresses, None, own.model)
    stress = ovalization.greatest_stress(
        scene.force, thinnest, g.length, g.bore / thinnest, m.elastic_modulus, m.poisson
    )
    return RingResult(own.ovalization, at(thinnest).ovalization, own.stresses, stress, own.model)


def _pressures(program: BushingProgram, outer: Array) -> Pressures | None:
    """Load over projected area: P/int D dx in the rod, half of it in a boss, and the triangle's peak P x/(a^2 D) with x
    from the boss's own end; of the two bosses the greater ones."""
    scene, g = program.scene, program.scene.geometry
    side, x = program.stations.side, program.stations.x
    weight = program.share * program.stations.span
    begin, end, second = (g.places[k][0] for k in (1, 3, 4))
    rod = (side >= begin) & (side < end)
    bosses = [(side < g.boss_length * (1.0 - 1e-12), x)]
    if not scene.symmetric:
        bosses.append((side >= second, g.length - x))
    area = (2.0 if scene.symmetric else 1.0) * float(weight[rod] @ outer[rod])
    bearing = min(float(weight[boss] @ outer[boss]) for boss, _ in bosses)
    if area <= 0.0 or bearing <= 0.0:
        return None
    density = max(
        float(np.max(np.divide(along, outer, out=np.zeros_like(x), where=boss & (outer > 0.0))))
        for boss, along in bosses
    )
    return Pressures(scene.force / area, 0.5 * scene.force / bearing, scene.force / g.boss_length**2 * density)


def _warnings(
    program: BushingProgram, limits: Limits, gap: Array, use: Array, deflection: float, found: RingResult | None
) -> tuple[str, ...]:
    said, scene, x = [], program.scene, program.stations.x
    over = use > 1.0 + 1e-9
    if over.any():
        said.append(f"the strength is exceeded {span(x[over])}")
    if 0.5 * gap.min() < limits.min_wall * (1.0 - 1e-9):
        said.append(
            f"the wall is {0.5e3 * gap.min():.4g} mm at its thinnest, not the {limits.min_wall * 1e3:.4g} asked"
        )
    if limits.max_deflection is not None and deflection > limits.max_deflection * (1.0 + 1e-9):
        said.append(f"the deflection of {deflection * 1e6:.4g} um exceeds its limit")
    if found is None or scene.force == 0.0:
        return tuple(said)
    if limits.max_ovalization is not None and (
        found.ovalization_max is None or found.ovalization_max > limits.max_ovalization * (1.0 + 1e-9)
    ):
        said.append("the ovalization exceeds its limit")
    allowable = limits.max_ring_stress or scene.material.allowable_stress
    if found.stress_max is None or found.stress_max > allowable * (1.0 + 1e-9):
        said.append(f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where the wall is thinnest")
    return tuple(said)
