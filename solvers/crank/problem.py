"""Names of the maximum loads of a cycle."""

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
"""Names of the maximum loads, in the order of the rows in ``cycle.worst_instants``."""
OF_THE_ROD = slice(1, 3)
"""Rod compression and tension: the error of the smaller one is relative to the scale of the larger."""
