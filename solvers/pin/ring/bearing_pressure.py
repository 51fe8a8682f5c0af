"""Bearing pressures in the rod's small end and the piston's bosses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.scene import Geometry, Scene
from solvers.pin.stations.lobatto_panels import Stations


@dataclass(frozen=True)
class Pressures:
    """Mean pressure in the small end, mean and peak pressure in the bosses [Pa]."""

    small_end: float
    boss_mean: float
    boss_peak: float


def pressures_of_pin(scene: Scene) -> Pressures:
    """Return the pressures of a pin: P/(D b), P/(2 a D), and the peak P/(a D) of the triangular load."""
    g = scene.geometry
    boss = scene.force / (2.0 * g.boss_length * g.outer_diameter)
    return Pressures(scene.force / (g.outer_diameter * g.small_end_length), boss, 2.0 * boss)


def bearing_pressures(scene: Scene, stations: Stations, outer: Array) -> Pressures | None:
    """Return load over projected area: P/int D dx in the small end, half of it in a boss, and the peak P x/(a^2 D).

    x is measured from the boss's outer end; of the two bosses the larger values apply. ``outer``: D [m] at the
    stations, (n,). None if there is no bearing surface.
    """
    g = scene.geometry
    if isinstance(g, Geometry):
        return pressures_of_pin(scene)
    side, x = stations.side, np.minimum(stations.x, g.length - stations.x)
    rod, middle = g.boss_length + g.gap, 0.5 * g.length
    length, inside = stations.weight * stations.span * outer, np.minimum(side, g.length - side)
    bosses = [(inside < g.boss_length) & half for half in (side < middle, side > middle) if half.any()]
    area, bearing = 2.0 / len(bosses) * length[inside > rod].sum(), min(length[boss].sum() for boss in bosses)
    if area <= 0.0 or bearing <= 0.0:
        return None
    density = np.max(np.divide(x, outer, out=np.zeros_like(x), where=(inside < g.boss_length) & (outer > 0.0)))
    return Pressures(
        scene.force / float(area), 0.5 * scene.force / float(bearing), scene.force / g.boss_length**2 * float(density)
    )
