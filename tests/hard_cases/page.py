"""Writes docs/hard-cases.md: ``python -m tests.hard_cases.page``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tests.hard_cases.hunt.log import told
from tests.hard_cases.rows import crank, linkage, pin, rod
from tests.hard_cases.rows.section import EPS, GOAL, Section

PAGE = Path(__file__).parents[2] / "docs" / "hard-cases.md"
SECTIONS = (*rod.SECTIONS, *crank.SECTIONS, *pin.SECTIONS, *linkage.SECTIONS)
COLUMNS = ("case", "why it is hard", "condition number", "error, ε", "error, ε max(1, κ)", "the textbook's error")


def line(cells) -> str:
    return "| " + " | ".join(cells) + " |"


def part(section: Section) -> Iterator[str]:
    yield f"## {section.title} ({len(section.cases)} cases)"
    yield ""
    yield section.introduction
    yield ""
    yield line(COLUMNS)
    yield "|---" * len(COLUMNS) + "|"
    for case in section.cases:
        yield line(section.row(case).cells())
    yield ""


def beyond() -> Iterator[str]:
    """Known exceptions to the goal, each with the reason given in its case and a limit that the tests enforce."""
    yield "## Beyond the goal"
    yield ""
    found = [
        f"- {case['name']}, below {case['within']:g} ε max(1, κ): {case['beyond']}."
        for section in SECTIONS
        for case in section.cases
        if "within" in case
    ]
    yield from found or ["No case misses it."]
    yield ""


def page() -> str:
    lines = [
        "# Hard cases",
        "",
        "Written by `python -m tests.hard_cases.page` from the cases in `tests/hard_cases/*_cases.json` and the "
        "references at 50 digits and more that the scripts `make_*_references.py` make beside them, without a formula "
        f"of the solvers. ε is {EPS:.3g}; κ is the relative condition number: what a change of the inputs' last digits "
        "does to the result anyway. Each column shows the greatest of all results of a case; the goal is an error "
        f"below {GOAL:g} ε max(1, κ); what misses it is listed first, with the reason. "
        "The last column is the relative error of the formulas as textbooks have them, in "
        "the same floats.",
        "",
        *told(),
        *beyond(),
    ]
    for section in SECTIONS:
        lines += part(section)
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
