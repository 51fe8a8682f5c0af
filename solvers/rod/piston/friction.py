"""Friction power between piston and cylinder.

    F |v| = (4/pi) mu int |q_wall| ds |v|,   v = r omega (sin phi + lambda sin phi cos phi/cos beta)

(the wall force: ``skirt``; the velocity: ``solvers.crank.motion.slider_crank``).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.piston.skirt import both_walls, couple_of
from solvers.rod.scene import Scene


def power_per_wall(scene: Scene) -> float:
    """(4/pi) mu r omega [m/s]: friction power per wall force and |dx/dphi|/r."""
    mechanism = scene.mechanism
    return scene.piston.friction_coefficient * (4.0 / math.pi) * mechanism.crank_radius * mechanism.angular_speed


def power_at(scene: Scene, angle: Array, side: Array, moment: Array) -> Array:
    """F |v| [W] at crank angles (n,) with side forces T [N] and clamp moments M0 [N m] there."""
    mechanism, piston = scene.mechanism, scene.piston
    ratio, lever = mechanism.crank_radius / mechanism.rod_length, 6.0 / piston.skirt_length
    return _power(angle, side, moment, piston.clamp_offset, lever, ratio, power_per_wall(scene))


@kernel
def _power(
    angle: Array, side: Array, moment: Array, offset: float, lever: float, ratio: float, per_wall: float
) -> Array:
    """As ``power_at``, all constants in ``per_wall`` [W/N]."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        wall = both_walls(abs(side[i]), abs(couple_of(side[i], moment[i], lever, offset)))
        out[i] = per_wall * wall * travel(ratio, angle[i])
    return out


@kernel
def travel(ratio: float, angle: float) -> float:
    """|dx/dphi|/r at a crank angle, from r/L."""
    sine = math.sin(angle)
    lean = math.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
    return abs(sine * (1.0 + ratio * math.cos(angle) / lean))
