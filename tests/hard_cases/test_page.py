"""The page shows every case there is, and figures that keep the goal."""

from __future__ import annotations

from tests.hard_cases.page import GOAL, PAGE, check_row, kernel_row
from tests.hard_cases.test_rod import CASES

ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.read_text("utf-8").splitlines()
    if line.startswith("| ") and not line.startswith("| case")
]


def test_the_page_has_the_cases_of_the_list():
    assert [row[:2] for row in ROWS] == [[case["name"], case["why"]] for case in CASES["checks"] + CASES["kernels"]]


def test_every_figure_keeps_the_goal():
    assert all(float(row[4]) < GOAL for row in ROWS)


def test_rows_are_made_as_the_page_has_them():
    """Case, reason and condition number, which no machine's rounding changes."""
    for case, make in ((CASES["checks"][0], check_row), (CASES["kernels"][3], kernel_row)):
        cells = [cell.strip() for cell in make(case).strip("|").split("|")]
        (shown,) = [row for row in ROWS if row[0] == case["name"]]
        assert cells[:2] == shown[:2]
