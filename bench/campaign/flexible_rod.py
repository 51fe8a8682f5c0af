"""Random machines with a flexible rod of any size and speed; stability safety of the strip from 1.05 to 40."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.rod.load.gas import ConstantLoad, SchmidtLoad, TableLoad
from solvers.rod.scene import Load
from solvers.rod.strip.buckling import critical_coupling


def request(rng: np.random.Generator) -> dict[str, Any]:
    """A check request; one in four is hard: a strip near buckling, or a cycle with a narrow peak."""
    diameter = 10 ** rng.uniform(-2.3, -0.9)
    length = diameter * rng.uniform(1.2, 6.0)
    free = length * (1.0 if rng.random() < 0.05 else rng.uniform(0.1, 1.0))
    radius = min(free * 10 ** rng.uniform(-3.5, -0.8), 0.5 * length)
    modulus = 10 ** rng.uniform(10.8, 11.4)
    hard = rng.random() < 0.25
    load, body = _load(rng, hard)
    angle = np.linspace(0.0, 2.0 * math.pi, 361)
    gas = (load.pressure(angle) - load.reference_pressure()) * math.pi * diameter**2 / 4
    compression = max(float(gas.max()), 0.05 * float(np.abs(gas).max()))
    safety = rng.uniform(1.05, 2.0) if hard else 10 ** rng.uniform(0.3, 1.6)
    inertia = compression * safety / (modulus * -critical_coupling(free, length))
    b = diameter * rng.uniform(0.1, 0.8)
    return {
        "mechanism": {
            "crank_radius_mm": radius * 1e3,
            "rod_length_mm": length * 1e3,
            "speed_hz": 10 ** rng.uniform(-0.5, 2.3),
        },
        "piston": {
            "diameter_mm": diameter * 1e3,
            "skirt_length_mm": diameter * 1e3 * rng.uniform(0.5, 2.5),
            "reciprocating_mass_kg": 10 ** rng.uniform(-5.0, 0.0) if rng.random() < 0.5 else 0.0,
            "clamp_offset_mm": diameter * 1e3 * rng.uniform(-1.0, 1.0) if rng.random() < 0.5 else 0.0,
            "friction_coefficient": rng.uniform(0.0, 0.3) if rng.random() < 0.7 else 0.0,
        },
        "load": body,
        "material": {
            "elastic_modulus_gpa": modulus * 1e-9,
            "fatigue_limit_mpa": 480.0,
            "fatigue_reduction": 1.15,
            "mean_stress_sensitivity": rng.uniform(0.0, 0.4),
            "yield_strength_mpa": 1200.0,
            "density_kg_m3": 10 ** rng.uniform(3.4, 3.95),
        },
        "dimensions": {"b_mm": b * 1e3, "h_mm": (12.0 * inertia / b) ** (1 / 3) * 1e3, "l_mm": free * 1e3},
    }


def _load(rng: np.random.Generator, hard: bool) -> tuple[Load, dict[str, Any]]:
    """A random load in SI and in request form: mostly Schmidt's cycle, some tables and constants."""
    level = 10 ** rng.uniform(4.5, 6.5)
    form = rng.integers(6)
    if form == 0:
        pressure = level * float(rng.choice([-0.3, 0.3]))
        return ConstantLoad(pressure), {"kind": "constant", "constant_pressure_mpa": pressure * 1e-6}
    if form == 1:
        points = int(rng.integers(4, 12))
        degrees, values = np.sort(rng.uniform(0.0, 359.0, points)), level * rng.uniform(0.5, 1.5, points)
        table = TableLoad(tuple(np.radians(degrees)), tuple(values))
        return table, {"kind": "table", "angle_deg": list(degrees), "pressure_mpa": list(values * 1e-6)}
    delta, theta = rng.uniform(0.6, 0.95) if hard else rng.uniform(0.02, 0.6), rng.uniform(0.0, 6.28)
    body = {"kind": "schmidt", "p_min_mpa": level * 1e-6, "delta": delta, "theta_rad": theta}
    return SchmidtLoad(level, delta, theta), body
