"""The lightest uniform-bore pin under the rod force, in closed form."""

from __future__ import annotations

import sys

import numpy as np

from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.optimum.discretised import sought_in
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import ShearFlexibility, cowper
from solvers.pin.section.variables import solidity_of
from solvers.pin.uniform import deflection_parts


def forces_at_ends(scene: Scene) -> InternalForces:
    """Return the resultants at the candidate critical sections: boss edge, small-end edge, middle."""
    g, p = scene.geometry, scene.force
    edge = p * g.boss_length / 6.0
    rod = edge + 0.5 * p * g.gap
    moment, shear = np.zeros((2, 3)), np.zeros((2, 3))
    moment[0] = edge, rod, rod + 0.125 * p * g.small_end_length
    shear[0] = 0.5 * p, 0.5 * p, 0.0
    return InternalForces(moment, shear, 0.0, 0.0)


def lightest_share(scene: Scene, limits: Limits, criterion: Criterion, shears: bool) -> float | None:
    """Return the relative volume of the lightest uniform-bore pin under strength, wall, ring and deflection limits.

    ``shears`` includes shear deflection. None if even the solid pin violates a limit. Raises InvalidInput for a
    minimum wall above the radius.
    """
    sought = sought_in(scene)
    constraints = sought.constraints(scene, criterion, [forces_at_ends(scene)])
    wall = float(sought.least_walls(constraints, sought.floor(scene, limits), 3).max())
    if np.isnan(wall):
        return None
    least = float(solidity_of(np.float64(wall)))
    if limits.max_deflection is None or scene.force == 0.0:
        return least
    return _stiff_enough(deflection_parts(scene), cowper(scene.material.poisson), limits.max_deflection, least, shears)


def _stiff_enough(
    parts: tuple[float, float], law: ShearFlexibility, limit: float, least: float, shears: bool
) -> float | None:
    """Return the least u >= ``least`` with B/v + S phi <= limit."""
    from scipy.optimize import brentq

    bend, shear = parts[0], parts[1] if shears else 0.0

    def beyond(u: float) -> float:
        c = 2.0 - u
        return (bend / (u * c) + shear * (law.a / u + law.b * (1.0 - u) / (u * c * c))) / limit - 1.0

    if least > 0.0 and beyond(least) <= 0.0:
        return least
    if beyond(1.0) > 0.0:
        return None
    low = least if least > 0.0 else 1e-3
    while beyond(low) <= 0.0:
        low *= 1e-3
    return float(brentq(beyond, low, 1.0, xtol=1e-300, rtol=4.0 * sys.float_info.epsilon))
