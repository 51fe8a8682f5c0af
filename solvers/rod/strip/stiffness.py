"""Stiffness of the strip's rectangular section, b wide and h thick in the plane of bending."""

from __future__ import annotations

from solvers.rod.scene import Dimensions, Scene

SHEAR_FACTOR = 5.0 / 6.0
"""Shear correction factor k of a rectangular section."""


def bending_stiffness(scene: Scene, dimensions: Dimensions) -> float:
    """EI = E b h^3/12 [N m^2]."""
    return scene.material.elastic_modulus * dimensions.b * dimensions.h**3 / 12.0


def shear_stiffness(scene: Scene, dimensions: Dimensions) -> float:
    """Shear stiffness k G A of the section [N]."""
    return SHEAR_FACTOR * scene.material.shear_modulus * dimensions.b * dimensions.h
