"""The linkage's closed forms, its transfer function and slope, its peak loads and its minimum box, for all types up to
the limits of rotatability."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers.linkage.loads.torque_and_pin_force import peaks
from solvers.linkage.swept_area.bounding_box import minimum_box
from solvers.linkage.swept_area.outline import sweep
from tests.hard_cases.hunt.quarry import Quarry, between, pick, power
from tests.hard_cases.make_linkage_references import DIGITS, closed_case, near_case
from tests.hard_cases.test_linkage import bar_of, closed_forms, curve_units, slope_units, units

KINDS = ("largest_coupler", "largest_base", "largest_rocker")
"""Tolerance of the minimum box, the tightest that a check requests."""


def family(point: np.ndarray) -> dict:
    """Type, restitution, and distance of the free ratio from its minimum."""
    kind = pick(point[0], *KINDS)
    restitution = pick(point[1], power(point[2], -9, -0.3), between(point[2], 0.3, 0.99))
    margin = power(point[3], -3 if kind == "largest_rocker" else -14, 4)
    return {"kind": kind, "restitution": restitution, "margin": margin}


def ratio(point: np.ndarray) -> dict:
    """The same at an angle of the cycle."""
    side = pick(point[5], 1.0, -1.0)
    near = power(point[6], -18, 0.49)
    angle = side * pick(point[4], near, between(point[6], 0.01, np.pi), np.pi - power(point[6], -15, 0))
    return {**family(point), "angles": [float(angle)]}


def judge_ratio(found: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = closed_case(found, found["angles"])
    bar = bar_of(found, reference)
    for name, value in closed_forms(bar):
        yield name, units(value, reference[name])
    for phi, entry in zip(found["angles"], reference["curve"], strict=True):
        yield f"u31 at {phi!r}", curve_units(bar, phi, entry)
        yield f"u31' at {phi!r}", slope_units(bar, phi, entry)


def judge_searched(found: dict) -> Iterator[tuple[str, float]]:
    """Errors of extreme values, compared with the exact extremes near the reported positions."""
    with mp.workdps(DIGITS):
        bar = bar_of(found, closed_case(found, ()))
    told, box = peaks(bar, 1.0, 1.0), minimum_box(sweep(bar, 1.0), 0.0)
    with mp.workdps(DIGITS):
        reference = near_case(found, told.torque_angle, told.force_angle, box.angle)
    for name, value in (("torque", told.torque), ("force", told.force), ("area", box.area)):
        yield name, units(value, reference[name])


QUARRIES = (
    Quarry("linkage", "ratios", "ratio", 7, ratio, judge_ratio),
    Quarry("linkage", "ratios", "searched", 4, family, judge_searched),
)
