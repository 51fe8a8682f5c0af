"""The pin's rows."""

from __future__ import annotations

import numpy as np

from solvers import pin
from tests.hard_cases.make_pin_references import PLACES
from tests.hard_cases.rows.section import NO_TEXTBOOK, Measured, Row, Section, figure, relative
from tests.hard_cases.test_pin import (
    BUSHINGS,
    CASES,
    REFERENCES,
    TUBES,
    WALLS,
    bushing_errors,
    designed,
    place_errors,
    scene_of,
    solid_deflection,
    tube_errors,
    units,
    walls,
)
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
        yield "constant_mass", value.constant_mass
        for share, wall in zip(PLACES, walls(case), strict=True):
            yield f"wall_{share}", wall


def pin_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = tuple(Measured(units(v, reference[n]), reference[n]["condition"]) for n, v in answers(case))
    if "free_mass" not in reference:
        return Row(case, measured, "answers complex numbers where no bore exists")
    errors = []
    for share in PLACES:
        wall = textbook.wall(case["pin"], float(share))
        if wall is None:
            return Row(case, measured, "its iteration does not settle")
        errors.append(relative(wall, reference[f"wall_{share}"]))
    return Row(case, measured, figure(float(np.max(errors))))


def place_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = tuple(Measured(error, reference[name]["condition"]) for name, error in place_errors(case, reference))
    wall = textbook.wall(case["pin"], float(case["place"]))
    return Row(
        case, measured, "its iteration does not settle" if wall is None else figure(relative(wall, reference["wall"]))
    )


def tube_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = tuple(Measured(error, reference[name]["condition"]) for name, error in tube_errors(case, reference))
    return Row(case, measured, NO_TEXTBOOK)


def bushing_row(case) -> Row:
    reference = REFERENCES[case["name"]]
    measured = tuple(Measured(error, reference[name]["condition"]) for name, error in bushing_errors(case, reference))
    return Row(case, measured, NO_TEXTBOOK)


SECTIONS = (
    Section(
        "The pin",
        "Walls along the pin, least masses, the greatest force and the solid pin's deflection. The textbook iterates "
        f"d = D (1 - F(d))^(1/4) up to {textbook.ROUNDS:,} times at each place; its error is that of"
        " the wall (D - d)/D.",
        CASES,
        pin_row,
    ),
    Section(
        "The pin at one place",
        "The wall at one place, and the solid pin's deflection; the textbook's wall as above.",
        WALLS,
        place_row,
    ),
    Section(
        "The pin of one bore",
        "Mass, deflection with shear, and the greatest equivalent stress of a pin with one bore all along.",
        TUBES,
        tube_row,
    ),
    Section(
        "The bushing at one place",
        "The least D - d around a given bore.",
        BUSHINGS,
        bushing_row,
    ),
)
