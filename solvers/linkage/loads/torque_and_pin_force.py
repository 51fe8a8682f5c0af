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

from solvers.linkage.mechanism.angular_velocity_ratio import motion
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.numerics.arrays import Array
from solvers.numerics.brackets import MOST_ROUNDS, narrow, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import largest

_SAMPLES, _CROWD = 96, 48
_EVEN = 1.0 / np.tan(math.pi * np.arange(1, _SAMPLES) / _SAMPLES)
_BETWEEN = 1.0 / np.tan(math.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
_SAMPLING_DEFICIT = 0.05
"""Allowance for a local maximum above its highest sample, relative; at most 0.0094 was observed in all kinds."""
TORQUE, FORCE, RATIO = 0, 1, 2
"""Indices of the quantities whose peaks are computed: torque/E, force l1/E and u31."""

_SHARP = 1e-14
"""Relative tolerance of a peak value."""


@dataclass(frozen=True)
class Peaks:
    """Maximum magnitudes over the cycle and their crank angles [rad]."""

    torque: float
    torque_angle: float
    force: float
    force_angle: float


def peaks(bar: FourBar, crank: float, energy: float) -> Peaks:
    """Peak crank torque [N m] and pin force [N] of a mechanism with its crank's length [m] and impact energy [J]."""
    row = unit_peaks(bar.coefficients[None], np.array([bar.end]), TORQUE, 2)[0]
    return peaks_of(tuple(row.tolist()), crank, energy)


def peaks_of(row: tuple[float, ...], crank: float, energy: float) -> Peaks:
    """Peaks from a row of ``unit_peaks`` that begins with the torque and the force."""
    torque, at_torque, force, at_force = row[:4]
    return Peaks(energy * torque, at_torque, energy / crank * force, at_force)


def series(bar: FourBar, crank: float, energy: float, phi: Array) -> tuple[Array, Array]:
    """Crank torque [N m] and pin force [N] at crank angles in [0, 2 pi]."""
    rows = unit_loads(bar.coefficients, bar.end, np.asarray(phi, float))
    return energy * rows[0], energy / crank * rows[1]


@kernel
def _loads(coefficients: Array, end: float, short: float) -> tuple[float, float]:
    """Torque over E, force times l1 over E and |u31| at phi - 2 pi in [-2 pi, 0]: near the blow, where the rocker may
    be fast, this argument keeps full precision."""
    return _loads_at(coefficients, end, -math.sin(0.5 * short), -math.cos(0.5 * short))


@kernel
def _loads_at(coefficients: Array, end: float, s: float, c: float) -> tuple[float, float]:
    """``_loads`` at a half angle's sine and cosine."""
    transfer, rate, root = motion(coefficients, s, c)
    return 2.0 * transfer * s * rate / end**2, coefficients[1] * abs(rate) / (end**2 * root), abs(transfer)


@kernel
def unit_loads(coefficients: Array, end: float, phi: Array) -> Array:
    """Torque over E and force times l1 over E at crank angles (m,): shape (2, m)."""
    out = np.empty((2, phi.size))
    for j in range(phi.size):
        out[0, j], out[1, j], _ = _loads(coefficients, end, phi[j] - 2.0 * math.pi)
    return out


@kernel
def _cotangents(coefficients: Array) -> Array:
    """cot(phi/2) over the cycle, decreasing, both ends included: uniform in phi, uniform in the angle that resolves the
    second change point near pi, and graded toward the blow, where a fast rocker turns within e or
    sqrt(lambda3 kappa/M)."""
    base, coupler, rocker, numerator, margin, kappa, _ = coefficients
    stretch = math.sqrt(max(margin, 1e-30) / (base * coupler * rocker))
    least = 0.03 * min(math.sqrt(rocker * kappa / max(margin, 1e-30)), 0.5 * kappa / abs(numerator), 1.0)
    closer = least ** (-1.0 / _CROWD)
    out = np.empty(_EVEN.size + _BETWEEN.size + _CROWD + 2)
    out[0], out[-1] = np.inf, -np.inf
    i, j, crowded = 0, 0, -closer
    for k in range(1, out.size - 1):
        even = _EVEN[i] if i < _EVEN.size else -np.inf
        opened = _BETWEEN[j] * stretch if j < _BETWEEN.size else -np.inf
        out[k] = max(even, opened, crowded)
        if out[k] == even:
            i += 1
        elif out[k] == opened:
            j += 1
        else:
            crowded *= closer
    return out


@kernel
def sampled(row: Array, end: float) -> tuple[Array, Array]:
    """cot(phi/2), decreasing over the cycle, and |torque|/E, force l1/E and |u31| there: (m,), (3, m)."""
    cotangents = _cotangents(row)
    samples = np.empty((3, cotangents.size))
    for j in range(cotangents.size):
        s, c = 0.0, math.copysign(1.0, cotangents[j])
        if abs(cotangents[j]) < np.inf:
            s = 1.0 / math.sqrt(1.0 + cotangents[j] * cotangents[j])
            c = cotangents[j] * s
        torque, samples[FORCE, j], samples[RATIO, j] = _loads_at(row, end, s, c)
        samples[TORQUE, j] = abs(torque)
    return cotangents, samples


@kernel
def angle_of(cotangent: float) -> float:
    """phi - 2 pi [rad], in [-2 pi, 0], from cot(phi/2)."""
    return -2.0 * math.atan2(1.0, -cotangent)


@kernel
def unit_peaks(coefficients: Array, end: Array, first: int, count: int) -> Array:
    """Maximum magnitude and its crank angle of ``count`` quantities from the ``first`` among torque/E, force l1/E and
    u31, for every row: shape (n, 2 count)."""
    out = np.empty((coefficients.shape[0], 2 * count))
    for i in range(coefficients.shape[0]):
        cotangents, samples = sampled(coefficients[i], end[i])
        for k in range(count):
            which = first + k
            peak, at = highest(coefficients[i], end[i], cotangents, samples[which], which)
            out[i, 2 * k], out[i, 2 * k + 1] = peak, at + 2.0 * math.pi
    return out


@kernel
def highest(row: Array, end: float, cotangents: Array, samples: Array, which: int) -> tuple[float, float]:
    """Maximum of a quantity and its phi - 2 pi; all local maxima within the sampling error of the highest sample are
    refined."""
    need, last = (1.0 - _SAMPLING_DEFICIT) * largest(samples), cotangents.size - 1
    place, value, points, heights = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    best, at = -1.0, angle_of(cotangents[0])
    for j in range(cotangents.size):
        here, before, after = samples[j], max(j - 1, 0), min(j + 1, last)
        if here < need or (j > 0 and samples[before] >= here) or samples[after] > here:
            continue
        for m in range(3):
            place[m] = angle_of(cotangents[min(max(j + m - 1, 0), last)])
        value[0], value[1], value[2] = samples[before], here, samples[after]
        for _ in range(MOST_ROUNDS):
            trial_points(place, value, points)
            for m in range(5):
                heights[m] = abs(_loads(row, end, points[m])[which])
            if narrow(place, value, points, heights) <= _SHARP * value[1]:
                break
        if value[1] > best:
            best, at = value[1], place[1]
    return best, at
