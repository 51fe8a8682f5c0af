"""One turn of the machine: forces on the strip and how it bends, at any crank angle and any section.

A cycle is composed, not switched: gas and moving masses make the axial force, a beam model turns force and stroke
into a bent strip, corrections refine its shape. What is not in the composition is not computed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.rod.load.axial_force import Drive, axial_forces, drive_of
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import beam_column, beam_column_kernels

Array = NDArray[np.float64]
_QUARTERS = 0.5 * np.pi * np.arange(4)


class MovingMass(Protocol):
    """Something that moves with the piston, so that its inertia is a part of the axial force."""

    def mass(self, scene: Scene) -> float:
        """The mass [kg]."""


class Shape(Protocol):
    """The strip as bent at some angles; every method gives arrays of shape (stations, angles)."""

    def curvature(self, stations: ArrayLike) -> Array:
        """V''(z) [1/m]."""

    def slope(self, stations: ArrayLike) -> Array:
        """V'(z)."""

    def deflection(self, stations: ArrayLike) -> Array:
        """V(z) [m]."""

    def axial_force(self, stations: ArrayLike) -> Array:
        """Force along the strip's own tangent [N]."""

    def side_force(self) -> Array:
        """Transverse force on the piston [N], shape (angles,)."""

    def clamp_moment(self) -> Array:
        """Moment on the piston [N m], shape (angles,)."""


class BeamModel(Protocol):
    """Turns axial force and lateral stroke into a bent strip.

    ``couples`` says whether the axial force bends the strip (1.0) or not (0.0).
    """

    couples: float

    def bend(self, scene: Scene, dimensions: Dimensions, force: Array, stroke: Array) -> Shape:
        """The strip under the axial force [N] with the crank pin at the lateral stroke [m]."""


class Feedback(Protocol):
    """Closes a loop from the bent strip back to the axial force."""

    def axial_force(self, scene: Scene, dimensions: Dimensions, beam: BeamModel, angle: Array, force: Array) -> Array:
        """The force [N] with the loop closed, given the force without it."""


class Refinement(Protocol):
    """A correction made ready for one cycle.

    ``error`` estimates its own numerical error, relative to the greatest bending; ``lasting_error`` the part of it that
    does not average out over the turn.
    """

    error: float
    lasting_error: float

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        """The corrected shape at the angles."""


class Correction(Protocol):
    """Refines the shape of the strip over the whole turn."""

    def prepare(self, cycle: Cycle) -> Refinement:
        """What the correction needs of the whole cycle, worked out once."""


@dataclass(frozen=True)
class LinearShape:
    """Small displacements: the shape per unit stroke, times the stroke."""

    constants: beam_column.BeamConstants
    stiffness: float
    force: Array
    stroke: Array

    def curvature(self, stations: ArrayLike) -> Array:
        c, z = self.constants, np.atleast_1d(np.asarray(stations, dtype=float))
        bent = beam_column_kernels.curvature(
            c.coupling, c.length, c.clamp_curvature, c.clamp_shear, c.head_curvature, z
        )
        return bent * self.stroke

    def slope(self, stations: ArrayLike) -> Array:
        return beam_column.slope(self.constants, stations) * self.stroke

    def deflection(self, stations: ArrayLike) -> Array:
        c, z = self.constants, np.atleast_1d(np.asarray(stations, dtype=float))
        bent = beam_column_kernels.deflection(
            c.coupling, c.length, c.clamp_curvature, c.clamp_shear, c.head_curvature, z
        )
        return bent * self.stroke

    def axial_force(self, stations: ArrayLike) -> Array:
        return np.broadcast_to(self.force, (np.size(stations), self.force.size))

    def side_force(self) -> Array:
        return -self.stiffness * self.constants.clamp_shear * self.stroke

    def clamp_moment(self) -> Array:
        return self.stiffness * self.constants.clamp_curvature * self.stroke


def bending_stiffness(scene: Scene, dimensions: Dimensions) -> float:
    """EI = E b h^3/12 [N m^2]."""
    return scene.material.elastic_modulus * dimensions.b * dimensions.h**3 / 12.0


class CoupledBeam(BeamModel, Protocol):
    """A beam model that differs from others only in how the axial force enters."""

    def coupling(self, scene: Scene, dimensions: Dimensions, force: Array) -> Array:
        """q [1/m^2]."""


@dataclass(frozen=True)
class PlainBending:
    """The strip bends as if the axial force did not: q = 0."""

    couples: float = 0.0
    shears: bool = False

    def coupling(self, scene: Scene, dimensions: Dimensions, force: Array) -> Array:
        return np.zeros_like(force)

    def bend(self, scene: Scene, dimensions: Dimensions, force: Array, stroke: Array) -> LinearShape:
        return _bend(self, scene, dimensions, force, stroke)


@dataclass(frozen=True)
class BeamColumn:
    """The axial force stiffens or softens the strip: q = P/EI."""

    couples: float = 1.0
    shears: bool = False

    def coupling(self, scene: Scene, dimensions: Dimensions, force: Array) -> Array:
        return force / bending_stiffness(scene, dimensions)

    def bend(self, scene: Scene, dimensions: Dimensions, force: Array, stroke: Array) -> LinearShape:
        return _bend(self, scene, dimensions, force, stroke)


def _bend(beam: CoupledBeam, scene: Scene, dimensions: Dimensions, force: Array, stroke: Array) -> LinearShape:
    coupling, length, rod_length = beam.coupling(scene, dimensions, force), dimensions.l, scene.mechanism.rod_length
    clamp, shear, head, determinant = beam_column_kernels.solve(coupling, length, rod_length)
    constants = beam_column.BeamConstants(coupling, length, rod_length, clamp, shear, head, determinant)
    return LinearShape(constants, bending_stiffness(scene, dimensions), force, stroke)


@dataclass(frozen=True)
class Composition:
    """Which physics a cycle is made of."""

    moving: tuple[MovingMass, ...] = ()
    beam: BeamModel = PlainBending()
    feedback: Feedback | None = None
    corrections: tuple[Correction, ...] = ()


@dataclass(frozen=True)
class Instants:
    """The machine at some crank angles: axial force, lateral stroke, bent strip."""

    angle: Array
    force: Array
    stroke: Array
    shape: Shape


@dataclass(frozen=True)
class Cycle:
    """A scene with its strip and the physics chosen for it.

    ``tolerance`` is the numerical error, relative to the bending, that corrections may have where they need series.
    """

    scene: Scene
    dimensions: Dimensions
    composition: Composition
    tolerance: float = 1e-10

    def without_corrections(self) -> Cycle:
        """The same with the linear shape."""
        return replace(self, composition=replace(self.composition, corrections=()))

    def without_feedback(self) -> Cycle:
        """The same with an axial force that no shape acts back on, which bends no strip."""
        plain = replace(self.composition, corrections=(), feedback=None, beam=PlainBending())
        return replace(self, composition=plain)

    @cached_property
    def drive(self) -> Drive:
        """Gas load and moving masses, ready for kernels."""
        return drive_of(self.scene, sum(part.mass(self.scene) for part in self.composition.moving))

    @cached_property
    def refinements(self) -> tuple[Refinement, ...]:
        return tuple(correction.prepare(self) for correction in self.composition.corrections)

    @property
    def refinement_error(self) -> float:
        """The corrections' own numerical errors, relative to the greatest bending of the strip."""
        return sum(refinement.error for refinement in self.refinements)

    @property
    def lasting_error(self) -> float:
        """The part of ``refinement_error`` that does not average out over the turn."""
        return sum(refinement.lasting_error for refinement in self.refinements)

    def axial_force(self, angle: Array) -> Array:
        """P(phi) = -(p - p_back) pi D^2/4 and the inertia of what moves, tension positive [N]."""
        force, feedback = axial_forces(self.drive, np.ascontiguousarray(angle)), self.composition.feedback
        if feedback is not None:
            force = feedback.axial_force(self.scene, self.dimensions, self.composition.beam, angle, force)
        return force

    def corners(self) -> Array:
        """Angles [rad] at which what follows from the cycle may have corners: dead centres and the load's own."""
        return np.concatenate([_QUARTERS, self.scene.load.sharp_angles()])

    def at(self, angle: ArrayLike) -> Instants:
        """The machine at the given crank angles [rad]."""
        angle = np.atleast_1d(np.asarray(angle, dtype=float))
        force = self.axial_force(angle)
        stroke = self.scene.mechanism.crank_radius * np.sin(angle)
        shape: Shape = self.composition.beam.bend(self.scene, self.dimensions, force, stroke)
        for refinement in self.refinements:
            shape = refinement.refine(angle, force, stroke, shape)
        return Instants(angle, force, stroke, shape)
