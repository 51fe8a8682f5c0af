"""Unbalanced forces and couples of several cylinders on one shaft, by order.

Cylinder i has its cycle delayed by psi_i relative to the first; its axis is at the angle alpha_i about the shaft.
Its crank is at phi - psi_i from its own axis, hence at phi - psi_i + alpha_i in space.

Source: any text on engine balance, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Cycle
from solvers.crank.scene import Engine
from solvers.numerics.arrays import Array

ORDERS = (1, 2, 4)
MOST_SAMPLES = 2**16
_ROUNDING = 8.0 * np.finfo(float).eps
"""Relative rounding of the angles and arms of balanced cylinders."""


@dataclass(frozen=True)
class OrderUnbalance:
    """Maximum unbalanced force [N] and couple [N m] of one order; the couple is None without positions."""

    order: int
    force: float
    couple: float | None


@dataclass(frozen=True)
class Balance:
    """Unbalance of the reciprocating masses by order, and of the rotating masses (constant, rotating with the
    shaft)."""

    reciprocating: tuple[OrderUnbalance, ...]
    rotating_force: float
    rotating_couple: float | None


def _harmonic_samples(cycle: Cycle) -> int:
    """Number of angles that keeps aliasing below rounding: harmonics decay as exp(-k acosh((L - |e|)/r))."""
    m = cycle.scene.mechanism
    fall = math.acosh((m.rod_length - abs(m.offset)) / m.crank_radius)
    return min(max(256, 2 ** math.ceil(math.log2(40.0 / fall))), MOST_SAMPLES)


def balance(cycle: Cycle, engine: Engine) -> Balance:
    """Compute unbalanced forces and couples, by order, from the harmonics of the exact motion.

    With a = r omega^2 Re sum c_k exp(i k phi), the force of order k is the sum of two vectors, one rotating with the
    shaft, sum c_k exp(i(alpha - k psi))/2, and one against it, sum conj(c_k) exp(i(alpha + k psi))/2; its maximum
    magnitude is the sum of theirs. Couples are taken about the middle of the cylinders.
    """
    samples = _harmonic_samples(cycle)
    angle = np.arange(samples) * (2.0 * math.pi / samples)
    harmonics = np.fft.rfft(cycle.motion.posture(angle).acceleration) / (samples / 2)
    masses, speed = cycle.scene.masses, cycle.machine.speed
    phase, axis = np.asarray(engine.phases), np.asarray(engine.axes)
    arm = np.asarray(engine.positions) if engine.positions else None
    if arm is not None:
        arm = arm - 0.5 * (arm.min() + arm.max())

    def greatest(order: int, weight: Array) -> float:
        c = harmonics[order] * masses.reciprocating * speed**2
        with_shaft, against = (_resultant(weight, axis + way * order * phase) for way in (-1, 1))
        return 0.5 * float(abs(c)) * (with_shaft + against)

    one = np.ones_like(phase)
    found = tuple(
        OrderUnbalance(order, greatest(order, one), None if arm is None else greatest(order, arm)) for order in ORDERS
    )
    # Rods on one pin share one crank.
    sharing = masses.rods_per_pin if phase.size > 1 else 1
    turning = cycle.machine.turning / sharing
    couple = None if arm is None else _resultant(arm, axis - phase) * abs(turning)
    return Balance(found, _resultant(one, axis - phase) * abs(turning), couple)


def _resultant(weight: Array, angle: Array) -> float:
    """|sum w exp(i angle)|; exactly zero where no more than the rounding of the angles is left of it."""
    found = float(abs(np.sum(weight * np.exp(1j * angle))))
    rounding = _ROUNDING * float(np.sum(np.abs(weight) * (1.0 + np.abs(angle))))
    return found if found > rounding else 0.0
