"""Optimisation under slope and deflection limits: a sequence of cone programs with an independent lower bound.

At the previous solution (initially, that on the previous stations) every station's flexibility h = bend f + shear g
is replaced by p/u + q u + constant with the same value, slope and curvature (p = 0 where h is concave), and the
program is solved again: exact for thin walls, otherwise convergence is quadratic, as that of Newton's method.
Reciprocals are written as p <= u t with the weight inside the cone; otherwise the interior-point method stalls.

The solver's status is not trusted: its solution is thickened until it satisfies every limit by our own formulas, and
the bound is computed from its multipliers by ``solvers.pin.optimum.dual_bound``.

Slope: with the sought diameter l r, r = sqrt(c -+ u) for a pin's bore or a bushing's outer diameter and c = (G/l)^2,
|u_{i+1} - u_i| <= k_i (r_i + r_{i+1}), k_i = s h_i/l, is exactly l |r_{i+1} - r_i| <= s h_i; r is concave in u.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.optimum.dual_bound import NeighbourMultipliers, coupled_bound, slope_steps
from solvers.pin.optimum.lagrangian import minimum_volume
from solvers.pin.optimum.program import Program, ShapeResult
from solvers.pin.section.flexibility import Flexibility, curvatures, flexibilities, slopes
from solvers.pin.stations.between_nodes import running_maximum_error

_MAX_ITERATIONS = 12
_TOLERANCE, _TOLERANCE_FRACTION = 1e-12, 1e-5
"""Relative tolerance of the solver, and the same as a fraction of the requested gap if that is larger."""
_RESOLUTION = 1e-12
"""Relative difference of walls that counts as rounding."""
_MIN_PROGRESS, _GAP_FRACTION = 1e-9, 1e-2
"""Stopping criteria: relative reduction of the gap per iteration, and the same as a fraction of the requested gap."""


def slope_limited_walls(program: Program, walls: Array) -> Array:
    """Return the least walls >= ``walls`` that satisfy the slope limit, exactly, by a forward and a backward sweep.

    The thickness T = D - d has the slope of the unknown diameter: T(x) = max over y of T_min(y) - s |x - y|.
    """
    slope, unit = program.limits.max_slope, program.variable.unit_diameter
    if slope is None:
        return walls
    ramp = slope / unit * program.stations.x
    if np.all(np.abs(np.diff(walls)) <= np.diff(ramp) + _RESOLUTION * walls[1:]):
        # Differences with the ramp would take away digits of walls much thinner than it.
        return walls
    forward = np.maximum.accumulate(walls + ramp) - ramp
    backward = np.maximum.accumulate((walls - ramp)[::-1])[::-1] + ramp
    return np.maximum(walls, np.maximum(forward, backward))


def slope_limited(program: Program, low: Array) -> Array:
    """Return the least u >= ``low`` that satisfies the slope limit."""
    if program.limits.max_slope is None:
        return low
    variable = program.variable
    return np.maximum(low, variable.solidity_of(slope_limited_walls(program, variable.wall_of(low))))


def slope_limit_error(program: Program, low: Array) -> Array:
    """Return the volume error of a slope-limited shape due to maxima of ``low`` between stations, per panel."""
    stations, slope, variable = program.stations, program.limits.max_slope, program.variable
    walls = variable.wall_of(low)
    if slope_limited_walls(program, walls) is walls:
        return np.zeros_like(stations.width)
    thick, ramp = variable.unit_diameter * walls, slope * stations.x
    error = running_maximum_error(stations.x, stations.weight, thick + ramp, stations.span, True)
    error = error + running_maximum_error(stations.x, stations.weight, thick - ramp, stations.span, False)
    return variable.max_derivative(float(thick.max())) * error


@kernel
def _local_model(u: Array, bend: Array, shear: Array, law: Flexibility) -> Array:
    """Return constant, p and q (3, n) for which constant + p/u + q u agrees with h to second order at u."""
    out = np.empty((3, u.size))
    for i in range(u.size):
        (f, g), (df, dg) = flexibilities(u[i], law), slopes(u[i], law)
        d2f, d2g = curvatures(u[i], law)
        p = 0.5 * u[i] ** 3 * max(bend[i] * d2f + shear[i] * d2g, 0.0)
        q = bend[i] * df + shear[i] * dg + p / (u[i] * u[i])
        out[0, i], out[1, i], out[2, i] = bend[i] * f + shear[i] * g - p / u[i] - q * u[i], p, q
    return out


def _solve(
    program: Program, low: Array, at: Array, drillable: bool, tolerance: float
) -> tuple[Array, float, NeighbourMultipliers, str] | None:
    """Solve the program with flexibilities approximated at u = ``at``: (u, multipliers of the deflection limit and
    between neighbours, solver status); None if the solver ends without a solution.

    The variables are u, t >= p/u of the loaded stations, and r. Every constraint is an affine function of them, a pair
    of matrix and constant: first the non-negative ones, then cones |(y, z)| <= x of three rows each.
    """
    import clarabel
    from scipy import sparse

    variable, n = program.variable, low.size
    loaded = np.flatnonzero((program.bending > 0.0) | (program.shear > 0.0))
    scaled = program.weight[loaded] / program.limit * np.stack([program.bending[loaded], program.shear[loaded]])
    constant, p, q = _local_model(at[loaded], scaled[0], scaled[1], program.law)
    limited = program.limits.max_slope is not None
    every = sparse.identity(n + loaded.size + (n if limited else 0), format="csr")
    u, t, r = every[:n], every[n : n + loaded.size], every[n + loaded.size :]
    step, none = u[1:] - u[:-1], np.zeros(n - 1)
    linear = [(sparse.csr_matrix(-q @ u[loaded] - np.ones(loaded.size) @ t), [1.0 - constant.sum()])]
    cones = [((u[loaded] + t, 0.0 * p), (0.0 * t, 2.0 * np.sqrt(p)), (u[loaded] - t, 0.0 * p))]
    if limited:
        slope_room, square = (
            sparse.diags(slope_steps(program)) @ (r[1:] + r[:-1]),
            (variable.given / variable.unit) ** 2,
        )
        linear += [(slope_room - step, none), (slope_room + step, none)]
        own = variable.sign * u
        cones.append(((own, np.full(n, square + 1.0)), (2.0 * r, np.zeros(n)), (own, np.full(n, square - 1.0))))
    if drillable:
        linear.append((step, none))
    linear.append((u, -low))
    if variable.kappa < 0.0:
        linear.append((-u, np.ones(n)))
    blocks = [*linear]
    for cone in cones:
        by_station = np.arange(3 * cone[0][0].shape[0]).reshape(3, -1).T.ravel()
        blocks.append((
            sparse.vstack([matrix for matrix, _ in cone], "csr")[by_station],
            np.concatenate([constant for _, constant in cone])[by_station],
        ))  # fmt: skip
    linear_count = sum(len(constant) for _, constant in linear)
    kinds = [clarabel.NonnegativeConeT(linear_count), *(clarabel.SecondOrderConeT(3) for c in cones for _ in c[0][1])]
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter = False, 200
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    size = every.shape[0]
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix((size, size)), program.weight @ u, -sparse.vstack([matrix for matrix, _ in blocks], "csc"),
        np.concatenate([constant for _, constant in blocks]), kinds, settings,
    ).solve()  # fmt: skip
    x, z = np.array(answer.x), np.maximum(answer.z[:linear_count], 0.0)
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        return None
    rise, fall, order = np.zeros((3, n - 1))
    if limited:
        rise, fall = z[1 : 2 * n - 1].reshape(2, n - 1)
    if drillable:
        first = 1 + (2 * n - 2 if limited else 0)
        order = -z[first : first + n - 1]
    return x[:n], float(z[0]), NeighbourMultipliers(rise, fall, order), str(answer.status)


def thickened(program: Program, u: Array) -> Array:
    """Return u with the thickness D - d increased everywhere by the least amount that satisfies the deflection limit.

    This preserves monotonicity and slope limits. A pin becomes solid if even that exceeds the limit, by rounding.
    """
    variable, walls = program.variable, program.variable.wall_of(u)

    def thicker_by(more: float) -> Array:
        return np.maximum(u, variable.solidity_of(np.minimum(walls + more, variable.thickest)))

    least, most = 0.0, 0.0
    while program.deflection(thicker_by(most)) > program.limit and most < variable.thickest:
        least, most = most, 2.0 * most or float(walls.max())
    while least < 0.5 * (least + most) < most and most - least > 1e-16 * most:
        middle = 0.5 * (least + most)
        least, most = (middle, most) if program.deflection(thicker_by(middle)) > program.limit else (least, middle)
    return thicker_by(most)


def slope_limited_optimum(program: Program, low: Array, drillable: bool, gap: float) -> ShapeResult | None:
    """Find the lightest profile under a deflection limit, optionally with a slope limit and a wall that does not
    decrease toward the middle."""
    if program.initial is not None:
        at = np.maximum(program.initial, low)
    else:
        solution = minimum_volume(program, low, drillable)
        if solution is None:
            return None
        at = solution.solidity

    def feasible(u: Array) -> Array:
        shaped = np.maximum(u, low)
        shaped = np.maximum.accumulate(shaped) if drillable else shaped
        return thickened(program, slope_limited(program, shaped))

    at = found = feasible(at)
    bound, status, iterations = 0.0, "none", 0
    for iterations in range(1, _MAX_ITERATIONS + 1):
        previous_gap = program.volume(found) - bound
        answer = _solve(program, low, at, drillable, max(_TOLERANCE, _TOLERANCE_FRACTION * gap))
        if answer is None:
            break
        previous, (solidity, multiplier, multipliers, status) = at, answer
        at = feasible(solidity)
        found = min(found, at, key=program.volume)
        bound = max(bound, coupled_bound(program, low, multiplier, multipliers, program.volume(found)))
        absolute_gap = program.volume(found) - bound
        if absolute_gap <= _GAP_FRACTION * gap * bound:
            break
        if iterations > 1 and previous_gap - absolute_gap <= max(_MIN_PROGRESS, _GAP_FRACTION * gap) * bound:
            break
        # The model's error in the volume is of second order in the distance from its expansion point.
        if float(np.abs(at - previous).max()) ** 2 <= _GAP_FRACTION * gap:
            break
    return ShapeResult(
        found, program.volume(found), partial(float, bound),
        "cone program (Clarabel), its multipliers checked by tangents",
        {"rounds": iterations, "solver_status": status}, error_estimate=program.stations.error_estimate(found),
    )  # fmt: skip
