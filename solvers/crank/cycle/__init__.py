"""Forces over a cycle and their maxima."""

LOADS = (
    "gas_force_max",
    "rod_compression_max",
    "rod_tension_max",
    "side_force_max",
    "wrist_pin_load_max",
    "crank_pin_load_max",
    "main_bearing_load_max",
)
"""The maximum loads of one cylinder, in the order of evaluation; here, where no kernel is imported."""
