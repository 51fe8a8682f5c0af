"""Discretisation of a scene and its limits into a program at stations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.load.piston_pin import weigh_deflection
from solvers.pin.optimum.program import Program
from solvers.pin.optimum.sought import sought_in
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import ShearFlexibility, cowper
from solvers.pin.section.strength import StrengthConstraint, strength_constraints
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]


def constraints_at(
    scene: Scene, criterion: Criterion, x: Array, side: Array, rest: Array | float = 0.0
) -> tuple[StrengthConstraint, ...]:
    """Return the strength constraints of all load cases at stations; ``side`` and ``rest`` as in ``forces_at``."""
    forces = [forces_at(case, x, side, rest) for case in scene.cases]
    return strength_constraints(criterion, forces, sought_in(scene).unit_diameter, scene.material)


def least_walls_at(scene: Scene, criterion: Criterion, floor: float, x: Array) -> Array:
    """Return the minimum walls at positions x of the first half; in a symmetric design they satisfy both halves."""
    sought = sought_in(scene)
    places = (x,) if scene.symmetric else (x, scene.geometry.length - x)
    walls = [sought.least_walls(constraints_at(scene, criterion, at, at), floor, at.size) for at in places]
    return walls[0] if scene.symmetric else np.maximum(*walls)


def assemble(
    scene: Scene,
    limits: Limits,
    criterion: Criterion,
    physics: Physics,
    stations: Stations,
    law: ShearFlexibility | None = None,
) -> Program:
    """Assemble the program at these stations; ``lower`` is NaN where even the solid section fails.

    ``law`` is the shear flexibility, Cowper's by default.
    """
    length, sought = scene.geometry.length, sought_in(scene)
    forces = [forces_at(case, stations.x, stations.side, stations.rest) for case in scene.cases]
    constraints = strength_constraints(criterion, forces, sought.unit_diameter, scene.material)
    floor = sought.floor(scene, limits)
    walls = sought.least_walls(constraints, floor, stations.x.size)
    sought = sought.fitted(walls, length)
    bending, shear = np.empty_like(stations.x), np.zeros_like(stations.x)
    stiff, stiff_in_shear = sought.stiffness(scene)
    r = scene.reference
    weigh_deflection(
        stations.x, stations.rest, stations.side, r.left, r.right, r.rest, forces[0].moment[0], forces[0].shear[0],
        length, stiff, stiff_in_shear if physics.shear_deflection else np.inf, bending, shear,
    )  # fmt: skip
    anchor = stations.x.size if scene.symmetric else int(np.searchsorted(stations.side, 0.5 * length, side="left"))
    return Program(
        scene, limits, criterion, physics, stations, sought, forces[0], constraints, floor, sought.solidity_of(walls),
        bending, shear, law or cowper(scene.material.poisson), limits.max_deflection, anchor,
    )  # fmt: skip
