"""Crank torque and pin force over ranges of the free ratio, by interval arithmetic in mean-value form.

The formulas are those of ``loads.torque_and_pin_force``, each with the range of its slope beside its value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.mechanism.change_point import ChangePoint, Gain
from solvers.numerics.intervals import Interval, Sloped

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """What the loads are formed from, over ranges of the free ratio, at one crank angle for each range."""

    swing: Sloped
    """u31"""
    rate: Sloped
    """|X|"""
    root: Sloped
    """T"""
    end: Sloped
    """|u31(2 pi)|"""
    coupler: Sloped
    s: Array


Load = Callable[[Motion], Sloped]


def torque_over(motion: Motion) -> Sloped:
    """|torque|/E. A peak over the cycle is nowhere below its value at any one angle, so what bounds this from below
    bounds the peak."""
    return 2.0 * (motion.swing.magnitude() * motion.s) * motion.rate / motion.end.square()


def force_over(motion: Motion) -> Sloped:
    """Force l1/E, which bounds its peak likewise."""
    return motion.coupler * motion.rate / (motion.end.square() * motion.root)


def over(kind: ChangePoint, gain: Gain, parameter: Sloped, phi: Array) -> Motion:
    """The motion over ranges of the free ratio (see ``angular_velocity_ratio``), at one crank angle for each range."""
    r = kind.family(gain, parameter)
    s, c = np.sin(0.5 * phi), np.cos(0.5 * phi)
    numerator, margin = kind.half_angle_coefficient(r), kind.rotatability_margin(r)
    # lambda0 lambda2 = g^2 lambda3, so T^2 = (g lambda3 c)^2 + M s^2 and kappa = (g^2 - 1) lambda3.
    lever = gain.square * r.rocker
    root = (((gain.value * c) * r.rocker).square() + margin * (s * s)).root()
    front, back = np.maximum(c, 0.0), np.minimum(c, 0.0)
    d_front, a_front = r.rocker * front + root, root + lever * front
    d_back = (gain.square_less_one * r.rocker.square() * (back * back) + margin * (s * s)) / (root - r.rocker * back)
    a_back = (margin * (s * s) - lever * r.rocker * (gain.square_less_one * back * back)) / (root - lever * back)
    d, a = _choose(c < 0, d_back, d_front), _choose(c < 0, a_back, a_front)
    along = kind.rocker_sign * c
    gap = _choose(along > 0, margin / (root + r.base * np.maximum(along, 0.0)), root - r.base * along)
    b = (d.square() + numerator.square() * (s * s)) / r.rocker
    factor = numerator / (root * b)
    rate = (factor * (a / b * gap.square() / root - (0.5 * lever) * margin / root.square())).magnitude()
    return Motion(factor * a, rate, root, (gain.value + 1.0) / kind.pin_to_pivot(r), r.coupler, s)


def _choose(condition: Array, yes: Sloped, no: Sloped) -> Sloped:
    def pick(one: Interval, other: Interval) -> Interval:
        return Interval(np.where(condition, one.low, other.low), np.where(condition, one.high, other.high))

    return Sloped(pick(yes.value, no.value), pick(yes.slope, no.slope))
