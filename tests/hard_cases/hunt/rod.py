"""The strip's constants and fields, from no load at all to a float below buckling and to a strip of a thousand k l."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers.references.rod import critical_coupling
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_rod_references import DIGITS, kernel_case
from tests.hard_cases.test_rod import kernel_errors


def case(point: np.ndarray) -> dict:
    """Family, how far along it, length, and how much longer the rod is than its strip."""
    length = between(point[2], 0.01, 1.0)
    rod_length = length * (1.0 + pick(point[3], 0.0, power(point[4], -9, 3), power(point[4], -2, 1)))
    family = pick(point[0], "tension", "compression", "buckling")
    if family == "tension":
        coupling = (power(point[1], -9, 3) / length) ** 2
    else:
        with mp.workdps(DIGITS):
            critical = critical_coupling(mp.mpf(length), mp.mpf(rod_length))
            rest = power(point[1], -14, -0.01)
            coupling = (
                float(critical * (1 - rest)) if family == "buckling" else float(critical) * power(point[1], -18, -0.05)
            )
    return {"coupling": coupling, "length": length, "rod_length": rod_length}


def judge(found: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = entries(kernel_case(found))
    yield from kernel_errors(found, reference)


QUARRIES = (Quarry("rod", "kernels", "strip", 5, case, judge),)
