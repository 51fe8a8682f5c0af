"""The coupled problem under a slope limit: a cone program with an independent lower bound.

In u every term is convex but one: phi = (A + B/4)/u + (B/4)/(2-u) - (B/2)/(2-u)^2, whose last term is concave. It is
linearised at the previous solution, where the tangent is an upper bound, and the program is solved again: the
iterates stay feasible, decrease monotonically and converge in a few rounds because the curvature is small. The lower
bound uses every station's convex envelope instead, so a gap remains for nearly solid pins. All quantities are
scaled, and the reciprocals are written as s_i <= u_i t_i with the weight inside the cone; otherwise the
interior-point method stalls.

The solver's status is not trusted: its solution is moved toward the solid pin until it satisfies every limit by our
own formulas, and the bound is computed from its multipliers by ``solvers.pin.optimum.dual_bound``.

Slope: |u_{i+1} - u_i| <= k_i (sqrt(1 - u_i) + sqrt(1 - u_{i+1})), k_i = s h_i/D, is |d_{i+1} - d_i| <= s h_i
exactly.
"""

from __future__ import annotations

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
_TOLERANCE, _TOLERANCE_FRACTION, _MAX_ITERATIONS = 1e-10, 1e-3, 200
"""Relative tolerance of the solver, the same as a fraction of the requested gap if that is larger; iterations."""
_MIN_PROGRESS, _GAP_FRACTION = 1e-9, 1e-2
"""Stopping criteria: relative progress of the gap per round, and the same as a fraction of the requested gap."""


@dataclass(frozen=True)
class _Solution:
    """One solve: u, the multipliers of the deflection and between neighbours, and the solver's status."""

    solidity: Array
    multiplier: float
    rise: Array
    fall: Array
    order: Array
    status: str


class _Cones:
    """Constraints of a cone program in ``size`` variables: rows of expressions M x + c, cone by cone."""

    def __init__(self, size: int) -> None:
        self.size, self.rows, self.constants, self.kinds = size, [], [], []

    def least_zero(self, matrix: Any, constant: Array | float) -> slice:
        """Add M x + c >= 0; return the rows."""
        import clarabel

        begin = sum(c.size for c in self.constants)
        self.rows.append(matrix)
        self.constants.append(constant + np.zeros(matrix.shape[0]))
        self.kinds.append(clarabel.NonnegativeConeT(matrix.shape[0]))
        return slice(begin, begin + matrix.shape[0])

    def within(self, parts: list[tuple[Any, Array | float]]) -> None:
        """Add |(e_1, e_2)| <= e_0 row by row for three expressions."""
        import clarabel
        from scipy import sparse

        count = parts[0][0].shape[0]
        order = np.arange(3 * count).reshape(3, count).T.ravel()
        self.rows.append(sparse.vstack([matrix for matrix, _ in parts]).tocsr()[order])
        self.constants.append(np.stack([c + np.zeros(count) for _, c in parts], axis=1).ravel())
        self.kinds += [clarabel.SecondOrderConeT(3)] * count

    def solved(self, cost: Array, tolerance: float) -> tuple[Array, Array, str]:
        """Return x of the least cost, the multipliers of all rows, and the status."""
        import clarabel
        from scipy import sparse

        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_iter = False, _MAX_ITERATIONS
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
        nothing = sparse.csc_matrix((self.size, self.size))
        rows, constants = sparse.vstack(self.rows).tocsc(), np.concatenate(self.constants)
        found = clarabel.DefaultSolver(nothing, cost, -rows, constants, self.kinds, settings).solve()
        return np.array(found.x), np.array(found.z), str(found.status)


def _solve(program: Program, low: Array, at: Array, drillable: bool, tolerance: float) -> _Solution | None:
    from scipy import sparse

    share, law, n = program.share, program.law, low.size
    bend, shear = share * program.bending / program.limit, share * program.shear / program.limit
    bends, shears = np.flatnonzero(bend > 0), np.flatnonzero(shear > 0)
    # Weights over u and over 2 - u.
    index = np.concatenate([bends, bends, shears, shears])
    sign = np.repeat([1.0, -1.0, 1.0, -1.0], [bends.size, bends.size, shears.size, shears.size])
    weight = [
        0.5 * bend[bends],
        0.5 * bend[bends],
        shear[shears] * (law.a + 0.25 * law.b),
        0.25 * law.b * shear[shears],
    ]
    m, size = index.size, 2 * n + index.size
    u, root, term = sparse.eye(n, size), sparse.eye(n, size, k=n), sparse.eye(m, size, k=2 * n)
    own = sparse.csr_matrix((sign, (np.arange(m), index)), (m, size))
    concave, slope = -0.5 * law.b * shear / (2.0 - at) ** 2, -law.b * shear / (2.0 - at) ** 3
    cones = _Cones(size)
    cones.least_zero(u, -np.minimum(low, 1.0))
    cones.least_zero(-u, 1.0)
    total = sparse.csr_matrix(np.concatenate([-slope, np.zeros(n), -np.ones(m)]))
    deflection = cones.least_zero(total, 1.0 - float(np.sum(concave - slope * at)))
    following = sparse.eye(n - 1, size, k=1) - sparse.eye(n - 1, size)
    neighbours = []
    if program.limits.max_slope is not None:
        room = sparse.diags(reaches(program)) @ (sparse.eye(n - 1, size, k=n) + sparse.eye(n - 1, size, k=n + 1))
        neighbours = [cones.least_zero(room - following, 0.0), cones.least_zero(room + following, 0.0)]
    ahead = np.where(np.arange(1, n) < program.anchor, 1.0, -1.0)
    ahead[program.anchor - 1 : program.anchor] = 0.0
    order = cones.least_zero(sparse.diags(ahead) @ following, 0.0) if drillable else None
    cones.within(
        [(own + term, 1.0 - sign), (0.0 * term, 2.0 * np.sqrt(np.concatenate(weight))), (own - term, 1.0 - sign)]
    )
    cones.within([(-u, 2.0), (2.0 * root, 0.0), (u, 0.0)])
    x, z, status = cones.solved(np.concatenate([share, np.zeros(n + m)]), tolerance)
    if not np.all(np.isfinite(x)):
        return None
    z, none = np.maximum(z, 0.0), np.zeros(n - 1)
    rise, fall = (z[rows] for rows in neighbours) if neighbours else (none, none)
    # A flow from i + 1 to i, where u must not fall.
    return _Solution(x[:n], float(z[deflection][0]), rise, fall, none if order is None else -ahead * z[order], status)


def reaches(program: Program) -> Array:
    """Return k_i = s h_i/D between neighbouring stations, (n - 1,)."""
    slope = program.limits.max_slope
    return slope * np.diff(program.stations.x) / program.scene.geometry.outer_diameter


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
    weighed = weigh(program, low, drillable)
    first = low if weighed is None else gentle(program, weighed.solidity)
    at, found, bound, status, rounds = first, solid, 0.0, "", 0
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
        reach = reaches(program) if program.limits.max_slope is not None else np.zeros(low.size - 1)
        bound = max(
            bound,
            coupled_bound(program, low, answer.multiplier, Neighbours(answer.rise, answer.fall, reach, answer.order)),
        )
        if program.volume(found) - bound <= _GAP_FRACTION * gap * bound:
            break
        if rounds > 1 and before - (program.volume(found) - bound) <= max(_MIN_PROGRESS, _GAP_FRACTION * gap) * bound:
            break
        at = np.clip(answer.solidity, low, 1.0)
    volume = program.volume(found)
    return Found(
        found, volume, partial(float, bound), "cone program (Clarabel), its multipliers checked by tangents",
        {"rounds": rounds, "solver_status": status or "none"}, doubt=program.stations.doubt(found),
    )  # fmt: skip
