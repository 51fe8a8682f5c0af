"""What is asked of a cycle: the loads that designs are made for, each by its greatest value."""

from __future__ import annotations

import numpy as np

LOADS = (
    ("gas_force_max", lambda f: f.gas),
    ("rod_compression_max", lambda f: f.rod),
    ("rod_tension_max", lambda f: -f.rod),
    ("side_force_max", lambda f: np.abs(f.side)),
    ("wrist_pin_load_max", lambda f: f.wrist_pin_load),
    ("crank_pin_load_max", lambda f: f.crank_pin_load),
    ("main_bearing_load_max", lambda f: f.main_bearing_load),
)
"""Instants that designs are made for. |N| is taken as one quantity: its corner at zero is never its maximum."""
OF_THE_ROD = slice(1, 3)
