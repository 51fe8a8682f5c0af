"""Sensitivities to the active constraints: the Karush-Kuhn-Tucker multipliers of the optimum.

In logarithms a multiplier is the sensitivity itself: the change of ln objective per unit change of ln limit.
Multipliers >= 0 are computed by nonnegative least squares over all equalities (C. L. Lawson, R. J. Hanson, Solving
Least Squares Problems, 1974).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.outcome import ActiveConstraint
from solvers.rod import rows
from solvers.rod.constraints import CONSTRAINTS, Limits
from solvers.rod.problem import Bounds, Objective
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions

Array = NDArray[np.float64]

ACTIVE = 1e-6
_NEGLIGIBLE = 1e-6


@dataclass(frozen=True)
class Stationarity:
    """First-order conditions at a strip.

    active     constraints with d ln objective/d ln bound
    residual   the part of the objective's gradient not balanced by multipliers, shape (3,)
    slope      the maximum component of the objective's gradient, or 1
    weights    those of the Lagrangian in all rows
    tangent    orthonormal basis of the directions tangent to all active constraints, shape (directions, 3)
    """

    active: tuple[ActiveConstraint, ...]
    residual: Array
    slope: float
    weights: Array
    tangent: Array

    @property
    def kkt_residual(self) -> float:
        """Maximum unbalanced gradient component, relative to the objective's gradient."""
        return float(np.max(np.abs(self.residual))) / self.slope


@dataclass
class _Active:
    """Active rows and bounds: names, signs, gradients (b, h, l, share of the maximum), row or -1."""

    names: list[str] = field(default_factory=list)
    signs: list[float] = field(default_factory=list)
    columns: list[Array] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)

    def add(self, name: str, sign: float, gradient: Array, row: int = -1, share: float = 0.0) -> None:
        self.names.append(name)
        self.signs.append(sign)
        self.columns.append(np.append(gradient, share))
        self.rows.append(row)


def stationarity(
    values: Array, slopes: Array, layout: Layout, objective: Objective, limits: Limits, bounds: Bounds, sizes: Bounds,
    d: Dimensions, within: float = ACTIVE,
) -> Stationarity:  # fmt: skip
    """First-order conditions of the rows at a strip; a row within ``within`` of its limit is active.

    ``sizes`` are the bounds restricted to available sizes: a dimension that is free in ``bounds`` but fixed there is
    named ``h_size`` and so on, with the sensitivity to the size itself.
    """
    active = _Active()
    for constraint in CONSTRAINTS:
        if constraint.row not in limits:
            continue
        sign, limit = (-1.0 if constraint.least else 1.0), limits[constraint.row]
        both = (rows.STABILITY, rows.SIDEWAYS) if constraint.row == rows.STABILITY else layout.parts(constraint.row)
        for row in both:
            if abs(values[row] - limit) < within:
                active.add(constraint.name, sign, slopes[row], row)
    for index, name in enumerate(("b", "h", "l")):
        value, (low, high) = getattr(d, name), getattr(bounds, name)
        unit = np.eye(3)[index]
        if low < high and len(set(getattr(sizes, name))) == 1:
            active.add(f"{name}_size", -1.0, -unit)
            active.add(f"{name}_size", 1.0, unit)
            continue
        for side, bound, sign in (("lower", low, -1.0), ("upper", high, 1.0)):
            if abs(math.log(value / bound)) < ACTIVE:
                active.add(f"{name}_{side}", sign, sign * unit)
    weights, target = np.zeros(layout.size), np.zeros(4)
    wanted = dict(objective.weights)
    top = next((row for row in wanted if len(layout.parts(row)) > 1), None)
    if top is not None:
        # A maximum of several parts: the weights of the governing parts add up to its weight.
        target[3] = wanted.pop(top)
        for row in layout.parts(top):
            if values[top] - values[row] < within:
                active.add("", 0.0, slopes[row], row, 1.0)
    for row, weight in wanted.items():
        weights[row] += weight
        target[:3] -= weight * slopes[row]
    slope = float(np.max(np.abs(target[:3]))) or 1.0
    if not active.columns:
        return Stationarity((), target[:3], slope, weights, np.eye(3))
    from scipy.optimize import nnls

    found, _ = nnls(np.array(active.columns).T, target)
    residual = target - np.array(active.columns).T @ found
    totals: dict[str, float] = {}
    for name, sign, multiplier, row in zip(active.names, active.signs, found, active.rows, strict=True):
        if row >= 0:
            weights[row] += multiplier
        if name:
            # Relaxing a limit by d ln changes ln cost by -multiplier; a minimum safety is relaxed downward.
            totals[name] = totals.get(name, 0.0) - objective.sign * sign * multiplier
    told = tuple(ActiveConstraint(name, float(value)) for name, value in totals.items() if abs(value) > _NEGLIGIBLE)
    held = [column for column, share in zip(active.columns, found, strict=True) if share > _NEGLIGIBLE]
    return Stationarity(told, residual[:3], slope, weights, _tangent(held))


def _tangent(columns: list[Array]) -> Array:
    """Directions in which none of these changes; the parts of a maximum may change equally."""
    matrix = np.array(columns).reshape(-1, 4)
    # With parts, the last unknown is the maximum itself, which all of them follow.
    matrix = matrix * np.array([1.0, 1.0, 1.0, -1.0]) if matrix[:, 3].any() else matrix[:, :3]
    if not matrix.size:
        return np.eye(3)
    _, singular, directions = np.linalg.svd(matrix)
    free = directions[int(np.sum(singular > 1e-9 * singular[0])) :, :3]
    norms = np.linalg.norm(free, axis=1)
    return free[norms > 1e-6] / norms[norms > 1e-6, None]
