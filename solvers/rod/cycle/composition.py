"""One revolution of the machine: axial force and bent strip at any crank angle and section.

A cycle is composed of models: gas and moving mass give the axial force, a beam model maps force and lateral
displacement to a bent strip, corrections refine its shape. Models outside the composition are not computed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from solvers.numerics.arrays import Array
from solvers.rod.cycle.bent_strip import BentStrip
from solvers.rod.cycle.section import RingingShape
from solvers.rod.cycle.state import FORCE, Strip, states_of
from solvers.rod.load.axial_force import Drive, drive_of
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import critical_force
from solvers.rod.strip.stiffness import bending_stiffness, shear_stiffness


class Refinement(Protocol):
    """A correction of the linear strip, prepared for one cycle.

    error              estimate of its numerical error, relative to the maximum bending
    lasting_error      the part of the error that does not average out over the revolution
    terms              number of Legendre coefficients of V'' and of V
    inclines           whether the axial force becomes tangential to the deflected strip
    highest_frequency  of its oscillations other than ringing [1/rad]; 0 if it follows force and lateral displacement
    without_ringing    the correction without its free vibration
    ringing            its free vibration, if any
    """

    error: float
    lasting_error: float
    terms: int
    inclines: bool
    highest_frequency: float

    @property
    def without_ringing(self) -> Refinement: ...

    @property
    def ringing(self) -> RingingShape | None: ...

    def add(self, states: Array, curvature_series: Array, deflection_series: Array) -> tuple[Array, Array]:
        """Add to the series of V'' [1/m] and V [m] at the states' angles; return the additions to T [N], M0 [N m]."""


class Correction(Protocol):
    """A correction of the strip's shape, over the whole revolution."""

    def prepare(self, cycle: Cycle) -> Refinement:
        """Precompute the correction for a cycle."""

    def neighbours(self, found: Refinement, cycles: Sequence[Cycle]) -> Sequence[Refinement | None]:
        """Prepare the correction for cycles of neighbouring strips, together, at the resolution of ``found``; None for
        a strip to which that resolution does not apply."""


@dataclass(frozen=True)
class Composition:
    """The models of a cycle.

    moves        the reciprocating mass adds its inertia to the axial force
    couples      the axial force stiffens or softens the strip: q = P/EI instead of 0
    shears       the strip is flexible in shear
    feedback     friction adds to the axial force
    corrections  of the strip's shape
    """

    moves: bool = False
    couples: bool = False
    shears: bool = False
    feedback: bool = False
    corrections: tuple[Correction, ...] = ()

    @cached_property
    def linear(self) -> Composition:
        """The composition without its corrections."""
        return replace(self, corrections=())


def strip_of(scene: Scene, dimensions: Dimensions, composition: Composition) -> Strip:
    """Kernel representation of a strip."""
    d, rod_length, modulus = dimensions, scene.mechanism.rod_length, scene.material.elastic_modulus
    stiffness = bending_stiffness(scene, d)
    return Strip(
        stiffness=stiffness,
        length=d.l,
        rod_length=rod_length,
        direct=1.0 / (d.b * d.h),
        bending=0.5 * modulus * d.h,
        line_mass=scene.material.density * d.b * d.h,
        couples=float(composition.couples),
        compliance=stiffness / shear_stiffness(scene, d) if composition.shears else 0.0,
        friction=4.0 / math.pi * scene.piston.friction_coefficient if composition.feedback else 0.0,
        lever=6.0 / scene.piston.skirt_length,
        offset=scene.piston.clamp_offset,
        critical=critical_force(modulus, d.b, d.h, d.l, rod_length),
    )


@dataclass(frozen=True)
class Cycle:
    """A scene with its strip and composition.

    ``tolerance`` is the admissible numerical error of series in corrections, relative to the bending; ``prepared`` are
    corrections that have already been prepared for this cycle.
    """

    scene: Scene
    dimensions: Dimensions
    composition: Composition
    tolerance: float = 1e-10
    prepared: tuple[Refinement, ...] | None = None

    def without_corrections(self) -> Cycle:
        """This cycle with the linear shape."""
        return Cycle(self.scene, self.dimensions, self.composition.linear, self.tolerance)

    def neighbours(self, strips: Sequence[Dimensions]) -> list[Cycle | None]:
        """The cycles of neighbouring strips, with corrections at this cycle's resolution; None where that does not
        apply. None of the strips may buckle.

        All are solved together, and differences between them contain no effect of a change of resolution.
        """
        corrections = self.composition.corrections
        cycles = [replace(self, dimensions=d, prepared=None) for d in strips]
        found = [
            correction.neighbours(refinement, cycles)
            for correction, refinement in zip(corrections, self.refinements, strict=True)
        ]
        return [
            None if any(one is None for one in refinements) else replace(cycle, prepared=refinements)
            for cycle, refinements in zip(cycles, zip(*found, strict=True), strict=True)
        ]

    @cached_property
    def drive(self) -> Drive:
        """Kernel representation of gas load and moving mass."""
        return drive_of(self.scene, self.scene.piston.reciprocating_mass if self.composition.moves else 0.0)

    @cached_property
    def refinements(self) -> tuple[Refinement, ...]:
        if self.prepared is not None:
            return self.prepared
        return tuple(correction.prepare(self) for correction in self.composition.corrections)

    @property
    def refinement_error(self) -> float:
        """Numerical error of the corrections, relative to the maximum bending of the strip."""
        return sum(refinement.error for refinement in self.refinements)

    @property
    def lasting_error(self) -> float:
        """The part of ``refinement_error`` that does not average out over the revolution."""
        return sum(refinement.lasting_error for refinement in self.refinements)

    @cached_property
    def strip(self) -> Strip:
        """Kernel representation of the strip with its composition."""
        return strip_of(self.scene, self.dimensions, self.composition)

    def axial_force(self, angle: Array) -> Array:
        """P(phi) = -(p - p_back) pi D^2/4, plus inertia and friction feedback; tension positive [N].

        If friction buckles the strip this is twice the critical compression.
        """
        return self.states(np.ascontiguousarray(angle))[FORCE]

    def at(self, angle: ArrayLike) -> BentStrip:
        """The strip at the given crank angles [rad]."""
        return self.bent_strip(self.states(np.ascontiguousarray(np.atleast_1d(np.asarray(angle, dtype=float)))))

    def states(self, angle: Array) -> Array:
        """The states of the linear strip at crank angles [rad], (ROWS, angles)."""
        return states_of(self.drive, self.strip, angle)

    def bent_strip(self, states: Array) -> BentStrip:
        """The strip at its states, with all corrections."""
        if not self.refinements:
            return BentStrip.linear(self.strip, states)
        terms = max(refinement.terms for refinement in self.refinements)
        curvature_series, deflection_series = np.zeros((2, terms, states.shape[1]))
        reactions = [refinement.add(states, curvature_series, deflection_series) for refinement in self.refinements]
        side, moment = np.sum(reactions, axis=0)
        inclined = any(refinement.inclines for refinement in self.refinements)
        return BentStrip(self.strip, states, curvature_series, deflection_series, side, moment, inclined)
