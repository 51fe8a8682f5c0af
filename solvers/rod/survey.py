"""A scene's cycle sampled once, ready for the search over strips."""

from __future__ import annotations

import numpy as np

from solvers.crank import kinematics
from solvers.fatigue import FatigueCriterion, Gerber, HaighLines
from solvers.numerics import periodic
from solvers.rod.cycle import Composition, Cycle
from solvers.rod.focus import Machine
from solvers.rod.scene import Dimensions, Scene

ANGLES = 96
_EXACT = 1e-10


def survey(scene: Scene, criterion: FatigueCriterion, composition: Composition, any_strip: Dimensions) -> Machine:
    """The machine as the search sees it: gas load, moving mass, beam-column, contact.

    ``any_strip`` only completes the cycle: without feedback the axial force does not depend on the strip.
    """
    cycle = Cycle(scene, any_strip, composition)
    angle = periodic.grid(ANGLES)
    force = cycle.axial_force(angle)
    least = periodic.maximum(lambda a: -cycle.axial_force(a), _EXACT, angle, -force)
    m, piston = scene.mechanism, scene.piston
    lines, parabola = _arrays(criterion)
    return Machine(
        cycle=cycle,
        crank_radius=m.crank_radius,
        rod_length=m.rod_length,
        modulus=scene.material.elastic_modulus,
        guide=np.array([piston.clamp_offset, piston.diameter, piston.skirt_length, piston.friction_coefficient]),
        lines=lines,
        parabola=parabola,
        angle=angle,
        force=force,
        stroke=m.crank_radius * np.sin(angle),
        speed=np.abs(kinematics.velocity(angle, m.crank_radius, m.rod_length, m.angular_speed)),
        compression=max(least.value, 0.0),
        hardest=least.angle,
    )


def _arrays(criterion: FatigueCriterion) -> tuple[np.ndarray, np.ndarray]:
    """The criterion as kernels take it: corners of lines (a corner's last line repeated to equal length), parabola."""
    if isinstance(criterion, Gerber):
        return np.zeros((0, 1, 2)), np.array([criterion.alpha, criterion.beta])
    if isinstance(criterion, HaighLines):
        longest = max(len(lines) for lines in criterion.corners)
        padded = [lines + (lines[-1],) * (longest - len(lines)) for lines in criterion.corners]
        return np.array(padded, dtype=float), np.zeros(2)
    raise TypeError(f"the search knows no criterion of type {type(criterion).__name__}")
