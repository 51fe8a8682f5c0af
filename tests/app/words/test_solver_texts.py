"""Translation of solver texts with figures."""

from __future__ import annotations

import re
from functools import cache

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.reports.build import report_of
from app.reports.html import html
from app.words.languages import speaking
from app.words.solver_texts import PATTERNS_FILE, is_foreign, spoken
from app.words.units import System, measuring
from scripts.sentences import patterns, sentences
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


@cache
def texts_of_all() -> set[str]:
    return set().union(*(texts_of(*case) for case in CASES))


def texts_of(slug: str, mode: Mode, changes: dict) -> set[str]:
    kind = KINDS[slug]
    found = set()
    for spec in (kind.example(mode), *kind.others(mode).values()):
        answer = kind.jobs[mode].run(kind.jobs[mode].request.model_validate({**spec, **changes}))
        result = answer.result or {}
        found |= {*(answer.verdict or {}).get("cautions", ()), *(result.get("warnings") or ())}
        found |= {item["advice"] for item in result.get("diagnosis") or ()} | {e["why"] for e in answer.effects}
    return found


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("an outer diameter of at least 25.4 mm would do", "an outer diameter of at least 1 in would do"),
        (
            "the strength is exceeded for 24.13 < x < 30.9 mm, by 5 %",
            "the strength is exceeded for 0.95 < x < 1.217 in, by 5 %",
        ),
        (
            "the wall is 1.995 mm at its thinnest, not the 3 mm asked",
            "the wall is 0.078543 in at its thinnest, not the 0.1181 in asked",
        ),
        ("between 0.254 and 2.54 mm", "between 0.01 and 0.1 in"),
        ("the deflection of 25.4 µm exceeds its limit", "the deflection of 1 mil exceeds its limit"),
        (
            "the ring's hoop stress exceeds 150 MPa where it is thin",
            "the ring's hoop stress exceeds 21756 psi where it is thin",
        ),
        ("order 2 at 3 N, 5 mm² and 12 N/mm²", "order 2 at 3 N, 0.00775 in² and 12 N/mm²"),
    ],
)
def test_figures_in_sentences_are_in_the_units_chosen(text, said):
    assert spoken(text) == text
    with measuring(System.INCH):
        assert spoken(text) == said


def test_a_sentence_in_inches_is_no_less_translated():
    text = "the wall is 2.54 mm at its thinnest, not the 5.08 mm asked"
    with measuring(System.INCH), speaking("ru"):
        assert spoken(text) == "стенка в тончайшем месте 0.1 in, а не 0.2 in, как требовалось"
        assert not is_foreign(text)
        assert is_foreign("a sentence of 3 mm that no one knows")
        assert not is_foreign("не более geometry.outer_diameter_mm"), "a screen reader would read it as English"


@pytest.mark.parametrize("code", ["ru", "uk"])
def test_cautions_warnings_and_advice_are_translated_with_their_figures(code):
    said = texts_of_all()
    assert len(said) > 12
    assert sum(any(character.isdigit() for character in text) for text in said) > 6
    with speaking(code):
        for text in said:
            told = spoken(text)
            assert told != text, text
            assert re.findall(r"\d+(?:\.\d+)?", told.replace(",", ".")) == re.findall(r"\d+(?:\.\d+)?", text), text


def test_the_patterns_are_up_to_date():
    assert PATTERNS_FILE.read_text("utf-8").splitlines() == patterns(sentences()), "run `make messages`"


def test_specific_patterns_precede_generic_ones():
    ordered = patterns(sentences())
    for k, pattern in enumerate(ordered):
        sample = pattern.replace("{}", "7")
        first = next(p for p in ordered if re.fullmatch("(.*?)".join(map(re.escape, p.split("{}"))), sample))
        assert ordered.index(first) == k, f"{first!r} hides {pattern!r}"


def test_sentences_are_extracted_from_the_sources():
    gathered = sentences()
    # A refusal, a warning with figures, an effect's reason, a claim, a description of a formula; but no formulas and no
    # names.
    assert {
        "the crank is not shorter than the rod, so the mechanism cannot turn",
        "the wall is {} mm at its thinnest, not the {} mm asked",
        "the influences of all effects left out add up to at most {}",
        "no {} of this form that keeps strength and limits is lighter than the bound",
        "pressure behind the piston{}",
    } <= gathered
    assert not any("**" in text or re.fullmatch(r"[\w.]+_\w+", text) for text in gathered)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "the tool strikes at 3.2 m/s, not at the 4 m/s asked for",
            "инструмент ударяет со скоростью 3.2 m/s, а не 4 m/s, как задано",
        ),
        ("needed by limits.max_pin_force_n", "нужен для: сила в шарнире, не более"),
        ("large_displacement, shear", "большие перемещения, сдвиг"),
        (
            "the check's own: strength of the beam's sections by the chosen criterion; hoop stress of the ring where "
            "the wall is thinnest",
            "как у проверки: прочность сечений балки по выбранному критерию; окружное напряжение кольца там, где "
            "стенка тоньше всего",
        ),
        ("0.8276", "0.8276"),
    ],
)
def test_parts_of_a_sentence_are_translated(text, said):
    with speaking("ru"):
        assert spoken(text) == said
    assert spoken(text) == text.replace("limits.max_pin_force_n", "greatest pin force").replace(
        "large_displacement", "large displacement"
    )


@pytest.mark.parametrize("code", ["ru", "uk"])
@pytest.mark.parametrize("slug", ["pin-profile", "impact-linkage", "flexible-rod"])
def test_a_report_is_in_the_requested_language(slug, code):
    run = example(slug, Mode.CHECK)
    with speaking(code):
        page = html(report_of(run))
    assert f'<html lang="{code}">' in page
    body = re.sub(r"<(style|pre|math|title|h1)\b.*?</\1>|<footer.*?</footer>", " ", page, flags=re.S)
    words = re.findall(r"\b[A-Za-z]{4,}\b", re.sub(r"<[^>]+>", " ", body))
    cyrillic = re.findall(r"\b[а-яіїєґё]{4,}\b", body.lower())
    assert not {"first", "root", "tension", "least", "greatest", "inner", "outer", "points"} & set(words)
    # Untranslated: sources, names, statements on proofs.
    assert len(words) < 0.25 * len(cyrillic), sorted(set(words))


@pytest.mark.parametrize("code", ["ru", "uk"])
@pytest.mark.parametrize(
    "text",
    [
        "The time budget ran out",
        "the solve was stopped after 10 s without an answer",
        "The ring is thin (d/D is 0.677, more than 0.65)",
        "greatest load of the main bearings",
        "gas force: 0, rod's compression: 1, load of the wrist pin: 2",
        "transmission_angle_greatest",
        "the strength is exceeded between 18.55 and 61.45 mm (and mirrored), by 77 %",
        "the strength is exceeded at 3.2 mm, by 7e-5 %",
        "determinant of the boundary conditions, compression",
        "least stress",
        "the stress of this fibre is least",
        "The greatest stress of all (inner fibre)",
        "transfer points",
        "closed",
        "out of reach even alone, closest with the largest base; a lower impact energy would lower it; with looser "
        "limits on the size, a lower blow frequency or a higher impact speed would, too; other transmission angles may "
        "help, too",
    ],
)
def test_no_english_word_is_left(text, code):
    with speaking(code):
        assert not re.search("[a-z]{3}", spoken(text))
