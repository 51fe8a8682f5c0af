"""The pin's wall at one place under every criterion, from a force of next to nothing to what the solid pin carries."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers import pin
from tests.hard_cases.cases import read
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_pin_references import DIGITS, place_values
from tests.hard_cases.test_pin import place_errors, scene_of

BASE = read("pin")["base"]


def case(point: np.ndarray) -> dict:
    """Lengths of diameters, criterion, shear allowable, share of the greatest force, place."""
    diameter = power(point[0], -4, 0)
    changes = {
        "outer_diameter": diameter,
        "boss_length": diameter * power(point[1], -3, 1.5),
        "small_end_length": diameter * power(point[2], -4, 1.5),
        "gap": pick(point[3], 0.0, diameter * power(point[3] * 3 % 1, -9, 1)),
        "criterion": pick(point[4], "tresca_paper", "fibre", "saint_venant", "von_mises"),
        "allowable_shear": pick(point[5], None, 75e6, power(point[5] * 3 % 1, 7, 9)),
        "poisson": between(point[8], 0.0, 0.499),
    }
    changes["force"] = 1.0
    whole = {"pin": BASE | changes}
    limit = pin.force_limit(scene_of(whole), pin.CRITERIA[changes["criterion"]])
    changes["force"] = limit * pick(point[6], power(point[7], -13, -0.3), 1.0 - power(point[7], -13, -0.3))
    place = repr(pick(point[9] * 5 % 1, power(point[9], -6, 0), between(point[9], 0.01, 1.0)))
    return {"changes": changes, "place": place}


def judge(found: dict) -> Iterator[tuple[str, float]]:
    whole = found | {"pin": BASE | found["changes"]}
    with mp.workdps(DIGITS + 10):
        reference = entries(place_values(whole["pin"], whole["place"]))
    if reference:
        yield from place_errors(whole, reference)


QUARRIES = (Quarry("pin", "walls", "wall", 10, case, judge),)
