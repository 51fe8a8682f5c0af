"""A scene's cycle sampled once, ready for the search over strips: the core's physics, which are gas load, moving mass,
beam-column and contact. The axial force is then the same for every strip."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers.crank.motion import in_line as kinematics
from solvers.fatigue import FatigueCriterion
from solvers.fatigue.kernels import Diagram
from solvers.numerics import periodic
from solvers.rod.load.axial_force import Drive, axial_forces, drive_of, least_force
from solvers.rod.optimum.core import peak_model
from solvers.rod.optimum.core.peak_model import Array, CorePeaks, side_and_pressure, stress_table
from solvers.rod.optimum.peaks import ANGLE_STEP, ANGLES, Peaks, Wanted, from_corners, peaks_of, reaction_peaks
from solvers.rod.optimum.sqp import ALL
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene

WHOLE, COARSE = 1024, 64
"""Angles of a mean, whose error falls with the third power (the piston ceases to bear on its second wall: a corner in
the second derivative): 3e-7 of slender strips close to buckling, where half as many missed 2e-6; and those of a quick
look at it, wrong by less than 5e-4 of strips that do not buckle."""
_EXACT = 1e-10
_AMONG_CORNERS = 2e-5, 1e-3
"""The least and the greatest step of the three angles through which a peak of a load with corners is followed [rad]."""


@dataclass(frozen=True)
class CoreCycle:
    """The axial force [N], the lateral stroke [m] and the numbers of the machine, SI units.

    ``whole`` has force, stroke and |piston speed| [m/s] at as many angles as the mean of friction power takes,
    ``hardest`` is the angle of the greatest compression. ``guide``: clamp offset, diameter, skirt length [m], friction
    coefficient. At ``corners`` [rad] derivatives of the load jump.
    """

    drive: Drive
    modulus: float
    guide: Array
    diagram: Diagram
    angle: Array
    force: Array
    stroke: Array
    whole: tuple[Array, Array, Array]
    compression: float
    hardest: float
    corners: Array

    @property
    def crank_radius(self) -> float:
        return self.drive.crank_radius

    @property
    def rod_length(self) -> float:
        return self.drive.rod_length

    def axial_force(self, angle: Array) -> Array:
        """P [N] at any crank angles [rad]."""
        return axial_forces(self.drive, np.ascontiguousarray(angle))

    def lateral_stroke(self, angle: Array) -> Array:
        """r sin(phi) [m]."""
        return self.crank_radius * np.sin(angle)

    @cached_property
    def coarse(self) -> CoreCycle:
        """The same with means over few angles."""
        force, stroke, speed = (values[:: WHOLE // COARSE].copy() for values in self.whole)
        return replace(self, whole=(force, stroke, speed))

    def strip(self, d: Dimensions) -> CoreStrip:
        """One strip at any angles and sections."""
        return CoreStrip(self, d)

    def peaks(self, d: Dimensions, wanted: Wanted) -> Peaks:
        """Where a strip's results peak."""
        return peaks_of(self.strip(d), self.diagram, wanted, self.corners)

    def reaction_peaks(self, d: Dimensions) -> Array:
        """Where its side force and contact pressure peak."""
        return reaction_peaks(self.strip(d), self.corners)

    def following(self, peaks: Peaks, wanted: Wanted) -> CoreRows:
        """The rows of strips near the one with these peaks."""
        threes = peaks.threes(self._apart(peaks.angles))
        reactions = peaks.reaction_threes(self._apart(peaks.reactions))
        core = CorePeaks(
            self.axial_force(threes), self.lateral_stroke(threes), peaks.stations(),
            self.axial_force(reactions), self.lateral_stroke(reactions),
            *(self.whole if wanted.power else (np.empty(0),) * 3),
            *self.diagram, self.compression, self.guide, self.modulus, self.rod_length,
        )  # fmt: skip
        # Both fibres of the clamp and of every inner section.
        fibres = 2 * (1 + peaks.sections.size)
        return CoreRows(core, Layout(fibres, fibres, peaks.reactions.size))

    def _apart(self, angles: Array) -> Array:
        """How far apart the three angles are through which each peak is followed: no corner lies between them, and a
        load's course between corners may be steep."""
        away = from_corners(angles, self.corners)
        return np.clip(away, *_AMONG_CORNERS) if self.corners.size else np.full(angles.size, ANGLE_STEP)


@dataclass(frozen=True)
class CoreStrip:
    """One strip of the core's physics: a ``peaks.Response``."""

    cycle: CoreCycle
    dimensions: Dimensions

    def stresses(self, angle: Array, eta: Array) -> Array:
        c, d, out = self.cycle, self.dimensions, np.empty((2, eta.size, angle.size))
        force, stroke = c.axial_force(angle), c.lateral_stroke(angle)
        stress_table(force, stroke, c.modulus, c.rod_length, d.b, d.h, d.l, eta, out)
        return out

    def reactions(self, angle: Array) -> Array:
        c, d, out = self.cycle, self.dimensions, np.empty((2, angle.size))
        force, stroke = c.axial_force(angle), c.lateral_stroke(angle)
        side_and_pressure(force, stroke, c.modulus, c.rod_length, c.guide, 1.0 / (d.b * d.h**3), d.l, out)
        return out


@dataclass(frozen=True)
class CoreRows:
    """All rows of strips near one whose peaks are known, as functions of x = ln(b, h, l)."""

    core: CorePeaks
    layout: Layout

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        out = np.empty(self.layout.size)
        b, h, l = math.exp(x[0]), math.exp(x[1]), min(math.exp(x[2]), self.core.rod_length)
        peak_model.rows_at(self.core, b, h, l, self._room(), out)
        return out

    def slopes(self, x: Array, free: Array = ALL) -> Array:
        """Their derivatives by x, shape (rows, 3), all of them."""
        out = np.empty((self.layout.size, 3))
        peak_model.row_slopes(self.core, np.ascontiguousarray(x), self._room(), out)
        return out

    def _room(self) -> Array:
        return np.empty((2, self.core.eta.size, self.core.force.size))


def core_cycle(scene: Scene, criterion: FatigueCriterion, mass: float) -> CoreCycle:
    """The cycle of a scene whose axial force holds the inertia of this mass [kg] beside the gas force."""
    drive, piston = drive_of(scene, mass), scene.piston
    angle, whole = periodic.grid(ANGLES), periodic.grid(WHOLE)
    force = axial_forces(drive, angle)
    least, hardest = least_force(drive, angle, force, _EXACT)
    m = scene.mechanism
    speed = np.abs(kinematics.velocity(whole, m.crank_radius, m.rod_length, m.angular_speed))
    return CoreCycle(
        drive=drive,
        modulus=scene.material.elastic_modulus,
        guide=np.array([piston.clamp_offset, piston.diameter, piston.skirt_length, piston.friction_coefficient]),
        diagram=criterion.diagram(),
        angle=angle,
        force=force,
        stroke=m.crank_radius * np.sin(angle),
        whole=(axial_forces(drive, whole), m.crank_radius * np.sin(whole), speed),
        compression=max(-least, 0.0),
        hardest=hardest % periodic.TURN,
        corners=scene.load.corners(),
    )
