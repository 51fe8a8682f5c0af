"""The printed hand calculation is reproducible and agrees with the run."""

from __future__ import annotations

import math

import pytest

from app.designs.calculation.chain import Chain
from app.designs.calculation.expression import calculated
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.reports.build import report_of
from app.reports.html import html
from app.reports.typst_source import typst_source
from tests.app.reports.printed import steps_in_html, steps_in_typst
from tests.app.reports.runs import EXAMPLES, OTHERS, example, solved

_SIX_DIGITS = 5.1e-6
_BY_HAND = 1e-4
_SIMPSON = 0.02


def chain_of(run: dict) -> Chain:
    chain = Chain()
    KINDS[run["kind"]].calculation(run, chain)
    return chain


def test_functions_of_angles_are_zero_where_only_rounding_is_left():
    """As a pocket calculator has them."""
    assert calculated("sin(2 * pi)", {}) == calculated("cos(pi / 2)", {}) == 0.0
    assert calculated("sin(x)", {"x": 1e-20}) == 1e-20
    assert calculated("sin(x)", {"x": math.pi * (1.0 + 1e-14)}) != 0.0


@pytest.mark.parametrize(("slug", "mode", "title"), EXAMPLES + OTHERS)
def test_the_printed_numbers_give_the_printed_results(slug, mode, title):
    run = example(slug, mode, title)
    chain, report = chain_of(run), report_of(run)
    page, source = steps_in_html(html(report)), steps_in_typst(typst_source(report))
    tabulated = sum(len(item.fresh) for item in chain.items if hasattr(item, "fresh"))
    assert len(page) == len(source) == len(chain.steps) + tabulated >= 3
    for numbers, result in page + source:
        assert numbers == pytest.approx(result, rel=_SIX_DIGITS, abs=1e-14)


@pytest.mark.parametrize(("slug", "mode", "title"), EXAMPLES + OTHERS)
def test_every_row_of_a_table_follows_from_its_numbers(slug, mode, title):
    for item in chain_of(example(slug, mode, title)).items:
        if not hasattr(item, "fresh"):
            continue
        for row in range(len(item.rows)):
            numbers = item.numbers(row)
            for column in item.columns:
                if column.formula:
                    values = {name: number.value for name, number in numbers.items()}
                    names = {"pi": math.pi, "sqrt": math.sqrt, "max": max, "sin": math.sin, "cos": math.cos}
                    names |= {"tan": math.tan, "asin": math.asin}
                    found = eval(column.formula, {"__builtins__": {}}, {**names, **values})
                    assert found == pytest.approx(numbers[column.symbol].value, rel=_SIX_DIGITS, abs=1e-9)


@pytest.mark.parametrize(("slug", "mode", "title"), EXAMPLES + OTHERS)
def test_the_hand_calculation_agrees_with_the_run(slug, mode, title):
    """Without effects beyond hand calculation all values agree."""
    kind, run = KINDS[slug], example(slug, mode, title)
    left_out = [e.name for e in kind.known_effects if e.name not in kind.followed]
    if any(e["state"] == "active" and e["name"] in left_out for e in run["effects"]):
        spec = {**run["spec"], "effects": {"include": [], "exclude": left_out}}
        run = solved(slug, mode, spec)
    compared = [step for step in chain_of(run).steps if step.reported is not None]
    assert len(compared) >= 2
    for step in compared:
        # A force may be a small difference of numbers that are printed with six digits.
        most = max(abs(other.reported) for other in compared if other.unit == step.unit)
        assert step.reported == pytest.approx(step.result.shown, rel=_BY_HAND, abs=_SIX_DIGITS * most), step.words


def test_the_papers_rod():
    """The reference case of the theory page, with values from an independent model."""
    example_of = KINDS["flexible-rod"].example(Mode.CHECK)
    spec = {**example_of, "effects": {"include": ["beam_column", "friction"], "exclude": [
        "reciprocating_inertia", "shear", "friction_feedback", "large_displacement", "rod_inertia"]}}  # fmt: skip
    found = {step.symbol: step.result.shown for step in chain_of(solved("flexible-rod", Mode.CHECK, spec)).steps}
    wanted = {"P_minus": -165.2293, "P_plus": 127.986, "P_cr": 313.754, "n_st": 1.8989, "sigma_a": 147.008}
    wanted |= {"sigma_m": 74.044, "n_sigma": 2.69747, "T_max": 5.67391, "p_max": 0.044506}
    for symbol, value in wanted.items():
        assert found[symbol] == pytest.approx(value, rel=5e-5), symbol


_ROD = {"name": "", "effects": {"include": ["reciprocating_inertia"], "exclude": [
    "shear", "friction_feedback", "large_displacement", "rod_inertia"]}}  # fmt: skip


@pytest.mark.parametrize(
    ("slug", "changes", "rel"),
    [
        ("flexible-rod", {"piston": {"diameter_mm": 20.0, "skirt_length_mm": 27.0, "reciprocating_mass_kg": 0.05,
                                     "clamp_offset_mm": 3.0, "friction_coefficient": 0.1}, **_ROD}, _BY_HAND),
        ("flexible-rod", {"dimensions": {"b_mm": 9.0, "h_mm": 0.2, "l_mm": 40.0}}, _BY_HAND),
        ("flexible-rod", {"dimensions": {"b_mm": 0.4, "h_mm": 0.9, "l_mm": 30.0}, **_ROD}, _BY_HAND),
        *[("flexible-rod", {"fatigue_criterion": name, "material": {"name": "spring-steel-1.1274"}, **_ROD}, _BY_HAND)
          for name in ("goodman", "gerber", "soderberg", "fkm")],
        *[("pin-profile", {"criterion": name}, _BY_HAND) for name in ("fibre", "saint_venant", "von_mises")],
        ("pin-profile", {"bore_mm": 19.0}, _BY_HAND),
        ("pin-profile", {"geometry": {"outer_diameter_mm": 21.99, "boss_length_mm": 24.0, "small_end_length_mm": 30.0,
                                      "gap_mm": 0.0}}, _BY_HAND),
    ],
)  # fmt: skip
def test_the_hand_calculation_agrees_for_other_scenes(slug, changes, rel):
    spec = {**KINDS[slug].example(Mode.CHECK), **changes}
    run = solved(slug, Mode.CHECK, spec)
    compared = [step for step in chain_of(run).steps if step.reported is not None]
    assert len(compared) >= 3
    for step in compared:
        assert step.reported == pytest.approx(step.result.shown, rel=rel), step.words


@pytest.mark.parametrize("form", ["free", "drillable"])
def test_a_free_bore_is_integrated_by_a_coarser_rule(form):
    spec = {**KINDS["pin-profile"].example(Mode.DESIGN), "form": {"kind": form}}
    steps = {step.words: step for step in chain_of(solved("pin-profile", Mode.DESIGN, spec)).steps if step.reported}
    mass = next(step for words, step in steps.items() if words.startswith("mass, both"))
    assert mass.reported == pytest.approx(mass.result.shown, rel=_SIMPSON)
    bent = next(step for words, step in steps.items() if words.startswith("deflection"))
    assert bent.reported == pytest.approx(bent.result.shown, rel=_SIMPSON)
    assert all(step.words.endswith("; the rule is coarser than the run's") for step in (mass, bent))
    stress = next(step for words, step in steps.items() if words.startswith("equivalent stress"))
    assert stress.reported == pytest.approx(stress.result.shown, rel=_BY_HAND)


@pytest.mark.parametrize("force", [0.0, 1e-9])
def test_a_pin_without_a_wall_gets_a_report(force):
    spec = {**KINDS["pin-profile"].example(Mode.DESIGN), "load": {"force_n": force}, "form": {"kind": "free"}}
    run = solved("pin-profile", Mode.DESIGN, {**spec, "limits": {"max_slope": 0.3}})
    assert "no wall here" in html(report_of(run))
