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
from solvers.pin.stations.initial_panels import initial_stations
from solvers.verdict import per_cent


@dataclass(frozen=True)
class Diagnosis:
    """The violated requirements, where the solid section fails, its capacity [N], and the required outer diameter
    [m].

    The latter three are None for a bushing, whose outer diameter is sought; the diameter is 0 where none suffices.
    """

    shortfalls: tuple[Shortfall, ...]
    weak: WeakSpan | None
    force_limit: float | None
    least_outer_diameter: float | None


def _solid_deflection(scene: Scene, criterion: Criterion, physics: Physics) -> tuple[float, float]:
    """Return the deflection [m] of the solid pin by bending and, with Cowper's law, by shear."""
    program = assemble(scene, Limits(), criterion, physics, initial_stations(scene))
    return float(program.weight @ program.bending), program.law.a * float(program.weight @ program.shear)


def _required_diameter_ratio(bent: float, sheared: float, limit: float) -> float:
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


def _ovalization_shortfall(scene: Scene, limits: Limits) -> Shortfall:
    """Return the only shortfall that a bushing can have: the ovalization of a solid bar of any diameter."""
    length, m = scene.geometry.length, scene.material
    solid = ovalization.ring(scene.force, 1.0, length, 0.0, m.elastic_modulus, m.poisson).ovalization
    return Shortfall("max_ovalization", limits.max_ovalization, solid, "a longer or stiffer bushing, or less force")


def diagnose(scene: Scene, limits: Limits, criterion: Criterion, physics: Physics) -> Diagnosis:
    """Return every requirement that even the solid section violates."""
    if isinstance(scene.geometry, BushingGeometry):
        return Diagnosis((_ovalization_shortfall(scene, limits),), None, None, None)
    g, m = scene.geometry, scene.material
    solid_ring = scene.force, g.outer_diameter, g.length, 0.0, m.elastic_modulus, m.poisson
    found: list[Shortfall] = []
    diameters = [0.0]

    greatest, weak = force_limit(scene, criterion), weak_span(scene, criterion)
    if weak is not None:
        diameters.append(least_outer_diameter(scene, criterion))
        why = (
            f"the solid section is too weak {_where(weak)}, by {per_cent(weak.utilisation - 1.0)} %; an outer "
            f"diameter of at least {_at_least(diameters[-1])} mm would do"
        )
        found.append(Shortfall("force", scene.force, greatest, why))
    limit = limits.max_deflection
    bent, sheared = (0.0, 0.0) if limit is None else _solid_deflection(scene, criterion, physics)
    if limit is not None and bent + sheared > limit:
        diameters.append(g.outer_diameter * _required_diameter_ratio(bent, sheared, limit))
        why = (
            f"the solid pin deflects more; an outer diameter of at least {_at_least(diameters[-1])} mm would do, or "
            "shorter bosses and gaps"
        )
        found.append(Shortfall("max_deflection", limit, bent + sheared, why))
    # The ovalization of a solid pin is independent of its diameter; only a longer pin reduces it.
    limit, solid = limits.max_ovalization, ovalization.ring(*solid_ring).ovalization
    too_soft_a_ring = limit is not None and solid > limit
    if too_soft_a_ring:
        found.append(Shortfall("max_ovalization", limit, solid, "a longer or stiffer pin, or less force"))
    limit, stress = limits.max_ring_stress, ovalization.greatest_stress(*solid_ring)
    if limit is not None and stress > limit:
        # The stress of geometrically similar rings is proportional to 1/D.
        diameters.append(g.outer_diameter * stress / limit)
        why = f"an outer diameter of at least {_at_least(diameters[-1])} mm would do, or a longer pin"
        found.append(Shortfall("max_ring_stress", limit, stress, why))
    return Diagnosis(tuple(found), weak, greatest, 0.0 if too_soft_a_ring else max(diameters))
