"""What is asked of a cycle: the loads that designs are made for, each by its greatest value."""

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
"""Names of the greatest loads, in the order of the rows in ``cycle.worst_instants``."""
OF_THE_ROD = slice(1, 3)
"""Its compression and its tension: next to none of one beside much of the other is what the other's digits leave."""
