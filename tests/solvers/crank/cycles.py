"""Made-up but plausible cycles: a four-stroke indicator diagram and a Stirling machine's pressures.

Four-stroke: intake at 0.09 MPa, polytropic compression (n = 1.35), a heat input that follows Wiebe's law over 60
degrees from 15 degrees before the top dead centre, one ratio of specific heats, exhaust at 0.11 MPa.
Stirling: Schmidt's isothermal cycle. Nothing here is measured.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.crank.motion.slider_crank import ExactMotion
from solvers.crank.scene import Cylinder, Mechanism

GAMMA, COMPRESSION_EXPONENT = 1.33, 1.35
INTAKE, EXHAUST = 0.09e6, 0.11e6
START, DURATION = math.radians(-15.0), math.radians(60.0)


def wiebe(angle: np.ndarray) -> np.ndarray:
    """Burnt share 1 - exp(-6.908 y^3) at angles from the firing dead centre."""
    share = np.clip((angle - START) / DURATION, 0.0, 1.0)
    return -np.expm1(-6.908 * share**3)


def four_stroke(mechanism: Mechanism, cylinder: Cylinder, heat: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Volumes [m3] and pressures [Pa] of intake, compression, expansion, exhaust; heat per cycle [J]."""
    motion = ExactMotion(mechanism.crank_radius, mechanism.rod_length)

    def volume(angle: np.ndarray) -> np.ndarray:
        return cylinder.clearance_volume + cylinder.area * motion.displacement(angle)

    steps = np.linspace(-math.pi, math.pi, 721)
    v, burnt = volume(steps), wiebe(steps)
    p = np.empty_like(v)
    p[0] = INTAKE
    for i in range(v.size - 1):
        gamma = COMPRESSION_EXPONENT if steps[i + 1] <= START else GAMMA
        expanded = p[i] * (v[i] / v[i + 1]) ** gamma
        p[i + 1] = expanded + (GAMMA - 1.0) * heat * (burnt[i + 1] - burnt[i]) / v[i + 1]
    along = np.linspace(v.min(), v.max(), 9)
    return [
        (along, np.full(9, INTAKE)),
        (v[:361:10], p[:361:10]),
        (v[360::10], p[360::10]),
        (along[::-1], np.full(9, EXHAUST)),
    ]


def stirling(points: int = 72) -> tuple[np.ndarray, np.ndarray]:
    """Angles [deg] and pressures [MPa] of p_min (1 + delta)/(1 - delta cos(phi - theta)): 1.4 MPa, 0.25, 1.16 rad."""
    angle = np.arange(points) * 360.0 / points
    return angle, 1.4 * 1.25 / (1.0 - 0.25 * np.cos(np.radians(angle) - 1.16))
