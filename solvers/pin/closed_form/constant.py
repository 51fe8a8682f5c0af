"""The lightest uniform-bore pin under the rod force, in closed form."""

from __future__ import annotations

import numpy as np

from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.load.piston_pin import deflection_integrals
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.lagrangian import Segments, minimum_segment_volume
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import cowper
from solvers.pin.section.strength import strength_constraints


def forces_at_critical_sections(scene: Scene) -> InternalForces:
    """Return the resultants at the candidate critical sections: boss edge, small-end edge, middle."""
    g, p = scene.geometry, scene.force
    edge = p * g.boss_length / 6.0
    rod = edge + 0.5 * p * g.gap
    moment, shear = np.zeros((2, 3)), np.zeros((2, 3))
    moment[0] = edge, rod, rod + 0.125 * p * g.small_end_length
    shear[0] = 0.5 * p, 0.5 * p, 0.0
    return InternalForces(moment, shear, 0.0, 0.0)


def lightest_relative_volume(scene: Scene, limits: Limits, criterion: Criterion, with_shear: bool) -> float | None:
    """Return the relative volume of the lightest uniform-bore pin under strength, wall, ring and deflection limits.

    ``with_shear``: whether to include shear deflection. None if even the solid pin violates a limit. Raises
    InvalidInput for a minimum wall above the radius.
    """
    variable = design_variable_of(scene)
    constraints = strength_constraints(
        criterion, [forces_at_critical_sections(scene)], variable.unit_diameter, scene.material
    )
    wall = float(variable.least_walls(constraints, variable.floor(scene, limits), 3).max())
    if np.isnan(wall):
        return None
    least = float(variable.solidity_of(np.float64(wall)))
    if limits.max_deflection is None or scene.force == 0.0:
        return least
    g, (bending_stiffness, shear_stiffness) = scene.geometry, variable.stiffness(scene)
    bend, shear = deflection_integrals(scene.force, g.boss_length, g.small_end_length, g.gap)
    sections = np.array([bend / bending_stiffness]), np.array([shear / shear_stiffness if with_shear else 0.0])
    whole = Segments(np.ones(1), *sections, limits.max_deflection, cowper(scene.material.poisson), 1)
    found = minimum_segment_volume(whole, np.array([least]), False)
    return None if found is None else float(found.solidity[0])
