"""Lightest uniform diameter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from solvers.pin.effects import Physics
from solvers.pin.optimum.capacity import greatest_along, own_deflection
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.lagrangian import Segments, minimum_segment_volume
from solvers.pin.optimum.program import Program, ShapeResult, constraints_at
from solvers.pin.scene import Limits, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import cowper

CONSTANT_TOLERANCE = 0.1
"""Relative tolerance of the lightest uniform diameter under further load cases, as a fraction of the accuracy."""


def lightest_constant_mass(
    scene: Scene, limits: Limits, criterion: Criterion, physics: Physics, accuracy: float
) -> float | None:
    """Return the mass [kg] of the lightest uniform diameter under strength, wall, ring and deflection limits, to
    CONSTANT_TOLERANCE of the accuracy; None if infeasible."""
    variable = design_variable_of(scene)
    floor = variable.floor(scene, limits)
    wall = greatest_along(
        scene,
        lambda x, side: variable.least_walls(constraints_at(scene, criterion, x, side), floor, x.size),
        CONSTANT_TOLERANCE * accuracy,
    )
    if not math.isfinite(wall):
        return None
    variable = variable.rescaled(wall, scene.geometry.length)
    u = variable.solidity_of(np.array([wall]))
    if limits.max_deflection is not None and scene.force > 0.0:
        bend, shear = np.array(own_deflection(scene, physics, variable)) / limits.max_deflection
        law = cowper(scene.material.poisson, variable.kappa)
        found = minimum_segment_volume(Segments(np.ones(1), np.array([bend]), np.array([shear]), law), u, False)
        if found is None:
            return None
        u = found.solidity
    return variable.mass_unit(scene) * float(u[0])


@dataclass(frozen=True)
class Constant:
    """A uniform bore or outer diameter."""

    name: str = "constant"

    def find(self, program: Program, gap: float) -> ShapeResult | None:
        """See ``solvers.pin.optimum.program``."""
        scene, variable = program.scene, program.variable
        mass = lightest_constant_mass(scene, program.limits, program.criterion, program.physics, gap)
        if mass is None:
            return None
        u = np.full_like(program.lower, mass / program.mass_unit)
        length, size = scene.geometry.length, float(variable.sizes(variable.wall_of(u[:1]))[0])
        return ShapeResult(
            u, float(u[0]), partial(_bound, program, u), "one unknown", corners=((0.0, size), (length, size))
        )


def _bound(program: Program, u: np.ndarray) -> float:
    """Return a u slightly thinner than this uniform one, after verifying that it violates a limit."""
    for margin in (1e-12, 1e-10, 1e-8, 1e-6):
        thinner = u * (1.0 - margin)
        walls = program.variable.wall_of(thinner)
        too_soft = program.limit is not None and program.deflection(thinner) > program.limit
        if too_soft or walls[0] < program.floor or program.utilisations(walls).max() > 1.0:
            return float(thinner[0])
    return 0.0
