"""Pins and bushings over HTTP: the paper's numbers in the contract's units, refusals by field, pictures and pages."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from xml.etree import ElementTree

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.app.web.test_forms import texts_of

PIN = KINDS["pin-profile"]
DESIGNS, CHECKS = "/api/v1/designs/pin-profile", "/api/v1/checks/pin-profile"


PAPERS = {
    "limits": {"min_wall_mm": 0, "max_deflection_um": None, "max_ovalization_um": None, "max_slope": None},
    "form": {"kind": "free"},
}
"""Strength alone, and any bore."""


@pytest.fixture
def design():
    return copy.deepcopy({**PIN.example(Mode.DESIGN), **PAPERS})


@pytest.fixture
def check():
    return {**PIN.example(Mode.CHECK), "limits": copy.deepcopy(PAPERS["limits"]), "bore_mm": 13.99}


@pytest.fixture
def bushing(design):
    request = copy.deepcopy(design)
    del request["geometry"]["outer_diameter_mm"]
    return {**request, "variable": "outer", "bore_mm": 14}


def solved(client, path, request):
    answer = client.post(path, json=request)
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert run["status"] == "succeeded"
    return run


def test_the_free_pin_of_the_paper(client, design):
    run = solved(client, DESIGNS, {**design, "accuracy": 1e-9})
    result = run["result"]
    assert result["mass_g"] == pytest.approx(79.43309106, rel=1e-9)
    assert result["solid_mass_g"] == pytest.approx(238.5063707, rel=1e-9)
    assert result["constant_bore_mass_g"] == pytest.approx(141.9736550, rel=1e-9)
    assert result["free_mass_g"] == result["mass_g"]
    assert result["min_bore_mm"] == pytest.approx(13.98983201, abs=1e-8)
    assert result["bore_mid_mm"] == pytest.approx(14.88119010, abs=1e-8)
    assert result["max_moment_nmm"] == pytest.approx(123750)
    assert result["force_limit_n"] == pytest.approx(18980.73, abs=0.01)
    assert result["certificate"]["gap"] <= 1e-7
    assert result["certificate"]["lower_bound_g"] <= result["mass_g"]
    assert any("the ring's hoop stress exceeds 150 MPa" in warning for warning in result["warnings"])
    section = next(row for row in result["profile"] if row["x_mm"] == pytest.approx(25))
    assert section["bore_mm"] == pytest.approx(13.98983201, abs=1e-8)
    assert section["equivalent_stress_mpa"] == pytest.approx(150, rel=1e-9)
    assert {effect["name"] for effect in run["effects"]} == {"shear_deflection", "ovalization", "contact_pressure"}


@pytest.mark.parametrize(
    ("form", "mass"),
    [
        ({"kind": "constant"}, 141.9736550), ({"kind": "stepped", "steps": 2}, 112.6827397),
        ({"kind": "stepped", "steps": 3}, 110.1931994), ({"kind": "double_cone"}, 128.9334688),
        ({"kind": "cone_cylinder"}, 123.0781785), ({"kind": "free"}, 104.0940262),
    ],
    ids=lambda value: value["kind"] if isinstance(value, dict) else None,
)  # fmt: skip
def test_every_form_with_a_wall_of_two_millimetres(client, design, form, mass):
    design["limits"]["min_wall_mm"] = 2
    result = solved(client, DESIGNS, {**design, "form": form, "accuracy": 1e-7})["result"]
    assert result["mass_g"] == pytest.approx(mass, rel=1e-7)
    if form["kind"] != "free":
        again = {name: value for name, value in design.items() if name != "form"}
        points = [{"x_mm": c["x_mm"], "bore_mm": c["bore_mm"]} for c in result["corners"]]
        judged = solved(client, CHECKS, {**again, "profile": points})["result"]
        assert judged["mass_g"] == pytest.approx(result["mass_g"], rel=1e-9)
        assert judged["strength_utilisation"] <= 1 + 1e-6


@pytest.mark.parametrize(("criterion", "mass"), [("fibre", 70.16738), ("saint_venant", 74.92565)])
def test_criteria(client, design, criterion, mass):
    assert solved(client, DESIGNS, {**design, "criterion": criterion})["result"]["mass_g"] == pytest.approx(
        mass, rel=1e-7
    )


def test_a_deflection_limit(client, design):
    design["limits"]["max_deflection_um"] = 11.22302193
    result = solved(client, DESIGNS, {**design, "accuracy": 1e-9})["result"]
    assert result["mass_g"] == pytest.approx(94.4759138, rel=2e-8)
    assert result["deflection_um"] <= 11.22302193 * (1 + 1e-9)
    assert result["certificate"]["gap"] <= 1e-7


def test_the_bore_of_the_paper_is_checked(client, check):
    result = solved(client, CHECKS, check)["result"]
    assert result["ovalization_um"] == pytest.approx(9.52, abs=5e-3)
    assert result["deflection_um"] == pytest.approx(13.29, abs=5e-3)
    assert result["contact_pressures_mpa"]["boss_peak"] == pytest.approx(28.42, abs=5e-3)
    assert result["ring_stresses_mpa"]["inner_side"] == pytest.approx(-123.7, abs=0.05)


def test_an_infeasible_pin_says_where_and_what_would_do(client, design):
    design["load"]["force_n"] = 20000
    run = client.post(DESIGNS, json=design).json()
    assert run["status"] == "infeasible"
    result = run["result"]
    assert result["infeasible_from_mm"] == pytest.approx(34.27, abs=5e-3)
    assert result["infeasible_to_mm"] == pytest.approx(45.73, abs=5e-3)
    assert result["force_limit_n"] == pytest.approx(18980.73, abs=0.01)
    (short,) = result["diagnosis"]
    assert short["requirement"] == "force_n"
    assert short["required"] == 20000
    design["geometry"]["outer_diameter_mm"] = result["least_outer_diameter_mm"] * (1 + 1e-9)
    assert client.post(DESIGNS, json=design).json()["status"] == "succeeded"
    design["geometry"]["outer_diameter_mm"] = result["least_outer_diameter_mm"] * (1 - 1e-6)
    assert client.post(DESIGNS, json=design).json()["status"] == "infeasible"


@pytest.mark.parametrize(
    "form", [{"kind": "free"}, {"kind": "drillable"}, {"kind": "constant"}, {"kind": "stepped", "steps": 3}]
)
def test_a_bushing(client, bushing, form):
    bushing["limits"]["max_deflection_um"] = 10
    result = solved(client, DESIGNS, {**bushing, "form": form})["result"]
    assert {row["bore_mm"] for row in result["profile"]} == {14}
    assert result["outer_max_mm"] == pytest.approx(max(row["outer_diameter_mm"] for row in result["profile"]), rel=1e-6)
    assert result["deflection_um"] <= 10 * (1 + 1e-6)
    assert result["free_mass_g"] <= result["mass_g"] * (1 + 1e-6) <= result["constant_bore_mass_g"] * (1 + 2e-6)
    if result["corners"]:
        points = [{"x_mm": c["x_mm"], "outer_diameter_mm": c["outer_diameter_mm"]} for c in result["corners"]]
        judged = solved(client, CHECKS, {**bushing, "profile": points})["result"]
        assert judged["mass_g"] == pytest.approx(result["mass_g"], rel=1e-6)


def test_a_bushing_of_one_outside_is_the_pin_of_that_bore(client, check):
    own = solved(client, CHECKS, check)["result"]
    turned = solved(client, CHECKS, {**check, "variable": "outer"})["result"]
    for name in ("mass_g", "deflection_um", "equivalent_stress_max_mpa", "ovalization_um"):
        assert turned[name] == pytest.approx(own[name], rel=1e-9)


def test_a_bushings_unreachable_ovalization_is_diagnosed(client, bushing):
    bushing["limits"]["max_ovalization_um"] = 0.01
    run = client.post(DESIGNS, json=bushing).json()
    assert run["status"] == "infeasible"
    assert run["result"]["diagnosis"][0]["requirement"] == "max_ovalization_um"


@pytest.mark.parametrize(
    ("path", "value", "pointer"),
    [
        ("geometry/outer_diameter_mm", None, "/geometry/outer_diameter_mm"),
        ("geometry/boss_length_mm", 0, "/geometry/boss_length_mm"),
        ("geometry/gap_mm", -1, "/geometry/gap_mm"),
        ("load/force_n", -1, "/load/force_n"),
        ("material/poisson", 0.5, "/material/poisson"),
        ("material/allowable_shear_mpa", 0, "/material/allowable_shear_mpa"),
        ("criterion", "beauty", "/criterion"),
        ("limits/min_wall_mm", 11, "/limits/min_wall_mm"),
        ("limits/max_slope", 0, "/limits/max_slope"),
        ("form", {"kind": "stepped"}, "/form/steps"),
        ("form", {"kind": "stepped", "steps": 2.5}, "/form/steps"),
        ("form", {"kind": "free", "steps": 2}, "/form/steps"),
        ("form", {"kind": "spiral"}, "/form/kind"),
        ("bore_mm", 14, "/bore_mm"),
        ("variable", "outer", "/bore_mm"),
        ("variable", "length", "/variable"),
    ],
)
def test_every_bad_field_of_a_design_is_named(client, design, path, value, pointer):
    here, (*parents, last) = design, path.split("/")
    for name in parents:
        here = here[name]
    here[last] = value
    answer = client.post(DESIGNS, json=design)
    assert answer.status_code == 422
    assert pointer in [entry["pointer"] for entry in answer.json()["errors"]]


@pytest.mark.parametrize("force", [15e3, 20e3])
def test_a_slope_limit_with_steps_is_refused_at_every_load(client, design, force):
    design["load"]["force_n"] = force
    design["form"], design["limits"]["max_slope"] = {"kind": "stepped", "steps": 2}, 0.1
    answer = client.post(DESIGNS, json=design)
    assert answer.status_code == 422
    assert [entry["pointer"] for entry in answer.json()["errors"]] == ["/limits/max_slope"]


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"bore_mm": None}, "/bore_mm"),
        ({"bore_mm": 22}, "/bore_mm"),
        ({"profile": [{"x_mm": 0, "bore_mm": 10}]}, "/bore_mm"),
        ({"bore_mm": None, "profile": []}, "/profile"),
        ({"bore_mm": None, "profile": [{"x_mm": 0, "bore_mm": 25}]}, "/profile/0/bore_mm"),
        ({"bore_mm": None, "profile": [{"x_mm": 5, "bore_mm": 9}, {"x_mm": 4, "bore_mm": 9}]}, "/profile/1/x_mm"),
        ({"bore_mm": None, "profile": [{"x_mm": 90, "bore_mm": 9}]}, "/profile/0/x_mm"),
        ({"bore_mm": None, "profile": [{"x_mm": 5, "outer_diameter_mm": 9}]}, "/profile/0/bore_mm"),
        ({"variable": "outer", "bore_mm": 22}, "/bore_mm"),
        ({"variable": "outer", "profile": [{"x_mm": 5, "outer_diameter_mm": 9}]}, "/profile/0/outer_diameter_mm"),
        ({"variable": "outer", "form": {"kind": "double_cone"}}, "/form/kind"),
    ],
)
def test_every_bad_field_of_a_check_is_named(client, check, changes, pointer):
    answer = client.post(CHECKS, json={**check, **changes})
    assert answer.status_code == 422, answer.text
    assert pointer in [entry["pointer"] for entry in answer.json()["errors"]]


def test_an_excluded_effect_that_a_limit_needs_is_named_at_both_ends(client, design):
    design["limits"]["max_ovalization_um"] = 20
    answer = client.post(DESIGNS, json={**design, "effects": {"exclude": ["ovalization"]}})
    assert answer.status_code == 422
    pointers = [entry["pointer"] for entry in answer.json()["errors"]]
    assert pointers == ["/effects/exclude", "/limits/max_ovalization_um"]
    for error in answer.json()["errors"]:
        assert error["detail"] == "the effect 'ovalization' is excluded but 'limits.max_ovalization_um' needs it"
        assert error["allowed"] == "keep 'ovalization', or drop 'limits.max_ovalization_um'"


def test_an_effect_that_a_limit_needs_names_it_as_it_was_sent(client, check):
    run = solved(client, CHECKS, {**check, "limits": {**check["limits"], "max_ovalization_um": 500.0}})
    why = {effect["name"]: effect["why"] for effect in run["effects"]}
    assert why["ovalization"] == "needed by limits.max_ovalization_um"


def test_an_excluded_effects_results_do_not_exist(client, check):
    excluded = {"exclude": ["shear_deflection", "ovalization", "contact_pressure"]}
    result = solved(client, CHECKS, {**check, "effects": excluded})["result"]
    assert result["deflection_um"] == pytest.approx(7.18, abs=5e-3)
    for name in ("ovalization_um", "ring_stresses_mpa", "ring_model", "contact_pressures_mpa"):
        assert result[name] is None


def test_studies_of_checks_designs_and_bushings(client, check, design, bushing):
    for spec, mode in ((check, "bore_mm"), (design, "form"), (bushing, "variable")):
        answer = client.post(
            "/api/v1/accuracy/pin-profile", json={"spec": {**spec, "accuracy": 1e-6}, "study_budget_s": 3.0}
        )
        assert answer.status_code == 201, answer.text
        run = answer.json()
        assert run["status"] == "succeeded", mode
        for level in run["result"]["levels"]:
            assert level["error"] <= level["accuracy"]
        assert run["result"]["recommended"]["error"] <= 1e-6


@pytest.mark.parametrize("variable", ["bore", "outer"])
@pytest.mark.parametrize("mode", ["design", "check"])
def test_every_picture_is_svg(client, design, check, variable, mode):
    spec = {**(design if mode == "design" else check), "variable": variable}
    if variable == "outer":
        spec["bore_mm"] = 14
    run = solved(client, DESIGNS if mode == "design" else CHECKS, spec)
    page = client.get(f"/runs/{run['id']}").text
    for name in PIN.plots:
        assert f"plots/{name}" in page
        plot = client.get(f"/api/v1/runs/{run['id']}/plots/{name}")
        assert plot.headers["content-type"] == "image/svg+xml"
        ElementTree.fromstring(plot.text)
        assert "nan" not in plot.text.lower().replace("finance", "")


def test_the_form_starts_with_the_example_and_leads_to_a_run(client):
    for mode in ("design", "check"):
        fields = texts_of("pin-profile", mode)
        assert fields["geometry.outer_diameter_mm"] == "21.99"
        answer = client.post(f"/designs/pin-profile?mode={mode}", data=fields, follow_redirects=False)
        assert answer.status_code == 303, answer.text
        assert "greatest force that a solid pin carries" in client.get(answer.headers["location"]).text


def test_the_contracts_own_case_is_answered(client):
    request = {
        "geometry": {"outer_diameter_mm": 21.99, "boss_length_mm": 24, "small_end_length_mm": 30, "gap_mm": 1},
        "load": {"force_n": 15000},
        "material": {"allowable_stress_mpa": 150, "elastic_modulus_gpa": 210, "poisson": 0.3, "density_kg_m3": 7850},
        "criterion": "tresca_paper",
        "form": {"kind": "free"},
    }
    assert solved(client, DESIGNS, request)["result"]["mass_g"] == pytest.approx(79.43309, rel=1e-6)


def test_the_command_line_prints_a_table(tmp_path):
    from typer.testing import CliRunner

    from app.cli import app

    file = Path(tmp_path) / "request.json"
    file.write_text(json.dumps(PIN.example(Mode.DESIGN)))
    answer = CliRunner().invoke(
        app, ["design", "pin-profile", str(file), "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3"]
    )
    assert answer.exit_code == 0, answer.output
    assert "pin-profile · design · succeeded" in answer.output


def test_no_shear_force_is_a_negative_zero(client):
    profile = solved(client, CHECKS, PIN.example(Mode.CHECK))["result"]["profile"]
    assert [math.copysign(1.0, row["shear_n"]) for row in profile if row["shear_n"] == 0.0].count(-1.0) == 0
    assert any(row["shear_n"] == 0.0 for row in profile)
