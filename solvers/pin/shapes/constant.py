"""Uniform diameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from solvers.pin.optimum.discretised import assemble
from solvers.pin.optimum.dual_bound import least_walls_bound
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import Segments, weigh_segments
from solvers.pin.optimum.program import Program, Weighed, refined
from solvers.pin.stations.between_nodes import risen

_MAX_PASSES = 40
CONSTANT_TOLERANCE = 0.1
"""Relative error of the lightest uniform diameter's mass, as a fraction of the accuracy."""


def _one_wall(program: Program) -> Weighed | None:
    """Return the least uniform u; None if even the solid section is too soft."""
    least = np.array([program.lower.max()])
    if program.limit is None:
        return Weighed(least, 0.0, 0)
    p, bend, shear = program, program.share @ program.bending, program.share @ program.shear
    whole = Segments(np.ones(1), np.array([bend]), np.array([shear]), p.limit, p.sought.kappa, p.law, 1)
    return weigh_segments(whole, least, False)


@dataclass(frozen=True)
class Constant:
    """A uniform bore or outer diameter."""

    name: str = "constant"

    def find(self, program: Program, gap: float) -> Found | None:
        """See ``solvers.pin.optimum.found``."""
        sought, least, weighed = program.sought, program.lower.max(), _one_wall(program)
        if weighed is None:
            return None
        u = float(weighed.solidity[0])
        if weighed.multiplier == 0.0:
            proof = partial(least_walls_bound, program, np.full_like(program.lower, least))
        else:
            # With a single unknown the proof is direct: a wall thinner by 1e-12 violates the deflection limit.
            proof = partial(float, u * (1.0 - 1e-12))
        length, size = program.scene.geometry.length, float(sought.sizes(sought.wall_of(weighed.solidity))[0])
        return Found(
            np.full_like(program.lower, u), u, proof, "one unknown", {"rounds": weighed.rounds},
            corners=((0.0, size), (length, size)),
            doubt=risen(program.stations, program.lower[None]) * (u if weighed.multiplier == 0.0 else 0.0),
        )  # fmt: skip


def lightest_constant_mass(program: Program, accuracy: float) -> float | None:
    """Return the mass [kg] of the lightest uniform diameter, to CONSTANT_TOLERANCE of the accuracy; None if infeasible.

    Panels that may hold the critical section between stations are refined.
    """
    for _ in range(_MAX_PASSES):
        found = _one_wall(program) if np.isfinite(program.lower).all() else None
        if found is None:
            return None
        doubt = risen(program.stations, program.lower[None]) / (CONSTANT_TOLERANCE * accuracy)
        if found.multiplier > 0.0 or not (doubt > 1.0).any():
            break
        stations = refined(program, doubt, program.lower)
        program = assemble(program.scene, program.limits, program.criterion, program.physics, stations, program.law)
    return program.mass_unit * float(found.solidity[0])
