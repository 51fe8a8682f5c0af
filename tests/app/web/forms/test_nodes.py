"""Form nodes: round trip of requests, parsing of user input, placement of errors."""

from __future__ import annotations

import json
import re

import pytest

from app.api.bodies import parse
from app.designs.kind import Mode
from app.designs.refusals import REQUIRED
from app.designs.registry import KINDS
from app.errors import Problem
from app.web.forms.faults import placed, said
from app.web.forms.nodes import Number, applies
from app.web.forms.numbers import number, shown
from app.web.forms.tables import cells_of
from app.web.forms.tree import form_of
from app.words.languages import speaking
from app.words.units import System, measuring

JOBS = [(kind.slug, mode) for kind in KINDS.values() for mode in kind.jobs]


def texts_of(slug: str, mode: Mode, request: dict | None = None) -> dict[str, str]:
    texts: dict[str, str] = {}
    form_of(KINDS[slug], mode).take(KINDS[slug].example(mode) if request is None else request, texts)
    return texts


def asked(slug: str, mode: Mode, texts: dict[str, str]):
    spec = form_of(KINDS[slug], mode).value(texts)
    return KINDS[slug].jobs[mode].request.model_validate_json(json.dumps(spec))


def without_nothing(value):
    """A request without nulls; a group of nulls only is dropped."""
    if isinstance(value, dict):
        found = {name: without_nothing(inner) for name, inner in value.items()}
        return {name: inner for name, inner in found.items() if inner not in (None, {})}
    return value


@pytest.mark.parametrize("units", System)
@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_the_example_round_trips(slug, mode, units):
    example = KINDS[slug].jobs[mode].request.model_validate_json(json.dumps(KINDS[slug].example(mode)))
    with measuring(units):
        back = asked(slug, mode, texts_of(slug, mode))
    assert without_nothing(back.model_dump()) == without_nothing(example.model_dump())


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_every_field_of_the_contract_has_an_input(slug, mode):
    """Compared by pointer, without fields filled by the service or excluded by a rule."""
    kind = KINDS[slug]
    schema = kind.jobs[mode].request.model_json_schema()
    placed_at = set()

    def walk(part):
        placed_at.add(part.pointer)
        for column in getattr(part, "columns", ()):
            placed_at.add(f"{part.pointer}/{column.key}")
        for child in (*getattr(part, "children", ()), *(m.part for m in getattr(part, "members", ()))):
            walk(child)

    def pointers(model, path=""):
        model = schema["$defs"][model["$ref"].rpartition("/")[2]] if "$ref" in model else model
        for member in (*model.get("oneOf", ()), *model.get("anyOf", ())):
            yield from pointers(member, path)
        for name, inner in model.get("properties", {}).items():
            here = f"{path}/{name}"
            if inner.get("description", "").startswith("filled in") or not kept(here):
                continue
            yield here
            if name != "effects":
                yield from pointers(inner, here)

    def kept(pointer):
        path = pointer[1:].replace("/", ".")
        return path not in kind.form.hidden and kind.form.only.get(path, mode) == mode

    walk(form_of(kind, mode))
    assert not set(pointers(schema)) - placed_at


def test_decimal_comma_and_point_are_accepted():
    assert number("1,5") == number("1.5") == 1.5
    assert number("\u22122,5e-3") == -2.5e-3


@pytest.mark.parametrize(
    ("typed", "unit", "meant"),
    [
        ("1 in", "mm", 25.4),
        ("145,04 psi", "MPa", 1.0000156),
        ("3000 rpm", "Hz", 50.0),
        ("30 mm", "mm", 30.0),
        ("1,5 см", "mm", 15.0),
        ("3000 об/мин", "Hz", 50.0),
        ("3000 хв⁻¹", "Hz", 50.0),
        ("5 \u03bcm", "µm", 5.0),
    ],
)
def test_another_unit_behind_the_number_is_converted(typed, unit, meant):
    assert number(typed, unit) == pytest.approx(meant, rel=1e-6)


@pytest.mark.parametrize("typed", ["fast", "1.2.3", "1 furlong", "nan", "1e999", "1 00", "10 0000", ""])
def test_invalid_numbers_stay_as_typed(typed):
    assert number(typed, "mm") == typed


@pytest.mark.parametrize("typed", ["210 000", "210\u00a0000", "210\u2009000", "210\u202f000 MPa", "210'000"])
def test_thousands_may_be_grouped(typed):
    assert number(typed, "MPa") == 210_000.0


@pytest.mark.parametrize("code", ["en", "ru"])
def test_a_comma_that_may_mean_thousands_is_refused_in_english_only(code):
    density = Number(key="d", name="d", pointer="/d", path="d")
    with speaking(code):
        assert density.value({"d": "7,850"}) == ("7,850" if code == "en" else 7.85)
        assert density.value({"d": "0,850"}) == 0.85
        assert number("\u22121,500 N", "N") == ("\u22121,500 N" if code == "en" else -1.5)
        assert cells_of("1,5") == (["1", "5"] if code == "en" else ["1,5"])


def refused(slug: str, mode: Mode, texts: dict[str, str]) -> dict[str, str]:
    """The messages at the inputs of a form that is not accepted."""
    form = form_of(KINDS[slug], mode)
    with pytest.raises(Problem) as problem:
        parse(KINDS[slug].jobs[mode].request, json.dumps(form.value(texts)).encode())
    return dict(placed(form, texts, problem.value).at)


THOUSANDS = "has a comma that may separate thousands or decimals; 1500 and 1.5 are clear"


def test_thousands_are_refused_in_lists_and_tables_too():
    texts = texts_of("flexible-rod", Mode.CHECK) | {"load": "table"}
    table = {"load.table.points": "0\t1.2\n90\t2,300\n180\t1.1"}
    assert refused("flexible-rod", Mode.CHECK, texts | table) == {"load.table.points": f"row 2, pressure: {THOUSANDS}"}
    engine = texts_of("crank-dynamics", Mode.ANALYSIS) | {"engine.positions_mm": "0; 1,100; 2,200; 3,300"}
    assert refused("crank-dynamics", Mode.ANALYSIS, engine) == {"engine.positions_mm": THOUSANDS}
    with speaking("ru"):
        assert form_of(KINDS["flexible-rod"], Mode.CHECK).value(texts | table)["load"]["pressure_mpa"][1] == 2.3


@pytest.mark.parametrize(("row", "column"), [("\t2", "crank angle"), ("90\t", "pressure"), ("90", "pressure")])
def test_an_empty_cell_is_a_fault_of_its_own_row_and_column(row, column):
    texts = texts_of("flexible-rod", Mode.CHECK) | {"load": "table", "load.table.points": f"0\t1\n{row}\n180;1"}
    (fault,) = refused("flexible-rod", Mode.CHECK, texts).values()
    assert fault.startswith(f"row 2, {column}: is not a number")


@pytest.mark.parametrize("row", ["270 1 200", "270;1;200", "270\t1\t\t200", "270 1 200 MPa"])
def test_more_values_than_columns_are_a_fault_of_their_row(row):
    texts = texts_of("flexible-rod", Mode.CHECK) | {"load": "table", "load.table.points": f"0\t1\t\n{row}\n300;1"}
    found = len(row.replace(" MPa", "").replace(";", " ").replace("\t", " ").split(" "))
    assert refused("flexible-rod", Mode.CHECK, texts) == {
        "load.table.points": f"row 2 has {found} values; 2 are expected"
    }


def test_a_point_with_more_values_than_its_table_is_a_fault():
    texts = texts_of("pin-profile", Mode.CHECK) | {"given": "points", "profile.bore": "0 14\n20 1 200"}
    assert refused("pin-profile", Mode.CHECK, texts) == {"profile.bore": "row 2 has 3 values; 2 are expected"}
    texts = texts_of("crank-dynamics", Mode.ANALYSIS)
    (name,) = [name for name, text in texts.items() if text.startswith("1\t") and name.endswith("strokes")]
    first, *others = texts[name].split("\n")
    wide = first.count("\t") + 1
    texts[name] = "\n".join([f"{first}\t5", *others])
    assert refused("crank-dynamics", Mode.ANALYSIS, texts)[name] == f"row 1 has {wide + 1} values; {wide} are expected"


@pytest.mark.parametrize("units", System)
def test_a_number_of_values_has_no_unit(units):
    with measuring(units):
        found = said({"detail": "has too few items", "allowed": "no fewer than 1"}, {}, "mm")
    assert found == "has too few values (allowed: no fewer than 1)"


def test_units_stay_with_their_numbers():
    texts = texts_of("flexible-rod", Mode.CHECK) | {
        "load": "table",
        "load.table.points": "0 ° 1 MPa\n90 ° 200 kPa\n180 1",
    }
    load = asked("flexible-rod", Mode.CHECK, texts).load
    assert (load.angle_deg, load.pressure_mpa) == ([0, 90, 180], [1, 0.2, 1])
    texts = texts_of("flexible-rod", Mode.DESIGN) | {"stock_h_mm.on": "on", "stock_h_mm": '0.02 " 0.5 mm'}
    assert form_of(KINDS["flexible-rod"], Mode.DESIGN).value(texts)["stock_h_mm"] == pytest.approx([0.508, 0.5])


def test_a_point_without_its_stroke_is_a_fault():
    texts = texts_of("crank-dynamics", Mode.ANALYSIS)
    (name,) = [name for name, text in texts.items() if text.startswith("1\t") and name.endswith("strokes")]
    first, second, *others = texts[name].split("\n")
    texts[name] = "\n".join([first, second[1:], *others])
    assert refused("crank-dynamics", Mode.ANALYSIS, texts)[name] == "row 2, stroke: is missing"


def test_rows_of_any_spreadsheet_locale_are_parsed():
    assert cells_of("\t1,5") == cells_of(";1,5") == ["", "1,5"]
    assert cells_of("0.5 mm") == ["0.5 mm"] and cells_of("0,4 mm, 0.5 mm 0.6") == ["0,4 mm", "0.5 mm", "0.6"]
    assert cells_of("") == cells_of(" ", 2) == []
    assert cells_of("10\t1,5") == cells_of("10;1,5") == cells_of("10 1,5") == ["10", "1,5"]
    assert cells_of("10\t1 500") == cells_of("10;1 500") == ["10", "1 500"]
    assert cells_of("10,1.5", 2) == cells_of("10, 1.5") == ["10", "1.5"]


def test_conditions_support_and_and_or():
    assert applies("a=1,2&b=3|c=4", {"a": "2", "b": "3"})
    assert applies("a=1,2&b=3|c=4", {"c": "4"})
    assert not applies("a=1,2&b=3|c=4", {"a": "2"})


def test_only_the_selected_member_is_submitted():
    texts = texts_of("flexible-rod", Mode.CHECK) | {"load": "table", "load.schmidt.delta": "nonsense"}
    load = asked("flexible-rod", Mode.CHECK, texts).load
    assert (load.kind, len(load.angle_deg)) == ("table", 6)


def test_an_enabled_empty_field_is_an_error():
    texts = texts_of("pin-profile", Mode.DESIGN) | {"limits.max_deflection_um.on": "on"}
    assert form_of(KINDS["pin-profile"], Mode.DESIGN).value(texts)["limits"]["max_deflection_um"] == ""
    assert refused("pin-profile", Mode.DESIGN, texts) == {"limits.max_deflection_um": "is missing"}


def test_a_pin_checked_by_points_and_a_bushing():
    texts = texts_of("pin-profile", Mode.CHECK) | {"given": "points", "profile.bore": "0 14\n20 12,5"}
    request = asked("pin-profile", Mode.CHECK, texts)
    assert [(p.x_mm, p.bore_mm) for p in request.profile] == [(0, 14), (20, 12.5)]
    assert request.bore_mm is None
    assert not request.contradictions()
    texts |= {"variable": "outer", "given": "one", "bore_mm": "10"}
    bushing = asked("pin-profile", Mode.CHECK, texts)
    assert (bushing.variable, bushing.bore_mm, bushing.profile) == ("outer", 10, None)


def test_individual_selection_of_effects():
    texts = texts_of("flexible-rod", Mode.CHECK) | {"effects": "choice", "effects.shear": "include"}
    texts["effects.friction"] = "exclude"
    effects = asked("flexible-rod", Mode.CHECK, texts).effects
    assert (effects.include, effects.exclude) == (["shear"], ["friction"])


def test_an_error_is_placed_at_a_visible_field():
    form = form_of(KINDS["flexible-rod"], Mode.CHECK)
    entry = {"detail": "is missing", "allowed": REQUIRED}
    errors = [
        {"pointer": "/load/angle_deg/3", "detail": "is out of range", "allowed": "at most 360"},
        {"pointer": "/load/back_pressure_mpa", **entry},
        {"pointer": "/nowhere", **entry},
    ]
    texts = texts_of("flexible-rod", Mode.CHECK) | {"load": "table"}
    faults = placed(form, texts, Problem(422, "no", "no", errors))
    assert faults.at["load.table.points"] == "row 4, crank angle: is out of range: at most 360"
    assert faults.at["load.table.back_pressure_mpa"] == "is missing"
    assert faults.elsewhere == ("nowhere is missing",)


def test_an_error_names_other_fields_by_their_labels():
    form, texts = form_of(KINDS["flexible-rod"], Mode.CHECK), texts_of("flexible-rod", Mode.CHECK)
    entry = {"pointer": "/dimensions/l_mm", "detail": "is too long", "allowed": "at most mechanism.rod_length_mm"}
    faults = placed(form, texts, Problem(422, "no", "no", [entry]))
    assert faults.at["dimensions.l_mm"] == "is too long (allowed: at most “Rod length L”)"


def test_inches_and_psi_are_converted_to_metric_units():
    with measuring(System.INCH):
        texts = texts_of("pin-profile", Mode.CHECK)
        assert float(texts["geometry.boss_length_mm"]) == pytest.approx(24.0 / 25.4, rel=1e-11)
        texts["geometry.boss_length_mm"], texts["geometry.gap_mm"] = "1,25", "2 mm"
        texts["material.pinmaterial.allowable_stress_mpa"] = "21.5 ksi"
        texts["material.pinmaterial.elastic_modulus_gpa"] = "30"
        found = asked("pin-profile", Mode.CHECK, texts)
        assert found.geometry.boss_length_mm == 31.75 and found.geometry.gap_mm == 2.0
        assert found.material.allowable_stress_mpa == pytest.approx(21.5 * 6.894757293168361, rel=1e-12)
        assert found.material.elastic_modulus_gpa == pytest.approx(30 * 6.894757293168361, rel=1e-11)
        form = form_of(KINDS["pin-profile"], Mode.CHECK)
        problem = Problem(422, "", "", errors=[{"pointer": "/geometry/boss_length_mm", "detail": "is out of range",
                                                "allowed": "at least 25.4"}])  # fmt: skip
        assert placed(form, texts, problem).at["geometry.boss_length_mm"] == "is out of range: at least 1"
    assert asked("pin-profile", Mode.CHECK, texts_of("pin-profile", Mode.CHECK)).geometry.boss_length_mm == 24.0


def test_a_small_number_is_shown_without_a_padded_exponent():
    assert [shown(value) for value in (1e-6, 2.5e-7, 0.01, 7850.0)] == ["1e-6", "2.5e-7", "0.01", "7850"]


@pytest.mark.parametrize("units", System)
@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_a_refused_value_gets_the_limit_that_the_hint_names(slug, mode, units):
    seen = 0
    with measuring(units):
        form = form_of(KINDS[slug], mode)
        texts = texts_of(slug, mode)
        for node in [part for part in form.parts(texts) if isinstance(part, Number) and part.present(texts)]:
            problem = None
            try:
                parse(KINDS[slug].jobs[mode].request, json.dumps(form.value(texts | {node.name: "-5"})).encode())
            except Problem as refused:
                problem = refused
            fault = placed(form, texts, problem).at.get(node.name, "") if problem else ""
            least = re.search(r"is out of range: (?:at least|more than) (\S+?)(?:[;,]|$)", fault)
            if least:
                words = fault.removeprefix("is out of range: ").partition(";")[0]
                told = node.allowed.startswith(f"{least[1]} … ") or words in node.allowed
                # Numerical safeguards are no hints: 1e-6 of the contract's units, at most 1e-3 of others.
                assert told or 0.0 < float(least[1]) <= 1e-3, (node.name, fault)
                seen += told
    assert seen
