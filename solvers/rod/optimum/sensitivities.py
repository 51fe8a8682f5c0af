"""Sensitivities to the active constraints: the Karush-Kuhn-Tucker multipliers of the optimum.

In logarithms a multiplier is the sensitivity itself: the change of ln objective per unit change of ln limit. The
multipliers, all >= 0, solve the stationarity conditions by nonnegative least squares (C. L. Lawson, R. J. Hanson,
Solving Least Squares Problems, 1974).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.outcome import ActiveConstraint
from solvers.rod import rows
from solvers.rod.constraints import CONSTRAINTS, Limits
from solvers.rod.objectives import Objective
from solvers.rod.optimum.sizes import Sizes
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions

ACTIVE = 1e-6
_NEGLIGIBLE = 1e-6


@dataclass(frozen=True)
class Stationarity:
    """First-order conditions at a strip.

    active     constraints with d ln objective/d ln bound
    residual   the part of the objective's gradient not balanced by multipliers, shape (3,)
    scale      the maximum component of the objective's gradient, or 1
    weights    coefficients of all rows in the Lagrangian
    tangent    orthonormal basis of the directions tangent to all active constraints, shape (directions, 3)
    """

    active: tuple[ActiveConstraint, ...]
    residual: Array
    scale: float
    weights: Array
    tangent: Array

    @property
    def kkt_residual(self) -> float:
        """Maximum unbalanced gradient component, relative to the objective's gradient."""
        return float(np.max(np.abs(self.residual))) / self.scale


class _Active(NamedTuple):
    """An active row or bound: the name and the sign of its limit (none if it is only part of the objective, a maximum),
    its gradient with respect to ln b, ln h, ln l, its row if it is one, and 1 for a part of the objective."""

    name: str
    sign: float
    gradient: Array
    row: int | None = None
    part: float = 0.0

    @property
    def column(self) -> Array:
        """The gradient and the share in the maximum, (4,)."""
        return np.append(self.gradient, self.part)


def stationarity(
    values: Array, jacobian: Array, layout: Layout, objective: Objective, limits: Limits, sizes: Sizes, d: Dimensions,
    tolerance: float = ACTIVE,
) -> Stationarity:  # fmt: skip
    """First-order conditions of the rows at a strip; rows within ``tolerance`` of their limits are active.

    A size that the bounds leave free, but not those available, is a constraint of its own, named ``h_size`` etc., with
    the sensitivity to the size itself.
    """
    active: list[_Active] = []
    for constraint in CONSTRAINTS:
        if constraint.row not in limits:
            continue
        sign, limit = (-1.0 if constraint.is_minimum else 1.0), limits[constraint.row]
        parts = (rows.STABILITY, rows.SIDEWAYS) if constraint.row == rows.STABILITY else layout.parts(constraint.row)
        for row in parts:
            if abs(values[row] - limit) < tolerance:
                active.append(_Active(constraint.name, sign, jacobian[row], row))
    available = sizes.around(d)
    for index, name in enumerate(("b", "h", "l")):
        value, (low, high) = getattr(d, name), getattr(sizes.bounds, name)
        unit = np.eye(3)[index]
        if low < high and len(set(getattr(available, name))) == 1:
            active += [_Active(f"{name}_size", sign, sign * unit) for sign in (-1.0, 1.0)]
            continue
        for side, bound, sign in (("lower", low, -1.0), ("upper", high, 1.0)):
            if abs(math.log(value / bound)) < ACTIVE:
                active.append(_Active(f"{name}_{side}", sign, sign * unit))
    weights, target = np.zeros(layout.size), np.zeros(4)
    objective_weights = dict(objective.weights)
    max_row = next((row for row in objective_weights if len(layout.parts(row)) > 1), None)
    if max_row is not None:
        # An objective that is a maximum of several parts: the multipliers of the governing parts sum to its weight.
        target[3] = objective_weights.pop(max_row)
        for row in layout.parts(max_row):
            if values[max_row] - values[row] < tolerance:
                active.append(_Active("", 0.0, jacobian[row], row, 1.0))
    for row, weight in objective_weights.items():
        weights[row] += weight
        target[:3] -= weight * jacobian[row]
    scale = float(np.max(np.abs(target[:3]))) or 1.0
    if not active:
        return Stationarity((), target[:3], scale, weights, np.eye(3))
    from scipy.optimize import nnls

    columns = np.array([one.column for one in active])
    multipliers, _ = nnls(columns.T, target)
    residual = target - columns.T @ multipliers
    totals: dict[str, float] = {}
    for one, multiplier in zip(active, multipliers, strict=True):
        if one.row is not None:
            weights[one.row] += multiplier
        if one.name:
            # Relaxing a limit by d ln changes ln cost by -multiplier; a minimum safety is relaxed downward.
            totals[one.name] = totals.get(one.name, 0.0) - objective.sign * one.sign * multiplier
    reported = tuple(ActiveConstraint(name, float(value)) for name, value in totals.items() if abs(value) > _NEGLIGIBLE)
    return Stationarity(reported, residual[:3], scale, weights, _tangent(columns[multipliers > _NEGLIGIBLE]))


def _tangent(columns: Array) -> Array:
    """Unit vectors tangent to constraints (constraints, 4), shape (directions, 3); parts of a maximum may change
    equally."""
    # With parts, the last unknown is the maximum itself: each part minus the maximum remains constant.
    matrix = columns * np.array([1.0, 1.0, 1.0, -1.0]) if columns[:, 3].any() else columns[:, :3]
    if not matrix.size:
        return np.eye(3)
    _, singular, directions = np.linalg.svd(matrix)
    free = directions[int(np.sum(singular > 1e-9 * singular[0])) :, :3]
    norms = np.linalg.norm(free, axis=1)
    return free[norms > 1e-6] / norms[norms > 1e-6, None]
