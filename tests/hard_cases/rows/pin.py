"""The pin's rows."""

from __future__ import annotations

import numpy as np

from solvers import pin
from tests.hard_cases.rows.section import Measured, Row, Section, figure, relative
from tests.hard_cases.test_pin import CASES, REFERENCES, designed, places, scene_of, solid_deflection, units, walls
from tests.hard_cases.textbook import pin as textbook


def answers(case):
    """What the solvers answer, by the reference's names."""
    reference, scene = REFERENCES[case["name"]], scene_of(case)
    yield "solid_deflection", solid_deflection(case)
    if "force_limit" in reference:
        yield "force_limit", pin.force_limit(scene, pin.CRITERIA[case["pin"]["criterion"]])
    if "free_mass" in reference:
        value = designed(case).value.check
        yield "free_mass", value.mass
        yield "constant_mass", value.constant_bore_mass
        for share, wall in zip(places(case), walls(case), strict=True):
            yield f"wall_{share}", wall


def pin_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = tuple(Measured(units(v, reference[n]), reference[n]["condition"]) for n, v in answers(case))
    if "free_mass" not in reference:
        return Row(case, measured, "answers complex numbers where no bore exists")
    errors = []
    for share in places(case):
        wall = textbook.wall(case["pin"], float(share))
        if wall is None:
            return Row(case, measured, "its iteration does not settle")
        errors.append(relative(wall, reference[f"wall_{share}"]))
    return Row(case, measured, figure(float(np.max(errors))))


SECTIONS = (
    Section(
        "The pin",
        "Walls along the pin, least masses, the greatest force and the solid pin's deflection. The textbook iterates "
        f"d = D (1 - F(d))^(1/4) up to {textbook.ROUNDS:,} times at each place; its error is that of the wall (D - d)/D.",
        CASES,
        pin_row,
    ),
)
