"""The strip's constants and fields; the check of a rod under a constant force: safeties, forces, contact pressure."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers.references.rod import critical_coupling
from tests.hard_cases.cases import read
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_rod_references import DIGITS, held_case, kernel_case, merged
from tests.hard_cases.test_rod import answers, kernel_errors, units

BASE = read("rod")["base"]


def strip(point: np.ndarray) -> dict:
    """Family, position within it, length, and excess of the rod's length over the strip's."""
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


def judge_strip(found: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = entries(kernel_case(found))
    yield from kernel_errors(found, reference)


def held(point: np.ndarray) -> dict:
    """Rod length, section, a constant pressure from strong tension up to one float below buckling, and the clamp
    offset."""
    rod_length = power(point[0], -4, 3)
    length = rod_length * pick(point[1], 1.0, power(point[2], -3, 0), between(point[2], 0.1, 1.0))
    h = length * power(point[3], -4, -0.5)
    b = h * power(point[4], -1, 2)
    diameter, modulus = rod_length * power(point[5], -2, 0.5), BASE["material"]["elastic_modulus"]
    with mp.workdps(DIGITS):
        critical = float(-critical_coupling(mp.mpf(length), mp.mpf(rod_length)))
    stiffest = modulus * b * h * min(b, h) ** 2 / 12.0 * critical / (np.pi * diameter**2 / 4.0)
    share = power(point[7], -14, -0.01)
    pressure = stiffest * pick(point[6], 1.0 - share, share, -(1e4 * share))
    offset = point[10] * 3 % 1
    return {
        "changes": {
            "mechanism.crank_radius": rod_length * power(point[8], -9, -0.01),
            "mechanism.rod_length": rod_length,
            "piston.diameter": diameter,
            "piston.skirt_length": diameter * power(point[9], -1, 1),
            "piston.clamp_offset": diameter * pick(point[10], 0.0, power(offset, -6, 3), between(offset, -3, 0)),
            "load": {"kind": "constant", "constant_pressure": float(pressure)},
            "dimensions.b": b,
            "dimensions.h": h,
            "dimensions.l": length,
        }
    }  # fmt: skip


def judge_held(found: dict) -> Iterator[tuple[str, float]]:
    whole = found | {"scene": {**merged(BASE, found["changes"]), "effects": []}}
    _, told = answers(whole, 1e-12)
    with mp.workdps(DIGITS):
        reference = entries(held_case(whole["scene"]))
    for name, entry in reference.items():
        yield name, units(told[name], entry) if name in told else np.inf


QUARRIES = (
    Quarry("rod", "kernels", "strip", 5, strip, judge_strip),
    Quarry("rod", "checks", "held", 11, held, judge_held),
)
