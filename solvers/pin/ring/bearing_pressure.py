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
    panel_start, x = stations.panel_start, stations.x
    length = stations.weight * stations.span
    begin, end, second = (g.places[k][0] for k in (1, 3, 4))
    rod = (panel_start >= begin) & (panel_start < end)
    bosses = [(panel_start < g.boss_length * (1.0 - 1e-12), x)]
    if not scene.symmetric:
        bosses.append((panel_start >= second, g.length - x))
    area = (2.0 if scene.symmetric else 1.0) * float(length[rod] @ outer[rod])
    bearing = min(float(length[boss] @ outer[boss]) for boss, _ in bosses)
    if area <= 0.0 or bearing <= 0.0:
        return None
    density = max(
        float(np.max(np.divide(along, outer, out=np.zeros_like(x), where=boss & (outer > 0.0))))
        for boss, along in bosses
    )
    return Pressures(scene.force / area, 0.5 * scene.force / bearing, scene.force / g.boss_length**2 * density)
