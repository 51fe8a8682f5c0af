"""Integration of one crank revolution between two blows by collocation on a graded mesh; see ``periodic_solution``.

The motor's work D(phi) since the blow satisfies dD/dphi = M0 - k omega, omega^2 = 2 (E0 + D)/J(phi). Four Gauss points
per step give order 8, also for the period; each step is solved by Newton's method, so a stiff motor line does not
require short steps. The mesh is refined where the rocker's speed varies over a small angle: at the blow over e, and at
phi = pi over the scale of a second change point.
Angles in [-pi, pi]: those of the second half of the cycle are measured back from its end, without cancellation. SI
units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.linkage.mechanism.angular_velocity_ratio import resolving_cotangents, transfer_and_slope
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_STAGES = 4
_STEP, _SHARE = 0.5, 0.17
"""Spacing of the coarsest mesh (``resolving_cotangents``)."""


def _gauss() -> tuple[Array, Array, Array]:
    """Nodes c, weights b and matrix A of the collocation on [0, 1]: A_ij integrates the j-th Lagrange polynomial."""
    nodes, weights = np.polynomial.legendre.leggauss(_STAGES)
    c = 0.5 * (nodes + 1.0)
    powers = np.arange(_STAGES)
    moments = c[:, None] ** (powers + 1) / (powers + 1)
    return c, 0.5 * weights, np.linalg.solve((c[:, None] ** powers).T, moments.T).T


_NODES, _WEIGHTS, _MATRIX = _gauss()


class Machine(NamedTuple):
    """A linkage's coefficients (``kinematics``), the inertias J1 of the crank and J3 of the rocker [kg m^2], and the
    motor's stall torque M0 [N m] and slope k [N m s]."""

    coefficients: Array
    crank: float
    rocker: float
    stall: float
    slope: float


@kernel
def mesh(coefficients: Array, parts: int) -> Array:
    """Steps of a revolution, more with more ``parts``: rows of start angle and length, shape (n, 2)."""
    cotangents = resolving_cotangents(coefficients, _STEP / parts, _SHARE / parts)
    half = cotangents.size // 2
    steps = np.empty((2 * half, 2))
    start = 0.0
    for k in range(half):
        end = 2.0 * math.atan2(1.0, cotangents[k + 1])
        steps[k, 0], steps[k, 1] = start, end - start
        steps[2 * half - 1 - k, 0], steps[2 * half - 1 - k, 1] = -end, end - start
        start = end
    return steps


@kernel
def inertias(machine: Machine, steps: Array) -> Array:
    """J = J1 + J3 u31^2 at the Gauss points of every step: shape (n, 4)."""
    angles = np.empty(steps.shape[0] * _STAGES)
    for n in range(steps.shape[0]):
        for i in range(_STAGES):
            # In the second half, from the end of the step backward, to full precision near the blow.
            if steps[n, 0] < 0.0:
                angles[_STAGES * n + i] = (steps[n, 0] + steps[n, 1]) - steps[n, 1] * _NODES[_STAGES - 1 - i]
            else:
                angles[_STAGES * n + i] = steps[n, 0] + steps[n, 1] * _NODES[i]
    u, _ = transfer_and_slope(machine.coefficients, angles)
    return (machine.crank + machine.rocker * u * u).reshape(-1, _STAGES)


@kernel
def _step(inertia: Array, width: float, energy: float, machine: Machine, torque: Array) -> bool:
    """Solve for the torques at the Gauss points of a step by Newton's method, in place; whether it converged."""
    for _ in range(40):
        matrix, correction = np.empty((_STAGES, _STAGES)), np.empty(_STAGES)
        for i in range(_STAGES):
            stage_energy = energy
            for j in range(_STAGES):
                stage_energy += width * _MATRIX[i, j] * torque[j]
            stage_energy = max(stage_energy, 1e-12 * energy)
            speed = math.sqrt(2.0 * stage_energy / inertia[i])
            decrease = machine.slope / (inertia[i] * speed)
            correction[i] = machine.stall - machine.slope * speed - torque[i]
            for j in range(_STAGES):
                matrix[i, j] = decrease * width * _MATRIX[i, j]
            matrix[i, i] += 1.0
        for i in range(_STAGES):
            for k in range(i + 1, _STAGES):
                factor = matrix[k, i] / matrix[i, i]
                for j in range(i + 1, _STAGES):
                    matrix[k, j] -= factor * matrix[i, j]
                correction[k] -= factor * correction[i]
        largest_correction = 0.0
        for i in range(_STAGES - 1, -1, -1):
            for j in range(i + 1, _STAGES):
                correction[i] -= matrix[i, j] * correction[j]
            correction[i] /= matrix[i, i]
            torque[i] += correction[i]
            largest_correction = max(largest_correction, abs(correction[i]))
        if largest_correction <= 1e-15 * machine.stall:
            return True
        if not largest_correction < math.inf:
            return False
    return largest_correction <= 1e-12 * machine.stall


@kernel
def integrate_revolution(inertia: Array, steps: Array, energy: float, machine: Machine) -> tuple[Array, float]:
    """Integrate one revolution: motor work at the step ends (n + 1,), and the period; NaN if a step has no solution."""
    work, time = np.zeros(steps.shape[0] + 1), 0.0
    torque = np.full(_STAGES, machine.stall - machine.slope * math.sqrt(2.0 * energy / inertia[0, 0]))
    for n in range(steps.shape[0]):
        width, initial_energy = steps[n, 1], energy + work[n]
        if not (initial_energy > 0.0 and _step(inertia[n], width, initial_energy, machine, torque)):
            work[n + 1 :] = math.nan
            return work, math.nan
        step_work = 0.0
        for i in range(_STAGES):
            step_work += width * _WEIGHTS[i] * torque[i]
            stage_energy = initial_energy
            for j in range(_STAGES):
                stage_energy += width * _MATRIX[i, j] * torque[j]
            time += width * _WEIGHTS[i] / math.sqrt(2.0 * stage_energy / inertia[n, i])
        work[n + 1] = work[n] + step_work
        torque[:] = torque[_STAGES - 1]
    return work, time


@kernel
def _excess_and_acceleration(
    u: float, u31_slope: float, work: float, energy: float, u31_start: float, machine: Machine
) -> tuple[float, float]:
    """omega/omega_0 - 1, without cancellation from J0 - J and the work done, and J omega omega' = M - J' omega^2/2."""
    rocker, inertia = machine.rocker, machine.crank + machine.rocker * u * u
    energy_excess = (
        rocker * (u31_start - u) * (u31_start + u) + (machine.crank + rocker * u31_start * u31_start) * work / energy
    ) / inertia
    square = 2.0 * (energy + work) / inertia
    acceleration = machine.stall - machine.slope * math.sqrt(square) - rocker * u * u31_slope * square
    return energy_excess / (1.0 + math.sqrt(1.0 + energy_excess)), acceleration


@kernel
def _inside_step(
    machine: Machine, row: Array, fraction: float, work: float, energy: float, u31_start: float
) -> tuple[float, float]:
    """``_excess_and_acceleration`` at a ``fraction`` of a step; NaN if that part of the step has no solution."""
    partial_step = np.empty((1, 2))
    partial_step[0, 0], partial_step[0, 1] = row[0], fraction * row[1]
    added_work, _ = integrate_revolution(inertias(machine, partial_step), partial_step, energy + work, machine)
    end_angle = row[0] + fraction * row[1]
    u, u31_slope = transfer_and_slope(
        machine.coefficients, np.array([end_angle if row[0] >= 0.0 else min(end_angle, -1e-300)])
    )
    return _excess_and_acceleration(u[0], u31_slope[0], work + added_work[1], energy, u31_start, machine)


@kernel
def speed_spread(machine: Machine, steps: Array, work: Array, energy: float, u31_start: float) -> float:
    """(max - min speed over the revolution)/(speed after the blow), from the step ends and all extrema in between; NaN
    if a part of a step has no solution. ``u31_start`` is |u31(0)|."""
    count = steps.shape[0]
    angles = np.append(steps[:, 0], -1e-300)
    u, u31_slope = transfer_and_slope(machine.coefficients, angles)
    accelerations, greatest, least = np.empty(count + 1), -math.inf, math.inf
    for n in range(count + 1):
        value, accelerations[n] = _excess_and_acceleration(u[n], u31_slope[n], work[n], energy, u31_start, machine)
        greatest, least = max(greatest, value), min(least, value)
    for n in range(count):
        if accelerations[n] * accelerations[n + 1] >= 0.0:
            continue
        low, high = 0.0, 1.0
        # At an extremum the value's error is quadratic in the position error.
        for _ in range(28):
            middle = 0.5 * (low + high)
            value, acceleration = _inside_step(machine, steps[n], middle, work[n], energy, u31_start)
            if math.isnan(value):
                return math.nan
            greatest, least = max(greatest, value), min(least, value)
            if acceleration * accelerations[n] > 0.0:
                low = middle
            else:
                high = middle
    return greatest - least
