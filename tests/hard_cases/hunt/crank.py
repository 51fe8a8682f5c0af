"""The crank's motion and its inverse, to the edges of what turns, and masses from a pendulum's periods."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers import crank
from solvers.references.crank import Motion
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_crank_references import motion_values, pendulum_values
from tests.hard_cases.test_crank import motions, units

DIGITS = 130
"""A position of 1e-30 is a difference of lengths, and is changed at the twentieth digit."""


def motion(point: np.ndarray) -> dict:
    """Rod, offset, an angle about a dead centre, across or anywhere, and a position near either end."""
    radius = between(point[0], 0.02, 0.09)
    length = radius * (1.0 + power(point[1], -9, 6))
    edge = pick(point[2], 0.0, power(point[3], -12, -0.3), 1.0 - power(point[3], -8, -0.3))
    offset = pick(point[4], 1.0, -1.0) * edge * (length - radius)
    off = pick(point[6], 1.0, -1.0) * power(point[6] * 2 % 1, -18, 0)
    angle = pick(point[5], off, math.pi + off, 0.5 * math.pi + off, between(point[6], -50.0, 50.0))
    with mp.workdps(DIGITS):
        turning = Motion(mp.mpf(radius), mp.mpf(length), mp.mpf(offset))
        stroke = turning.high - turning.low
        share = mp.mpf(power(point[8], -30, -0.3))
        position = float(stroke * pick(point[7], share, 1 - share))
        inside = 0 < position < stroke * (1 - mp.mpf(2) ** -52)
    values = {"crank_radius": radius, "rod_length": length, "offset": offset, "angle": angle}
    return {"inputs": values | ({"position": position} if inside else {})}


def judge_motion(case: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = entries(motion_values(case))
    for name, value in motions(case["inputs"]):
        yield name, units(value, reference[name])


def pendulum(point: np.ndarray) -> dict:
    """A rod's share of length, its inertia about that of two masses, amplitude, and bores."""
    pivots = power(point[0], -3, 1)
    arm = between(point[1], 0.51, 0.95) * pivots
    radius_squared = arm * (pivots - arm) * (1.0 - power(point[2], -3.3, -0.2))
    amplitude = pick(point[3], 0.0, power(point[4], -9, -0.5), between(point[4], 0.3, 1.55))
    late = float(2 * mp.ellipk(mp.sin(amplitude / 2) ** 2) / mp.pi)

    def period(distance):
        return 2 * math.pi * math.sqrt((radius_squared + distance**2) / distance / 9.81) * late

    bore = between(point[5], 0.0, 0.2) * (pivots - arm)
    return {
        "inputs": {
            "pivot_distance": pivots,
            "period_small_end": period(arm),
            "period_big_end": period(pivots - arm),
            "rod_mass": power(point[0], -4, 4),
            "amplitude": amplitude,
            "gravity": 9.81,
            "small_end_bore_radius": bore,
            "big_end_bore_radius": pick(point[3] * 7 % 1, 0.0, bore),
        }
    }


def judge_pendulum(case: dict) -> Iterator[tuple[str, float]]:
    found = crank.swing(crank.Pendulum(**case["inputs"])).values
    with mp.workdps(50):
        reference = entries(pendulum_values(case))
    for name, entry in reference.items():
        yield name, units(found[name], entry)


QUARRIES = (
    Quarry("crank", "motions", "motion", 9, motion, judge_motion),
    Quarry("crank", "pendulums", "pendulum", 6, pendulum, judge_pendulum),
)
