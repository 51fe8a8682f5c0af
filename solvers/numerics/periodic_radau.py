"""The periodic motion of a linear vibrating system whose coefficients are smooth between given angles.

    mu_n a_n'' + sum_m stiffness_nm(phi) a_m = right_n(phi),   a(phi + 2 pi) = a(phi)

Radau's collocation (order 2 s - 1, damps what its steps cannot follow) on elements that end where the coefficients
have corners, so that a corner costs no digits. Every element's stages are eliminated first: what is left maps its first
state to its last one. The product of these maps, the motion's monodromy matrix, closes the turn.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8; G. Floquet (1883).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

STAGES = 7
_BATCH = 1 << 20
"""Numbers in the matrices that are solved for at a time: they stay in the processor's caches."""


@cache
def nodes() -> Array:
    """Radau's points on (0, 1], the last one at 1."""
    series = np.zeros(STAGES + 1)
    series[STAGES - 1 :] = -1.0, 1.0
    return 0.5 * (np.sort(legendre.legroots(series).real) + 1.0)


@cache
def _integral() -> Array:
    """A: integrals from 0 to every point of the polynomials that are 1 at one point and 0 at the others."""
    x = 2.0 * nodes() - 1.0
    powers = legendre.legvander(x, STAGES - 1)
    columns = [legendre.legval(x, legendre.legint(row, lbnd=-1.0, scl=0.5)) for row in np.eye(STAGES)]
    return np.stack(columns, axis=1) @ np.linalg.inv(powers)


@cache
def _phase_errors() -> tuple[Array, Array]:
    """Logarithms of steps and of the errors that Radau's method makes in exp(i x) over them."""
    steps = np.geomspace(1.5, 20.0, 60)
    matrix = np.eye(STAGES) - 1j * steps[:, None, None] * _integral()
    last = np.linalg.solve(matrix, np.ones((steps.size, STAGES, 1)))[:, -1, 0]
    return np.log(steps), np.log(np.abs(last - np.exp(1j * steps)))


def phase_error(step: Array) -> Array:
    """The error of a free oscillation of amplitude 1 over elements of so many radians."""
    steps, errors = _phase_errors()
    place = np.log(np.maximum(step, 1e-300))
    # On shorter ones rounding would hide it: it falls with the order plus one.
    return np.exp(np.interp(place, steps, errors) + 2.0 * STAGES * np.minimum(place - steps[0], 0.0))


def steady_motion(widths: Array, slowness: Array, stiffness: Array, right: Array) -> tuple[Array, float]:
    """The periodic motion from the stiffness (elements, stages, modes, modes) and right side (elements, stages,
    modes) at the points of elements of these widths; without swing the stiffness is about the unit matrix.

    Gives amplitudes at the first end and the points of every element, shape (elements, 1 + stages, modes), and the
    greatest factor by which closing the turn enlarges what one turn misses.
    """
    modes = slowness.size
    size = STAGES * modes
    each = max(1, _BATCH // (size * size))
    stages = np.concatenate(
        [
            _stages(widths[i : i + each], slowness, stiffness[i : i + each], right[i : i + each])
            for i in range(0, widths.size, each)
        ]
    )
    # The state is (a, sqrt(mu) a'), in which a free motion of the mean system keeps its length.
    first = np.zeros((modes, 2 * modes + 1))
    first[:, :modes] = np.eye(modes)
    steepest = np.linalg.inv(_integral())[-1]
    speed = np.einsum("j,kjnm->knm", steepest, stages) - steepest.sum() * first
    speed *= (np.sqrt(slowness) / widths[:, None])[:, :, None]
    step = np.concatenate([stages[:, -1], speed], axis=1)
    whole = np.eye(2 * modes, 2 * modes + 1)
    for one in step:
        whole = one[:, :-1] @ whole
        whole[:, -1] += one[:, -1]
    closing = np.eye(2 * modes) - whole[:, :-1]
    least = float(np.linalg.svd(closing, compute_uv=False)[-1])
    state = np.linalg.solve(closing, whole[:, -1]) if least > 0 else np.full(2 * modes, np.inf)
    states = np.empty((widths.size, 2 * modes))
    for k, one in enumerate(step):
        states[k] = state
        state = one[:, :-1] @ state + one[:, -1]
    inner = np.einsum("kjnm,km->kjn", stages[..., :-1], states) + stages[..., -1]
    return np.concatenate([states[:, None, :modes], inner], axis=1), 1.0 / least if least > 0 else np.inf


def _stages(widths: Array, slowness: Array, stiffness: Array, right: Array) -> Array:
    """Amplitudes at the points of every element for unit first states and, last, for the right side alone.

    Shape (elements, stages, modes, 2 modes + 1). With v = a' the stages obey a_i = a_0 + c_i h v_0 + h^2 sum_j (A^2)_ij
    a''_j, multiplied by mu here, so that even infinitely fast modes have their place.
    """
    count, modes = widths.size, slowness.size
    twice, square = _integral() @ _integral(), widths**2
    weight = 1.0 / (slowness + square[:, None])
    matrix = (square[:, None] * weight)[:, None, :, None, None] * twice[None, :, None, :, None]
    matrix = matrix * stiffness.transpose(0, 2, 1, 3)[:, None]
    diagonal = np.einsum("kinin->kin", matrix)
    diagonal += (slowness * weight)[:, None, :]
    unit = np.zeros((count, STAGES, modes, 2 * modes + 1))
    n = np.arange(modes)
    unit[:, :, n, n] = (slowness * weight)[:, None, :]
    unit[:, :, n, modes + n] = (np.sqrt(slowness) * weight * widths[:, None])[:, None, :] * nodes()[:, None]
    unit[..., -1] = (square[:, None] * weight)[:, None, :] * np.einsum("ij,kjn->kin", twice, right)
    size = STAGES * modes
    found = np.linalg.solve(matrix.reshape(count, size, size), unit.reshape(count, size, -1))
    return found.reshape(unit.shape)
