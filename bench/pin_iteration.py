"""Where the paper's own iteration for the bore settles: docs/pin-iteration.svg. ``python -m bench.pin_iteration``"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from app.designs.pictures.chart import BLUE, GREEN, RED, Chart, Linear
from oracles.textbook.pin_bore_iteration import factor
from solvers import pin
from solvers.pin.section.criteria import ShearLaw
from solvers.pin.section.least_wall import least_wall
from solvers.pin.section.strength import StrengthConstraint
from solvers.pin.stations.lobatto_panels import initial_stations

PICTURE = Path(__file__).parents[1] / "docs" / "pin-iteration.svg"
FORCES = (15e3, 17.12e3, 18.98e3)


def ratios(m: np.ndarray, q: np.ndarray) -> np.ndarray:
    """d/D of the section equation."""
    return 1.0 - least_wall([StrengthConstraint(m, q, 0.0, 0.0, ShearLaw(3.0, -3.0, 1.0))], 0.0, m.size)


def boundary(points: int = 181) -> tuple[list[float], list[float]]:
    """(m, q) where the iteration's factor is -1: outward of it no start settles."""
    out = []
    for angle in np.linspace(1e-6, 0.5 * math.pi - 1e-6, points):
        low, high = 0.0, 1.0 - 1e-12
        for _ in range(50):
            middle = 0.5 * (low + high)
            m, q = middle * math.cos(angle), middle * math.sin(angle)
            ratio = float(ratios(np.array([m]), np.array([q]))[0])
            low, high = (middle, high) if abs(factor(m, q, ratio)) < 1.0 else (low, middle)
        out.append((low * math.cos(angle), low * math.sin(angle)))
    return [m for m, _ in out], [q for _, q in out]


def share(samples: int = 200_000) -> float:
    """Of all loads that a section carries, the share on which the iteration does not settle."""
    rng = np.random.default_rng(0)
    m, q = rng.random((2, samples))
    inside = m * m + q * q <= 1.0
    m, q = m[inside], q[inside]
    found = ratios(m, q)
    return float(np.mean([abs(factor(*triple)) >= 1.0 for triple in zip(m, q, found, strict=True)]))


def paths(force: float) -> tuple[list[float], list[float]]:
    """m and q along the paper's pin under a force."""
    material = pin.PinMaterial(150e6, 210e9, 0.3, 7850.0)
    scene = pin.Scene(pin.Geometry(21.99e-3, 24e-3, 30e-3, 1e-3), force, material)
    stations = initial_stations(scene)
    moment, shear = scene.own_forces(stations.x, stations.side)[:2]
    m = 32.0 * moment / (math.pi * 150e6 * 21.99e-3**3)
    return list(m), list(32.0 * shear / (3.0 * math.pi * 150e6 * 21.99e-3**2))


def main() -> None:
    """Write the picture and print the share."""
    chart = Chart(
        "Where the paper's iteration settles: on the lower left only",
        Linear(0.0, 1.05),
        Linear(0.0, 1.05),
        "m = 32 M/(π σ D³)",
        "q = 32 Q/(3 π σ D²)",
    )
    angle = np.linspace(0.0, 0.5 * math.pi, 181)
    m, q = boundary()
    chart.area([*np.cos(angle), *reversed(m)], [*np.sin(angle), *reversed(q)])
    chart.line(list(np.cos(angle)), list(np.sin(angle)), BLUE)
    chart.line(m, q, RED)
    chart.words(0.62, 0.82, "no pin beyond", BLUE)
    chart.words(0.05, 0.62, f"diverges: {share():.0%} of the loads a pin can carry", RED)
    for force in FORCES:
        along = paths(force)
        chart.line(*along, GREEN)
        chart.words(along[0][-1] - 0.16, 0.12, f"{force / 1e3:.4g} kN", GREEN)
    PICTURE.write_text(chart.svg(), "utf-8")
    print(f"{PICTURE}: {share():.3f}")


if __name__ == "__main__":
    main()
