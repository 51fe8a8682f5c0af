"""What a check is judged by, of one sampled turn: the numbers that an effect must not change unnoticed.

    sigma+- = N/(b h) +- (E h/2) psi',   T,   M0,   4/(pi D Lp) (|T| + 6 |M0 + T e|/Lp),   F |v|,   P

at equal steps along the strip and at given angles: extremes are those of the samples. Two turns sampled alike are
compared, and what sampling leaves out of the one it leaves out of the other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.jit import kernel, reducing_kernel
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SOFTENING
from solvers.rod.piston.skirt import both_walls
from solvers.rod.strip.shape import bend

Array = NDArray[np.float64]

STATIONS = 17

UTILISATION, STRESS, PUSH, PULL, SIDE, MOMENT, CONTACT, POWER = range(8)
"""1/n of fatigue, greatest |sigma| [Pa], greatest compression and tension [N] (of either sign), greatest T [N], M0
[N m] and contact load |T| + 6 |M0 + T e|/Lp [N], mean of int |q| ds |v| [N m/rad]."""

RESULTS = 8


class Section(NamedTuple):
    """1/(b h) [1/m^2], E h/2 [Pa m], and the fatigue diagram (``solvers.fatigue.kernels``)."""

    direct: float
    bending: float
    lines: Array
    parabola: Array


class Skirt(NamedTuple):
    """6/Lp [1/m] and the clamp's offset e [m]."""

    lever: float
    offset: float


class Judged(NamedTuple):
    """The results (RESULTS,), and of every fibre and station the utilisation and the stress amplitude [Pa],
    (2, 2, stations)."""

    results: Array
    sections: Array


@reducing_kernel
def _extremes(f: Array) -> tuple[float, float]:
    high, low = -np.inf, np.inf
    for i in range(f.size):
        high, low = max(high, f[i]), min(low, f[i])
    return high, low


@kernel
def judge(
    states: Array, side: Array, moment: Array, series: Array, inclined: bool, length: float, compliance: float,
    skirt: Skirt, section: Section, speeds: Array,
) -> Judged:  # fmt: skip
    """The main results of a table of states (``cycle.state``), one column an angle.

    ``side`` and ``moment`` hold T and M0 with all corrections, (n,); ``series`` the Legendre coefficients over the strip
    of what corrections add to V'' [1/m], (terms, n), or no terms; ``inclined`` says whether N follows the strip's
    slope. ``speeds`` are |dx/dphi| [m] times each sample's share of the turn.
    """
    n = states.shape[1]
    results, sections = np.zeros(RESULTS), np.empty((2, 2, STATIONS))
    force = states[FORCE]
    pull, push = _extremes(force)
    results[PUSH], results[PULL] = -push, pull
    for i in range(n):
        t, couple = abs(side[i]), skirt.lever * abs(moment[i] + side[i] * skirt.offset)
        results[SIDE], results[MOMENT] = max(results[SIDE], t), max(results[MOMENT], abs(moment[i]))
        results[CONTACT] = max(results[CONTACT], t + couple)
        results[POWER] += speeds[i] * both_walls(t, couple)
    bent, turned, sunk = np.empty(n), np.empty(n), np.empty(n)
    upper, lower = np.empty(n), np.empty(n)
    for j in range(STATIONS):
        z = length * j / (STATIONS - 1)
        bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], length, z, bent, turned, sunk)
        before, here, x = 0.0, 1.0, 2.0 * j / (STATIONS - 1) - 1.0
        for k in range(series.shape[0]):
            for i in range(n):
                bent[i] += here * series[k, i]
            before, here = here, ((2 * k + 1) * x * here - k * before) / (k + 1)
        for i in range(n):
            tangent = force[i]
            if inclined:
                slope = turned[i] / states[SOFTENING, i] - compliance * states[SHEAR, i]
                tangent = tangent * (1.0 - 0.5 * slope * slope) + side[i] * slope
            upper[i] = section.direct * tangent + section.bending * bent[i]
            lower[i] = section.direct * tangent - section.bending * bent[i]
        for fibre in range(2):
            high, low = _extremes(upper if fibre == 0 else lower)
            used = utilisation_of(high, low, section.lines, section.parabola)
            sections[0, fibre, j], sections[1, fibre, j] = used, 0.5 * (high - low)
            results[UTILISATION] = max(results[UTILISATION], used)
            results[STRESS] = max(results[STRESS], max(high, -low))
    return Judged(results, sections)


@kernel
def change(found: Judged, exact: Judged, critical: float, found_critical: float) -> float:
    """The greatest relative difference of the first from the second; inf where a result exists in one of them only.

    ``critical`` is the exact buckling load [N], ``found_critical`` that of the first.
    """
    worst = abs(found_critical / critical - 1.0)
    for k in range(RESULTS):
        here, truth = found.results[k], exact.results[k]
        # A safety is the inverse of what is used.
        base = here if k == UTILISATION or k == STRESS else truth
        if here != truth:
            worst = max(worst, abs(here - truth) / abs(base) if base != 0.0 else np.inf)
    if found.results[PUSH] > 0.0 and exact.results[PUSH] > 0.0:
        ratio = exact.results[PUSH] / found.results[PUSH] * (found_critical / critical)
        worst = max(worst, abs(ratio - 1.0))
    elif found.results[PUSH] > 0.0 or exact.results[PUSH] > 0.0:
        worst = np.inf
    return max(worst, _amplitude_change(found, exact))


@kernel
def _amplitude_change(found: Judged, exact: Judged) -> float:
    """Of the amplitude at the section that governs fatigue, or would if the sections' order changed a little more."""
    top, at = -1.0, 0
    drift = 0.0
    used, seen = exact.sections[0].ravel(), exact.sections[1].ravel()
    other, now = found.sections[0].ravel(), found.sections[1].ravel()
    for j in range(used.size):
        if used[j] > top:
            top, at = used[j], j
        drift = max(drift, abs(other[j] - used[j]))
    if top <= 0.0 or seen[at] == 0.0:
        return 0.0
    worst = abs(now[at] / seen[at] - 1.0)
    for j in range(used.size):
        fibre, k = j // STATIONS, j % STATIONS
        peak = (k == 0 or used[j] >= used[j - 1]) and (k == STATIONS - 1 or used[j] >= used[j + 1])
        if peak and used[j] >= top - 2.0 * drift:
            worst = max(worst, abs(now[j] / seen[at] - 1.0))
    return worst
