"""Crank dynamics and masses over HTTP, and a rod whose load is a stored run."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from app.designs.crank_dynamics.kind import case_of
from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.solvers.crank.cycles import four_stroke, stirling
from tests.solvers.crank.machines import CAR, CYLINDER

DYNAMICS, MASSES = "/api/v1/analyses/crank-dynamics", "/api/v1/analyses/crank-masses"
RODS = "/api/v1/checks/flexible-rod"


@pytest.fixture
def dynamics_request() -> dict:
    return KINDS["crank-dynamics"].example(Mode.ANALYSIS)


def cooler_request() -> dict:
    angle, pressure = stirling()
    return {
        "mechanism": {"crank_radius_mm": 1.5, "rod_length_mm": 45.5, "speed_hz": 50.0},
        "cylinder": {"bore_mm": 20.0, "crankcase_pressure_mpa": 1.8, "strokes": 2},
        "pressure": {"kind": "table", "angle_deg": angle.tolist(), "pressure_mpa": pressure.tolist()},
        "masses": {"piston_kg": 0.02, "rod_kg": 0.01, "rod_cg_from_pin_mm": 30.0},
    }


def test_the_example_is_the_generated_cycle(dynamics_request):
    strokes = dynamics_request["pressure"]["strokes"]
    for told, (volume, pressure) in zip(strokes, four_stroke(CAR, CYLINDER, 900.0), strict=True):
        assert told["volume_cm3"] == pytest.approx(volume * 1e6, abs=1e-4)
        assert told["pressure_mpa"] == pytest.approx(pressure / 1e6, abs=1e-5)


def test_crank_dynamics_in_the_contracts_names(client, dynamics_request):
    answer = client.post(DYNAMICS, json=dynamics_request)
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert (run["kind"], run["mode"], run["status"]) == ("crank-dynamics", "analysis", "succeeded")
    result = run["result"]
    columns = {name: len(column) for name, column in result["series"].items()}
    for name in (
        "angle_deg", "pressure_mpa", "gas_force_n", "inertia_force_n", "side_force_n", "rod_force_n",
        "tangential_force_n", "radial_force_n", "torque_nm", "crank_pin_load_n",
    ):  # fmt: skip
        assert columns[name] == 360, name
    power = result["mean_torque_nm"] * 2 * 3.141592653589793 * 50.0
    assert power == pytest.approx(result["indicated_power_w"], rel=1e-12)
    assert result["reciprocating_mass_kg"] == pytest.approx(0.45 + 0.6 * 40 / 140)
    assert result["engine"]["indicated_power_w"] == pytest.approx(4 * result["indicated_power_w"])
    assert run["figure"] == {"name": "engine.indicated_power_w", "value": result["engine"]["indicated_power_w"]}
    assert result["irregularity"] > 0
    assert {w["feeds"] for w in result["worst"]} == {"pin-profile", "flexible-rod", None}
    assert {e["name"] for e in run["effects"]} == {
        "reciprocating_inertia", "rod_inertia_couple", "pin_offset", "engine",
    }  # fmt: skip
    assert result["cycle"] is None  # four strokes are the load of no rod
    assert client.get(answer.headers["location"]).content == answer.content


@pytest.mark.parametrize("accuracy", [1e-1, 1e-6, 1e-12])
def test_a_series_is_rounded_far_below_the_accuracy_asked(dynamics_request, accuracy):
    job = KINDS["crank-dynamics"].jobs[Mode.ANALYSIS]
    request = job.request.model_validate({**dynamics_request, "accuracy": accuracy})
    series, forces = job.run(request).result["series"], case_of(request).evaluate().value.series
    for name, exact in (
        ("torque_nm", forces.torque),
        ("side_force_n", forces.side),
        ("pressure_mpa", forces.pressure / 1e6),
    ):
        told, greatest = np.array(series[name]), np.abs(exact).max()
        assert np.abs(told - exact).max() <= max(0.5e-2 * accuracy, 4e-16) * greatest * (1 + 1e-6), name
        assert np.abs(np.abs(told).max() / greatest - 1.0) <= accuracy
    if accuracy == 1e-6:
        assert max(len(repr(number)) for number in series["torque_nm"]) <= 11


@pytest.mark.parametrize("plot", list(KINDS["crank-dynamics"].plots))
def test_plots(client, dynamics_request, plot):
    run = client.post(DYNAMICS, json=dynamics_request).json()
    drawn = client.get(f"/api/v1/runs/{run['id']}/plots/{plot}")
    assert drawn.headers["content-type"] == "image/svg+xml"
    assert "nan" not in drawn.text
    assert "<path" in drawn.text


def test_a_faulty_point_is_reported_and_repaired_on_request(client, dynamics_request):
    volumes = dynamics_request["pressure"]["strokes"][1]["volume_cm3"]
    volumes[9], volumes[10] = volumes[10], volumes[9]
    refused = client.post(DYNAMICS, json=dynamics_request)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/pressure/strokes/1/volume_cm3/10"
    dynamics_request["pressure"]["repair"] = True
    result = client.post(DYNAMICS, json=dynamics_request).json()["result"]
    assert result["repairs"] == [{"pointer": "/pressure/strokes/1/volume_cm3/10", "what": "points sorted by volume"}]


def test_a_marine_cylinder_exceeds_a_cubic_metre(client, dynamics_request):
    """960 mm bore and 2.5 m stroke, volumes of the example scaled up."""
    request = copy.deepcopy(dynamics_request)
    request["mechanism"] |= {"crank_radius_mm": 1250.0, "rod_length_mm": 3000.0, "speed_hz": 1.7}
    request["cylinder"] |= {"bore_mm": 960.0}
    grown = (960.0 / 80.0) ** 2 * 2500.0 / 80.0
    request["cylinder"]["clearance_volume_cm3"] *= grown
    for stroke in request["pressure"]["strokes"]:
        stroke["volume_cm3"] = [v * grown for v in stroke["volume_cm3"]]
    request["masses"]["rod_cg_from_pin_mm"] = 2000.0
    assert client.post(DYNAMICS, json=request).json()["status"] == "succeeded"


@pytest.mark.parametrize(
    ("path", "value", "pointer"),
    [
        (("engine", "phases_deg"), [0.0], "/engine/phases_deg"),
        (("engine", "bank_deg"), [0.0], "/engine/bank_deg"),
        (("engine", "bank_deg"), "wide", "/engine/bank_deg"),
        (("mechanism", "offset_mm"), 100.0, "/mechanism/offset_mm"),
        (("mechanism", "crank_radius_mm"), 140.0, "/mechanism/crank_radius_mm"),
        (("masses", "rod_cg_from_pin_mm"), 141.0, "/masses/rod_cg_from_pin_mm"),
        (("cylinder", "strokes"), 3, "/cylinder/strokes"),
        (("pressure", "kind"), "guess", "/pressure/kind"),
        (("cylinder", "strokes"), 2, "/pressure/strokes"),
    ],
)
def test_refusals_name_the_field(client, dynamics_request, path, value, pointer):
    dynamics_request[path[0]][path[1]] = value
    refused = client.post(DYNAMICS, json=dynamics_request)
    assert refused.status_code == 422, refused.text
    assert [e["pointer"] for e in refused.json()["errors"]] == [pointer]


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("offset_mm", 100.0, "less than the rod length less the crank radius, on either side"),
        ("crank_radius_mm", 140.0, "less than mechanism.rod_length_mm"),
    ],
)
def test_refusals_tell_what_is_allowed_in_the_contracts_names(client, dynamics_request, name, value, allowed):
    dynamics_request["mechanism"][name] = value
    refused = client.post(DYNAMICS, json=dynamics_request)
    assert [e["allowed"] for e in refused.json()["errors"]] == [allowed]


def test_masses_by_every_method(client):
    example = KINDS["crank-masses"].example(Mode.ANALYSIS)
    swung = client.post(MASSES, json=example).json()["result"]
    assert swung["rod_cg_from_pin_mm"] == pytest.approx(115.0, abs=1e-6)
    assert 0 < swung["rod_cg_from_pin_mm_u"] < 1
    assert swung["uncertainty_method"] == "linear"
    weighed = client.post(
        MASSES,
        json={
            "method": "weighing",
            "length_mm": 160.0,
            "small_end_reading_kg": 0.174375,
            "big_end_reading_kg": 0.445625,
        },
    ).json()["result"]
    assert weighed["rod_cg_from_pin_mm"] == pytest.approx(115.0)
    assert weighed["rod_inertia_kg_m2"] is None
    assert weighed["rod_mass_kg_u"] is None
    guessed = client.post(
        MASSES, json={"method": "estimate", "bore_mm": 80.0, "piston_kg_m2": 100.0, "rod_kg_m2": 150.0}
    ).json()["result"]
    assert guessed["piston_mass_kg"] == pytest.approx(0.50265482)
    assert guessed["rod_cg_from_pin_mm"] is None


def test_a_singular_pendulum_is_refused_with_its_uncertainty(client):
    body = {**KINDS["crank-masses"].example(Mode.ANALYSIS), "uncertainty": {"period_small_end_s": 0.01}}
    refused = client.post(MASSES, json=body)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/period_big_end_s"
    # In the rod's lengths: figures in metres would be foreign to a request in millimetres.
    assert "is uncertain by 27.3 % of the rod's length (the two pendulum lengths" in refused.json()["detail"]


def test_readings_that_do_not_add_up_are_refused(client):
    readings = {"length_mm": 160.0, "small_end_reading_kg": 0.174375, "big_end_reading_kg": 0.445625}
    refused = client.post(MASSES, json={"method": "weighing", **readings, "rod_mass_kg": 0.7})
    (entry,) = refused.json()["errors"]
    assert (entry["pointer"], entry["allowed"]) == ("/rod_mass_kg", "within 2 % of their sum")


def test_masses_offer_only_the_files_they_have(client):
    run = client.post(MASSES, json=KINDS["crank-masses"].example(Mode.ANALYSIS)).json()
    plot, file = (client.get(f"/api/v1/runs/{run['id']}/{what}/none") for what in ("plots", "exports"))
    assert (plot.status_code, plot.json()["detail"]) == (404, "the run has none")
    assert (file.status_code, file.json()["detail"]) == (404, "there are " + ", ".join(run["links"]["exports"]))


def test_too_many_digits_are_refused_in_plain_words(client, dynamics_request):
    body = json.dumps(dynamics_request).replace('"strokes": 4', '"strokes": 1' + 400 * "0", 1)
    refused = client.post(DYNAMICS, content=body, headers={"Content-Type": "application/json"})
    (entry,) = refused.json()["errors"]
    assert (entry["detail"], entry["allowed"]) == ("has too many digits", "a whole number of fewer digits")


def test_an_unknown_method_is_refused(client):
    refused = client.post(MASSES, json={"method": "guessing"})
    assert refused.status_code == 422
    missing = client.post(MASSES, json={"method": "estimate", "bore_mm": 80.0, "piston_kg_m2": 100.0})
    assert [e["pointer"] for e in missing.json()["errors"]] == ["/rod_kg_m2"]


def test_a_rods_load_may_be_a_stored_run(client, check_request):
    source = client.post(DYNAMICS, json=cooler_request()).json()
    named = copy.deepcopy(check_request) | {"load": {"kind": "run", "run_id": source["id"]}}
    run = client.post(RODS, json=named).json()
    assert run["status"] == "succeeded", run
    load = run["spec"]["load"]
    assert {name: load[name] for name in ("angle_deg", "pressure_mpa")} == source["result"]["cycle"]
    assert load["run_id"] == source["id"]
    assert load["taken_from"] == f"crank-dynamics {source['spec_hash']}"
    assert load["back_pressure_mpa"] == 1.8
    told = copy.deepcopy(check_request)
    told["load"] = {**cooler_request()["pressure"], "back_pressure_mpa": 1.8}
    by_hand = client.post(RODS, json=told).json()
    for name, value in by_hand["result"].items():
        if isinstance(value, float):
            assert run["result"][name] == pytest.approx(value, rel=1e-9), name
    # The stored request can be sent again as it is, and studied.
    again = client.post(RODS, json=run["spec"])
    assert again.json()["result"] == run["result"]
    study = client.post(
        "/api/v1/accuracy/flexible-rod",
        json={"spec": {**named, "effects": {"exclude": ["rod_inertia"]}}, "time_budget_s": 0.1},
    )
    assert study.json()["status"] == "succeeded"
    assert study.json()["spec"]["spec"]["load"]["taken_from"] == load["taken_from"]


def test_a_rods_load_may_be_the_worst_instant_of_four_strokes(client, check_request, dynamics_request):
    source = client.post(DYNAMICS, json=dynamics_request).json()
    worst = next(w for w in source["result"]["worst"] if w["name"] == "gas_force_max")
    part = {"effects": {"exclude": ["rod_inertia"]}, "accuracy": 1e-4}
    named = {**check_request, **part, "load": {"kind": "run", "run_id": source["id"], "instant": "gas_force_max"}}
    run = client.post(RODS, json=named).json()
    assert run["spec"]["load"]["pressure_mpa"] == [worst["pressure_mpa"]]
    told = {"kind": "constant", "constant_pressure_mpa": worst["pressure_mpa"], "back_pressure_mpa": 0.1}
    by_hand = client.post(RODS, json={**check_request, **part, "load": told}).json()
    assert run["result"] == by_hand["result"]


def test_an_unsuitable_run_is_refused_at_its_id(client, check_request, dynamics_request):
    four = client.post(DYNAMICS, json=dynamics_request).json()["id"]
    other = client.post(RODS, json=check_request).json()["id"]
    for run_id, words in ((four, "four strokes"), (other, "flexible-rod"), ("none", "no run has this id")):
        refused = client.post(RODS, json={**check_request, "load": {"kind": "run", "run_id": run_id}})
        assert refused.status_code == 422
        (entry,) = refused.json()["errors"]
        assert entry["pointer"] == "/load/run_id"
        assert words in entry["detail"]


def test_references_are_resolved_before_a_run_is_accepted(client, design_request):
    request = {**design_request, "load": {"kind": "run", "run_id": "none"}}
    refused = client.post("/api/v1/designs/flexible-rod", json=request, headers={"Prefer": "respond-async"})
    assert refused.status_code == 422


def test_a_runs_page_shows_worst_instants_cylinders_and_repairs(client, dynamics_request):
    volumes = dynamics_request["pressure"]["strokes"][1]["volume_cm3"]
    volumes[9], volumes[10] = volumes[10], volumes[9]
    dynamics_request["pressure"]["repair"] = True
    run = client.post(DYNAMICS, json=dynamics_request).json()
    page = client.get(f"/runs/{run['id']}").text
    for words in ("greatest crank pin load", "unbalance of order 2", "points sorted by volume", "Study the accuracy"):
        assert words in page, words
    for plot in KINDS["crank-dynamics"].plots:
        assert f"/plots/{plot}" in page
    masses = client.post(MASSES, json=KINDS["crank-masses"].example(Mode.ANALYSIS)).json()
    shown = client.get(f"/runs/{masses['id']}").text
    assert "centre of mass" in shown
    assert "115.00 ±\u00a00.56" in shown
    assert "Study the accuracy" not in shown


def test_forms_and_pages(client):
    for slug in ("crank-dynamics", "crank-masses"):
        page = client.get(f"/designs/{slug}?mode=analysis")
        assert page.status_code == 200
    assert "/designs/crank-dynamics?mode=analysis" in client.get("/").text
    assert json.loads(client.get("/api/v1/effects/crank-masses").text)["effects"] == []
