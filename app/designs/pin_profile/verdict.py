"""Criteria of pins and bushings, in the names and units of the API."""

from __future__ import annotations

from app.designs.units import MEGA, MICRO, MILLI
from app.designs.verdict import Word

WORDS = {
    "equivalent_stress": Word("equivalent_stress_max_mpa", "equivalent stress of bending and shear", "MPa", MEGA),
    "shear_stress": Word("shear_stress_max_mpa", "shear stress", "MPa", MEGA),
    "ring_stress": Word("ovalization_stress_max_mpa", "hoop stress of the ring", "MPa", MEGA),
    "max_ring_stress": Word("max_ring_stress_mpa", "hoop stress of the ring", "MPa", MEGA),
    "max_ovalization": Word("max_ovalization_um", "ovalization", "µm", MICRO),
    "min_wall": Word("min_wall_mm", "wall at its thinnest", "mm", MILLI, no="the wall runs out"),
    "max_deflection": Word("max_deflection_um", "deflection of the middle", "µm", MICRO),
    "max_slope": Word("max_slope", "slope of the bore or the outside"),
}
