"""Friction between piston and cylinder: what it costs in power, and what it does to the axial force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.crank import kinematics
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
    mechanism = cycle.scene.mechanism
    speed = kinematics.velocity(angle, mechanism.crank_radius, mechanism.rod_length, mechanism.angular_speed)
    return force(cycle.scene, cycle.at(angle).shape) * np.abs(speed)


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
