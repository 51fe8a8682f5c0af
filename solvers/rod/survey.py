"""A scene's cycle sampled once, ready for the search over strips."""

from __future__ import annotations

import numpy as np

from solvers.crank import kinematics
from solvers.fatigue import FatigueCriterion
from solvers.numerics import periodic
from solvers.rod.cycle import Composition, Cycle
from solvers.rod.drive import least_force
from solvers.rod.focus import Machine
from solvers.rod.haigh import diagram_of
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
    least, hardest = least_force(cycle.drive, angle, force, _EXACT)
    m, piston = scene.mechanism, scene.piston
    lines, parabola = diagram_of(criterion)
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
        compression=max(-least, 0.0),
        hardest=hardest % periodic.TURN,
    )
