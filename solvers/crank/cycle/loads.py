"""The loads of one cylinder whose greatest values are found, without importing what finds them."""

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
"""Their names, in the order in which they are evaluated."""
