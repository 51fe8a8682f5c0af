"""Joint and crank loads at constant crank speed, due to the rocker's inertia alone.

The rocker has the impact energy E at its speed before the blow: J3 = 2 E/(omega u31(2 pi))^2. Then, with
du31/dphi = s X (see ``angular_velocity_ratio``),

    crank torque           J3 omega^2 u31 u31'              = 2 E u31 s X / u31(2 pi)^2
    coupler (pin) force    J3 omega^2 |u31'| / (l3 sin nu)  = E lambda2 |X| / (u31(2 pi)^2 l1 T)

with sin nu = 2 sin(nu/2) cos(nu/2), sin(nu/2) = sqrt(lambda0/(lambda2 lambda3)) s and cos(nu/2) =
T/sqrt(lambda0 lambda2 lambda3), so that s cancels: the force is finite at both ends, where u31' and sin nu vanish.
Torque in N m and force in N for E in J and lengths in m; both scale with E, the force also with 1/l1, neither with
speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.linkage.mechanism.angular_velocity_ratio import INFINITE, ratio_at_half_angle, resolving_cotangents
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.numerics.arrays import Array
from solvers.numerics.brackets import MAX_ITERATIONS, shrink_bracket, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import largest

_SAMPLE_STEP, _SAMPLED_SHARE, _SAMPLING_DEFICIT = 0.1, 0.03, 0.05
"""Spacing of the samples (``resolving_cotangents``), and the relative allowance for a local maximum above its highest
sample; at most 0.0144 was observed in 3000 mechanisms of all kinds."""
TORQUE, FORCE, RATIO = 0, 1, 2
"""Indices of the quantities whose peaks are computed: torque/E, force l1/E and u31."""

_PEAK_TOLERANCE = 1e-14
"""Relative tolerance of a peak value."""


@dataclass(frozen=True)
class Peaks:
    """Maximum magnitudes over the cycle of crank torque [N m], pin force [N] and u31, the former with their crank
    angles [rad]."""

    torque: float
    torque_angle: float
    force: float
    force_angle: float
    u31: float


def peaks(bar: FourBar, crank: float, energy: float) -> Peaks:
    """Peaks of a mechanism with its crank's length [m] and impact energy [J]."""
    torque, at_torque, force, at_force, u31 = peaks_per_energy(bar.coefficients, bar.u31_end)
    return Peaks(energy * torque, at_torque, energy / crank * force, at_force, max(u31, bar.u31_start, bar.u31_end))


def series(bar: FourBar, crank: float, energy: float, phi: Array) -> tuple[Array, Array]:
    """Crank torque [N m] and pin force [N] at crank angles in [0, 2 pi]."""
    cotangents = 1.0 / np.tan(np.maximum(0.5 * np.asarray(phi, float), 1.0 / INFINITE))
    torque, force, _ = loads_per_energy(bar.coefficients, bar.u31_end, cotangents)
    return energy * torque, energy / crank * force


@kernel
def _loads(coefficients: Array, u31_end: float, s: float, c: float) -> tuple[float, float, float]:
    """Torque over E, force times l1 over E and |u31| at a half angle's sine and cosine."""
    transfer, rate, root = ratio_at_half_angle(coefficients, s, c)
    return 2.0 * transfer * s * rate / u31_end**2, coefficients[1] * abs(rate) / (u31_end**2 * root), abs(transfer)


@kernel
def loads_per_energy(coefficients: Array, u31_end: float, cotangents: Array) -> Array:
    """``_loads`` at crank angles given by cot(phi/2), (m,): shape (3, m)."""
    out = np.empty((3, cotangents.size))
    for j in range(cotangents.size):
        s = 1.0 / math.sqrt(1.0 + cotangents[j] * cotangents[j])
        out[0, j], out[1, j], out[2, j] = _loads(coefficients, u31_end, s, cotangents[j] * s)
    return out


@kernel
def sampled_loads(coefficients: Array, u31_end: float) -> tuple[Array, Array]:
    """cot(phi/2), decreasing over the cycle, and |torque|/E, force l1/E and |u31| there: (m,), (3, m)."""
    cotangents = resolving_cotangents(coefficients, _SAMPLE_STEP, _SAMPLED_SHARE)
    return cotangents, np.abs(loads_per_energy(coefficients, u31_end, cotangents))


@kernel
def peaks_per_energy(coefficients: Array, u31_end: float) -> tuple[float, float, float, float, float]:
    """Maximum magnitudes of torque/E and force l1/E, each with its crank angle, and of u31."""
    cotangents, samples = sampled_loads(coefficients, u31_end)
    torque, at_torque = refined_peak(coefficients, u31_end, cotangents, samples[TORQUE], TORQUE)
    force, at_force = refined_peak(coefficients, u31_end, cotangents, samples[FORCE], FORCE)
    u31, _ = refined_peak(coefficients, u31_end, cotangents, samples[RATIO], RATIO)
    return torque, at_torque + 2.0 * math.pi, force, at_force + 2.0 * math.pi, u31


@kernel
def refined_peak(
    coefficients: Array, u31_end: float, cotangents: Array, samples: Array, quantity: int
) -> tuple[float, float]:
    """Maximum of a quantity and its phi - 2 pi [rad]: to full precision near the blow, where the rocker may be fast.

    All local maxima within the sampling error of the highest sample are refined.
    """
    threshold, last = (1.0 - _SAMPLING_DEFICIT) * largest(samples), cotangents.size - 1
    place, value, points, heights = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    best, at = -1.0, -2.0 * math.pi
    for j in range(cotangents.size):
        sample, before, after = samples[j], max(j - 1, 0), min(j + 1, last)
        if sample < threshold or (j > 0 and samples[before] >= sample) or samples[after] > sample:
            continue
        for m in range(3):
            place[m] = -2.0 * math.atan2(1.0, -cotangents[min(max(j + m - 1, 0), last)])
        value[0], value[1], value[2] = samples[before], sample, samples[after]
        for _ in range(MAX_ITERATIONS):
            trial_points(place, value, points)
            for m in range(5):
                s, c = -math.sin(0.5 * points[m]), -math.cos(0.5 * points[m])
                heights[m] = abs(_loads(coefficients, u31_end, s, c)[quantity])
            if shrink_bracket(place, value, points, heights) <= _PEAK_TOLERANCE * value[1]:
                break
        if value[1] > best:
            best, at = value[1], place[1]
    return best, at
