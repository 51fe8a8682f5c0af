"""The impact linkage over HTTP, in forms and on the command line."""

from __future__ import annotations

import copy
import json
import math
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from app.cli import app
from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.app.web.test_forms import texts_of

CHECKS, DESIGNS = "/api/v1/checks/impact-linkage", "/api/v1/designs/impact-linkage"


@pytest.fixture
def check() -> dict:
    return KINDS["impact-linkage"].example(Mode.CHECK)


@pytest.fixture
def design() -> dict:
    return KINDS["impact-linkage"].example(Mode.DESIGN)


def solved(client, path: str, request: dict) -> dict:
    answer = client.post(path, json=request)
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_a_check_in_the_contracts_names(client, check):
    run = solved(client, CHECKS, {**check, "accuracy": 1e-8})
    assert (run["kind"], run["mode"], run["status"]) == ("impact-linkage", "check", "succeeded")
    result = run["result"]
    assert result["type"] == "largest_base"
    assert result["lengths_mm"]["base"] == pytest.approx(73.780769, abs=5e-7)
    assert result["ratios"]["lambda3"] == pytest.approx(2.0, abs=1e-8)
    assert result["kinematic_restitution"] == pytest.approx(0.3)
    assert result["u31_start"] / result["u31_end"] == pytest.approx(0.3)
    assert (result["rotatable"], result["impact_speed_m_s"]) == (True, pytest.approx(5.0))
    assert result["box_mm"] == {
        "width": pytest.approx(103.2707, abs=5e-5),
        "height": pytest.approx(56.4971, abs=5e-5),
        "angle_deg": pytest.approx(18.367, abs=5e-4),
    }
    assert result["longest_link_mm"] == result["lengths_mm"]["base"]
    assert result["transfer"][0] == {"phi_deg": 0.0, "u31": pytest.approx(-result["u31_start"])}
    assert result["transfer"][-1] == {"phi_deg": 360.0, "u31": pytest.approx(result["u31_end"])}
    assert result["running_frequency_hz"] > 0
    assert {e["name"] for e in run["effects"]} == {"envelope", "impact_dynamics", "coupler_elasticity", "tolerances"}


def test_a_design_in_the_contracts_names(client, design):
    result = solved(client, DESIGNS, design)["result"]
    assert result["type"] == "largest_coupler"
    assert result["value"] == pytest.approx(1412.2836, abs=5e-5)
    assert [a["type"] for a in result["alternatives"]] == ["largest_coupler", "largest_rocker", "largest_base"]
    assert result["certificate"]["bound"] == pytest.approx(result["value"], rel=2e-6)
    assert result["front"] is None


def test_unneeded_inputs_may_be_omitted(client):
    result = solved(client, CHECKS, {"type": "largest_coupler", "restitution": 0.3, "ratios": {"lambda2": 2.5}})[
        "result"
    ]
    assert result["ratios"]["lambda0"] == pytest.approx(2.0292, abs=5e-5)
    assert result["kinematic_restitution"] == pytest.approx(0.3)
    for name in ("lengths_mm", "box_mm", "impact_speed_m_s", "pin_force_n", "peak_torque_nm"):
        assert result[name] is None
    lengths = {"base": 20, "crank": 10, "coupler": 40, "rocker": 30}
    result = solved(client, CHECKS, {"restitution": 0.3, "lengths_mm": lengths, "blow_frequency_hz": 20})["result"]
    assert (result["type"], result["closure"]["closes"]) == ("largest_coupler", True)
    # g^2 = lambda0 lambda2/lambda3 = 8/3, u31(2 pi) = g + 1.
    assert result["u31_end"] == pytest.approx(math.sqrt(8 / 3) + 1)
    assert result["impact_speed_m_s"] == pytest.approx(40 * math.pi * 0.03 * (math.sqrt(8 / 3) + 1))
    assert result["pin_force_n"] is None


def test_lengths_that_do_not_close_have_a_window_and_no_curve(client):
    lengths = {"base": 20, "crank": 10, "coupler": 40.1, "rocker": 30}
    request = {"restitution": 0.3, "lengths_mm": lengths, "blow_frequency_hz": 20, "impact_speed_m_s": 5}
    run = solved(client, CHECKS, request)
    result = run["result"]
    assert (result["transfer"], result["u31_end"], result["kinematic_restitution"]) == ([], None, None)
    assert result["closure"]["surplus_mm"] == pytest.approx(-0.1)
    assert result["window"]["blocked"]
    assert not result["rotatable"]
    assert "transfer" not in client.get(f"/runs/{run['id']}").text.partition("Effects")[0]
    assert client.get(f"/api/v1/runs/{run['id']}/plots/transfer").status_code == 409
    assert client.get(f"/api/v1/runs/{run['id']}/plots/mechanism").status_code == 200


def test_a_blocked_crank_is_reported_and_drawn(client, check):
    request = {**check, "type": "largest_coupler", "ratios": {"lambda2": 1.0}}
    run = solved(client, CHECKS, request)
    assert run["result"]["rotatable"] is False
    assert 60 < run["result"]["confined_deg"] < 180
    for plot in ("mechanism", "transfer"):
        ElementTree.fromstring(client.get(f"/api/v1/runs/{run['id']}/plots/{plot}").text)


def test_an_infeasible_design_says_what_comes_closest(client, design):
    design["limits"]["longest_link_mm"] = 15.0
    run = solved(client, DESIGNS, design)
    assert run["status"] == "infeasible"
    entry = next(e for e in run["result"]["diagnosis"] if e["requirement"] == "longest_link_mm")
    assert entry["required"] == pytest.approx(15.0)
    assert entry["attainable"] > 15.0
    assert "closest with the largest coupler" in entry["advice"]


def test_a_front_in_one_request(client, design):
    design["front"] = {"against": "pin_force", "points": 3}
    run = solved(client, DESIGNS, design)
    front = run["result"]["front"]
    assert (front["objective"], front["against"], front["against_unit"]) == ("box_area", "pin_force", "N")
    forces = [point["against"] for point in front["points"]]
    areas = [point["objective"] for point in front["points"]]
    assert forces == sorted(forces)
    assert areas == sorted(areas, reverse=True)
    assert areas[-1] == pytest.approx(run["result"]["value"])
    assert f"/runs/{run['id']}/plots/front" in client.get(f"/runs/{run['id']}").text


@pytest.mark.parametrize("plot", ["mechanism", "transfer", "loads"])
@pytest.mark.parametrize("path", [CHECKS, DESIGNS])
def test_plots_are_valid_svg(client, check, design, path, plot):
    run = solved(client, path, check if path == CHECKS else design)
    drawn = client.get(f"/api/v1/runs/{run['id']}/plots/{plot}")
    assert drawn.headers["content-type"] == "image/svg+xml"
    assert "nan" not in drawn.text
    ElementTree.fromstring(drawn.text)
    assert ("<animate " in drawn.text) == (plot == "mechanism")
    assert client.get(f"/api/v1/runs/{run['id']}/plots/front").status_code == 409


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"restitution": 0.96}, "/restitution"),
        ({"restitution": True}, "/restitution"),
        ({"restitution": {"low": 0.3, "high": 0.2}}, "/restitution/low"),
        ({"type": "largest_crank"}, "/type"),
        ({"type": None}, "/type"),
        ({"ratios": {"lambda2": 3.0}}, "/ratios/lambda0"),
        ({"ratios": None}, "/ratios"),
        ({"lengths_mm": {"base": 20, "crank": 10, "coupler": 40, "rocker": 30}}, "/ratios"),
        ({"ratios": None, "lengths_mm": {"base": 20, "crank": 10, "coupler": 40}}, "/lengths_mm/rocker"),
        ({"ratios": None, "lengths_mm": {"base": 90, "crank": 10, "coupler": 40, "rocker": 30}}, "/lengths_mm/base"),
        ({"ratios": None, "lengths_mm": {"base": 0, "crank": 10, "coupler": 40, "rocker": 30}}, "/lengths_mm/base"),
        (
            {
                "type": "largest_coupler",
                "ratios": None,
                "lengths_mm": {"base": 60, "crank": 20, "coupler": 50, "rocker": 30},
            },
            "/type",
        ),
        ({"type": "largest_rocker", "ratios": {"lambda2": 1.5}}, "/ratios/lambda2"),
        ({"drive": {"stall_torque_nm": 5.0}}, "/drive/free_speed_hz"),
        ({"impact_energy_j": None}, "/impact_energy_j"),
        ({"effects": {"include": ["beauty"]}}, "/effects/include"),
    ],
)
def test_refusals_name_the_field(client, check, change, pointer):
    answer = client.post(CHECKS, json={**check, **change})
    assert answer.status_code == 422, answer.text
    assert pointer in [error["pointer"] for error in answer.json()["errors"]]


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"types": []}, "/types"),
        ({"objective": "beauty"}, "/objective"),
        ({"blow_frequency_hz": None}, "/blow_frequency_hz"),
        ({"impact_speed_m_s": -1}, "/impact_speed_m_s"),
        ({"front": {"against": "box_area"}}, "/front/against"),
        ({"front": {"against": "pin_force", "points": 2.5}}, "/front/points"),
        ({"effects": {"exclude": ["envelope"]}}, "/effects/exclude"),
        ({"objective": "impact_speed", "limits": {"min_link_mm": 8}}, "/limits"),
        ({"limits": {"joint_radius_mm": 6, "width_mm": 10}}, "/limits/width_mm"),
        ({"limits": {"transmission_angle_deg": [140, 40]}}, "/limits/transmission_angle_deg/0"),
    ],
)
def test_contradictory_designs_are_refused(client, design, change, pointer):
    answer = client.post(DESIGNS, json={**design, **change})
    assert answer.status_code == 422, answer.text
    assert pointer in [error["pointer"] for error in answer.json()["errors"]]


@pytest.mark.parametrize("mode", ["check", "design"])
def test_the_forms_example_has_a_page_with_the_moving_mechanism(client, mode):
    fields = texts_of("impact-linkage", mode)
    answer = client.post(f"/designs/impact-linkage?mode={mode}", data=fields, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    shown = client.get(answer.headers["location"]).text
    assert "plots/mechanism" in shown
    assert "base = <strong>" in shown
    assert ("The best of every type" in shown) == (mode == "design")


def test_a_study_shows_what_accuracy_costs(client, check):
    request = {"spec": {**check, "effects": "all"}, "study_budget_s": 3.0}
    result = solved(client, "/api/v1/accuracy/impact-linkage", request)["result"]
    errors = [level["error"] for level in result["levels"]]
    assert errors[0] >= errors[-1]
    assert all(level["error"] <= level["accuracy"] for level in result["levels"])
    assert {"box_area_mm2", "running_frequency_hz"} <= set(result["levels"][0]["errors"])


def test_on_the_command_line(tmp_path, check):
    file = tmp_path / "request.json"
    file.write_text(json.dumps(copy.deepcopy(check)))
    database = f"sqlite:///{tmp_path}/runs.sqlite3"
    answer = CliRunner().invoke(app, ["check", "impact-linkage", str(file), "--database-url", database])
    assert answer.exit_code == 0, answer.output
    assert "impact-linkage · check · succeeded" in answer.output
