"""One bore all along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.pin.optimum.discretised import Program, assemble, refined, walls_of
from solvers.pin.optimum.dual_bound import least_walls_bound
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import weigh
from solvers.pin.optimum.lumped import segments
from solvers.pin.section.variables import wall_of
from solvers.pin.stations.between_nodes import risen

_PASSES = 40


@dataclass(frozen=True)
class Constant:
    """One bore all along."""

    name: str = "constant"

    def find(self, program: Program, gap: float) -> Found | None:
        weighed = weigh(segments(program, np.array([program.lower.max()]), [slice(None)]), None, False)
        if weighed is None:
            return None
        u = float(weighed.solidity[0])
        bound = least_walls_bound(program, np.full_like(program.lower, program.lower.max()))
        if weighed.multiplier != 0.0:
            # One unknown: a bore wider by 1e-12 breaks the deflection limit.
            bound = u * (1.0 - 1e-12)
        wall = wall_of(u) if weighed.multiplier != 0.0 else walls_of(program, program.lower).max()
        length, bore = program.scene.geometry.length, program.scene.geometry.outer_diameter * float(1.0 - wall)
        return Found(
            np.full_like(program.lower, u), u, min(bound, u), "one unknown", {"rounds": weighed.rounds},
            corners=((0.0, bore), (length, bore)),
            doubt=risen(program.stations, program.lower[None]) * (u if weighed.multiplier == 0.0 else 0.0),
        )  # fmt: skip


def lightest_constant(program: Program, accuracy: float) -> Found | None:
    """The lightest pin of one bore, on the program's panels and halves of those that may hold its weakest section
    between stations; None where even the solid pin is too weak or too soft."""
    found = None
    for _ in range(_PASSES):
        found = None if np.isnan(program.lower).any() else Constant().find(program, accuracy)
        between = None if found is None else found.doubt > 0.1 * accuracy * found.volume
        if between is None or not between.any():
            break
        stations = refined(program, between)
        program = assemble(program.scene, program.limits, program.criterion, program.physics, stations, program.law)
    return found
