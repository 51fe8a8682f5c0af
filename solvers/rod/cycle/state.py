"""The strip at one crank angle: axial force with friction feedback, and the constants of the bent shape.

    P0(phi) = gas load + inertia of the moving mass,   s = r sin(phi),   q = P/EI
    P = P0 + sign(s) (4/pi) mu int |q_wall| ds                       friction opposes the piston
    psi = C S1(z) + D S2(z),  V' = psi/m - g D,  m = 1 + g q,  q_s = q/m,  g = EI/(kGA)

(S_k: ``strip.beam_column``; shear: ``strip.shear``; the wall force: ``piston.skirt``.) An effect excluded from a scene
has the parameter that removes its term: no mass, no coupling, g = 0, mu = 0.

Near buckling the friction force grows as 1/(P_cr + P), a convex function of P, so secants started from P0 approach the
first solution from one side; if there is none, friction buckles the strip. At the dead centres the stroke, and with it
the friction, vanishes, so the force is continuous.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.piston.skirt import both_walls
from solvers.rod.strip.beam_column import constants

Array = NDArray[np.float64]

ANGLE, FORCE, STROKE, COUPLING, CLAMP, SHEAR, HEAD, SOFTENING, SIDE, MOMENT = range(10)
"""Rows of a table of states, one column per angle: phi [rad], P [N], s [m], q_s [1/m^2], s C [1/m], s D [1/m^2],
psi'(l) [1/m], m, T [N], M0 [N m]."""

ROWS = 10

_MAX_SECANTS = 60
_EPS = float(np.finfo(float).eps)
_FORCE_TOLERANCE, _CONVERGED = 4.0 * _EPS, 0.01 * _EPS
_MIN_WARM_SLOPE, _MAX_WARM_FORCE = 0.5, 0.4
"""Conditions for starting the secants from the neighbouring solution: minimum slope, and maximum force relative to the
one that denotes buckling, i.e. far from buckling by friction."""


class Strip(NamedTuple):
    """A strip and its models in kernel representation. SI units.

    stiffness     EI [N m^2]
    couples       1.0 if the axial force contributes to bending, else 0.0
    compliance    g = EI/(kGA) [m^2], 0.0 if rigid in shear
    friction      (4/pi) mu, 0.0 without feedback of friction to the axial force
    lever         6/Lp [1/m] of the skirt
    offset        clamp offset e [m]
    buckled       axial force [N] that denotes a strip buckled by friction: far beyond its critical load
    """

    stiffness: float
    length: float
    rod_length: float
    couples: float
    compliance: float
    friction: float
    lever: float
    offset: float
    buckled: float


@kernel
def wall_force(strip: Strip, q: float) -> float:
    """int |q_wall| ds per unit stroke [N/m] for the coupling q."""
    _, m, clamp, shear, _ = constants(q, strip.length, strip.rod_length, strip.compliance)
    side = -m * shear
    return strip.stiffness * both_walls(abs(side), strip.lever * abs(clamp + side * strip.offset))


@kernel
def closed_force(strip: Strip, force: float, stroke: float) -> float:
    """P [N] including friction feedback, from P0; ``strip.buckled`` if friction buckles the strip.

    The velocity has the sign of the stroke for every crank shorter than its rod.
    """
    return _secants(strip, force, stroke, force, 1.0)[0]


@kernel
def _secants(strip: Strip, force: float, stroke: float, start: float, slope: float) -> tuple[float, float]:
    """``closed_force`` and the last slope of P - P0 - friction, by secants from a start with a given slope."""
    per_force, push = strip.couples / strip.stiffness, strip.friction * stroke
    if push == 0.0:
        return force, 1.0
    here, step, last = start, np.inf, np.inf
    gap = force + push * wall_force(strip, per_force * here) - here
    for _ in range(_MAX_SECANTS):
        earlier, last, step = last, step, gap / slope
        here += step
        size = abs(force) + abs(here)
        # A secant error is proportional to the product of the two before it; the last three give the factor. A first
        # step away from the critical load is too long to tell.
        if abs(step) <= _FORCE_TOLERANCE * size or (
            earlier < np.inf and step * step <= _CONVERGED * size * min(abs(earlier), size)
        ):
            return here, slope
        if here <= strip.buckled:
            break
        gap_before, gap = gap, force + push * wall_force(strip, per_force * here) - here
        slope = (gap_before - gap) / step
        # Without a usable slope, as beyond the last solution, take a plain step.
        if not slope > 0.0:
            slope = 1.0
    return strip.buckled, 1.0


@kernel
def fill_states(drive: Drive, strip: Strip, angle: Array, states: Array) -> None:
    """Fill a table of shape (ROWS, n) with the states at the angles (n,); fastest if the angles are increasing."""
    # Friction force and slope reduction per stroke at the previous angle, as an initial guess.
    added, softer = 0.0, 0.0
    shape = constants(0.0, strip.length, strip.rod_length, strip.compliance)
    for i in range(angle.size):
        stroke = drive.crank_radius * math.sin(angle[i])
        force = axial_force(drive, angle[i])
        push = strip.friction * stroke
        if push != 0.0:
            closed, slope, start, far = (
                strip.buckled,
                1.0 - push * softer,
                force + push * added,
                _MAX_WARM_FORCE * strip.buckled,
            )
            if slope > _MIN_WARM_SLOPE and min(force, start) > far:
                closed, slope = _secants(strip, force, stroke, start, slope)
            if not closed > far:
                closed, slope = _secants(strip, force, stroke, force, 1.0)
            added, softer = 0.0, 0.0
            if closed > far:
                added, softer = (closed - force) / push, (1.0 - slope) / push
            force = closed
        states[ANGLE, i], states[FORCE, i], states[STROKE, i] = angle[i], force, stroke
        if strip.couples != 0.0:
            shape = constants(strip.couples / strip.stiffness * force, strip.length, strip.rod_length, strip.compliance)
        q, m, clamp, shear, head = shape
        states[COUPLING, i], states[SOFTENING, i] = q, m
        states[CLAMP, i], states[SHEAR, i], states[HEAD, i] = clamp * stroke, shear * stroke, head * stroke
        states[SIDE, i] = -strip.stiffness * m * shear * stroke
        states[MOMENT, i] = strip.stiffness * clamp * stroke


@kernel
def _both_walls_begin(drive: Drive, strip: Strip, angle: float) -> float:
    """6 |M|/Lp - |T| per unit stroke and unit EI: positive where the piston contacts both walls."""
    force = axial_force(drive, angle)
    force = closed_force(strip, force, drive.crank_radius * math.sin(angle))
    q = strip.couples / strip.stiffness * force
    _, m, clamp, shear, _ = constants(q, strip.length, strip.rod_length, strip.compliance)
    side = -m * shear
    return strip.lever * abs(clamp + side * strip.offset) - abs(side)


@kernel
def friction_corners(drive: Drive, strip: Strip, angle: Array) -> Array:
    """Angles [rad] between those given, increasing, at which contact switches between one and both walls.

    Only there does the second derivative of the friction force jump: at sign changes of T or M it is smooth.
    """
    found = [0.0 for _ in range(0)]
    before = _both_walls_begin(drive, strip, angle[0])
    for i in range(1, angle.size):
        here = _both_walls_begin(drive, strip, angle[i])
        if before * here < 0.0:
            # The false position; the value at an end that stays twice is halved (Illinois).
            left, right, low, high, last, stays = angle[i - 1], angle[i], before, here, np.inf, 0
            middle = right
            while abs(middle - last) > 4.0 * _EPS * max(abs(middle), 1.0):
                last, middle = middle, right - high * (right - left) / (high - low)
                if not left < middle < right:
                    break
                value = _both_walls_begin(drive, strip, middle)
                if value * high > 0.0:
                    right, high, low = middle, value, low if stays <= 0 else 0.5 * low
                    stays = 1
                else:
                    left, low, high = middle, value, high if stays >= 0 else 0.5 * high
                    stays = -1
            found.append(min(max(middle, left), right))
        before = here
    return np.array(found)
