"""The linkage's closed forms and its transfer function, over all types to the edges of what turns."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from tests.hard_cases.hunt.quarry import Quarry, between, pick, power
from tests.hard_cases.make_linkage_references import DIGITS, closed_case
from tests.hard_cases.test_linkage import bar_of, closed_forms, curve_units, units

KINDS = ("largest_coupler", "largest_base", "largest_rocker")


def case(point: np.ndarray) -> dict:
    """Type, restitution, how far the free ratio is above its least, and an angle of the cycle."""
    kind = pick(point[0], *KINDS)
    restitution = pick(point[1], power(point[2], -9, -0.3), between(point[2], 0.3, 0.99))
    side = pick(point[5], 1.0, -1.0)
    near = power(point[6], -18, 0.49)
    angle = side * pick(point[4], near, between(point[6], 0.01, np.pi), np.pi - power(point[6], -15, 0))
    margin = power(point[3], -3 if kind == "largest_rocker" else -14, 4)
    return {"kind": kind, "restitution": restitution, "margin": margin, "angles": [float(angle)]}


def judge(found: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = closed_case(found, found["angles"])
    bar = bar_of(found, reference)
    for name, value in closed_forms(bar):
        yield name, units(value, reference[name])
    for phi, entry in zip(found["angles"], reference["curve"], strict=True):
        yield f"u31 at {phi!r}", curve_units(bar, phi, entry)


QUARRIES = (Quarry("linkage", "ratios", "ratio", 7, case, judge),)
