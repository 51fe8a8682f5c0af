"""Where a slope limit ties stations together: the same program as a cone program, with a bound of our own.

In u every part is convex but one: phi = (A + B/4)/u + (B/4)/(2-u) - (B/2)/(2-u)^2, whose last term is concave. It is
replaced by its tangent at the last answer, which is never below it, and the program is solved again: the answers stay
feasible, fall, and settle in a few rounds, since that term bends little. The bound takes every station's convex
envelope instead, so that nearly solid pins keep a gap. Everything is divided by its own size, and the reciprocals
stand as s_i <= u_i t_i with the weight inside the cone, without which the interior point stops short.

The solver's word is not taken: its answer is moved toward the solid pin until it keeps every limit by our own formulas,
and the bound comes from its multipliers through ``solvers.pin.optimum.dual_bound``.

Slope: |u_{i+1} - u_i| <= k_i (sqrt(1 - u_i) + sqrt(1 - u_{i+1})), k_i = s h_i/D, is |d_{i+1} - d_i| <= s h_i exactly.
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
_ROUNDS = 12
_TOLERANCE = 1e-10
_SETTLED, _CLOSE = 1e-9, 1e-2
"""Rounds that bring answer and bound no closer than by this, relative, or by this share of the gap asked for, are the
last."""


@dataclass(frozen=True)
class _Answer:
    """One solve: u, the deflection's multiplier, those between neighbours, and the solver's own word."""

    solidity: Array
    multiplier: float
    rise: Array
    fall: Array
    order: Array
    status: str


def _over(denominator: Any, weight: Array, constraints: list[Any]) -> Any:
    """sum of weight/denominator: the weight inside the cone |(2 sqrt(weight), x - t)| <= x + t."""
    import cvxpy as cp

    if not weight.size:
        return 0.0
    t = cp.Variable(weight.size)
    constraints.append(cp.SOC(denominator + t, cp.vstack([2.0 * np.sqrt(weight), denominator - t])))
    return cp.sum(t)


def _solve(program: Program, low: Array, at: Array, drillable: bool) -> _Answer | None:
    import cvxpy as cp

    share, law = program.share, program.law
    n = low.size
    u = cp.Variable(n)
    lowered = np.minimum(low, 1.0)
    constraints = [u >= lowered, u <= 1.0]
    deflection = None
    if program.limit is not None:
        bend, shear = share * program.bending / program.limit, share * program.shear / program.limit
        bends, shears = np.flatnonzero(bend > 0), np.flatnonzero(shear > 0)
        s, point = shear[shears], at[shears]
        drop, drop_slope = -0.5 * law.b * s / (2.0 - point) ** 2, -law.b * s / (2.0 - point) ** 3
        parts = [
            _over(u[bends], 0.5 * bend[bends], constraints),
            _over(2.0 - u[bends], 0.5 * bend[bends], constraints),
            _over(u[shears], s * (law.a + 0.25 * law.b), constraints),
            _over(2.0 - u[shears], s * 0.25 * law.b, constraints),
            float(drop.sum()) + drop_slope @ (u[shears] - point),
        ]
        deflection = sum(parts) <= 1.0
        constraints.append(deflection)
    rise = fall = None
    if program.limits.max_slope is not None:
        reach = reaches(program)
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
            # An inaccurate answer is judged by our own bound like any other.
            warnings.simplefilter("ignore")
            problem.solve(
                solver=cp.CLARABEL, tol_gap_abs=_TOLERANCE, tol_gap_rel=_TOLERANCE, tol_feas=_TOLERANCE, max_iter=200
            )
    except cp.SolverError:
        return None
    if u.value is None:
        return None
    none = np.zeros(n - 1)
    up = none if rise is None else np.maximum(np.asarray(rise.dual_value), 0.0)
    down = none if fall is None else np.maximum(np.asarray(fall.dual_value), 0.0)
    order = np.zeros(n - 1)
    for part, constraint, sign in narrowing:
        # u must not fall: u_i - u_{i+1} <= 0, a flow from i + 1 to i; behind the middle the other way round.
        order[part] = sign * np.maximum(np.asarray(constraint.dual_value), 0.0)
    value = 0.0 if deflection is None else max(float(deflection.dual_value), 0.0)
    return _Answer(np.asarray(u.value), value, up, down, order, str(problem.status))


def reaches(program: Program) -> Array:
    """k_i = s h_i/D between neighbouring stations, (n - 1,)."""
    slope = program.limits.max_slope
    return slope * np.diff(program.stations.x) / program.scene.geometry.outer_diameter


def toward_solid(program: Program, u: Array, low: Array) -> Array | None:
    """The least step from u toward the solid pin that keeps the walls and the deflection; None where none does.

    The step scales every bore by the same factor, so a bore that narrows or is gentle stays so.
    """

    def ok(part: float) -> bool:
        v = u + part * (1.0 - u)
        return bool(np.all(v >= low)) and (program.limit is None or program.deflection(v) <= program.limit)

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
    """The lightest bore under a deflection limit, with or without a slope limit, narrowing toward the middle or not."""
    solid = np.ones_like(low)
    if program.limit is not None and program.deflection(solid) > program.limit:
        return None
    weighed = weigh(program, low, drillable)
    first = low if weighed is None else gentle(program, weighed.solidity)
    at, found, bound, status, rounds = first, solid, 0.0, "", 0
    for rounds in range(1, _ROUNDS + 1):
        before = program.volume(found) - bound
        answer = _solve(program, low, at, drillable)
        if answer is None:
            break
        status = answer.status
        shaped = np.clip(answer.solidity, low, 1.0)
        shaped = rising(shaped, program.anchor) if drillable else shaped
        feasible = toward_solid(program, gentle(program, shaped), low)
        if feasible is not None and program.volume(feasible) < program.volume(found):
            found = feasible
        reach = reaches(program) if program.limits.max_slope is not None else np.zeros(low.size - 1)
        bound = max(
            bound,
            coupled_bound(program, low, answer.multiplier, Neighbours(answer.rise, answer.fall, reach, answer.order)),
        )
        if program.volume(found) - bound <= _CLOSE * gap * bound:
            break
        if rounds > 1 and before - (program.volume(found) - bound) <= max(_SETTLED, _CLOSE * gap) * bound:
            break
        at = np.clip(answer.solidity, low, 1.0)
    volume = program.volume(found)
    return Found(
        found, volume, partial(float, bound), "cone program (Clarabel), its multipliers checked by tangents",
        {"rounds": rounds, "solver_status": status or "none"}, doubt=program.stations.doubt(found),
    )  # fmt: skip
