"""What modes that are not made to ring leave unknown: anywhere in the turn, in greatest values, and in means.

Behind a corner a mode rings with at most r, which falls with the angle y from there as exp(-eta omega y/2). The
greatest value of f over the turn suffers where it is reached, or could be with that ringing: by at most the greatest of

    min(r, (f + r - max f)_+)

Weights of a mean have few jumps and kinks; each leaves about r/omega of a mode.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.radau import Radau
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SIDE
from solvers.rod.strip.shape import bend
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import TURN, Excitation

Array = NDArray[np.float64]

_MARGIN = 2.0
"""On the ringing of what is left out."""
_ENDS = 8
"""Angles at which the weights of a mean jump or turn, taken for so many."""
_FURTHER = 3
"""Times the number of known modes, up to which others are told apart."""
_PASSED_ON = 1e-5
"""Share of what is left out that others, which fall more slowly, ring with instead: 4e-6 was found."""
_SECTIONS = np.linspace(0.0, 1.0, 5)
_SIGNS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


def known_modes(fast: int, slow: int) -> int:
    """Of so many of the fast modes the polynomials tell the frequencies to a hundredth of a radian in a turn: of fewer
    than the slower half of all."""
    return max((fast + slow) // 2 - 1 - slow, 1)


def left_out(shares: Array, slow: int, falls: float) -> Array:
    """What all modes from one on leave out, for every one that is known, and for the one behind these, from what each
    of the fast modes may leave: beyond the known ones that is taken to fall as n^-falls. Behind a corner modes ring in
    step: their shares add up."""
    known = known_modes(shares.size, slow)
    beyond = shares[known - 1] * (known + slow) / (falls - 1.0)
    return _MARGIN * (np.append(np.cumsum(shares[:known][::-1])[::-1], 0.0) + beyond)


def chosen(shares: Array, slow: int, falls: float, most: int, wanted: float) -> tuple[int, float]:
    """How many fast modes are to ring, and what the others leave out, from what each would ring with."""
    if not shares.size:
        # All modes are followed.
        return 0, 0.0
    left = left_out(shares, slow, falls)
    enough = np.flatnonzero(left <= 0.5 * wanted)
    ringing = min(int(enough[0]) if enough.size else left.size - 1, most)
    return ringing, float(left[ringing])


def in_means(equation: StripEquation, rings: Array, slow: int, falls: float, ringing: int) -> float:
    """What all but so many ``ringing`` modes leave in a mean over the turn, from what each fast one rings with, as
    shares of V'' and V''', (2, corners, fast)."""
    each = rings.max(axis=0)
    left = (each.sum(axis=0) + _ENDS * each.max(axis=0)) / (0.5 * TURN * equation.pace[slow:])
    return float(left_out(np.minimum(left, each.max(axis=0)), slow, falls + 2.0)[ringing])


def left_behind(
    equation: StripEquation, excitation: Excitation, rule: Radau, edges: Array, states: Array, samples: Array,
    rings: Array, greatest: Array, slow: int, falls: float, ringing: int,
) -> tuple[float, float]:  # fmt: skip
    """What they leave in greatest values, relative to the greatest of their kind (side force, clamp moment, contact
    load, and stress at sections of the strip), and in a mean of the wall force, weighed with the piston's speed: at
    corners and where side force and couple change their sign.

    From states (rows, elements points) and d in amplitudes of the basis (elements, points, basis) at a rule's points of
    elements between edges, and ``rings`` as shares of ``greatest`` V'' and V''' (2,).
    """
    strip, (count, p, basis) = equation.strip, samples.shape
    d = samples.reshape(-1, basis).T
    third = equation.basis.values(np.zeros(1), 3)[0] @ d - states[SIDE] / strip.stiffness
    second = equation.basis.values(_SECTIONS, 2) @ d
    unused, bent = np.empty((2, d.shape[1])), np.empty(d.shape[1])
    for k, zeta in enumerate(_SECTIONS.tolist()):
        z = zeta * strip.length
        bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], strip.length, z, bent, *unused)
        second[k] += bent
    values = np.vstack([states[FORCE] * excitation.stretch, second, third]).reshape(-1, count, p)

    # What every mode may ring with at the points, (modes, 2, elements, points): it began at the corner before them.
    behind = np.searchsorted(excitation.corners, edges[:-1], side="right") - 1
    angle = edges[:-1, None] + np.diff(edges)[:, None] * rule.points
    known = known_modes(rings.shape[2], slow)
    number, share = _beyond(known + slow, falls)
    pace, around = equation.pace[slow : slow + known], _MARGIN * rings[:, behind, :known]
    pace = np.concatenate([pace, pace[-1] * number**2])
    around = np.concatenate([around, around[..., -1:] * share], axis=2).transpose(2, 0, 1)[..., None]
    since = angle - excitation.corners[behind, None]
    around = around * np.exp(-0.5 * equation.loss * pace[:, None, None] * since)[:, None]

    heard, left = around[:ringing].sum(axis=0), around[ringing:].sum(axis=0)
    # Of a mode's V'' the greatest is taken for that at the clamp; its axial stress is nought.
    of = np.array([0] * _SECTIONS.size + [1])
    rung, unknown = (
        np.concatenate([np.zeros((1, count, p)), (greatest[:, None, None] * f)[of]]) for f in (heard, left)
    )
    most = 0.0
    *loads, stress = _kinds(strip.lever, strip.offset)
    for weights in (*loads, stress):
        f, r, e = (np.tensordot(w, v, 1) for w, v in ((weights, values), (abs(weights), rung), (abs(weights), unknown)))
        # Of stresses every section has its own greatest and least; those below half of the greatest do not govern.
        least = (f - r).max(axis=(1, 2))
        least = np.maximum(least, (0.5 if weights is stress else 1.0) * least.max())
        over = np.maximum(f[..., :-1], f[..., 1:]) + (r + e)[..., :-1] - least[:, None, None]
        most = max(most, float(np.max(np.clip(over, 0.0, e[..., :-1])) / np.abs(f).max()))

    most += _PASSED_ON * float(left.max())
    speed, around, pace = np.abs(np.sin(angle)), around[ringing:].max(axis=1), pace[ringing:]
    first, side, couple = excitation.panels(edges), values[-1], values[1] - strip.offset * values[-1]
    ends = np.sum(around[:, first, 0] * (speed[first, 0] + 1.0 / pace[:, None]), axis=1)
    for f in (side, couple):
        e, i = np.nonzero(f[:, :-1] * f[:, 1:] <= 0.0)
        ends += 2.0 * np.sum(around[:, e, i] * np.maximum(speed[e, i], speed[e, i + 1]), axis=1)
    return most, float(np.sum(ends / (0.5 * TURN * pace)))


def _beyond(known: int, falls: float) -> tuple[Array, Array]:
    """Numbers of modes behind so many known ones, relative to the last of these, and what they ring with relative to
    it; the last number is taken for all that follow."""
    number = 1.0 + np.arange(1, _FURTHER * known + 1) / known
    share = number**-falls
    share[-1] += known * number[-1] ** (1.0 - falls) / (falls - 1.0)
    return number, share


def _kinds(lever: float, offset: float) -> list[Array]:
    """Combinations of axial stress, V'' at the sections and V''' at the clamp, (combinations, values), the greatest of
    which are looked at: +-V''' for the side force, +-V'' for the moment, and with lever and offset of the skirt for the
    contact load; the stresses of both sides, and less them."""
    side, moment, stress = (np.zeros((n, 2 + _SECTIONS.size)) for n in (4, 4, 4 * _SECTIONS.size))
    side[:, -1] = _SIGNS[:, 0]
    moment[:, 1] = _SIGNS[:, 0]
    contact = -side
    contact[:, [1, -1]] += _SIGNS[:, 1:] * np.array([lever, -lever * offset])
    for k in range(_SECTIONS.size):
        stress[4 * k : 4 * k + 4, [0, 1 + k]] = _SIGNS
    return [side, moment, contact, stress]
