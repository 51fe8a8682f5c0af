"""The best strip nearby by the full model's own slopes alone: a linear program in ln b, ln h, ln l.

The search's model knows many peaks, and which of them govern on the full model may be others than on its own. Where
tilted rows (``solvers.rod.optimum.full_model.tilt``) foretell what does not come, a straight line through the full
model's results still points downhill. Source: R. E. Griffith, R. A. Stewart, A nonlinear programming technique for the
optimization of continuous processing systems (1961).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.rod.check import RodCheck
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.tilt import Tilt, full_rows
from solvers.rod.optimum.peak_model import STRESS
from solvers.rod.problem import Bounds, Objective, Requirements
from solvers.rod.scene import Dimensions

_SIZES = {rows.TAU: (-1.0, -3.0, 0.0), rows.LENGTH: (0.0, 0.0, 1.0), rows.THICKNESS: (0.0, 1.0, 0.0)}
"""Rows that are sizes: their slopes hold everywhere."""


def downhill(
    objective: Objective, requirements: Requirements, guard: float, tilt: Tilt, full: RodCheck, box: Bounds
) -> tuple[Dimensions, float] | None:
    """The best strip within the box if every result went on as straight as at ``tilt.at``, with ln objective's change.

    ``full`` are the results there, ``guard`` by what share requirements are kept to the safe side; a strip short of one
    is led no further from it. None where no strip is better.
    """
    from scipy.optimize import linprog

    slopes = tilt.full.copy()
    for row, along in _SIZES.items():
        slopes[row] = along
    down = np.sum([weight * slopes[row] for row, weight in objective.weights], axis=0)
    which, room = _limited(requirements, guard, full)
    edges = np.log([box.b, box.h, box.l]) - tilt.at[:, None]
    found = linprog(down, A_ub=slopes[which] if which else None, b_ub=room if which else None, bounds=edges)
    if found.status != 0 or found.fun >= 0.0:
        return None
    at = np.exp(tilt.at + found.x)
    sizes = (min(max(x, low), high) for x, (low, high) in zip(at.tolist(), (box.b, box.h, box.l), strict=True))
    return Dimensions(*sizes), float(found.fun)


def _limited(r: Requirements, guard: float, full: RodCheck) -> tuple[list[int], list[float]]:
    """The rows that are limited, and by how much each may still rise."""
    values = full_rows(full)
    limits = (
        (rows.UTILISATION, r.min_fatigue_safety, -1.0),
        (rows.STABILITY, r.min_stability_safety, -1.0),
        (STRESS, r.min_yield_safety, -1.0),
        (rows.PRESSURE, r.max_contact_pressure, 1.0),
        (rows.POWER, r.max_friction_power, 1.0),
    )
    which, room = [], []
    for row, limit, sign in limits:
        if limit is not None and math.isfinite(values[row]):
            which.append(row)
            room.append(max(sign * math.log(limit) - guard - values[row], 0.0))
    return which, room
