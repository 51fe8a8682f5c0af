"""One strip of the full model at any crank angles and sections, and strips as points in ln b, ln h, ln l."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.numerics import periodic
from solvers.numerics.arrays import Array
from solvers.rod.cycle.composition import Cycle
from solvers.rod.piston.friction import power_at
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import critical_coupling
from solvers.rod.strip.shear import critical_coupling_with_shear

_POWER_ANGLES = periodic.grid(256)
"""Angles of the mean of friction power: its quadrature error is nearly equal for neighbouring strips, and exact checks
correct it."""


@dataclass(frozen=True)
class FullStrip:
    """One strip of the full model: a ``peaks.Response``."""

    cycle: Cycle

    @property
    def dimensions(self) -> Dimensions:
        return self.cycle.dimensions

    def stresses(self, angle: Array, eta: Array) -> Array:
        return self.cycle.at(angle).fibre_stresses((1.0 - eta) * self.dimensions.l)

    def reactions(self, angle: Array) -> Array:
        piston, shape = self.cycle.scene.piston, self.cycle.at(angle)
        side, moment = shape.side_force(), shape.clamp_moment()
        couple = 6.0 * np.abs(moment + side * piston.clamp_offset) / piston.skirt_length
        return np.array([np.abs(side), np.abs(side) + couple])

    def friction_power(self) -> float:
        """Mean friction power over equidistant angles of the revolution [W]."""
        state = self.cycle.at(_POWER_ANGLES)
        power = power_at(self.cycle.scene, _POWER_ANGLES, state.side_force(), state.clamp_moment())
        return float(np.mean(power))

    @cached_property
    def critical(self) -> tuple[float, float]:
        """Critical forces in the crank's plane, with shear deformation if that is active, and out of that plane [N]."""
        d, strip = self.dimensions, self.cycle.strip
        in_plane = critical_coupling_with_shear(strip.length, strip.rod_length, strip.compliance)
        out_of_plane = critical_coupling(strip.length, strip.rod_length)
        return -strip.stiffness * in_plane, -strip.stiffness * out_of_plane * (d.b / d.h) ** 2


def logarithms(d: Dimensions) -> Array:
    """x = ln(b, h, l), sizes in m."""
    return np.log([d.b, d.h, d.l])


def dimensions_of(x: Array, scene: Scene) -> Dimensions:
    """The strip with x = ln(b, h, l)."""
    b, h, l = np.exp(x).tolist()
    return Dimensions(b, h, min(l, scene.mechanism.rod_length))
