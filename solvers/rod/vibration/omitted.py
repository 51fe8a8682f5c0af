"""Error due to modes whose ringing is omitted: in values throughout the revolution, in greatest values, and in means.

Behind a corner a mode rings with an amplitude of at most r, which decays with the angle y from there as exp(-eta omega
y/2). The greatest value of f over the revolution is affected only near points at which it is attained, or could be with
that ringing: by at most the maximum over the revolution of

    min(r, (f + r - max f)_+)

The weights of a mean have few jumps and kinks; each contributes an error of about r/omega per mode.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import Radau
from solvers.rod.cycle.state import FORCE, SIDE, bend_states
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import Excitation

_MARGIN = 2.0
"""Safety factor on the ringing of omitted modes."""
_DISCONTINUITIES = 8
"""Assumed number of jumps and kinks in the weights of a mean."""
_EXTRAPOLATED = 3
"""Modes extrapolated one by one, per known mode."""
_TRANSFERRED = 1e-5
"""Fraction of the omitted ringing that appears in other modes, which decay more slowly: 4e-6 was observed."""
_SECTIONS = np.linspace(0.0, 1.0, 5)
_SIGNS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


def known_modes(fast: int, slow: int) -> int:
    """Number of fast modes whose frequencies the polynomials give to a hundredth of a radian per revolution: those
    among the slower half of all modes, less one."""
    return max((fast + slow) // 2 - 1 - slow, 1)


def omitted_sums(shares: Array, slow: int, decay: float) -> Array:
    """Error of omitting all modes from one on, for each known mode and for the one after them, from the amplitudes
    ``shares`` of the fast modes: beyond the known ones these are assumed to decrease as n^-decay. Behind a corner modes
    ring in phase, so their amplitudes are summed."""
    known = known_modes(shares.size, slow)
    beyond = shares[known - 1] * (known + slow) / (decay - 1.0)
    return _MARGIN * (np.append(np.cumsum(shares[:known][::-1])[::-1], 0.0) + beyond)


def choose_ringing(shares: Array, slow: int, decay: float, max_ringing: int, tolerance: float) -> tuple[int, float]:
    """Number of fast modes that are to ring, and the error of omitting the others, from the amplitudes ``shares`` with
    which they would ring."""
    if not shares.size:
        # All modes are slow.
        return 0, 0.0
    errors = omitted_sums(shares, slow, decay)
    sufficient = np.flatnonzero(errors <= 0.5 * tolerance)
    ringing = min(int(sufficient[0]) if sufficient.size else errors.size - 1, max_ringing)
    return ringing, float(errors[ringing])


def error_of_means(equation: StripEquation, ringing_shares: Array, slow: int, decay: float, ringing: int) -> float:
    """Error in means over the revolution of omitting all but ``ringing`` fast modes, from their amplitudes as fractions
    of V'' and V''', (2, corners, fast)."""
    largest = ringing_shares.max(axis=0)
    errors = (largest.sum(axis=0) + _DISCONTINUITIES * largest.max(axis=0)) / (0.5 * TURN * equation.frequencies[slow:])
    return float(omitted_sums(np.minimum(errors, largest.max(axis=0)), slow, decay + 2.0)[ringing])


def omission_errors(
    equation: StripEquation, excitation: Excitation, rule: Radau, edges: Array, states: Array, samples: Array,
    ringing_shares: Array, greatest: Array, slow: int, decay: float, ringing: int,
) -> tuple[float, float]:  # fmt: skip
    """Error of omitting all but ``ringing`` fast modes: in greatest values, relative to the greatest of their kind
    (side force, clamp moment, contact load, and stress at sections of the strip); and in a mean of the wall force
    weighted with the piston's speed, which has kinks at corners and where side force and couple change sign.

    Inputs: states (rows, elements points) and d in amplitudes of the basis (elements, points, basis) at the points of a
    rule on elements between ``edges``, and amplitudes of ringing as fractions of the ``greatest`` V'' and V''' (2,).
    """
    strip, (count, p, basis) = equation.strip, samples.shape
    d = samples.reshape(-1, basis).T
    third = equation.basis.values(np.zeros(1), 3)[0] @ d - states[SIDE] / strip.stiffness
    second = equation.basis.values(_SECTIONS, 2) @ d
    workspace, curvature = np.empty((2, d.shape[1])), np.empty(d.shape[1])
    for k, zeta in enumerate(_SECTIONS.tolist()):
        z = zeta * strip.length
        bend_states(states, strip.length, z, curvature, *workspace)
        second[k] += curvature
    values = np.vstack([states[FORCE] * excitation.curvature_per_force, second, third]).reshape(-1, count, p)

    # Bounds on each mode's ringing at the points, (modes, 2, elements, points), from the corner before them.
    corner = np.searchsorted(excitation.corners, edges[:-1], side="right") - 1
    angle = edges[:-1, None] + np.diff(edges)[:, None] * rule.points
    known = known_modes(ringing_shares.shape[2], slow)
    number, share = _further_modes(known + slow, decay)
    frequency, amplitude = equation.frequencies[slow : slow + known], _MARGIN * ringing_shares[:, corner, :known]
    frequency = np.concatenate([frequency, frequency[-1] * number**2])
    amplitude = np.concatenate([amplitude, amplitude[..., -1:] * share], axis=2).transpose(2, 0, 1)[..., None]
    elapsed = angle - excitation.corners[corner, None]
    amplitude = amplitude * np.exp(-0.5 * equation.loss * frequency[:, None, None] * elapsed)[:, None]

    resolved, unresolved = amplitude[:ringing].sum(axis=0), amplitude[ringing:].sum(axis=0)
    # A mode's V'' is at most that at the clamp along the strip; its axial stress is zero.
    rows = np.array([0] * _SECTIONS.size + [1])
    resolved_values, unresolved_values = (
        np.concatenate([np.zeros((1, count, p)), (greatest[:, None, None] * f)[rows]]) for f in (resolved, unresolved)
    )
    error = 0.0
    *loads, stress = _combinations(strip.lever, strip.offset)
    for weights in (*loads, stress):
        f, r, e = (
            np.tensordot(w, v, 1)
            for w, v in ((weights, values), (abs(weights), resolved_values), (abs(weights), unresolved_values))
        )
        # Every section has its own extreme stresses; those below half of the greatest do not govern.
        governing = (f - r).max(axis=(1, 2))
        governing = np.maximum(governing, (0.5 if weights is stress else 1.0) * governing.max())
        excess = np.maximum(f[..., :-1], f[..., 1:]) + (r + e)[..., :-1] - governing[:, None, None]
        error = max(error, float(np.max(np.clip(excess, 0.0, e[..., :-1])) / np.abs(f).max()))

    error += _TRANSFERRED * float(unresolved.max())
    speed, amplitude, frequency = np.abs(np.sin(angle)), amplitude[ringing:].max(axis=1), frequency[ringing:]
    first, side, couple = excitation.panels(edges), values[-1], values[1] - strip.offset * values[-1]
    mean_errors = np.sum(amplitude[:, first, 0] * (speed[first, 0] + 1.0 / frequency[:, None]), axis=1)
    for f in (side, couple):
        e, i = np.nonzero(f[:, :-1] * f[:, 1:] <= 0.0)
        mean_errors += 2.0 * np.sum(amplitude[:, e, i] * np.maximum(speed[e, i], speed[e, i + 1]), axis=1)
    return error, float(np.sum(mean_errors / (0.5 * TURN * frequency)))


def _further_modes(known: int, decay: float) -> tuple[Array, Array]:
    """Mode numbers beyond the known ones, relative to the last of these, and their relative ringing amplitudes; the
    last one includes all that follow."""
    number = 1.0 + np.arange(1, _EXTRAPOLATED * known + 1) / known
    share = number**-decay
    share[-1] += known * number[-1] ** (1.0 - decay) / (decay - 1.0)
    return number, share


def _combinations(lever: float, offset: float) -> list[Array]:
    """Combinations of axial stress, V'' at the sections and V''' at the clamp whose greatest values matter,
    (combinations, values) each: +-V''' for the side force, +-V'' for the moment, both with lever and offset of the
    skirt for the contact load; and the stresses on both sides of the strip with either sign."""
    side, moment, stress = (np.zeros((n, 2 + _SECTIONS.size)) for n in (4, 4, 4 * _SECTIONS.size))
    side[:, -1] = _SIGNS[:, 0]
    moment[:, 1] = _SIGNS[:, 0]
    contact = -side
    contact[:, [1, -1]] += _SIGNS[:, 1:] * np.array([lever, -lever * offset])
    for k in range(_SECTIONS.size):
        stress[4 * k : 4 * k + 4, [0, 1 + k]] = _SIGNS
    return [side, moment, contact, stress]
