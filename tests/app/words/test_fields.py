"""Field names in the wording of engineers."""

from __future__ import annotations

import re

import pytest

from app.designs.registry import KINDS
from app.designs.units import figures, power, tidy, with_unit
from app.web.rendering import uncertain
from app.words.fields import named
from app.words.languages import speaking
from app.words.solver_texts import spoken


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("axial_force_max_n", "greatest axial force", "N"),
        ("torque_min_nm", "least torque", "N·m"),
        ("max_shear_n", "greatest shear force", "N"),
        ("stability_safety", "safety against buckling", ""),
        ("rod_mass_at_pin_kg_u", "± rod's mass at the wrist pin", "kg"),
        ("mass_g", "mass", "g"),
        ("engine.indicated_power_w", "indicated power of all cylinders", "W"),
    ],
)
def test_names_are_worded(name, words, unit):
    assert named(name) == (words, unit)


def test_no_result_is_named_by_an_abbreviation():
    names = {name for kind in KINDS.values() for job in kind.jobs.values() for name in job.result.model_fields}
    found = {name: named(name)[0] for name in names}
    assert [words for words in found.values() if re.search(r"\b(max|min|mid|cg|brix)\b(?!-cycle)|_|\.\d", words)] == []


def test_other_languages_have_their_own_wording():
    with speaking("ru"):
        assert named("axial_force_max_n")[0] == "наибольшая осевая сила"


def test_field_names_in_a_sentence_become_words():
    said = spoken("the same case at 1e-12; stability_safety, side_force_max_n: needed by limits.min_wall_mm")
    assert said == (
        "the same case at 1e-12; safety against buckling, greatest side force: needed by wall at its thinnest"
    )
    assert spoken("2.5 mm at 0.1 of the length, e.g. there") == "2.5 mm at 0.1 of the length, e.g. there"


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (figures(10.4, 1), "10"),
        (figures(9.7, 1), "10"),
        (figures(9999.7), "10000"),
        (figures(7e-6, 1), "7e-6"),
        (figures(3e8), "3e8"),
        (power(1e-12), "1e-12"),
        (power(2.34e-6, 1), "2.3e-6"),
        (tidy("between 1e-06 and 2e+07"), "between 1e-6 and 2e7"),
        (with_unit("90", "°"), "90°"),
        (with_unit("90", "mm"), "90 mm"),
        (with_unit("90", ""), "90"),
        (uncertain(0.174375, 0.00225), "0.1744 ±\u00a00.0022"),
        (uncertain(11512.3, 34.0), "11512 ±\u00a034"),
    ],
)
def test_figures_are_as_one_writes_them(shown, expected):
    assert shown == expected
