"""Discretisation of a scene and its limits into a program at stations."""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.load.piston_pin import write_deflection_coefficients
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.program import Program
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.strength import StrengthConstraint, strength_constraints
from solvers.pin.stations.lobatto_panels import Stations


def constraints_at(
    scene: Scene, criterion: Criterion, x: Array, panel_start: Array, residual: Array | None = None
) -> tuple[StrengthConstraint, ...]:
    """Return the strength constraints of all load cases at stations (arguments as in ``forces_at``)."""
    forces = [forces_at(case, x, panel_start, residual) for case in scene.cases]
    return strength_constraints(criterion, forces, design_variable_of(scene).unit_diameter, scene.material)


def least_walls_at(scene: Scene, criterion: Criterion, floor: float, x: Array) -> Array:
    """Return the minimum walls at positions x of the first half; in a symmetric design they satisfy both halves."""
    variable = design_variable_of(scene)
    places = (x,) if scene.symmetric else (x, scene.geometry.length - x)
    walls = [variable.least_walls(constraints_at(scene, criterion, at, at), floor, at.size) for at in places]
    return walls[0] if scene.symmetric else np.maximum(*walls)


def assemble(
    scene: Scene,
    limits: Limits,
    criterion: Criterion,
    physics: Physics,
    stations: Stations,
) -> Program:
    """Assemble the program at these stations; ``lower`` is NaN where even the solid section fails."""
    length, variable = scene.geometry.length, design_variable_of(scene)
    forces = [forces_at(case, stations.x, stations.panel_start, stations.residual) for case in scene.cases]
    constraints = strength_constraints(criterion, forces, variable.unit_diameter, scene.material)
    floor = variable.floor(scene, limits)
    walls = variable.least_walls(constraints, floor, stations.x.size)
    variable = variable.rescaled(walls, length)
    bending, shear = np.empty_like(stations.x), np.zeros_like(stations.x)
    bending_stiffness, shear_stiffness = variable.stiffness(scene)
    r = scene.reference
    write_deflection_coefficients(
        stations.x, stations.residual, stations.panel_start, r.left, r.right, r.residual, forces[0].moment[0],
        forces[0].shear[0], length, bending_stiffness, shear_stiffness if physics.shear_deflection else np.inf,
        bending, shear,
    )  # fmt: skip
    middle_index = (
        stations.x.size if scene.symmetric else int(np.searchsorted(stations.panel_start, 0.5 * length, side="left"))
    )
    return Program(
        scene, limits, criterion, physics, stations, variable, forces[0], constraints, floor,
        variable.solidity_of(walls), bending, shear, limits.max_deflection,
        middle_index,
    )  # fmt: skip
