"""Criteria of pins and bushings, in the names and units of the API."""

from __future__ import annotations

from app.designs.verdict import Word

WORDS = {
    "equivalent_stress": Word("equivalent_stress_max_mpa", "equivalent stress of bending and shear"),
    "shear_stress": Word("shear_stress_max_mpa", "shear stress"),
    "ring_stress": Word("ovalization_stress_max_mpa", "hoop stress of the ring"),
    "max_ring_stress": Word("max_ring_stress_mpa", "hoop stress of the ring"),
    "max_ovalization": Word("max_ovalization_um", "ovalization"),
    "min_wall": Word("min_wall_mm", "wall at its thinnest", no="the wall runs out"),
    "max_deflection": Word("max_deflection_um", "deflection of the middle"),
    "max_slope": Word("max_slope", "slope of the bore or the outside"),
}
