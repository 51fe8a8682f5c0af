"""The cycle of a scene on the core's physics, sampled once for the search over strips.

The core consists of gas load, moving mass, beam-column and contact, so the axial force is the same for every strip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from solvers.crank.motion import slider_crank as kinematics
from solvers.fatigue import FatigueCriterion
from solvers.fatigue.kernels import Diagram
from solvers.numerics import periodic
from solvers.numerics.arrays import Array
from solvers.numerics.panels import greatest, resolve
from solvers.rod.cycle.sampling import MAX_PANELS, panel_edges, rule_for
from solvers.rod.load.axial_force import Drive, axial_forces, drive_of
from solvers.rod.optimum.core import peak_model
from solvers.rod.optimum.core.peak_model import CorePeaks, guide_reactions_at, stresses_at
from solvers.rod.optimum.peaks import (
    ANGLE_STEP,
    Peaks,
    RequiredResults,
    distance_to_corners,
    find_peaks,
    reaction_peaks,
    stencils,
)
from solvers.rod.optimum.sqp import ALL
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene

MEAN_ANGLES = 1024
"""Number of angles for a mean over the cycle.

The error falls with the third power of the number, since the second derivative jumps where the piston loses contact
with its second wall. It is 3e-7 for slender strips near buckling (with half as many angles: 2e-6).
"""
_FORCE_TOLERANCE = 1e-10
_SPACING_BETWEEN_CORNERS = 2e-5, 1e-3
"""Minimum and maximum spacing of a stencil of angles for a load with corners [rad]."""


@dataclass(frozen=True)
class CoreCycle:
    """Axial force, lateral displacement and constants of the machine; SI units.

    guide                   clamp offset, diameter, skirt length [m], friction coefficient
    mean_samples            force, lateral and |piston speed| [m/s] at the angles of the mean of friction power
    compression             maximum compression [N]
    peak_compression_angle  its crank angle [rad]
    corners                 crank angles [rad] at which derivatives of the load jump
    """

    drive: Drive
    modulus: float
    guide: Array
    diagram: Diagram
    mean_samples: tuple[Array, Array, Array]
    compression: float
    peak_compression_angle: float
    corners: Array

    @property
    def rod_length(self) -> float:
        return self.drive.rod_length

    def axial_force(self, angle: Array) -> Array:
        """Axial force P [N] at any crank angles [rad]."""
        return axial_forces(self.drive, np.ascontiguousarray(angle))

    def lateral_displacement(self, angle: Array) -> Array:
        """Lateral displacement of the crank pin r sin(phi) [m]."""
        return self.drive.crank_radius * np.sin(angle)

    def strip(self, d: Dimensions) -> CoreStrip:
        """Response of a strip."""
        return CoreStrip(self, d)

    def peaks(self, d: Dimensions, required: RequiredResults) -> Peaks:
        """Locations of the peaks of a strip."""
        return find_peaks(self.strip(d), self.diagram, required, self.corners)

    def reaction_peaks(self, d: Dimensions) -> Array:
        """Crank angles of the peaks of its side force and contact pressure [rad]."""
        return reaction_peaks(self.strip(d), self.corners)

    def rows_near(self, peaks: Peaks, required: RequiredResults) -> CoreRows:
        """Rows of the strips near the one with these peaks."""
        stresses, reactions = (stencils(angles, self._spacing(angles)) for angles in (peaks.angles, peaks.reactions))
        core = CorePeaks(
            self.axial_force(stresses), self.lateral_displacement(stresses), peaks.stations(),
            self.axial_force(reactions), self.lateral_displacement(reactions),
            *(self.mean_samples if required.power else (np.empty(0),) * 3),
            *self.diagram, self.compression, self.guide, self.modulus, self.rod_length,
        )  # fmt: skip
        # Both fibres at the clamp and at every interior section.
        fibres = 2 * (1 + peaks.sections.size)
        return CoreRows(core, Layout(fibres, fibres, peaks.reactions.size))

    def rows(self, d: Dimensions, required: RequiredResults) -> Array:
        """All rows of a strip, at its own peaks."""
        return self.rows_near(self.peaks(d, required), required).values(np.log([d.b, d.h, d.l]))

    def _spacing(self, angles: Array) -> Array:
        """Spacing of the stencil of each peak [rad]: no corner lies inside a stencil, and a load may change steeply
        between corners."""
        distance = distance_to_corners(angles, self.corners)
        return np.clip(distance, *_SPACING_BETWEEN_CORNERS) if self.corners.size else np.full(angles.size, ANGLE_STEP)


@dataclass(frozen=True)
class CoreStrip:
    """Response of one strip on the core's physics (a ``peaks.Response``)."""

    cycle: CoreCycle
    dimensions: Dimensions

    def stresses(self, angle: Array, eta: Array) -> Array:
        c, d = self.cycle, self.dimensions
        force, lateral = c.axial_force(angle), c.lateral_displacement(angle)
        return stresses_at(force, lateral, c.modulus, c.rod_length, d.b, d.h, d.l, eta)

    def reactions(self, angle: Array) -> Array:
        c, d = self.cycle, self.dimensions
        force, lateral = c.axial_force(angle), c.lateral_displacement(angle)
        return guide_reactions_at(force, lateral, c.modulus, c.rod_length, c.guide, 1.0 / (d.b * d.h**3), d.l)


@dataclass(frozen=True)
class CoreRows:
    """All rows of the strips near one with known peaks, as functions of x = ln(b, h, l)."""

    core: CorePeaks
    layout: Layout
    _values: dict[bytes, Array] = field(default_factory=dict)
    """Rows evaluated so far."""

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        key = x.tobytes()
        if key not in self._values:
            out = self._values[key] = np.empty(self.layout.size)
            b, h, l = math.exp(x[0]), math.exp(x[1]), min(math.exp(x[2]), self.core.rod_length)
            peak_model.rows_at(self.core, b, h, l, out)
        return self._values[key]

    def jacobian(self, x: Array, free: Array = ALL) -> Array:
        """Derivatives of all rows with respect to x, shape (rows, 3)."""
        out = np.empty((self.layout.size, 3))
        peak_model.row_jacobian(self.core, np.ascontiguousarray(x), out)
        return out


def core_cycle(scene: Scene, criterion: FatigueCriterion, mass: float) -> CoreCycle:
    """Cycle of a scene under the gas force and the inertia of a reciprocating mass [kg]."""
    drive, piston = drive_of(scene, mass), scene.piston
    mean_angle, m = periodic.grid(MEAN_ANGLES), scene.mechanism
    edges = panel_edges(np.mod(scene.load.sharp_angles(), periodic.TURN))
    rule = rule_for(scene.load, _FORCE_TOLERANCE)
    panels, force, _ = resolve(
        lambda angle: axial_forces(drive, angle)[None], edges, rule, 1, _FORCE_TOLERANCE, MAX_PANELS
    )
    compression, _, peak_compression_angle = greatest(*panels, force[0], -1.0, _FORCE_TOLERANCE * np.abs(force).max())
    speed = np.abs(kinematics.velocity(mean_angle, m.crank_radius, m.rod_length, m.angular_speed))
    return CoreCycle(
        drive=drive,
        modulus=scene.material.elastic_modulus,
        guide=np.array([piston.clamp_offset, piston.diameter, piston.skirt_length, piston.friction_coefficient]),
        diagram=criterion.diagram(),
        mean_samples=(axial_forces(drive, mean_angle), m.crank_radius * np.sin(mean_angle), speed),
        compression=max(compression, 0.0),
        peak_compression_angle=peak_compression_angle % periodic.TURN,
        corners=scene.load.corners(),
    )
