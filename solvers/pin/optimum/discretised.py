"""From a scene and its limits to a program at stations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.optimum.bore_sought import BoreSought
from solvers.pin.optimum.outside_sought import OutsideSought
from solvers.pin.optimum.program import Program
from solvers.pin.scene import BushingGeometry, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import ShearFlexibility, cowper
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]


def sought_in(scene: Scene) -> BoreSought | OutsideSought:
    """Which diameter is sought: that which the geometry does not give."""
    g = scene.geometry
    return OutsideSought(g.bore, g.bore) if isinstance(g, BushingGeometry) else BoreSought(g.outer_diameter)


def least_walls_at(scene: Scene, criterion: Criterion, floor: float, x: Array) -> Array:
    """The least walls at any places x of the first half, where the halves are alike."""
    sought = sought_in(scene)
    places = (x,) if scene.symmetric else (x, scene.geometry.length - x)
    walls = [sought.least_walls(sought.constraints(scene, criterion, at, at, 0.0), floor, at.size) for at in places]
    return walls[0] if scene.symmetric else np.maximum(*walls)


def assemble(
    scene: Scene,
    limits: Limits,
    criterion: Criterion,
    physics: Physics,
    stations: Stations,
    law: ShearFlexibility | None = None,
) -> Program:
    """The program at these stations; ``lower`` is NaN where even the solid section is too weak.

    ``law`` is how sections shear, Cowper's unless another is given.
    """
    length, sought = scene.geometry.length, sought_in(scene)
    constraints = sought.constraints(scene, criterion, stations.x, stations.side, stations.rest)
    floor = sought.floor(scene, limits)
    walls = sought.least_walls(constraints, floor, stations.x.size)
    sought = sought.fitted(walls, length)
    forces = forces_at(scene.cases[0], stations.x, stations.side, stations.rest)
    unit_moment, unit_shear = scene.reference.unit_load(stations.x, stations.rest)
    # A station on an end of the span lies inside only if its panel does.
    inside = (stations.side >= scene.reference.left) & (stations.side < scene.reference.right)
    bending, shear = sought.coefficients(forces.moment[0] * unit_moment, forces.shear[0] * unit_shear, scene)
    bending = np.where(inside, np.maximum(bending, 0.0), 0.0) * length
    shear = np.where(inside, np.maximum(shear, 0.0), 0.0) * length
    if not physics.shear_deflection:
        shear = np.zeros_like(shear)
    anchor = stations.x.size if scene.symmetric else int(np.searchsorted(stations.side, 0.5 * length, side="left"))
    return Program(
        scene, limits, criterion, physics, stations, sought, constraints, floor, sought.solidity_of(walls), bending,
        shear, law or cowper(scene.material.poisson), limits.max_deflection, anchor,
    )  # fmt: skip
