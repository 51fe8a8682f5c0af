"""The page shows every case of every wing, with errors within the goal, or within the limit given in the case."""

from __future__ import annotations

import pytest

from tests.hard_cases.cases import WINGS, read
from tests.hard_cases.page import PAGE, SECTIONS
from tests.hard_cases.rows.section import GOAL

TEXT = PAGE.read_text("utf-8")


def shown(title: str) -> list[list[str]]:
    """The rows below a section's title."""
    (part,) = [part for part in TEXT.split("\n## ")[1:] if part.startswith(f"{title} (")]
    lines = [line for line in part.splitlines() if line.startswith("| ") and not line.startswith("| case")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def each(sections):
    return pytest.mark.parametrize("section", sections, ids=lambda section: section.title)


@each(SECTIONS)
def test_the_page_has_the_cases_of_the_list(section):
    assert [row[:2] for row in shown(section.title)] == [[case["name"], case["why"]] for case in section.cases]


def test_every_case_of_the_data_is_on_the_page():
    on_page = [case["name"] for section in SECTIONS for case in section.cases]
    for wing in WINGS:
        data = read(wing)
        names = [case["name"] for group in data.values() if isinstance(group, list) for case in group
                 if isinstance(case, dict)]  # fmt: skip
        assert len(names) >= 40, wing
        assert set(names) <= set(on_page)
    assert TEXT.count("\n## ") == len(SECTIONS) + 2


@each(SECTIONS)
def test_every_error_meets_the_goal(section):
    for row, case in zip(shown(section.title), section.cases, strict=True):
        assert float(row[4]) < case.get("within", GOAL), row[0]
        assert ("within" in case) == ("beyond" in case)


@each(SECTIONS)
def test_rows_match_the_page(section):
    """Case, reason and condition number, which no machine's rounding changes."""
    rows = shown(section.title)
    assert list(section.row(section.cases[0]).cells()[:3]) == rows[0][:3]
