"""The pin's wall at one place under every criterion, from a force of next to nothing to what the solid pin carries."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers import pin
from tests.hard_cases.cases import read
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_pin_references import DIGITS, INPUTS, PLACES, STEP, Pin
from tests.hard_cases.test_pin import scene_of, solid_deflection, units, walls

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
    return {"changes": changes, "places": [place]}


def wall(inputs: dict, share: str, change: str | None):
    """The wall at a share of its boss, gap or rod, all of which one input may change."""
    plain, moved = Pin(inputs), Pin(inputs, change)
    x = mp.mpf(share) * plain.L / 2
    if x <= plain.a:
        at = x * moved.a / plain.a
    elif x <= plain.a + plain.gap:
        at = moved.a + (x - plain.a) * (moved.gap / plain.gap if plain.gap else 1)
    else:
        at = moved.a + moved.gap + (x - plain.a - plain.gap) * moved.b / plain.b
    return moved.wall(at), moved.solid_deflection()


def judge(found: dict) -> Iterator[tuple[str, float]]:
    inputs, (share,) = BASE | found["changes"], found["places"]
    with mp.workdps(DIGITS + 10):
        plain = wall(inputs, share, None)
        if plain[0] is None:
            return
        moved = [wall(inputs, share, name) for name in INPUTS]
        kappas = [mp.fsum(abs(m[i] / plain[i] - 1) for m in moved) / STEP for i in (0, 1)]
        reference = entries({"wall": (plain[0], kappas[0]), "solid_deflection": (plain[1], kappas[1])})
    whole = found | {"pin": inputs}
    yield f"the wall at {share}", units(walls(whole)[len(PLACES)], reference["wall"])
    yield "solid_deflection", units(solid_deflection(whole), reference["solid_deflection"])


QUARRIES = (Quarry("pin", "cases", "wall", 10, case, judge),)
