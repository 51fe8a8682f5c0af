"""Unbalanced forces and couples of several cylinders on one shaft, by order.

Cylinder i has its cycle delayed by psi_i relative to the first; its axis is at the angle alpha_i about the shaft.
Its crank is at phi - psi_i from its own axis, hence at phi - psi_i + alpha_i in space.

Source: any text on engine balance, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Cycle

_ORDERS = (1, 2, 4)
_MOST_SAMPLES = 2**16
"""Beyond, aliasing changes no force by more than a relative 1e-8."""
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


def balance(cycle: Cycle) -> Balance:
    """Compute unbalanced forces and couples, by order, from the harmonics of the exact motion.

    With x = Re sum x_k exp(i k phi) and c_k = -k^2 omega^2 x_k, the acceleration's, the force of order k is the sum of
    two vectors, one rotating with the shaft, sum c_k exp(i(alpha - k psi))/2, and one against it, sum conj(c_k)
    exp(i(alpha + k psi))/2; its maximum magnitude is the sum of theirs. Couples are taken about the middle of the
    cylinders.
    """
    m = cycle.scene.mechanism
    # Harmonics decay as exp(-k acosh((L - |e|)/r)): so many samples keep aliasing below rounding.
    decay = math.acosh((m.rod_length - abs(m.offset)) / m.crank_radius)
    samples = min(max(256, 2 ** math.ceil(math.log2(40.0 / decay))), _MOST_SAMPLES)
    angle = np.arange(samples) * (2.0 * math.pi / samples)
    # Of the displacement: with a rod hardly longer than the crank the acceleration's peaks are too narrow to sample.
    harmonics = np.fft.rfft(cycle.motion.displacement(angle))
    masses, engine = cycle.scene.masses, cycle.scene.engine
    per_harmonic = masses.reciprocating * cycle.machine.speed**2 / (samples / 2)
    middle = 0.5 * (min(engine.positions) + max(engine.positions)) if engine.positions else 0.0
    arms = [position - middle for position in engine.positions]
    ones = [1.0] * len(engine.phases)

    def resultant(weights: Sequence[float], order: int) -> float:
        """|sum w exp(i(alpha + order psi))|; exactly zero if it does not exceed the rounding of the angles.

        In plain Python: an array operation on a few cylinders takes as long as the whole sum.
        """
        total, size = 0j, 0.0
        for weight, axis, phase in zip(weights, engine.axes, engine.phases, strict=True):
            angle = axis + order * phase
            total += cmath.rect(weight, angle)
            size += abs(weight) * (1.0 + abs(angle))
        return abs(total) if abs(total) > _ROUNDING * size else 0.0

    def greatest(order: int, weights: Sequence[float]) -> float:
        both = resultant(weights, -order) + resultant(weights, order)
        return 0.5 * per_harmonic * order**2 * abs(complex(harmonics[order])) * both

    found = tuple(
        OrderUnbalance(order, greatest(order, ones), greatest(order, arms) if arms else None) for order in _ORDERS
    )
    # Rods on one pin share one crank.
    sharing = masses.rods_per_pin if len(engine.phases) > 1 else 1
    rotating = abs(cycle.machine.rotating / sharing)
    return Balance(found, resultant(ones, -1) * rotating, resultant(arms, -1) * rotating if arms else None)
