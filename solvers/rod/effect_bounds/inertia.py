"""Inertia of the strip, to first order: response to the quasi-static motion, and the first mode's own motion.

    EI d'''' - P(phi) d'' = -rho A omega^2 V_phiphi,     d clamped, with the pin at no offset

V is the quasi-static shape and P, of a strip flexible in shear, that of q_s (``strip.shear``); d is the first of the
iterates whose sum is the motion without ringing; each angle is solved independently (``strip.elastica_kernels``). The
first mode, with the share c(phi) of V projected on the shape of d, obeys

    a'' + eta Omega a' + Omega(phi)^2 a = -c'',     Omega = omega_1(P)/omega,  eta the loss factor

which is solved exactly on steps with constant Omega and linear c'', with periodic closure: this includes harmonics near
a resonance, corners and jumps of the load, however narrow, and the variation of Omega. Its difference from
-c''/Omega^2, which d already contains, is added in d's shape. A mode too fast for the step width is represented by its
amplitude, and for a smooth load by the corners due to friction.

The periodic closure depends on the phase after a revolution, which is shifted toward resonance by its uncertainty.
Faster modes ring too and are not computed: ``first_order`` has margins for them.

Sources: G. Floquet (1883); A. Erdelyi, Asymptotic Expansions (1956), section 2.9, for the ringing that corners excite.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import COUPLING, FORCE, MOMENT, SHEAR, SIDE, SOFTENING, STROKE, Strip
from solvers.rod.effect_bounds.first_mode import Phase, certain_sine, divisor, own_motion
from solvers.rod.effect_bounds.sampling import Sampling
from solvers.rod.strip.elastica_kernels import Collocation, bent_by, scratch

Array = NDArray[np.float64]

NODES = 12
"""Legendre polynomials along the strip: boundary layers of 1/20 of it are resolved as well as an estimate requires."""

SIGNED, FOLLOWED = 0.5, 2.0
"""First-mode phase [rad] per uniform step above which the steps may miss its maximum, and above which they do not
resolve its excitation."""

_FIRST_ROUNDS, _ROUNDS = 6, 3
"""Inverse iterations for the natural frequency under the first force, and from its mode under the others."""

_TURN = 2.0 * math.pi


class Inert(NamedTuple):
    """rho A omega^2 [N/m^2], the loss factor, and P_cr [N] in the crank's plane, rigid in shear."""

    line_mass: float
    loss: float
    critical: float


class Motion(NamedTuple):
    """Contributions of inertia, for the kernels of the main results.

    side, moment, series        T [N] and M0 [N m], (n,), and Legendre coefficients over the strip of V'' [1/m],
                                (terms, n), of the response that follows the load, at uniform angles
    mode_side, _moment, …       the same of a unit of the first mode's motion, the last of shape (terms,)
    rings, steeper              the mode's ringing, and what else it does where the load is sharper than between uniform
                                angles, at the judged angles
    either                      whether the ringing may have either sign at any angle
    share                       share of ringing in the first mode's maximum motion
    pace                        mean of Omega
    sine                        |sin| of half the phase after a revolution
    nearer                      how much nearer to resonance it is assumed
    detuning                    relative change of the ringing per change of the sine, at its steepest between the two
    """

    side: Array
    moment: Array
    series: Array
    mode_side: float
    mode_moment: float
    mode_series: Array
    rings: Array
    steeper: Array
    either: bool
    share: float
    pace: float
    sine: float
    nearer: float
    detuning: float


@kernel
def motion_of(
    states: Array, sampling: Sampling, every: int, strip: Strip, inert: Inert, tables: Collocation, nearer: float
) -> Motion:
    """The motion over a revolution of an unbuckled strip from its states at the sampled angles, returned at every
    ``every``-th uniform one.

    ``nearer`` is that of a strip to compare with, or negative: by the uncertainty of the phase.
    """
    angle, order, ends, even = sampling.angle, sampling.order, sampling.ends, sampling.even
    loss, l, per_force = inert.loss, strip.length, strip.length * strip.length / strip.stiffness
    head, inertia, coupling = (strip.rod_length - l) / l, inert.line_mass * l * l * per_force, states[COUPLING] * l * l
    smooth, step = order.size == even, _TURN / even
    pace = paces(coupling, head, inertia, tables)
    rise = _quasi_static(states, strip.compliance, l, head, tables)
    rows, shape, greatest = _first_iterate(rise, coupling, head, inertia, even, every, tables)
    share = _share_of(rise, shape)
    follows, fast = np.empty(even), pace.min() * step > SIGNED
    for i in range(even):
        follows[i] = -_second_difference(share, i, even) / (step * pace[i]) ** 2
    # Steps too wide for the mode do not resolve ringing after corners, so it is added separately.
    corners = _corners_ring(states, even, share, pace, loss, strip, inert.critical) if smooth and fast else 0.0
    rings, steeper, phase = np.zeros(order.size), np.zeros(order.size), Phase(1.0, 0.0, 0.0)
    if smooth and pace.min() * step > FOLLOWED:
        for i in range(even):
            # The quasi-static response is the first term of a series; the second difference estimates the next one.
            rings[i] = corners / math.sqrt(pace[i]) + abs(_second_difference(follows, i, even)) / (step * pace[i]) ** 2
    else:
        own, still, free, phase = own_motion(angle[order], share[order], pace[order], ends[order], loss, smooth, nearer)
        for i in range(order.size):
            k = order[i]
            near = follows[k if k < even else round(angle[k] / step) % even]
            if not fast:
                rings[k] = own[i] - near
            elif not smooth:
                steeper[k] = still[i] - near
        if fast:
            _fill_amplitudes(rings, angle[order], free, even)
            for i in range(order.size):
                if order[i] >= even:
                    rings[order[i]] = max(free[i], free[i - 1])
            for i in range(even):
                rings[i] = max(rings[i], corners / math.sqrt(pace[i]))
    whole, most = np.abs(follows).max(), np.abs(rings).max()
    count = order.size // every
    for i in range(count):
        # The inertia of a mode's motion is proportional to the square of its frequency.
        k = i * every
        rate = (pace[k] / pace[greatest * every]) ** 2
        # Use one sign for the whole revolution: that of the stroke at every angle, or its opposite at every angle.
        rings[i] = rate * (math.copysign(rings[k], states[STROKE, k]) if fast else rings[k])
        steeper[i] = rate * steeper[k]
    sides, moments = -1.0 / per_force, strip.stiffness / l
    return Motion(
        sides * rows[0], moments * rows[1], rows[2:] / l, sides * rows[0, greatest], moments * rows[1, greatest],
        rows[2:, greatest] / l, rings[:count], steeper[:count], fast, most / max(whole, most) if most > 0.0 else 0.0,
        pace[:even].mean(), phase.sine, phase.nearer, phase.detuning,
    )  # fmt: skip


@kernel
def _second_difference(values: Array, i: int, n: int) -> float:
    """Second difference of a periodic function at one of ``n`` uniform points."""
    return values[i - 1 if i > 0 else n - 1] - 2.0 * values[i] + values[i + 1 if i < n - 1 else 0]


@kernel
def _fill_amplitudes(rings: Array, angle: Array, free: Array, even: int) -> None:
    """The maximum amplitude within a step of each of ``even`` uniform angles, from those at increasing angles [rad]."""
    for i in range(free.size):
        at = angle[i] / _TURN * even
        for k in (math.floor(at), math.ceil(at)):
            rings[k % even] = max(rings[k % even], free[i])


@kernel
def paces(coupling: Array, head: float, inertia: float, tables: Collocation) -> Array:
    """Omega under axial forces with q_s l^2: the square root of a parabola through three values of Omega^2.

    Each is the first eigenvalue of d'''' - q d'' = inertia Omega^2 d by inverse iteration with the Rayleigh quotient.
    """
    n = NODES
    room, none, load = scratch(n), np.zeros(n), np.empty(n)
    bend, shape, sunk = np.empty(n + 2), np.zeros(n + 2), np.empty(n + 2)
    least, most = coupling.min(), coupling.max()
    squares, shape[0] = np.empty(3), 1.0
    for m in range(3):
        q = least + 0.5 * m * (most - least)
        for _ in range(_FIRST_ROUNDS if m == 0 else _ROUNDS):
            load[0] = 0.5 * shape[0] - shape[1] / 6.0
            for k in range(1, n):
                load[k] = tables.low[k] * shape[k - 1] - tables.high[k] * shape[k + 1]
            bent_by(q, head, 0.0, shape[0], load, none, tables, room, bend, sunk)
            product, square = 0.0, 0.0
            for k in range(n + 2):
                product += sunk[k] * shape[k] / (2 * k + 1)
                square += sunk[k] * sunk[k] / (2 * k + 1)
            for k in range(n + 2):
                shape[k] = sunk[k] / math.sqrt(square)
        squares[m] = product / (square * inertia)
    out, middle = np.empty(coupling.size), 0.5 * (least + most)
    bent, tilt = 0.5 * (squares[0] + squares[2]) - squares[1], 0.5 * (squares[2] - squares[0])
    half = 0.5 * (most - least)
    for i in range(coupling.size):
        x = (coupling[i] - middle) / half if half > 0.0 else 0.0
        out[i] = math.sqrt(max(squares[1] + x * (tilt + x * bent), 1e-6 * abs(squares[1])))
    return out


@kernel
def _quasi_static(states: Array, compliance: float, l: float, head: float, tables: Collocation) -> Array:
    """Legendre coefficients of V over the strip's length at all angles, (angles, NODES + 2).

    V = W/m - g D z, where psi = W' obeys psi'' = q_s psi + D (``strip.shear``) and, from the conditions at the head,
    W(l) + e m psi(l) = m (s + g D l), psi'(l) + e m psi''(l) = 0.
    """
    n, count = NODES, states.shape[1]
    room, none, bend, out = scratch(n), np.zeros(n), np.empty(n + 2), np.empty((count, n + 2))
    for i in range(count):
        m, leant = states[SOFTENING, i], compliance * states[SHEAR, i]
        offset = m * (states[STROKE, i] / l + leant)
        bent_by(l * l * states[COUPLING, i], m * head, offset, 0.0, none, none, tables, room, bend, out[i])
        for k in range(n + 2):
            out[i, k] = out[i, k] / m
        # z/l is (P_0 + P_1)/2.
        out[i, 0] -= 0.5 * leant
        out[i, 1] -= 0.5 * leant
    return out


@kernel
def _first_iterate(
    rise: Array, coupling: Array, head: float, inertia: float, count: int, every: int, tables: Collocation
) -> tuple[Array, Array, int]:
    """d at every ``every``-th of the first ``count`` angles, which are uniform: (NODES + 4, count/every); the Legendre
    coefficients of its shape at its maximum, (NODES + 2,), and that column's index.

    Rows are Q and theta'(0) in units of the strip's length, then the Legendre coefficients of theta'. ``coupling`` is
    q_s l^2, ``inertia`` rho A omega^2 l^4/EI.
    """
    n = NODES
    room, load, none = scratch(n), np.zeros(n), np.zeros(n)
    out, shape = np.empty((n + 4, count // every)), np.zeros(n + 2)
    bend, sunk, moved = np.empty(n + 2), np.empty(n + 2), np.empty(n + 2)
    scale, greatest, where = inertia * (count / _TURN) ** 2, -1.0, 0
    for j in range(count // every):
        i = j * every
        before, after = rise[i - 1 if i > 0 else count - 1], rise[i + 1 if i < count - 1 else 0]
        for k in range(n + 2):
            moved[k] = scale * (before[k] - 2.0 * rise[i, k] + after[k])
        load[0] = -(0.5 * moved[0] - moved[1] / 6.0)
        for k in range(1, n):
            load[k] = -(tables.low[k] * moved[k - 1] - tables.high[k] * moved[k + 1])
        q, c = bent_by(coupling[i], head, 0.0, -moved[0], load, none, tables, room, bend, sunk)
        out[0, j], out[1, j] = q, c
        for k in range(n + 2):
            out[2 + k, j] = bend[k]
        if abs(sunk[0]) > greatest:
            greatest = abs(sunk[0])
            where = j
            for k in range(sunk.size):
                shape[k] = sunk[k]
    return out, shape, where


@kernel
def _share_of(rise: Array, shape: Array) -> Array:
    """int V psi dz/int psi^2 dz at every angle: the projection on the shape psi."""
    out, whole = np.zeros(rise.shape[0]), 0.0
    for k in range(shape.size):
        whole += shape[k] * shape[k] / (2 * k + 1)
    for i in range(out.size):
        for k in range(shape.size):
            out[i] += rise[i, k] * shape[k] / (2 * k + 1)
        out[i] = out[i] / whole if whole > 0.0 else 0.0
    return out


@kernel
def _corners_ring(
    states: Array, count: int, share: Array, pace: Array, loss: float, strip: Strip, critical: float
) -> float:  # fmt: skip
    """Ringing amplitude of a fast mode after the corners due to friction between ``count`` uniform angles, times
    Omega^(1/2), which is invariant while Omega varies slowly.

    Where 6 |M|/Lp = |T|, F'' jumps by (4/pi) mu |T| ((6 |M|/(|T| Lp))')^2.
    """
    total, phase, step = 0.0, 0.0, _TURN / count
    friction, lever, offset = strip.friction, strip.lever, strip.offset
    for i in range(count):
        j = (i + 1) % count
        phase += pace[i] * step
        here, after = abs(states[SIDE, i]), abs(states[SIDE, j])
        skew = lever * abs(states[MOMENT, i] + states[SIDE, i] * offset) - here
        skew_after = lever * abs(states[MOMENT, j] + states[SIDE, j] * offset) - after
        if friction == 0.0 or skew * skew_after >= 0.0:
            continue
        at = skew / (skew - skew_after)
        side, rate = here + at * (after - here), (skew_after - skew) / step
        force = states[FORCE, i] + at * (states[FORCE, j] - states[FORCE, i])
        stiff = max(critical + force - friction * side, 1e-3 * critical)
        moved = abs(share[i] + at * (share[j] - share[i])) / stiff
        total += friction * rate * rate / side * moved / pace[i] ** 1.5
    kept = math.exp(-0.5 * loss * phase)
    return total * max(1.0, 1.0 / divisor(kept, certain_sine(abs(math.sin(0.5 * phase)), phase)))
