"""Capacity of the solid pin: maximum force, where it fails, the outer diameter required; diagnosis of infeasible
problems."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.outcome import Shortfall
from solvers.pin.effects import Physics
from solvers.pin.load.macaulay import LIMIT_TOLERANCE, ROUNDING
from solvers.pin.load.piston_pin import deflection_integrals
from solvers.pin.optimum.design_variable import DesignVariable, design_variable_of
from solvers.pin.optimum.program import constraints_at
from solvers.pin.ring import ovalization
from solvers.pin.scene import BushingGeometry, Limits, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import cowper
from solvers.pin.section.strength import utilisations, where_over
from solvers.pin.stations.between_nodes import maximum_excess
from solvers.pin.stations.lobatto_panels import initial_stations
from solvers.verdict import per_cent

_MAX_PASSES = 60
_PLACES = 2001
"""Positions in which the span of failure is sought."""
_VIOLATED = 1.0 + 0.5 * LIMIT_TOLERANCE
"""Ratio to a limit above which it counts as violated. A design tolerates twice the excess, so that no rounding leaves
an infeasible one without a diagnosis."""
_ROOM, _DIAMETER_TOLERANCE = 1e-9, 1e-13
"""Extension of the bracket of log D at both ends, and tolerance of the root."""


@dataclass(frozen=True)
class WeakSpan:
    """Range [m] in which even the solid section fails, and its maximum utilisation."""

    begin: float
    end: float
    utilisation: float


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


def greatest_along(scene: Scene, values: Callable[[Array, Array], Array], tolerance: float = ROUNDING) -> float:
    """Return the maximum of utilisations or minimum walls of one section along the part, NaN if one of them is.

    ``values`` evaluates them at stations and their sides. Under the part's own load the maximum is at an end of the gap
    or in the middle (``solvers.pin.closed_form.kernel``); further cases are resolved to the relative ``tolerance``.
    """
    if not scene.further_cases:
        g = scene.geometry
        boss, rod, middle = g.boss_length, g.boss_length + g.gap, 0.5 * g.length
        return float(values(np.array([boss, rod, middle]), np.array([boss, boss, middle])).max())
    stations = initial_stations(scene)
    for _ in range(_MAX_PASSES):
        found = values(stations.x, stations.side)
        between = maximum_excess(stations.x, found[None]) > tolerance
        if not between.any():
            break
        stations = stations.halved(between)
    return float(found.max())


def greatest_utilisation(scene: Scene, criterion: Criterion) -> float:
    """Return the maximum utilisation of the solid pin; feasible if it is at most 1."""

    def of_solid(x: Array, side: Array) -> Array:
        return utilisations(constraints_at(scene, criterion, x, side), np.zeros_like(x), np.ones_like(x)).max(axis=0)

    return greatest_along(scene, of_solid)


def span_over(
    scene: Scene, criterion: Criterion, wall_at: Callable[[Array], Array], places: tuple[float, ...] = ()
) -> tuple[float, float] | None:
    """Return the first and last position [m] of the first half where the walls are too weak; None: nowhere.

    ``wall_at`` evaluates the walls, which may jump at ``places``; the strength is sampled in 2,001 positions.
    """
    g = scene.geometry
    ends = g.boss_length, g.boss_length + g.gap, *places
    edges = np.unique(np.append(np.linspace(0.0, 0.5 * g.length, _PLACES), ends))
    x, side = np.repeat(edges, 2)[1:-1], np.repeat(0.5 * (edges[:-1] + edges[1:]), 2)
    found = design_variable_of(scene).utilisations(constraints_at(scene, criterion, x, side), wall_at(side))
    return where_over(x, found)


def force_limit(scene: Scene, criterion: Criterion) -> float:
    """Return the maximum force [N] that the solid pin carries; further cases scale in proportion."""
    probe = scene if scene.force > 0 else replace(scene, force=1.0, further_cases=())
    return probe.force / greatest_utilisation(probe, criterion)


def weak_span(scene: Scene, criterion: Criterion) -> WeakSpan | None:
    """Return the range along the pin in which the solid section fails; None if it fails nowhere."""
    worst, g = greatest_utilisation(scene, criterion), scene.geometry
    if worst <= _VIOLATED:
        return None
    begin, _ = span_over(scene, criterion, np.ones_like) or (0.5 * g.length, None)
    return WeakSpan(begin, g.length - begin, worst)


def least_outer_diameter(scene: Scene, criterion: Criterion) -> float:
    """Return the least outer diameter [m] whose solid pin carries the loads, all else equal; 0 without a load."""
    from scipy.optimize import brentq

    def worst(diameter: float) -> float:
        return greatest_utilisation(
            replace(scene, geometry=replace(scene.geometry, outer_diameter=diameter)), criterion
        )

    own = scene.geometry.outer_diameter
    now = worst(own)
    if now == 0.0:
        return 0.0
    # The utilisation decreases at least as 1/D, at most as 1/D^3.
    least, most = sorted((math.log(now) / 3.0, math.log(now)))
    found = brentq(lambda x: math.log(worst(own * math.exp(x))), least - _ROOM, most + _ROOM, xtol=_DIAMETER_TOLERANCE)
    return own * math.exp(found + _DIAMETER_TOLERANCE)


def own_deflection(scene: Scene, physics: Physics, variable: DesignVariable) -> tuple[float, float]:
    """Return the deflection [m] of a part with f = 1 and g = 1 throughout, by bending and by shear."""
    g, (bending_stiffness, shear_stiffness) = scene.geometry, variable.stiffness(scene)
    bend, shear = deflection_integrals(scene.force, g.boss_length, g.small_end_length, g.gap)
    return bend / bending_stiffness, shear / shear_stiffness if physics.shear_deflection else 0.0


def _at_least(diameter: float) -> str:
    """Format a diameter in millimetres to six digits, rounded up so that the printed value is sufficient."""
    millimetres = 1e3 * diameter
    digit = 10.0 ** (math.floor(math.log10(millimetres)) - 5)
    return f"{math.ceil(millimetres / digit) * digit:.6g}"


def _where(weak: WeakSpan) -> str:
    begin, end = (f"{1e3 * x:.4g}" for x in (weak.begin, weak.end))
    return f"at x = {begin} mm" if begin == end else f"for {begin} < x < {end} mm"


def diagnose(scene: Scene, limits: Limits, criterion: Criterion, physics: Physics) -> Diagnosis:
    """Return every requirement that even the solid section violates."""
    g, m, found, diameters = scene.geometry, scene.material, [], [0.0]
    # The ovalization of a solid bar is independent of its diameter; only a longer one reduces it. A bushing can violate
    # nothing else.
    limit, bar = limits.max_ovalization, (g.length, 0.0, m.elastic_modulus, m.poisson)
    solid = ovalization.ring(scene.force, 1.0, *bar).ovalization
    if isinstance(g, BushingGeometry):
        short = Shortfall("max_ovalization", limit, solid, "a longer or stiffer bushing, or less force")
        return Diagnosis((short,), None, None, None)
    too_soft_a_ring = limit is not None and solid > limit * _VIOLATED
    greatest, weak = force_limit(scene, criterion), weak_span(scene, criterion)
    if weak is not None:
        diameters.append(least_outer_diameter(scene, criterion))
        why = (
            f"the solid section is too weak {_where(weak)}, by {per_cent(weak.utilisation - 1.0)} %; an outer "
            f"diameter of at least {_at_least(diameters[-1])} mm would do"
        )
        found.append(Shortfall("force", scene.force, greatest, why))
    limit, (bent, sheared) = limits.max_deflection, own_deflection(scene, physics, design_variable_of(scene))
    sheared *= cowper(m.poisson).a
    if limit is not None and bent + sheared > limit * _VIOLATED:
        # bent (D0/D)^4 + sheared (D0/D)^2 = limit
        ratio = math.sqrt((sheared + math.sqrt(sheared * sheared + 4.0 * limit * bent)) / (2.0 * limit))
        diameters.append(g.outer_diameter * ratio)
        why = (
            f"the solid pin deflects more; an outer diameter of at least {_at_least(diameters[-1])} mm would do, or "
            "shorter bosses and gaps"
        )
        found.append(Shortfall("max_deflection", limit, bent + sheared, why))
    if too_soft_a_ring:
        why = "a longer or stiffer pin, or less force"
        found.append(Shortfall("max_ovalization", limits.max_ovalization, solid, why))
    limit, stress = limits.max_ring_stress, ovalization.greatest_stress(scene.force, g.outer_diameter, *bar)
    if limit is not None and stress > limit * _VIOLATED:
        # The stress of geometrically similar rings is proportional to 1/D.
        diameters.append(g.outer_diameter * stress / limit)
        why = f"an outer diameter of at least {_at_least(diameters[-1])} mm would do, or a longer pin"
        found.append(Shortfall("max_ring_stress", limit, stress, why))
    return Diagnosis(tuple(found), weak, greatest, 0.0 if too_soft_a_ring else max(diameters))
