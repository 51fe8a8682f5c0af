"""The hunt finds what there is to find, and nothing beyond the goal where nothing is known to be."""

from __future__ import annotations

import math

import numpy as np

from tests.hard_cases.hunt import crank, linkage, pin, rod
from tests.hard_cases.hunt.quarry import Quarry
from tests.hard_cases.hunt.search import search
from tests.hard_cases.rows.section import GOAL


def test_a_short_search_on_the_strip_finds_no_error_above_the_goal():
    strip = rod.QUARRIES[0]
    bag = search(strip, 7, math.inf, beginnings=1, generations=3)
    assert bag.scenes >= 60
    assert 0.0 < bag.finds[0].units < GOAL


def test_an_error_is_found_and_its_scene_reported():
    """With errors that grow toward one corner, the worst scene is the closest to it; non-finite errors are the
    worst."""

    def judge(case):
        yield "small", 0.1
        yield "tilted", math.inf if case["x"] > 0.99 else case["x"]

    tilted = Quarry("rod", "kernels", "tilted", 1, lambda point: {"x": float(point[0])}, judge)
    bag = search(tilted, 1, math.inf, beginnings=2)
    assert bag.finds[0].value == "tilted"
    assert bag.finds[0].case["x"] == max(find.case["x"] for find in bag.finds) or bag.finds[0].units > 1.0
    assert list(bag.finds) == sorted(bag.finds, key=lambda find: -find.units)
    assert bag.finds[0].case["x"] > 0.9


def test_every_space_of_scenes_is_valid_to_its_corners():
    for quarry in (*rod.QUARRIES, *crank.QUARRIES, *pin.QUARRIES, *linkage.QUARRIES):
        for corner in (np.zeros(quarry.dimensions), np.ones(quarry.dimensions)):
            assert quarry.case(corner)
