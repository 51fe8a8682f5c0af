"""Shear flexibility of the strip, after Engesser: the section's turn psi and the slope V' part ways.

    EI psi'' = P V' + Q,  m V' = psi - Q/(kGA),  m = 1 + P/(kGA),  k = 5/6
    psi(0) = V(0) = 0,  V(l) + e psi(l) = s,  M(L) = 0  (the rigid head follows psi)

Eliminating V' leaves the beam-column's own equation with q_s = q/m, so psi = C S1 + D S2 with Q = EI m D, and with
g = EI/(kGA), all c_k at t = -q_s l^2:

    det = l^3 (c2 - c3)/m + e l (l + m e) c1 + g l (c0 + e q l c1)
    C = s (l c1 + e m c0)/det,  D = -s (c0 + e q l c1)/det,  psi'(l) = s e m/det

Rigid in shear (g = 0, m = 1) this is ``beam_column``. Validity: P > -kGA, always so before buckling.
Source: F. Engesser (1891); Z. P. Bazant, L. Cedolin, Stability of Structures, section 1.7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.numerics.stumpff import stumpff, stumpff_scaled
from solvers.rod.cycle.composition import Array, CoupledBeam, Shape, bending_stiffness
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip import beam_column
from solvers.rod.strip.buckling import critical_phase

SHEAR_FACTOR = 5.0 / 6.0


def shear_stiffness(scene: Scene, dimensions: Dimensions) -> float:
    """k G A [N] of the rectangular strip."""
    return SHEAR_FACTOR * scene.material.shear_modulus * dimensions.b * dimensions.h


@dataclass(frozen=True)
class ShearShape:
    """The strip with shear: curvature means psi', the rate of the section's turn that stresses the fibres."""

    constants: beam_column.BeamConstants
    stiffness: float
    softening: Array
    compliance: float
    force: Array
    stroke: Array

    def curvature(self, stations: ArrayLike) -> Array:
        return beam_column.curvature(self.constants, stations) * self.stroke

    def slope(self, stations: ArrayLike) -> Array:
        shear = self.compliance * self.constants.clamp_shear
        return (beam_column.slope(self.constants, stations) / self.softening - shear) * self.stroke

    def deflection(self, stations: ArrayLike) -> Array:
        z = np.atleast_1d(np.asarray(stations, dtype=float))[:, None]
        shear = self.compliance * self.constants.clamp_shear * z
        return (beam_column.deflection(self.constants, stations) / self.softening - shear) * self.stroke

    def axial_force(self, stations: ArrayLike) -> Array:
        return np.broadcast_to(self.force, (np.size(stations), self.force.size))

    def side_force(self) -> Array:
        return -self.stiffness * self.softening * self.constants.clamp_shear * self.stroke

    def clamp_moment(self) -> Array:
        return self.stiffness * self.constants.clamp_curvature * self.stroke


@dataclass(frozen=True)
class ShearFlexible:
    """A beam model with shear, on top of plain bending or of a beam-column."""

    base: CoupledBeam
    shears: bool = True

    @property
    def couples(self) -> float:
        return self.base.couples

    def bend(self, scene: Scene, dimensions: Dimensions, force: Array, stroke: Array) -> Shape:
        stiffness, shear = bending_stiffness(scene, dimensions), shear_stiffness(scene, dimensions)
        l, e = dimensions.l, scene.mechanism.rod_length - dimensions.l
        q = self.base.coupling(scene, dimensions, force)
        compliance = stiffness / shear
        softening = 1.0 + q * compliance
        scaled = q / softening
        c = stumpff_scaled(-scaled * l * l)
        det = _determinant(c.c0, c.c1, c.c2 - c.c3, q, softening, l, e, compliance)
        decay = np.exp(-np.sqrt(np.maximum(scaled, 0.0)) * l)
        constants = beam_column.BeamConstants(
            coupling=scaled,
            length=l,
            rod_length=scene.mechanism.rod_length,
            clamp_curvature=(l * c.c1 + e * softening * c.c0) / det,
            clamp_shear=-(c.c0 + e * q * l * c.c1) / det,
            head_curvature=e * softening * decay / det,
            determinant=det,
        )
        return ShearShape(constants, stiffness, softening, compliance, force, stroke)


def _determinant(
    c0: Array,
    c1: Array,
    c2_minus_c3: Array,
    q: Array,
    softening: Array,
    l: float,
    e: float,
    compliance: float,
) -> Array:
    return l**3 * c2_minus_c3 / softening + e * l * (l + softening * e) * c1 + compliance * l * (c0 + e * q * l * c1)


def critical_coupling(length: float, rod_length: float, compliance: float) -> float:
    """-P_cr/EI [1/m^2] with shear, for g = EI/(kGA) [m^2]: the first zero of the determinant.

    With x^2 = -q_s l^2, m = 1/(1 + g x^2/l^2). Shear can only soften, so the root lies below that without it.
    """
    from scipy.optimize import brentq

    e = rod_length - length

    def determinant(x: float) -> float:
        scaled = -((x / length) ** 2)
        softening = 1.0 / (1.0 - compliance * scaled)
        c = stumpff(x * x)
        q = scaled * softening
        return float(_determinant(c.c0, c.c1, c.c2 - c.c3, q, softening, length, e, compliance)) / rod_length**3

    rigid = float(critical_phase(length / rod_length))
    root = brentq(determinant, 1e-3, rigid, xtol=1e-15, rtol=8.9e-16) if determinant(rigid) < 0 else rigid
    return -((root / length) ** 2) / (1.0 + compliance * (root / length) ** 2)
