"""The strip at one crank angle: axial force with friction feedback, and the constants of the bent shape.

    P0(phi) = gas load + inertia of the moving mass,   s = r sin(phi),   q = P/EI
    P = P0 + sign(s) (4/pi) mu int |q_wall| ds                       friction opposes the piston
    psi = C S1(z) + D S2(z),  V' = psi/m - g D,  m = 1 + g q,  q_s = q/m,  g = EI/(kGA)

(S_k: ``strip.beam_column``; shear: ``strip.shear``; the wall force: ``piston.skirt``.) An effect excluded from a scene
has the parameter that removes its term: no mass, no coupling, g = 0, mu = 0.

Near buckling the friction force grows as 1/(P_cr + P). It is a convex function of P there, so secants started from
P0 approach the first solution from one side; if there is none, friction buckles the strip. At the dead centres the
lateral displacement, and with it the friction, vanishes, so the force is continuous.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.piston.skirt import both_walls, couple_of
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.shape import bend
from solvers.rod.strip.shear import critical_coupling_with_shear

ANGLE, FORCE, LATERAL, COUPLING, CLAMP, SHEAR, HEAD, SOFTENING, SIDE, MOMENT, ROWS = range(11)
"""Rows of a table of states, one column per angle: phi [rad], P [N], s [m], q_s [1/m^2], s C [1/m], s D [1/m^2],
psi'(l) [1/m], m, T [N], M0 [N m]; and their number."""

_EPS = float(np.finfo(float).eps)
_MAX_SECANTS, _FORCE_TOLERANCE, _SECANT_CONVERGED = 60, 4.0 * _EPS, 0.01 * _EPS
"""Number of secant steps, the relative step that ends them, and the relative product of two steps that does."""
_FIRST_STEP = 1e-3
"""First step to an upper end of a bracket of the force, relative to P_cr."""
GOLDEN, GOLDEN_STEPS = 0.5 * (math.sqrt(5.0) - 1.0), 65
"""The golden ratio, and the number of sections by it that reduce a bracket to 3e-14."""
_BUCKLED = -2.0
"""Axial force that denotes a strip buckled by friction, relative to its critical one: far beyond it."""
_CORNER_GRID = TURN / 128 * np.arange(129)
"""Angles [rad] between which switches of the contact are sought."""
_MIN_WARM_SLOPE, _MAX_WARM_FORCE = 0.5, 0.8
"""Conditions for starting from the solution at the previous angle: minimum slope, and maximum compression relative to
the critical one."""


class Strip(NamedTuple):
    """A strip and its models in kernel representation. SI units.

    stiffness     EI [N m^2]
    direct        1/(b h) [1/m^2], the stress by a unit axial force
    bending       E h/2 [Pa m], the stress of a fibre by a unit curvature
    line_mass     rho b h [kg/m]
    couples       1.0 if the axial force contributes to bending, else 0.0
    compliance    g = EI/(kGA) [m^2], 0.0 if rigid in shear
    friction      (4/pi) mu, 0.0 without feedback of friction to the axial force
    lever         6/Lp [1/m] of the skirt
    offset        clamp offset e [m]
    critical      P_cr [N] about the weaker axis, rigid in shear
    """

    stiffness: float
    length: float
    rod_length: float
    direct: float
    bending: float
    line_mass: float
    couples: float
    compliance: float
    friction: float
    lever: float
    offset: float
    critical: float


@kernel
def with_models(strip: Strip, couples: float, compliance: float, friction: float) -> Strip:
    """The strip with other models: the three fields with these names."""
    return Strip(
        strip.stiffness, strip.length, strip.rod_length, strip.direct, strip.bending, strip.line_mass, couples,
        compliance, friction, strip.lever, strip.offset, strip.critical,
    )  # fmt: skip


@kernel
def least_critical_force(strip: Strip) -> float:
    """P_cr [N] about the weaker axis; bending in the crank's plane with the strip's shear flexibility."""
    if strip.compliance == 0.0:
        return strip.critical
    with_shear = critical_coupling_with_shear(strip.length, strip.rod_length, strip.compliance)
    return min(strip.critical, -strip.stiffness * with_shear)


@kernel
def wall_force(strip: Strip, q: float) -> float:
    """int |q_wall| ds per unit lateral displacement [N/m] for the coupling q = P/EI."""
    _, m, clamp, shear, _ = constants(q, strip.length, strip.rod_length, strip.compliance)
    side = -m * shear
    return strip.stiffness * both_walls(abs(side), abs(couple_of(side, clamp, strip.lever, strip.offset)))


@kernel
def _solve_from_core(strip: Strip, force: float, lateral: float) -> tuple[float, float]:
    """As ``_solve_friction``, started from P0 = ``force``, and by bisection where the secants find nothing; P is twice
    -P_cr if friction buckles the strip.

    The velocity has the sign of the lateral displacement for every crank shorter than its rod.
    """
    friction_factor, critical = strip.friction * lateral, -strip.critical
    if force <= critical:
        # Friction that relieves a strip is no hold: the machine may stop at this angle.
        return _BUCKLED * strip.critical, 1.0
    solution, slope = _solve_friction(strip, force, lateral, force, 1.0)
    if solution > critical:
        return solution, slope
    # On a short skirt friction changes so steeply, up to where the clamp moment vanishes, that a step of fixed-point
    # iteration leads far past the solution.
    left, right = force, force
    if friction_factor > 0.0:
        step = -_FIRST_STEP * critical
        while _residual(strip, force, friction_factor, right) > 0.0:
            right, step = right + step, 2.0 * step
    else:
        share, compression = greatest_share(strip, force, friction_factor, -critical, 1.0)
        if share < 1.0:
            return _BUCKLED * strip.critical, 1.0
        left = -compression
    while right - left > _FORCE_TOLERANCE * (abs(left) + abs(right)):
        middle = 0.5 * (left + right)
        if _residual(strip, force, friction_factor, middle) >= 0.0:
            left = middle
        else:
            right = middle
    return left, 1.0


@kernel
def greatest_share(
    strip: Strip, force: float, friction_factor: float, critical: float, enough: float
) -> tuple[float, float]:
    """The greatest share p/(-P0 - friction) of the axial forces that a compression p up to P_cr = ``critical`` [N]
    holds, and p [N]; or the first share found above ``enough``. P0 is ``force`` [N]; friction pushes. At 1 and more the
    strip has an equilibrium. Friction is convex in p, so that the share has a single maximum."""
    left, right, best, at = 0.0, critical, 0.0, 0.0
    for _ in range(GOLDEN_STEPS):
        lower, upper = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        at_lower = _share(strip, force, friction_factor, lower)
        at_upper = _share(strip, force, friction_factor, upper)
        if max(at_lower, at_upper) > best:
            best, at = max(at_lower, at_upper), lower if at_lower > at_upper else upper
        if best > enough:
            break
        if at_lower > at_upper:
            right = upper
        else:
            left = lower
    return best, at


@kernel
def _share(strip: Strip, force: float, friction_factor: float, compression: float) -> float:
    """A compression [N] of the strip over that which the axial forces exert on it then."""
    exerted = -force - friction_factor * wall_force(strip, -strip.couples / strip.stiffness * compression)
    return compression / exerted if exerted > 0.0 else np.inf


@kernel
def _residual(strip: Strip, force: float, friction_factor: float, solution: float) -> float:
    """P0 + friction(P) - P [N]."""
    return force + friction_factor * wall_force(strip, strip.couples / strip.stiffness * solution) - solution


@kernel
def _solve_friction(strip: Strip, force: float, lateral: float, start: float, slope: float) -> tuple[float, float]:
    """Solve P - P0 - friction(P) = 0 by the secant method from a start with a given slope; return P [N] and the last
    slope."""
    friction_factor = strip.friction * lateral
    if friction_factor == 0.0:
        return force, 1.0
    solution, step, last_step = start, np.inf, np.inf
    residual = _residual(strip, force, friction_factor, solution)
    for _ in range(_MAX_SECANTS):
        earlier_step, last_step, step = last_step, step, residual / slope
        solution += step
        size = abs(force) + abs(solution)
        # The error of a secant step is proportional to the product of the two before it; the last three give the
        # factor. A first step away from the critical load is too long to judge.
        if abs(step) <= _FORCE_TOLERANCE * size or (
            earlier_step < np.inf and step * step <= _SECANT_CONVERGED * size * min(abs(earlier_step), size)
        ):
            return solution, slope
        if solution <= _BUCKLED * strip.critical:
            break
        last_residual, residual = residual, _residual(strip, force, friction_factor, solution)
        slope = (last_residual - residual) / step
        # Without a usable slope, as beyond the last solution, take a step of fixed-point iteration.
        if not slope > 0.0:
            slope = 1.0
    return _BUCKLED * strip.critical, 1.0


@kernel
def fill_states(drive: Drive, strip: Strip, angle: Array, states: Array) -> None:
    """Fill a table of shape (ROWS, n) with the states at the angles (n,), fastest if the angles are increasing."""
    # Friction force and slope reduction per friction factor at the previous angle, for the initial guess.
    last_friction, last_reduction = 0.0, 0.0
    coefficients = constants(0.0, strip.length, strip.rod_length, strip.compliance)
    for i in range(angle.size):
        lateral = drive.crank_radius * math.sin(angle[i])
        force = axial_force(drive, angle[i])
        friction_factor = strip.friction * lateral
        if friction_factor != 0.0:
            solution, slope = _BUCKLED * strip.critical, 1.0 - friction_factor * last_reduction
            start, warm_limit = force + friction_factor * last_friction, -_MAX_WARM_FORCE * strip.critical
            if slope > _MIN_WARM_SLOPE and min(force, start) > warm_limit:
                solution, slope = _solve_friction(strip, force, lateral, start, slope)
            if not solution > warm_limit:
                solution, slope = _solve_from_core(strip, force, lateral)
            last_friction, last_reduction = 0.0, 0.0
            if solution > warm_limit:
                last_friction, last_reduction = (solution - force) / friction_factor, (1.0 - slope) / friction_factor
            force = solution
        states[ANGLE, i], states[FORCE, i], states[LATERAL, i] = angle[i], force, lateral
        if strip.couples != 0.0:
            coefficients = constants(
                strip.couples / strip.stiffness * force, strip.length, strip.rod_length, strip.compliance
            )
        q, m, clamp, shear, head = coefficients
        states[COUPLING, i], states[SOFTENING, i] = q, m
        states[CLAMP, i], states[SHEAR, i], states[HEAD, i] = clamp * lateral, shear * lateral, head * lateral
        states[SIDE, i] = -strip.stiffness * m * shear * lateral
        states[MOMENT, i] = strip.stiffness * clamp * lateral


@kernel
def states_of(drive: Drive, strip: Strip, angle: Array) -> Array:
    """The states at the angles, (ROWS, n), as by ``fill_states``."""
    states = np.empty((ROWS, angle.size))
    fill_states(drive, strip, angle, states)
    return states


@kernel
def bend_states(states: Array, length: float, z: float, curvature: Array, rotation: Array, integral: Array) -> None:
    """Write psi' [1/m], psi and int psi dz [m] at the section z at the states' angles, each (angles,)."""
    bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], length, z, curvature, rotation, integral)


@kernel
def _wall_contact_margin(drive: Drive, strip: Strip, angle: float) -> float:
    """6 |M|/Lp - |T| per unit lateral displacement and unit EI: positive where the piston contacts both walls."""
    force = axial_force(drive, angle)
    force, _ = _solve_from_core(strip, force, drive.crank_radius * math.sin(angle))
    q = strip.couples / strip.stiffness * force
    _, m, clamp, shear, _ = constants(q, strip.length, strip.rod_length, strip.compliance)
    side = -m * shear
    return abs(couple_of(side, clamp, strip.lever, strip.offset)) - abs(side)


@kernel
def friction_corners(drive: Drive, strip: Strip, further: Array) -> Array:
    """Angles [rad] at which contact switches between one and both walls, between those of a grid and ``further`` ones.

    Only there does the second derivative of the friction force jump: at sign changes of T or M it is smooth.
    """
    corners, angle = [0.0 for _ in range(0)], np.sort(np.concatenate((_CORNER_GRID, further)))
    last_value = _wall_contact_margin(drive, strip, angle[0])
    for i in range(1, angle.size):
        value_here = _wall_contact_margin(drive, strip, angle[i])
        if last_value * value_here < 0.0:
            corners.append(_switch_between(drive, strip, angle[i - 1], angle[i], last_value, value_here))
        last_value = value_here
    return np.array(corners)


@kernel
def _switch_between(
    drive: Drive, strip: Strip, left: float, right: float, left_value: float, right_value: float
) -> float:
    """The angle [rad] at which the margin of contact, given at both ends, changes its sign: by regula falsi, where the
    value at an end that is kept twice is halved (Illinois)."""
    last_middle, middle, side = np.inf, right, 0
    while abs(middle - last_middle) > 4.0 * _EPS * max(abs(middle), 1.0):
        last_middle, middle = middle, right - right_value * (right - left) / (right_value - left_value)
        if not left < middle < right:
            break
        value = _wall_contact_margin(drive, strip, middle)
        if value * right_value > 0.0:
            right, right_value, left_value = middle, value, left_value if side <= 0 else 0.5 * left_value
            side = 1
        else:
            left, left_value, right_value = middle, value, right_value if side >= 0 else 0.5 * right_value
            side = -1
    return min(max(middle, left), right)
