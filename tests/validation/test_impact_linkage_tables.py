"""The paper on crank-rocker impact mechanisms with the largest coupler and the largest base: its Tables 1 and 2.

R_k = 0.3, lengths over the crank, the text's commas as points. Every entry is reproduced to one unit of its last digit
but eleven; six columns are of cranks that cannot turn, which the paper does not say.
"""

from __future__ import annotations

import math

import pytest

from solvers import linkage
from solvers.linkage.mechanism.kinematics import of_family

TABLE_1 = {
    "lambda2": ("0.75", "1.0", "1.25", "1.5", "1.75", "2.0", "2.5", "3.0"),
    "lambda3": ("0.313", "0.450", "0.599", "0.758", "0.926", "1.100", "1.472", "1.846"),
    "lambda0": ("1.437", "1.551", "1.652", "1.742", "1.824", "1.900", "2.028", "2.154"),
    "u31": ("6.532", "5.190", "4.385", "3.850", "3.466", "3.176", "2.778", "2.488"),
}
TABLE_2 = {
    "lambda0": ("1.75", "2.0", "2.25", "2.50", "2.75", "3.0", "3.25", "3.5"),
    "lambda2": ("1.824", "1.899", "1.967", "2.029", "2.086", "2.147", "2.188", "2.234"),
    "lambda3": ("0.925", "1.101", "1.283", "1.471", "1.664", "1.868", "2.062", "2.267"),
    "u31": ("1.039", "0.952", "0.879", "0.816", "0.762", "0.714", "0.672", "0.635"),
}
MISPRINTS = {
    ("largest_coupler", "2.0", "lambda3"): "1.1011",
    ("largest_coupler", "2.0", "lambda0"): "1.8989",
    ("largest_coupler", "2.0", "u31"): "3.1786",
    ("largest_coupler", "2.5", "lambda3"): "1.4708",
    ("largest_coupler", "2.5", "lambda0"): "2.0292",
    ("largest_coupler", "2.5", "u31"): "2.7762",
    ("largest_coupler", "3.0", "lambda3"): "1.8608",
    ("largest_coupler", "3.0", "lambda0"): "2.1392",
    ("largest_coupler", "3.0", "u31"): "2.5079",
    ("largest_base", "3.0", "lambda2"): "2.1392",
    ("largest_base", "3.0", "lambda3"): "1.8608",
}
"""What the paper's own formulas give where it prints something else."""

CONFINED = {
    ("largest_coupler", "0.75"): "47.6",
    ("largest_coupler", "1.0"): "65.2",
    ("largest_coupler", "1.25"): "84.6",
    ("largest_coupler", "1.5"): "107.7",
    ("largest_coupler", "1.75"): "140.9",
    ("largest_base", "1.75"): "158.4",
}
"""Columns of the tables whose crank cannot rotate fully, and the degrees on either side of the blow that it can
reach."""

SCENE = linkage.Scene(linkage.Restitution(0.3, 0.3), blow_frequency=25.0, impact_speed=5.0, impact_energy=2.0)
ENTRIES = [
    (kind, column, name, table[name][i])
    for kind, table in (("largest_coupler", TABLE_1), ("largest_base", TABLE_2))
    for i, column in enumerate(next(iter(table.values())))
    for name in table
]
COLUMNS = [("largest_coupler", c) for c in TABLE_1["lambda2"]] + [("largest_base", c) for c in TABLE_2["lambda0"]]


def by_the_formulas(kind: str, column: str) -> dict[str, float]:
    bar = of_family(linkage.KINDS[kind], 0.3, float(column))
    r = bar.ratios
    return {"lambda0": float(r.base), "lambda2": float(r.coupler), "lambda3": float(r.rocker), "u31": bar.u31_end}


def by_the_paper(kind: str, column: str) -> dict[str, float]:
    """Its formulas (10), (11) and (4), (6) as printed."""
    square, p = (1.3 / 0.7) ** 2, float(column)
    if kind == "largest_coupler":
        base, coupler, rocker = square * (p + 1) / (p + square), p, p * (p + 1) / (p + square)
        end = (1 + math.sqrt(coupler * base / rocker)) / (base - 1)
    else:
        base, coupler, rocker = p, square * (p + 1) / (p + square), p * (p + 1) / (p + square)
        end = (1 + math.sqrt(coupler * base / rocker)) / (base + 1)
    return {"lambda0": base, "lambda2": coupler, "lambda3": rocker, "u31": end}


@pytest.mark.parametrize(("kind", "column"), COLUMNS)
def test_the_families_are_the_papers_formulas(kind, column):
    assert by_the_formulas(kind, column) == pytest.approx(by_the_paper(kind, column), rel=1e-13)


@pytest.mark.parametrize(("kind", "column", "name", "printed"), ENTRIES)
def test_every_entry_is_reproduced_or_a_listed_misprint(kind, column, name, printed):
    exact = by_the_formulas(kind, column)[name]
    right = MISPRINTS.get((kind, column, name))
    if right is None:
        assert exact == pytest.approx(float(printed), abs=1e-3)
    else:
        assert abs(exact - float(printed)) > 1e-3
        assert f"{exact:.4f}" == right


@pytest.mark.parametrize(("kind", "column"), COLUMNS)
def test_six_columns_have_a_crank_that_cannot_turn(kind, column):
    mechanism = linkage.of_ratio(SCENE, linkage.KINDS[kind], float(column))
    found = linkage.check(SCENE, mechanism).value
    assert found.mechanism.rotatable == ((kind, column) not in CONFINED)
    if not found.mechanism.rotatable:
        assert f"{math.degrees(found.mechanism.confined):.1f}" == CONFINED[kind, column]
        # The rocker is shorter than the crank.
        assert mechanism.bar.ratios.rocker < 1


def test_the_largest_base_strikes_more_often_but_not_four_times():
    # The paper claims 4 to 5; at equal links, speed of the rocker and size the formulas give less for all that turn.
    gains = [
        of_family(linkage.LARGEST_COUPLER, 0.3, ratio).u31_end / of_family(linkage.LARGEST_BASE, 0.3, ratio).u31_end
        for ratio in (2.0, 2.5, 3.0)
    ]
    square = (1.3 / 0.7) ** 2
    expected = [(square + x) * (1 + x) / (x * (square - 1)) for x in (2.0, 2.5, 3.0)]
    assert gains == pytest.approx(expected, rel=1e-13)
    assert all(3.3 < gain < 3.6 for gain in gains)


def test_where_the_rocker_is_fastest_in_mid_cycle():
    for column in TABLE_2["lambda0"][1:]:
        found = linkage.check(SCENE, linkage.of_ratio(SCENE, linkage.LARGEST_BASE, float(column))).value
        faster = found.strike.peaks.u31 > found.mechanism.bar.u31_end * (1 + 1e-9)
        assert faster == (float(column) < 2.5786)


@pytest.mark.parametrize(
    ("ratios", "kind"), [((2, 4, 3), "largest_coupler"), ((2, 3, 4), "largest_rocker"), ((4, 3, 2), "largest_base")]
)
def test_the_mechanisms_of_figure_2_are_of_the_types_it_names(ratios, kind):
    base, coupler, rocker = ratios
    found = linkage.check(SCENE, linkage.of_lengths(linkage.Lengths(base, 1.0, coupler, rocker))).value
    assert found.mechanism.bar.kind.name == kind
    assert found.mechanism.rotatable
    # Formulas (4) and (6).
    g, reach = math.sqrt(coupler * base / rocker), base + (1 if kind == "largest_base" else -1)
    bar = found.mechanism.bar
    assert (bar.u31_start, bar.u31_end) == pytest.approx(((g - 1) / reach, (g + 1) / reach), rel=1e-14)
