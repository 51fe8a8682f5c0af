"""Conditions of optimality on the full model, and the steps that they suggest."""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import Iterate
from solvers.rod.optimum.search.optimum import SecondOrder
from solvers.rod.optimum.sensitivities import Stationarity, stationarity
from solvers.rod.problem import Bounds

CURVATURE_STEP = 0.02
"""Step of the differences for curvatures, in ln b, ln h, ln l."""
_MAX_STEP = 0.1
"""Length of a step along negative curvature, in ln b, ln h, ln l."""


def first_order_conditions(context: Context, at: Iterate) -> Stationarity:
    """First-order optimality conditions of the full model at an iterate."""
    values, slopes = at.rows.values(at.x), at.rows.jacobian(at.x)
    tolerance = max(1e-6, 10.0 * context.task.margin)
    return stationarity(
        values, slopes, at.rows.layout, context.problem.objective, at.limits, context.sizes,
        at.dimensions, tolerance,
    )  # fmt: skip


def second_order(at: Iterate, conditions: Stationarity, bounds: Bounds) -> SecondOrder:
    """Newton's method along the directions that limits leave free.

    Curvatures are differences over ``CURVATURE_STEP``, large enough for the noise of time meshes to be negligible.
    """
    directions, slope = conditions.tangent, conditions.tangent @ conditions.residual
    if not len(directions):
        return SecondOrder(None, 0.0, ())
    lagrangian = conditions.weights
    centre = float(lagrangian @ at.rows.corrected_values(at.x))

    def second(direction: Array) -> float:
        ahead, behind = (at.rows.corrected_values(at.x + side * CURVATURE_STEP * direction) for side in (1.0, -1.0))
        return (float(lagrangian @ ahead) + float(lagrangian @ behind) - 2.0 * centre) / CURVATURE_STEP**2

    matrix = np.diag([second(direction) for direction in directions])
    for i in range(len(directions)):
        for j in range(i):
            mixed = second((directions[i] + directions[j]) / math.sqrt(2.0))
            matrix[i, j] = matrix[j, i] = mixed - 0.5 * (matrix[i, i] + matrix[j, j])
    curvatures, axes = np.linalg.eigh(matrix)
    # The residual is the negative gradient of the Lagrangian.
    descent = axes.T @ slope
    if curvatures[0] > 0.0:
        # A flat minimum may be far away; the search from the predicted point tests the quadratic model.
        step = (axes @ (descent / curvatures)) @ directions
        fraction = min(1.0, _max_step_fraction(at.x, step, bounds))
        predicted_gain = fraction * (1.0 - 0.5 * fraction) * float(descent @ (descent / curvatures))
        return SecondOrder(float(curvatures[0]), predicted_gain, (fraction * step,))
    steps = tuple(side * _MAX_STEP * axes[:, 0] @ directions for side in (1.0, -1.0))
    predicted_gain = abs(descent[0]) * _MAX_STEP - 0.5 * float(curvatures[0]) * _MAX_STEP**2
    return SecondOrder(float(curvatures[0]), predicted_gain, steps)


def _max_step_fraction(x: Array, step: Array, bounds: Bounds) -> float:
    """The largest fraction of a step that stays within the bounds."""
    lower, upper = bounds.logarithms.T
    room = np.where(step > 0.0, upper - x, lower - x)
    moving = np.abs(step) > 1e-12
    return max(float(np.min(room[moving] / step[moving], initial=math.inf)), 0.0)
