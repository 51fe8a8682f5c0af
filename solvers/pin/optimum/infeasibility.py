"""Diagnosis of infeasible problems: where the pin is too weak or too soft, and the outer diameter required."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.outcome import Shortfall
from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.optimum.capacity import WeakSpan, force_limit, least_outer_diameter, weak_span
from solvers.pin.optimum.discretised import assemble
from solvers.pin.ring import ovalization
from solvers.pin.scene import BushingGeometry, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import cowper
from solvers.pin.stations.opening import opening_stations


@dataclass(frozen=True)
class Diagnosis:
    """The violated requirements, where the solid section fails, its capacity [N], and the required outer diameter
    [m].

    The latter three are None for a bushing, whose outer diameter is sought.
    """

    shortfalls: tuple[Shortfall, ...]
    weak: WeakSpan | None
    force_limit: float | None
    least_outer_diameter: float | None


def _solid_deflection(scene: Scene, criterion: Criterion, physics: Physics) -> tuple[float, float]:
    """Return the deflection [m] of the solid pin by bending and, with Cowper's law, by shear."""
    program = assemble(scene, Limits(), criterion, physics, opening_stations(scene), cowper(scene.material.poisson))
    return float(program.share @ program.bending), program.law.a * float(program.share @ program.shear)


def _widened(bent: float, sheared: float, limit: float) -> float:
    """Return D/D0 at which the solid pin's deflection bent (D0/D)^4 + sheared (D0/D)^2 equals ``limit``."""
    return math.sqrt((sheared + math.sqrt(sheared * sheared + 4.0 * limit * bent)) / (2.0 * limit))


def _at_least(diameter: float) -> str:
    """Format a diameter in millimetres to six digits, rounded up so that the printed value is sufficient."""
    millimetres = 1e3 * diameter
    digit = 10.0 ** (math.floor(math.log10(millimetres)) - 5)
    return f"{math.ceil(millimetres / digit) * digit:.6g}"


def _where(weak: WeakSpan) -> str:
    begin, end = (f"{1e3 * x:.4g}" for x in (weak.begin, weak.end))
    return f"at x = {begin} mm" if begin == end else f"for {begin} < x < {end} mm"


def _too_soft_a_ring(scene: Scene, limits: Limits) -> Shortfall:
    """Return the only possible shortfall of a bushing: the ovalization of a solid bar is independent of its
    diameter."""
    length, m = scene.geometry.length, scene.material
    solid = ovalization.ring(scene.force, 1.0, length, 0.0, m.elastic_modulus, m.poisson).ovalization
    return Shortfall("max_ovalization", limits.max_ovalization, solid, "a longer or stiffer bushing, or less force")


def diagnose(scene: Scene, limits: Limits, criterion: Criterion, physics: Physics) -> Diagnosis:
    """Return every requirement that even the solid section violates."""
    if isinstance(scene.geometry, BushingGeometry):
        return Diagnosis((_too_soft_a_ring(scene, limits),), None, None, None)
    found: list[Shortfall] = []
    diameters = [0.0]
    greatest, weak = force_limit(scene, criterion), weak_span(scene, criterion)
    if weak is not None:
        diameters.append(least_outer_diameter(scene, criterion))
        found.append(
            Shortfall(
                "force",
                scene.force,
                greatest,
                f"the solid section is too weak {_where(weak)}, by {100.0 * (weak.utilisation - 1.0):.3g} %; an outer "
                f"diameter of at least {_at_least(diameters[-1])} mm would do",
            )
        )
    if limits.max_deflection is not None:
        bent, sheared = _solid_deflection(scene, criterion, physics)
        solid = bent + sheared
        if solid > limits.max_deflection:
            diameters.append(scene.geometry.outer_diameter * _widened(bent, sheared, limits.max_deflection))
            found.append(
                Shortfall(
                    "max_deflection",
                    limits.max_deflection,
                    solid,
                    "the solid pin deflects more; an outer diameter of at least "
                    f"{_at_least(diameters[-1])} mm would do, or shorter bosses and gaps",
                )
            )
    if limits.max_ovalization is not None:
        g, m = scene.geometry, scene.material
        # The ovalization of a solid pin is independent of its diameter; only a longer pin reduces it.
        solid = ovalization.ring(scene.force, g.outer_diameter, g.length, 0.0, m.elastic_modulus, m.poisson).ovalization
        if solid > limits.max_ovalization:
            found.append(
                Shortfall("max_ovalization", limits.max_ovalization, solid, "a longer or stiffer pin, or less force")
            )
    if limits.max_ring_stress is not None and scene.force > 0:
        g, m = scene.geometry, scene.material
        stress = ovalization.greatest_stress(scene.force, g.outer_diameter, g.length, 0.0, m.elastic_modulus, m.poisson)
        if stress > limits.max_ring_stress:
            # The stress of geometrically similar rings is proportional to 1/D.
            diameters.append(g.outer_diameter * stress / limits.max_ring_stress)
            found.append(
                Shortfall(
                    "max_ring_stress",
                    limits.max_ring_stress,
                    stress,
                    f"an outer diameter of at least {_at_least(diameters[-1])} mm would do, or a longer pin",
                )
            )
    return Diagnosis(tuple(found), weak, greatest, max(diameters))
