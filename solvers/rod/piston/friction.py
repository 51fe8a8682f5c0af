"""Friction between piston and cylinder: what it costs in power, and what it does to the axial force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.rod.cycle.composition import Array, BeamModel, Cycle, Shape
from solvers.rod.piston import skirt
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import buckling

_MOST_ITERATIONS = 60
_CONVERGED = 4.0 * np.finfo(float).eps


Index = NDArray[np.int64]


def force(scene: Scene, shape: Shape) -> Array:
    """Friction force on the piston [N], not negative, shape (angles,)."""
    piston = scene.piston
    return skirt.friction_force(
        shape.side_force(), shape.clamp_moment(), piston.clamp_offset, piston.skirt_length, piston.friction_coefficient
    )


def power_at(scene: Scene, angle: Array, side: Array, moment: Array) -> Array:
    """F |v| [W] at crank angles with side forces T [N] and clamp moments M0 [N m] there."""
    mechanism, piston = scene.mechanism, scene.piston
    per_wall = piston.friction_coefficient * (4.0 / math.pi) * mechanism.crank_radius * mechanism.angular_speed
    ratio, lever = mechanism.crank_radius / mechanism.rod_length, 6.0 / piston.skirt_length
    return _power(angle, side, moment, piston.clamp_offset, lever, ratio, per_wall)


def power(cycle: Cycle, angle: Array) -> Array:
    """F |v| [W] at the crank angles."""
    shape = cycle.at(angle).shape
    return power_at(cycle.scene, angle, shape.side_force(), shape.clamp_moment())


@kernel
def _power(
    angle: Array, side: Array, moment: Array, offset: float, lever: float, ratio: float, per_wall: float
) -> Array:
    """int |q| ds of ``solvers.rod.piston.skirt`` times |v| of ``solvers.crank.kinematics``, all constants in
    ``per_wall``."""
    out = np.empty(angle.size)
    for i in range(angle.size):
        wall = skirt.both_walls(abs(side[i]), lever * abs(moment[i] + side[i] * offset))
        sine = math.sin(angle[i])
        lean = math.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
        out[i] = per_wall * wall * abs(sine * (1.0 + ratio * math.cos(angle[i]) / lean))
    return out


def pressure(cycle: Cycle, angle: Array) -> Array:
    """Greatest contact pressure on the skirt [Pa] at the crank angles."""
    piston, shape = cycle.scene.piston, cycle.at(angle).shape
    return skirt.contact_pressure(
        shape.side_force(), shape.clamp_moment(), piston.clamp_offset, piston.diameter, piston.skirt_length
    )


@dataclass(frozen=True)
class FrictionFeedback:
    """The friction force acts along the cylinder and so changes the axial force that causes it.

    P = P_0 + sign(v) F(P): friction opposes the piston, so it relieves compression on the way down and adds to it on
    the way up. There F grows toward buckling as 1/(P_cr + P), a convex function, so that secants from P_0 fall short of
    the first solution, never beyond it; where they find none, the friction buckles the strip. At the dead centres the
    stroke, and with it F, vanishes: the loop closes without a jump.
    """

    def axial_force(self, scene: Scene, dimensions: Dimensions, beam: BeamModel, angle: Array, force: Array) -> Array:
        """P [N] at the angles; twice the critical compression where friction buckles the strip."""
        stroke = scene.mechanism.crank_radius * np.sin(angle)
        # cos(beta) + lambda cos(phi) > 0 for every crank shorter than its rod: v has the sign of the stroke.
        direction = np.sign(stroke)

        def missing(live: Index, total: Array) -> Array:
            shape = beam.bend(scene, dimensions, total, stroke[live])
            return force[live] + direction[live] * _friction(scene, shape) - total

        buckled = -2.0 * buckling.critical_force(
            *(scene.material.elastic_modulus, dimensions.b, dimensions.h, dimensions.l, scene.mechanism.rod_length)
        )
        found, live = np.full(force.size, buckled), np.arange(force.size)
        before, gap = force, missing(live, force)
        slope = np.ones(force.size)
        for _ in range(_MOST_ITERATIONS):
            step = gap / slope
            here = before + step
            closed = np.abs(step) <= _CONVERGED * (np.abs(force[live]) + np.abs(here))
            found[live[closed]] = here[closed]
            going = ~closed & (here > buckled)
            if not going.any():
                break
            live, before, here, gap_before = live[going], before[going], here[going], gap[going]
            gap = missing(live, here)
            slope = (gap_before - gap) / (here - before)
            # Without a slope to follow, as beyond the place where there is a solution, a plain step.
            slope, before = np.where(slope > 0.0, slope, 1.0), here
        return found


_friction = force
