"""Axial force and lateral displacement of the strip at any crank angle, compiled.

    P(phi) = -(p(phi) - p_back) pi D^2/4 + m a(phi),   s(phi) = r sin(phi)

with the pressure as Schmidt's expression or as piecewise cubics (``solvers.rod.load.gas``) and the acceleration of
``solvers.crank.motion.slider_crank``, m being the part of the reciprocating mass taken into account.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.scene import PressureCurve, Scene


class Drive(NamedTuple):
    """Kernel representation of the machine, SI units."""

    curve: PressureCurve
    back_pressure: float
    area: float
    mass: float
    crank_radius: float
    rod_length: float
    angular_speed: float


def drive_of(scene: Scene, mass: float) -> Drive:
    """The drive of a scene whose axial force includes the inertia of this mass [kg] and the gas force."""
    m, load = scene.mechanism, scene.load
    return Drive(
        load.curve,
        load.reference_pressure(),
        scene.piston.area,
        float(mass),
        m.crank_radius,
        m.rod_length,
        m.angular_speed,
    )


@kernel
def pressure(d: PressureCurve, angle: float) -> float:
    """p(phi) [Pa]."""
    if d.breaks.size == 0:
        half = math.sin(0.5 * (angle - d.phase))
        return d.level * (1.0 + d.sharpness) / ((1.0 - d.sharpness) + 2.0 * d.sharpness * half * half)
    place = angle - d.breaks[0]
    place = d.breaks[0] + (place - TURN * math.floor(place / TURN))
    low, high = 0, d.breaks.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if d.breaks[middle] <= place:
            low = middle
        else:
            high = middle
    x = place - d.breaks[low]
    return ((d.pieces[0, low] * x + d.pieces[1, low]) * x + d.pieces[2, low]) * x + d.pieces[3, low]


@kernel
def axial_force(d: Drive, angle: float) -> float:
    """P(phi) [N], tension positive."""
    force = -(pressure(d.curve, angle) - d.back_pressure) * d.area
    if d.mass != 0.0:
        ratio = d.crank_radius / d.rod_length
        sine, cosine = math.sin(angle), math.cos(angle)
        lean = math.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
        square = sine * sine
        numerator = (cosine - sine) * (cosine + sine) + ratio * ratio * square * square
        scale = d.crank_radius * d.angular_speed * d.angular_speed
        force += d.mass * scale * (cosine + ratio * numerator / (lean * lean * lean))
    return force


@kernel
def axial_forces(d: Drive, angle: Array) -> Array:
    """``axial_force`` at angles of shape (n,)."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        out[i] = axial_force(d, angle[i])
    return out
