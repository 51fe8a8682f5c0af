"""Friction between piston and cylinder: what it costs in power, and what it does to the axial force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.numerics.jit import kernel
from solvers.rod import guide
from solvers.rod.cycle import Array, BeamModel, Cycle, Shape
from solvers.rod.scene import Dimensions, Scene

_MOST_ITERATIONS = 60
_CONVERGED = 4.0 * np.finfo(float).eps


def force(scene: Scene, shape: Shape) -> Array:
    """Friction force on the piston [N], not negative, shape (angles,)."""
    piston = scene.piston
    return guide.friction_force(
        shape.side_force(), shape.clamp_moment(), piston.clamp_offset, piston.skirt_length, piston.friction_coefficient
    )


def power(cycle: Cycle, angle: Array) -> Array:
    """F |v| [W] at the crank angles."""
    mechanism, piston, shape = cycle.scene.mechanism, cycle.scene.piston, cycle.at(angle).shape
    per_wall = piston.friction_coefficient * (4.0 / math.pi) * mechanism.crank_radius * mechanism.angular_speed
    ratio, lever = mechanism.crank_radius / mechanism.rod_length, 6.0 / piston.skirt_length
    return _power(angle, shape.side_force(), shape.clamp_moment(), piston.clamp_offset, lever, ratio, per_wall)


@kernel
def _power(
    angle: Array, side: Array, moment: Array, offset: float, lever: float, ratio: float, per_wall: float
) -> Array:
    """int |q| ds of ``solvers.rod.guide`` times |v| of ``solvers.crank.kinematics``, all constants in ``per_wall``."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        wall = guide.both_walls(abs(side[i]), lever * abs(moment[i] + side[i] * offset))
        sine = math.sin(angle[i])
        lean = math.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
        out[i] = per_wall * wall * abs(sine * (1.0 + ratio * math.cos(angle[i]) / lean))
    return out


def pressure(cycle: Cycle, angle: Array) -> Array:
    """Greatest contact pressure on the skirt [Pa] at the crank angles."""
    piston, shape = cycle.scene.piston, cycle.at(angle).shape
    return guide.contact_pressure(
        shape.side_force(), shape.clamp_moment(), piston.clamp_offset, piston.diameter, piston.skirt_length
    )


@dataclass(frozen=True)
class FrictionFeedback:
    """The friction force acts along the cylinder and so changes the axial force that causes it.

    P = P_0 + sign(v) F(P): friction opposes the piston, so it relieves compression on the way down. F is small beside
    P and grows slowly with it, so the map contracts; secant steps on the scalar equation at every angle finish it.
    At the dead centres the stroke, and with it F, vanishes: the loop closes without a jump.
    """

    def axial_force(self, scene: Scene, dimensions: Dimensions, beam: BeamModel, angle: Array, force: Array) -> Array:
        stroke = scene.mechanism.crank_radius * np.sin(angle)
        # cos(beta) + lambda cos(phi) > 0 for every crank shorter than its rod: v has the sign of the stroke.
        direction = np.sign(stroke)

        def closed(total: Array) -> Array:
            return force + direction * _friction(scene, beam.bend(scene, dimensions, total, stroke))

        previous, image = force, closed(force)
        current = image
        for _ in range(_MOST_ITERATIONS):
            next_image = closed(current)
            step = next_image - current
            if np.all(np.abs(step) <= _CONVERGED * (np.abs(force) + np.abs(current))):
                return next_image
            slope = np.where(
                current != previous, (next_image - image) / np.where(current != previous, current - previous, 1.0), 0.0
            )
            slope = np.where(np.abs(slope) < 0.9, slope, 0.0)
            previous, image, current = current, next_image, current + step / (1.0 - slope)
        return current


_friction = force
