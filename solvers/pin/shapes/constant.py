"""Lightest uniform diameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from solvers.pin.optimum.discretised import assemble
from solvers.pin.optimum.dual_bound import least_walls_bound
from solvers.pin.optimum.lagrangian import Segments, minimum_segment_volume
from solvers.pin.optimum.program import DualSolution, Program, refined
from solvers.pin.optimum.shape_result import ShapeResult
from solvers.pin.stations.between_nodes import maximum_excess

_MAX_PASSES = 40
CONSTANT_TOLERANCE = 0.1
"""Relative tolerance of the lightest uniform diameter's mass, as a fraction of the accuracy."""


def _one_wall(program: Program) -> DualSolution | None:
    """Return the least uniform u; None if even the solid section is too soft."""
    least = np.array([program.lower.max()])
    if program.limit is None:
        return DualSolution(least, 0.0, 0)
    p, bend, shear = program, program.weight @ program.bending, program.weight @ program.shear
    whole = Segments(np.ones(1), np.array([bend]), np.array([shear]), p.limit, p.law, 1)
    return minimum_segment_volume(whole, least, False)


@dataclass(frozen=True)
class Constant:
    """A uniform bore or outer diameter."""

    name: str = "constant"

    def find(self, program: Program, gap: float) -> ShapeResult | None:
        """See ``solvers.pin.optimum.shape_result``."""
        variable, least, solution = program.variable, program.lower.max(), _one_wall(program)
        if solution is None:
            return None
        u = float(solution.solidity[0])
        if solution.multiplier == 0.0:
            proof = partial(least_walls_bound, program, np.full_like(program.lower, least))
        else:
            # With a single unknown the proof is direct: a wall thinner by 1e-12 violates the deflection limit.
            proof = partial(float, u * (1.0 - 1e-12))
        length, size = program.scene.geometry.length, float(variable.sizes(variable.wall_of(solution.solidity))[0])
        return ShapeResult(
            np.full_like(program.lower, u), u, proof, "one unknown", {"rounds": solution.iterations},
            corners=((0.0, size), (length, size)),
            error_estimate=maximum_excess(program.stations, program.lower[None])
            * (u if solution.multiplier == 0.0 else 0.0),
        )  # fmt: skip


def lightest_constant_mass(program: Program, accuracy: float) -> float | None:
    """Return the mass [kg] of the lightest uniform diameter, to CONSTANT_TOLERANCE of the accuracy; None if infeasible.

    Panels that may hold the critical section between stations are refined.
    """
    for _ in range(_MAX_PASSES):
        found = _one_wall(program) if np.isfinite(program.lower).all() else None
        if found is None:
            return None
        error_estimate = maximum_excess(program.stations, program.lower[None]) / (CONSTANT_TOLERANCE * accuracy)
        if found.multiplier > 0.0 or not (error_estimate > 1.0).any():
            break
        stations = refined(program, error_estimate, program.lower)
        program = assemble(program.scene, program.limits, program.criterion, program.physics, stations)
    return program.mass_unit * float(found.solidity[0])
