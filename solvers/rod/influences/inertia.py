"""Dynamic response of the strip to first order: forced by its quasi-static motion, and resonance of the first mode.

    EI d'''' - P(phi) d'' = -rho A omega^2 V_phiphi,     d clamped, with the pin at no offset

V is the quasi-static shape; with shear, P is that of q_s (``strip.shear``). The solution d is the first of the iterates
whose sum is the motion without free vibration (ringing); each angle is solved independently
(``strip.elastica_kernels``). With c(phi) the projection of V on the shape of d, the amplitude of the first mode obeys

    a'' + eta Omega a' + Omega(phi)^2 a = -c'',     Omega = omega_1(P)/omega,  eta the loss factor

which is solved exactly on steps with constant Omega and linear c'', with periodicity (``first_mode``): this includes
harmonics near a resonance, corners and jumps of the load, however narrow, and the variation of Omega. Its difference
from -c''/Omega^2, which d already contains, is added with the shape of d. For a mode too fast for the step width only
the amplitude is found; one that does not even resolve what excites it under a smooth load is taken not to ring.

The response depends on the mode's phase after a revolution, which is shifted toward resonance by its uncertainty.
Higher modes ring too and are not computed: ``first_order`` has margins for them.

Source: G. Floquet (1883).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import extremes, largest
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.state import COUPLING, LATERAL, SHEAR, SOFTENING, Strip
from solvers.rod.influences.first_mode import Phase, first_mode_response
from solvers.rod.influences.sampled_angles import Sampling
from solvers.rod.strip.elastica_kernels import Collocation, scratch, solve_bending
from solvers.rod.vibration.natural_frequencies import FEW_POLYNOMIALS, Polynomials, frequency_under

NODES = 12
"""Number of Legendre polynomials along the strip; they resolve boundary layers of 1/20 of its length, enough for an
estimate."""

MAX_PHASE_FOR_SIGN, MAX_PHASE_FOR_EXCITATION = 0.5, 2.0
"""Increments of the first mode's phase [rad] per uniform step above which the steps may miss its maximum, so that only
its amplitude is known, and above which they do not resolve its excitation."""


class InertiaParameters(NamedTuple):
    """Inertia rho A omega^2 [N/m^2], the loss factor, and tables for the first natural frequency."""

    inertia: float
    loss: float
    modes: Polynomials


class Motion(NamedTuple):
    """Contributions of inertia, for the kernels of the main results.

    side, moment, series        T [N] and M0 [N m], (n,), and Legendre coefficients over the strip of V'' [1/m],
                                (terms, n), of the response without ringing, at uniform angles
    mode_side, _moment, …       the same for unit amplitude of the first mode, the last of shape (terms,)
    ringing                     amplitude of the mode's ringing, at the angles of the results
    sign_unknown                whether the ringing may have either sign at any angle
    ringing_share               share of ringing in the first mode's maximum amplitude
    frequency                   mean of Omega
    phase                       the mode's phase after a revolution
    """

    side: Array
    moment: Array
    series: Array
    mode_side: float
    mode_moment: float
    mode_series: Array
    ringing: Array
    sign_unknown: bool
    ringing_share: float
    frequency: float
    phase: Phase


@kernel
def first_order_motion(
    states: Array, sampling: Sampling, every: int, strip: Strip, parameters: InertiaParameters, tables: Collocation
) -> Motion:
    """Return the motion over a revolution of an unbuckled strip from its states at the sampled angles; results are at
    every ``every``-th of them."""
    angle, order, ends, uniform = sampling.angle, sampling.order, sampling.ends, sampling.uniform
    l, per_force = strip.length, strip.length * strip.length / strip.stiffness
    head, inertia = (strip.rod_length - l) / l, parameters.inertia * l * l * per_force
    coupling = states[COUPLING] * l * l
    smooth, step = order.size == uniform, TURN / uniform
    frequency = first_frequencies(coupling, head, inertia, parameters.modes)
    deflection = _quasi_static(states, strip.compliance, l, head, tables)
    iterate, shape, at = _first_iterate(deflection, coupling, head, inertia, uniform, every, tables)
    projection = _projection(deflection, shape)
    least_step = extremes(frequency)[1] * step
    quasi_static, fast = np.empty(uniform), least_step > MAX_PHASE_FOR_SIGN
    for i in range(uniform):
        quasi_static[i] = -_second_difference(projection, i, uniform) / (step * frequency[i]) ** 2
    ringing, phase = np.zeros(order.size), Phase(1.0, 0.0)
    if not smooth or least_step <= MAX_PHASE_FOR_EXCITATION:
        response, amplitude, phase = first_mode_response(
            angle[order], projection[order], frequency[order], ends[order], parameters.loss, smooth
        )
        for i in range(order.size):
            k = order[i]
            if not fast:
                ringing[k] = response[i] - quasi_static[k if k < uniform else round(angle[k] / step) % uniform]
            elif k >= uniform:
                ringing[k] = max(amplitude[i], amplitude[i - 1])
        if fast:
            _fill_maximum_amplitudes(ringing, angle[order], amplitude, uniform)
    max_quasi_static, max_ringing = largest(quasi_static), largest(ringing)
    ringing_share = max_ringing / max(max_quasi_static, max_ringing) if max_ringing > 0.0 else 0.0
    count = order.size // every
    for i in range(count):
        # The inertia of a mode's motion is proportional to the square of its frequency.
        k = i * every
        scale = (frequency[k] / frequency[at * every]) ** 2
        # One sign applies to the whole revolution: that of the lateral displacement at every angle, or its opposite.
        ringing[i] = scale * (math.copysign(ringing[k], states[LATERAL, k]) if fast else ringing[k])
    sides, moments, series = -1.0 / per_force * iterate[0], strip.stiffness / l * iterate[1], iterate[2:] / l
    return Motion(
        sides, moments, series, sides[at], moments[at], series[:, at].copy(), ringing[:count],
        fast, ringing_share, frequency[:uniform].mean(), phase,
    )  # fmt: skip


@kernel
def _second_difference(values: Array, i: int, n: int) -> float:
    """Return the second difference of a periodic function at one of ``n`` uniform points."""
    return values[i - 1 if i > 0 else n - 1] - 2.0 * values[i] + values[i + 1 if i < n - 1 else 0]


@kernel
def _fill_maximum_amplitudes(ringing: Array, angle: Array, amplitude: Array, uniform: int) -> None:
    """Fill in, at ``uniform`` uniform angles, the maximum of the amplitudes at increasing angles [rad] within a step of
    each."""
    for i in range(amplitude.size):
        position = angle[i] / TURN * uniform
        for k in (math.floor(position), math.ceil(position)):
            ringing[k % uniform] = max(ringing[k % uniform], amplitude[i])


@kernel
def first_frequencies(coupling: Array, head: float, inertia: float, modes: Polynomials) -> Array:
    """Return Omega under axial forces with q_s l^2, as the square root of a parabola through three values of
    Omega^2."""
    squares, out, (high, low) = np.empty(3), np.empty(coupling.size), extremes(coupling)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for m in range(3):
        q = middle + (m - 1.0) * half
        squares[m] = (TURN * frequency_under(modes, 1.0, inertia, 1.0, 1.0 + head, q, FEW_POLYNOMIALS)) ** 2
    second, first = 0.5 * (squares[0] + squares[2]) - squares[1], 0.5 * (squares[2] - squares[0])
    for i in range(coupling.size):
        x = (coupling[i] - middle) / half if half > 0.0 else 0.0
        out[i] = math.sqrt(max(squares[1] + x * (first + x * second), 1e-6 * abs(squares[1])))
    return out


@kernel
def _quasi_static(states: Array, compliance: float, l: float, head: float, tables: Collocation) -> Array:
    """Return the Legendre coefficients of V/l at all angles, (angles, NODES + 2).

    V = W/m - g D z, where psi = W' obeys psi'' = q_s psi + D (``strip.shear``) and, at the head, W(l) + e m psi(l) = m
    (s + g D l), psi'(l) + e m psi''(l) = 0.
    """
    n, count = NODES, states.shape[1]
    workspace, none, curvature, out = scratch(n), np.zeros(n), np.empty(n + 2), np.empty((count, n + 2))
    for i in range(count):
        m, sheared = states[SOFTENING, i], compliance * states[SHEAR, i]
        offset = m * (states[LATERAL, i] / l + sheared)
        solve_bending(
            l * l * states[COUPLING, i], m * head, offset, 0.0, none, none, tables, workspace, curvature, out[i]
        )
        for k in range(n + 2):
            out[i, k] = out[i, k] / m
        # z/l is (P_0 + P_1)/2.
        out[i, 0] -= 0.5 * sheared
        out[i, 1] -= 0.5 * sheared
    return out


@kernel
def _first_iterate(
    deflection: Array, coupling: Array, head: float, inertia: float, count: int, every: int, tables: Collocation
) -> tuple[Array, Array, int]:
    """Return d at every ``every``-th of the first ``count`` angles, which are uniform, (NODES + 4, count/every); the
    Legendre coefficients of its shape at its maximum, (NODES + 2,), and the column of that maximum.

    Rows are Q and theta'(0) in units of the strip's length, then the Legendre coefficients of theta'. ``coupling`` is
    q_s l^2, ``inertia`` rho A omega^2 l^4/EI.
    """
    n = NODES
    workspace, load, none = scratch(n), np.zeros(n), np.zeros(n)
    out, shape = np.empty((n + 4, count // every)), np.zeros(n + 2)
    curvature, response, acceleration = np.empty(n + 2), np.empty(n + 2), np.empty(n + 2)
    scale, greatest, column = inertia * (count / TURN) ** 2, -1.0, 0
    for j in range(count // every):
        i = j * every
        previous, following = deflection[i - 1 if i > 0 else count - 1], deflection[i + 1 if i < count - 1 else 0]
        for k in range(n + 2):
            acceleration[k] = scale * (previous[k] - 2.0 * deflection[i, k] + following[k])
        load[0] = -(0.5 * acceleration[0] - acceleration[1] / 6.0)
        for k in range(1, n):
            load[k] = -(tables.low[k] * acceleration[k - 1] - tables.high[k] * acceleration[k + 1])
        q, c = solve_bending(
            coupling[i], head, 0.0, -acceleration[0], load, none, tables, workspace, curvature, response
        )
        out[0, j], out[1, j] = q, c
        for k in range(n + 2):
            out[2 + k, j] = curvature[k]
        if abs(response[0]) > greatest:
            greatest = abs(response[0])
            column = j
            for k in range(response.size):
                shape[k] = response[k]
    return out, shape, column


@kernel
def _projection(deflection: Array, shape: Array) -> Array:
    """Return the projection int V psi dz/int psi^2 dz of V on the shape psi at every angle."""
    out, norm = np.zeros(deflection.shape[0]), 0.0
    for k in range(shape.size):
        norm += shape[k] * shape[k] / (2 * k + 1)
    for i in range(out.size):
        for k in range(shape.size):
            out[i] += deflection[i, k] * shape[k] / (2 * k + 1)
        out[i] = out[i] / norm if norm > 0.0 else 0.0
    return out
