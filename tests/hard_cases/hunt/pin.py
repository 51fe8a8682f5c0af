"""The pin's wall at one position under every criterion, from almost no force to the capacity of the solid pin; mass,
deflection and stress of a pin with uniform bore; the bushing's wall at one position."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers import pin
from tests.hard_cases.cases import read
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_pin_references import DIGITS, bushing_values, place_values, tube_values
from tests.hard_cases.test_pin import bushing_errors, place_errors, scene_of, tube_errors

BASE = read("pin")["base"]


def geometry(point: np.ndarray) -> dict:
    """Lengths relative to the diameter, criterion and Poisson's ratio, from the first six coordinates."""
    diameter = power(point[0], -4, 0)
    return {
        "outer_diameter": diameter,
        "boss_length": diameter * power(point[1], -3, 1.5),
        "small_end_length": diameter * power(point[2], -4, 1.5),
        "gap": pick(point[3], 0.0, diameter * power(point[3] * 3 % 1, -9, 1)),
        "criterion": pick(point[4], "tresca_paper", "fibre", "saint_venant", "von_mises"),
        "poisson": between(point[5], 0.0, 0.499),
    }


def place(share: float) -> str:
    return repr(pick(share * 5 % 1, power(share, -6, 0), between(share, 0.01, 1.0)))


def wall(point: np.ndarray) -> dict:
    """Shear allowable, force relative to the capacity, position."""
    changes = geometry(point) | {"force": 1.0}
    changes["allowable_shear"] = pick(point[6], None, 75e6, power(point[6] * 3 % 1, 7, 9))
    whole = {"pin": BASE | changes}
    limit = pin.force_limit(scene_of(whole), pin.CRITERIA[changes["criterion"]])
    changes["force"] = limit * pick(point[7], power(point[8], -13, -0.3), 1.0 - power(point[8], -13, -0.3))
    return {"changes": changes, "place": place(point[9])}


def judge_wall(found: dict) -> Iterator[tuple[str, float]]:
    whole = found | {"pin": BASE | found["changes"]}
    with mp.workdps(DIGITS + 10):
        reference = entries(place_values(whole["pin"], whole["place"]))
    if reference:
        yield from place_errors(whole, reference)


def tube(point: np.ndarray) -> dict:
    """Force, and bore relative to the diameter, from none to almost no wall."""
    changes = geometry(point) | {"force": power(point[7], -6, 6)}
    ratio = pick(point[6], power(point[8], -9, 0), between(point[8], 0.01, 0.99), 1.0 - power(point[8], -9, -1))
    return {"changes": changes, "ratio": min(ratio, 1.0 - 1e-9)}


def judge_tube(found: dict) -> Iterator[tuple[str, float]]:
    whole = found | {"pin": BASE | found["changes"]}
    with mp.workdps(DIGITS):
        reference = entries(tube_values(whole["pin"], whole["ratio"]))
    yield from tube_errors(whole, reference)


def bushing(point: np.ndarray) -> dict:
    """Shear allowable, force from zero to one that requires a wall of a hundred bores, bore, position."""
    changes = geometry(point) | {"force": power(point[7], -12, 12) * power(point[0], -4, 0) ** 2}
    changes["allowable_shear"] = pick(point[6], None, 75e6, power(point[6] * 3 % 1, 7, 9))
    return {"changes": changes, "bore": pick(point[8], 0.0, changes["outer_diameter"]), "place": place(point[9])}


def judge_bushing(found: dict) -> Iterator[tuple[str, float]]:
    whole = found | {"pin": BASE | found["changes"]}
    with mp.workdps(DIGITS):
        reference = entries(bushing_values(whole["pin"], whole["bore"], whole["place"]))
    yield from bushing_errors(whole, reference)


QUARRIES = (
    Quarry("pin", "walls", "wall", 10, wall, judge_wall),
    Quarry("pin", "tubes", "tube", 9, tube, judge_tube),
    Quarry("pin", "bushings", "bushing", 10, bushing, judge_bushing),
)
