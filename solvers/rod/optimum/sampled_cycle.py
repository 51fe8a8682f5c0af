"""A scene's cycle sampled once, ready for the search over strips."""

from __future__ import annotations

import numpy as np

from solvers.crank import kinematics
from solvers.fatigue import FatigueCriterion
from solvers.numerics import periodic
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.load.axial_force import least_force
from solvers.rod.optimum.machine import Machine
from solvers.rod.scene import Dimensions, Scene

ANGLES, WHOLE = 96, 512
"""Where stresses and reactions are first looked for; of a mean, whose error falls with the third power (the piston
ceases to bear on its second wall: a corner in the derivative), a few 1e-7 at the most of 1,000 random machines."""
_EXACT = 1e-10


def survey(scene: Scene, criterion: FatigueCriterion, composition: Composition, any_strip: Dimensions) -> Machine:
    """The machine as the search sees it: gas load, moving mass, beam-column, contact.

    ``any_strip`` only completes the cycle: without feedback the axial force does not depend on the strip.
    """
    cycle = Cycle(scene, any_strip, composition)
    angle, whole = periodic.grid(ANGLES), periodic.grid(WHOLE)
    force = cycle.axial_force(angle)
    least, hardest = least_force(cycle.drive, angle, force, _EXACT)
    m, piston = scene.mechanism, scene.piston
    lines, parabola = criterion.diagram()
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
        whole=(
            cycle.axial_force(whole),
            m.crank_radius * np.sin(whole),
            np.abs(kinematics.velocity(whole, m.crank_radius, m.rod_length, m.angular_speed)),
        ),
        compression=max(-least, 0.0),
        hardest=hardest % periodic.TURN,
    )
