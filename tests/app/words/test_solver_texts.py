"""What solvers say with figures is told in the language of who reads it, figures and all."""

from __future__ import annotations

import re

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.reports.build import report_of
from app.reports.html import html
from app.words.languages import speaking
from app.words.solver_texts import PATTERNS, spoken
from tests.app.reports.runs import example

CASES = [
    ("flexible-rod", Mode.CHECK, {"dimensions": {"b_mm": 9.0, "h_mm": 0.1, "l_mm": 40.0}}),
    ("flexible-rod", Mode.CHECK, {"effects": {"include": [], "exclude": ["friction", "shear"]}}),
    ("pin-profile", Mode.CHECK, {"bore_mm": 21.9}),
    ("pin-profile", Mode.DESIGN, {"load": {"force_n": 1e6}}),
    ("pin-profile", Mode.DESIGN, {"limits": {"max_deflection_um": 1.0}}),
    ("impact-linkage", Mode.CHECK, {}),
    ("crank-masses", Mode.ANALYSIS, {}),
]


def texts_of(slug: str, mode: Mode, changes: dict) -> set[str]:
    kind = KINDS[slug]
    found = set()
    for spec in (kind.example(mode), *kind.others(mode).values()):
        answer = kind.jobs[mode].run(kind.jobs[mode].request.model_validate({**spec, **changes}))
        result = answer.result or {}
        found |= {*(answer.verdict or {}).get("cautions", ()), *(result.get("warnings") or ())}
        found |= {item["advice"] for item in result.get("diagnosis") or ()} | {e["why"] for e in answer.effects}
    return found


@pytest.mark.parametrize("code", ["ru", "uk"])
def test_cautions_warnings_and_advice_are_translated_with_their_figures(code):
    said = set().union(*(texts_of(*case) for case in CASES))
    assert len(said) > 12
    assert sum(any(character.isdigit() for character in text) for text in said) > 6
    with speaking(code):
        for text in said:
            told = spoken(text)
            assert told != text, text
            assert re.findall(r"\d+(?:\.\d+)?", told.replace(",", ".")) == re.findall(r"\d+(?:\.\d+)?", text), text


def test_a_pattern_is_found_before_what_it_begins_with():
    for k, pattern in enumerate(PATTERNS):
        sample = pattern.replace("{}", "7")
        first = next(p for p in PATTERNS if re.fullmatch("(.+?)".join(map(re.escape, p.split("{}"))), sample))
        assert PATTERNS.index(first) == k


@pytest.mark.parametrize("code", ["ru", "uk"])
@pytest.mark.parametrize("slug", ["pin-profile", "impact-linkage"])
def test_a_report_speaks_the_language_asked_for(slug, code):
    run = example(slug, Mode.CHECK)
    with speaking(code):
        page = html(report_of(run))
    assert f'<html lang="{code}">' in page
    body = re.sub(r"<(style|pre|math|title|h1)\b.*?</\1>|<footer.*?</footer>", " ", page, flags=re.S)
    words = re.findall(r"\b[A-Za-z]{4,}\b", re.sub(r"<[^>]+>", " ", body))
    cyrillic = re.findall(r"\b[а-яіїєґё]{4,}\b", body.lower())
    # What stays English: sources, names, what a solver says of its proofs.
    assert len(words) < 0.25 * len(cyrillic), sorted(set(words))
