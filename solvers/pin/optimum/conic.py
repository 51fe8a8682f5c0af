"""The coupled problem under a slope limit: a cone program with an independent lower bound.

In u every term is convex but one: phi = (A + B/4)/u + (B/4)/(2-u) - (B/2)/(2-u)^2, whose last term is concave. It is
linearised at the previous solution, at first that on the former stations, where the tangent is an upper bound, and the
program is solved again: the iterates stay feasible, decrease monotonically and converge in a few rounds because the
curvature is small. The lower bound uses every station's convex envelope instead, so a gap remains for nearly solid
pins. All quantities are scaled, and the reciprocals are written as s_i <= u_i t_i with the weight inside the cone;
otherwise the interior-point method stalls.

The solver's status is not trusted: its solution is moved toward the solid pin until it satisfies every limit by our
own formulas, and the bound is computed from its multipliers by ``solvers.pin.optimum.dual_bound``.

Slope: |u_{i+1} - u_i| <= k_i (sqrt(1 - u_i) + sqrt(1 - u_{i+1})), k_i = s h_i/D, is |d_{i+1} - d_i| <= s h_i
exactly.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.dual_bound import Neighbours, coupled_bound
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import weigh
from solvers.pin.optimum.program import Program, rising
from solvers.pin.optimum.slope_limit import gentle

Array = NDArray[np.float64]
_MAX_ROUNDS = 12
_TOLERANCE, _TOLERANCE_FRACTION = 1e-12, 1e-5
"""Relative tolerance of the solver, and the same as a fraction of the requested gap if that is larger."""
_MIN_PROGRESS, _GAP_FRACTION = 1e-9, 1e-2
"""Stopping criteria: relative progress of the gap per round, and the same as a fraction of the requested gap."""


@dataclass(frozen=True)
class _Solution:
    """One solve: u, the multipliers of the deflection and between neighbours, and the solver's status."""

    solidity: Array
    multiplier: float
    between: Neighbours
    status: str


def _sum_of_reciprocals(denominator: Any, weight: Array, constraints: list[Any]) -> Any:
    """Return the sum of weight/denominator, with the weight inside the cone |(2 sqrt(weight), x - t)| <= x + t."""
    import cvxpy as cp

    if not weight.size:
        return 0.0
    t = cp.Variable(weight.size)
    constraints.append(cp.SOC(denominator + t, cp.vstack([2.0 * np.sqrt(weight), denominator - t])))
    return cp.sum(t)


def _solve(program: Program, low: Array, at: Array, drillable: bool, tolerance: float) -> _Solution | None:
    import cvxpy as cp

    share, law = program.share, program.law
    n = low.size
    u = cp.Variable(n)
    lowered = np.minimum(low, 1.0)
    constraints = [u >= lowered, u <= 1.0]
    bend, shear = share * program.bending / program.limit, share * program.shear / program.limit
    bends, shears = np.flatnonzero(bend > 0), np.flatnonzero(shear > 0)
    s, point = shear[shears], at[shears]
    drop, drop_slope = -0.5 * law.b * s / (2.0 - point) ** 2, -law.b * s / (2.0 - point) ** 3
    parts = [
        _sum_of_reciprocals(u[bends], 0.5 * bend[bends], constraints),
        _sum_of_reciprocals(2.0 - u[bends], 0.5 * bend[bends], constraints),
        _sum_of_reciprocals(u[shears], s * (law.a + 0.25 * law.b), constraints),
        _sum_of_reciprocals(2.0 - u[shears], s * 0.25 * law.b, constraints),
        float(drop.sum()) + drop_slope @ (u[shears] - point),
    ]
    deflection = sum(parts) <= 1.0
    constraints.append(deflection)
    rise, fall, reach = None, None, reaches(program)
    if program.limits.max_slope is not None:
        root = cp.Variable(n)
        constraints.append(cp.SOC(2.0 - u, cp.vstack([2.0 * root, u])))
        room = cp.multiply(reach, root[:-1] + root[1:])
        rise, fall = u[1:] - u[:-1] <= room, u[:-1] - u[1:] <= room
        constraints += [rise, fall]
    narrowing = []
    if drillable:
        middle = program.anchor
        narrowing.append((slice(0, middle - 1), u[1:middle] >= u[: middle - 1], -1.0))
        if middle < n:
            narrowing.append((slice(middle, n - 1), u[middle : n - 1] >= u[middle + 1 :], 1.0))
    constraints += [constraint for _, constraint, _ in narrowing]
    problem = cp.Problem(cp.Minimize(share @ u), constraints)
    try:
        with warnings.catch_warnings():
            # An inaccurate solution is assessed by the independent bound like any other.
            warnings.simplefilter("ignore")
            problem.solve(
                solver=cp.CLARABEL, tol_gap_abs=tolerance, tol_gap_rel=tolerance, tol_feas=tolerance, max_iter=200
            )
    except cp.SolverError:
        return None
    if u.value is None:
        return None
    up, down, order = np.zeros((3, n - 1))
    if rise is not None:
        up, down = (np.maximum(np.asarray(constraint.dual_value), 0.0) for constraint in (rise, fall))
    for part, constraint, sign in narrowing:
        # u non-decreasing: u_i - u_{i+1} <= 0, a flow from i + 1 to i; reversed beyond the middle.
        order[part] = sign * np.maximum(np.asarray(constraint.dual_value), 0.0)
    value = max(float(deflection.dual_value), 0.0)
    return _Solution(np.asarray(u.value), value, Neighbours(up, down, reach, order), str(problem.status))


def reaches(program: Program) -> Array:
    """Return k_i = s h_i/D between neighbouring stations, (n - 1,); 0 without a slope limit."""
    return (program.limits.max_slope or 0.0) * np.diff(program.stations.x) / program.scene.geometry.outer_diameter


def toward_solid(program: Program, u: Array, low: Array) -> Array | None:
    """Move u toward the solid pin by the least step that satisfies walls and deflection; None if none does.

    The step scales every bore by the same factor, which preserves monotonicity and slope limits.
    """

    def ok(part: float) -> bool:
        v = u + part * (1.0 - u)
        return bool(np.all(v >= low)) and program.deflection(v) <= program.limit

    if not ok(1.0):
        return None
    least, most = 0.0, 1.0
    if ok(0.0):
        return u
    while most - least > 1e-16 and least < 0.5 * (least + most) < most:
        part = 0.5 * (least + most)
        least, most = (least, part) if ok(part) else (part, most)
    return u + most * (1.0 - u)


def sloped(program: Program, low: Array, drillable: bool, gap: float) -> Found | None:
    """Find the lightest bore under a deflection limit, optionally with a slope limit and narrowing toward the
    middle."""
    solid = np.ones_like(low)
    if program.deflection(solid) > program.limit:
        return None
    if program.near is not None:
        at = np.clip(program.near, low, 1.0)
    else:
        weighed = weigh(program, low, drillable)
        at = low if weighed is None else gentle(program, weighed.solidity)
    found, bound, status, rounds = solid, 0.0, "", 0
    for rounds in range(1, _MAX_ROUNDS + 1):
        before = program.volume(found) - bound
        answer = _solve(program, low, at, drillable, max(_TOLERANCE, _TOLERANCE_FRACTION * gap))
        if answer is None:
            break
        status = answer.status
        shaped = np.clip(answer.solidity, low, 1.0)
        shaped = rising(shaped, program.anchor) if drillable else shaped
        feasible = toward_solid(program, gentle(program, shaped), low)
        if feasible is not None and program.volume(feasible) < program.volume(found):
            found = feasible
        bound = max(bound, coupled_bound(program, low, answer.multiplier, answer.between))
        if program.volume(found) - bound <= _GAP_FRACTION * gap * bound:
            break
        if rounds > 1 and before - (program.volume(found) - bound) <= max(_MIN_PROGRESS, _GAP_FRACTION * gap) * bound:
            break
        former, at = at, np.clip(answer.solidity, low, 1.0)
        # What linearisation adds to the volume is of second order in the distance from where it was made.
        if float(np.abs(at - former).max()) ** 2 <= _GAP_FRACTION * gap:
            break
    volume = program.volume(found)
    return Found(
        found, volume, partial(float, bound), "cone program (Clarabel), its multipliers checked by tangents",
        {"rounds": rounds, "solver_status": status or "none"}, doubt=program.stations.doubt(found),
    )  # fmt: skip
