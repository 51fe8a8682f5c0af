"""Random pins and bushings of any size and slenderness: uniform bores, cones, steps, thin walls."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers import pin


def request(rng: np.random.Generator) -> dict[str, Any]:
    """A check request; one in four is hard: a wall of 1e-5 of the diameter, no gap, a very short boss."""
    outer = 10 ** rng.uniform(-3.0, -0.7)
    hard = rng.random() < 0.25
    lengths = outer * 10 ** rng.uniform(-0.7, 0.6, 2)
    if hard and rng.random() < 0.3:
        lengths[rng.integers(2)] *= 1e-3
    gap = 0.0 if hard or rng.random() < 0.2 else outer * 10 ** rng.uniform(-2.5, -0.5)
    geometry = pin.Geometry(outer, *lengths, gap)
    material = {
        "allowable_stress_mpa": 10 ** rng.uniform(1.7, 3.0),
        "allowable_shear_mpa": 10 ** rng.uniform(1.5, 2.5) if rng.random() < 0.3 else None,
        "elastic_modulus_gpa": 10 ** rng.uniform(1.5, 2.4),
        "poisson": rng.uniform(0.0, 0.49),
        "density_kg_m3": 10 ** rng.uniform(3.2, 4.0),
    }
    body: dict[str, Any] = {
        "geometry": {
            "outer_diameter_mm": outer * 1e3,
            "boss_length_mm": geometry.boss_length * 1e3,
            "small_end_length_mm": geometry.small_end_length * 1e3,
            "gap_mm": gap * 1e3,
        },
        "load": {"force_n": outer**2 * material["allowable_stress_mpa"] * 1e6 * 10 ** rng.uniform(-3.0, 0.3)},
        "material": material,
        "criterion": str(rng.choice(list(pin.CRITERIA))),
        "limits": {"min_wall_mm": outer * 1e3 * rng.uniform(0.0, 0.2)},
    }
    widest = 1.0 - 1e-5 if hard else 0.97
    if rng.random() < 0.2:
        bore = outer * 1e3 * rng.uniform(0.1, widest)
        return {**body, "variable": "outer", "bore_mm": bore}
    if rng.random() < 0.3:
        return {**body, "bore_mm": outer * 1e3 * rng.uniform(0.0, widest)}
    return {**body, "profile": _bore(rng, geometry, widest)}


def _bore(rng: np.random.Generator, geometry: pin.Geometry, widest: float) -> list[dict[str, float]]:
    """A piecewise linear profile over the half or the whole pin, sometimes with a step."""
    points = int(rng.integers(2, 7))
    end = geometry.length * (0.5 if rng.random() < 0.7 else 1.0)
    positions = np.sort(rng.uniform(0.0, end, points))
    if rng.random() < 0.4:
        positions[1] = positions[0]
    bores = geometry.outer_diameter * rng.uniform(0.0, widest, points)
    return [{"x_mm": float(x) * 1e3, "bore_mm": float(d) * 1e3} for x, d in zip(positions, bores, strict=True)]
