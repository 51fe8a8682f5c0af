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

from solvers.linkage.mechanism.angular_velocity_ratio import ratio_at_half_angle
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.numerics.arrays import Array
from solvers.numerics.brackets import MAX_ITERATIONS, shrink_bracket, trial_points
from solvers.numerics.jit import kernel
from solvers.numerics.panels import largest

_SAMPLES, _GRADED = 96, 48
_UNIFORM = 1.0 / np.tan(math.pi * np.arange(1, _SAMPLES) / _SAMPLES)
_MIDPOINTS = 1.0 / np.tan(math.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
_SAMPLING_DEFICIT = 0.05
"""Allowance for a local maximum above its highest sample, relative; at most 0.0094 was observed in all kinds."""
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
    row = peaks_per_energy(bar.coefficients[None], np.array([bar.u31_end]), TORQUE, 3)[0]
    torque, at_torque, force, at_force, u31, _ = row.tolist()
    return Peaks(energy * torque, at_torque, energy / crank * force, at_force, max(u31, bar.u31_start, bar.u31_end))


def series(bar: FourBar, crank: float, energy: float, phi: Array) -> tuple[Array, Array]:
    """Crank torque [N m] and pin force [N] at crank angles in [0, 2 pi]."""
    rows = loads_per_energy(bar.coefficients, bar.u31_end, np.asarray(phi, float))
    return energy * rows[0], energy / crank * rows[1]


@kernel
def _loads(coefficients: Array, u31_end: float, angle_from_end: float) -> tuple[float, float]:
    """Torque over E, force times l1 over E and |u31| at phi - 2 pi in [-2 pi, 0]: near the blow, where the rocker may
    be fast, this argument keeps full precision."""
    return _loads_at(coefficients, u31_end, -math.sin(0.5 * angle_from_end), -math.cos(0.5 * angle_from_end))


@kernel
def _loads_at(coefficients: Array, u31_end: float, s: float, c: float) -> tuple[float, float]:
    """``_loads`` at a half angle's sine and cosine."""
    transfer, rate, root = ratio_at_half_angle(coefficients, s, c)
    return 2.0 * transfer * s * rate / u31_end**2, coefficients[1] * abs(rate) / (u31_end**2 * root), abs(transfer)


@kernel
def loads_per_energy(coefficients: Array, u31_end: float, phi: Array) -> Array:
    """Torque over E and force times l1 over E at crank angles (m,): shape (2, m)."""
    out = np.empty((2, phi.size))
    for j in range(phi.size):
        out[0, j], out[1, j], _ = _loads(coefficients, u31_end, phi[j] - 2.0 * math.pi)
    return out


@kernel
def _cotangents(coefficients: Array) -> Array:
    """cot(phi/2) over the cycle, decreasing, both ends included: uniform in phi, uniform in the angle that resolves the
    second change point near pi, and graded toward the blow, where a fast rocker turns within e or
    sqrt(lambda3 kappa/M)."""
    base, coupler, rocker, numerator, margin, kappa, _ = coefficients
    stretch = math.sqrt(max(margin, 1e-30) / (base * coupler * rocker))
    least = 0.03 * min(math.sqrt(rocker * kappa / max(margin, 1e-30)), 0.5 * kappa / abs(numerator), 1.0)
    growth = least ** (-1.0 / _GRADED)
    out = np.empty(_UNIFORM.size + _MIDPOINTS.size + _GRADED + 2)
    out[0], out[-1] = np.inf, -np.inf
    i, j, graded = 0, 0, -growth
    for k in range(1, out.size - 1):
        uniform = _UNIFORM[i] if i < _UNIFORM.size else -np.inf
        resolving = _MIDPOINTS[j] * stretch if j < _MIDPOINTS.size else -np.inf
        out[k] = max(uniform, resolving, graded)
        if out[k] == uniform:
            i += 1
        elif out[k] == resolving:
            j += 1
        else:
            graded *= growth
    return out


@kernel
def sampled_loads(coefficients: Array, u31_end: float) -> tuple[Array, Array]:
    """cot(phi/2), decreasing over the cycle, and |torque|/E, force l1/E and |u31| there: (m,), (3, m)."""
    cotangents = _cotangents(coefficients)
    samples = np.empty((3, cotangents.size))
    for j in range(cotangents.size):
        s, c = 0.0, math.copysign(1.0, cotangents[j])
        if abs(cotangents[j]) < np.inf:
            s = 1.0 / math.sqrt(1.0 + cotangents[j] * cotangents[j])
            c = cotangents[j] * s
        torque, samples[FORCE, j], samples[RATIO, j] = _loads_at(coefficients, u31_end, s, c)
        samples[TORQUE, j] = abs(torque)
    return cotangents, samples


@kernel
def angle_from_cotangent(cotangent: float) -> float:
    """phi - 2 pi [rad], in [-2 pi, 0], from cot(phi/2)."""
    return -2.0 * math.atan2(1.0, -cotangent)


@kernel
def peaks_per_energy(coefficients: Array, u31_end: Array, first: int, count: int) -> Array:
    """Maximum magnitude and its crank angle of ``count`` quantities from the ``first`` among torque/E, force l1/E and
    u31, for every row: shape (n, 2 count)."""
    out = np.empty((coefficients.shape[0], 2 * count))
    for i in range(coefficients.shape[0]):
        cotangents, samples = sampled_loads(coefficients[i], u31_end[i])
        for k in range(count):
            quantity = first + k
            peak, at = refined_peak(coefficients[i], u31_end[i], cotangents, samples[quantity], quantity)
            out[i, 2 * k], out[i, 2 * k + 1] = peak, at + 2.0 * math.pi
    return out


@kernel
def refined_peak(
    coefficients: Array, u31_end: float, cotangents: Array, samples: Array, quantity: int
) -> tuple[float, float]:
    """Maximum of a quantity and its phi - 2 pi; all local maxima within the sampling error of the highest sample are
    refined."""
    threshold, last = (1.0 - _SAMPLING_DEFICIT) * largest(samples), cotangents.size - 1
    place, value, points, heights = np.empty(3), np.empty(3), np.empty(5), np.empty(5)
    best, at = -1.0, angle_from_cotangent(cotangents[0])
    for j in range(cotangents.size):
        sample, before, after = samples[j], max(j - 1, 0), min(j + 1, last)
        if sample < threshold or (j > 0 and samples[before] >= sample) or samples[after] > sample:
            continue
        for m in range(3):
            place[m] = angle_from_cotangent(cotangents[min(max(j + m - 1, 0), last)])
        value[0], value[1], value[2] = samples[before], sample, samples[after]
        for _ in range(MAX_ITERATIONS):
            trial_points(place, value, points)
            for m in range(5):
                heights[m] = abs(_loads(coefficients, u31_end, points[m])[quantity])
            if shrink_bracket(place, value, points, heights) <= _PEAK_TOLERANCE * value[1]:
                break
        if value[1] > best:
            best, at = value[1], place[1]
    return best, at
