"""Random crank mechanisms of any size and speed, with tables or indicator diagrams, one or several cylinders."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def request(rng: np.random.Generator) -> dict[str, Any]:
    """An analysis request; one in four is hard: a rod barely longer than the crank, or a narrow pressure peak."""
    hard = rng.random() < 0.25
    length = 10 ** rng.uniform(-2.0, 0.3)
    radius = length * (rng.uniform(0.5, 0.95) if hard and rng.random() < 0.5 else rng.uniform(0.02, 0.4))
    bore, strokes = radius * rng.uniform(0.8, 3.0), int(rng.choice([2, 4]))
    area = math.pi * bore**2 / 4
    clearance = area * 2 * radius / rng.uniform(4.0, 20.0)
    offset = (length - radius) * 10 ** rng.uniform(-5.0, -0.7) if rng.random() < 0.4 else 0.0
    rod = area * 10 ** rng.uniform(0.5, 2.6)
    cg = length * rng.uniform(0.4, 0.8)
    inertia = rod * cg * (length - cg) * rng.uniform(0.8, 1.05)
    form = _diagram if rng.random() < 0.5 and offset == 0.0 else _table
    body = {
        "mechanism": {
            "crank_radius_mm": radius * 1e3,
            "rod_length_mm": length * 1e3,
            "speed_hz": 10 ** rng.uniform(-1.5, 1.0) / math.sqrt(length),
            "offset_mm": offset * 1e3 * float(rng.choice([-1, 1])),
        },
        "cylinder": {
            "bore_mm": bore * 1e3,
            "clearance_volume_cm3": clearance * 1e6,
            "crankcase_pressure_mpa": 0.1,
            "strokes": strokes,
        },
        "pressure": form(rng, strokes, clearance * 1e6, area * 2 * radius * 1e6, hard),
        "masses": {
            "piston_kg": area * 10 ** rng.uniform(0.5, 2.6),
            "rod_kg": rod,
            "rod_cg_from_pin_mm": cg * 1e3,
            "rod_inertia_kg_m2": inertia,
            "crank_pin_kg": area * rng.uniform(0.0, 200.0),
        },
        "series_angles": 2,
    }
    if rng.random() < 0.3:
        count = int(rng.integers(2, 7))
        even = [180.0 * strokes * i / count for i in range(count)]
        phases = even if rng.random() < 0.7 else list(rng.uniform(0.0, 180.0 * strokes, count))
        body["engine"] = {"cylinders": count, "phases_deg": phases, "flywheel_inertia_kg_m2": rod * radius**2 * 50.0}
    return body


def _table(rng: np.random.Generator, strokes: int, _low: float, _swept: float, hard: bool) -> dict[str, Any]:
    """One pressure peak per cycle on a constant level, from a few degrees to half a turn wide."""
    period = 180.0 * strokes
    width = rng.uniform(0.03, 0.1) if hard else rng.uniform(0.1, 1.0)
    top, level = rng.uniform(5.0, 60.0) + (360.0 if strokes == 4 else 0.0), 10 ** rng.uniform(-1.0, 0.8)
    far = np.sort(rng.uniform(0.0, period, int(rng.integers(12, 60))))
    near = top + width * 180.0 * np.linspace(-1.0, 1.0, 15)
    degrees = np.unique(np.round(np.mod(np.concatenate([far, near]), period), 3))
    apart = np.abs(np.remainder(degrees - top + period / 2, period) - period / 2)
    values = 0.1 + level * np.exp(-((apart / (width * 90.0)) ** 2))
    return {"kind": "table", "angle_deg": degrees.tolist(), "pressure_mpa": values.tolist()}


def _diagram(rng: np.random.Generator, strokes: int, low: float, swept: float, _hard: bool) -> dict[str, Any]:
    """Two polytropes, the upper one raised by combustion; for four strokes a gas exchange near constant pressure."""
    count = int(rng.integers(6, 40))
    volume = low + swept * 0.5 * (1 - np.cos(np.linspace(0.0, math.pi, count)))
    volume[0], volume[-1] = low, low + swept
    squeezed = 0.09 * (volume[-1] / volume) ** rng.uniform(1.2, 1.4)
    lifted = squeezed * rng.uniform(1.2, 4.0)
    pairs = [(volume, lifted), (volume[::-1], squeezed[::-1])]
    if strokes == 4:
        flat = np.full(count, 0.09)
        pairs = [(volume, flat), pairs[1], pairs[0], (volume[::-1], flat * 1.2)]
    return {"kind": "indicator", "strokes": [{"volume_cm3": v.tolist(), "pressure_mpa": p.tolist()} for v, p in pairs]}
