"""Names of the maximum loads of one cylinder, in a module that imports no kernels."""

from __future__ import annotations

LOADS = (
    "gas_force_max",
    "rod_compression_max",
    "rod_tension_max",
    "side_force_max",
    "wrist_pin_load_max",
    "crank_pin_load_max",
    "main_bearing_load_max",
)
"""The names, in the order of evaluation."""
