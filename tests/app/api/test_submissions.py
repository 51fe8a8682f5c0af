"""Checks and designs over HTTP, stored and found again."""

from __future__ import annotations

import json
import time

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS

CORE = {
    "include": ["beam_column", "friction"],
    "exclude": ["reciprocating_inertia", "rod_inertia", "large_displacement", "shear", "friction_feedback"],
}
CHECKS = "/api/v1/checks/flexible-rod"
DESIGNS = "/api/v1/designs/flexible-rod"


def test_a_check_gives_the_reference_numbers_in_the_contracts_units(client, check_request):
    answer = client.post(CHECKS, json={**check_request, "effects": CORE})
    assert answer.status_code == 201
    run = answer.json()
    assert answer.headers["location"] == f"/api/v1/runs/{run['id']}"
    assert run["status"] == "succeeded"
    assert (run["kind"], run["mode"]) == ("flexible-rod", "check")
    expected = {
        "fatigue_safety": 2.69747, "stability_safety": 1.89890, "critical_force_n": 313.754,
        "axial_force_min_n": -165.2293, "axial_force_max_n": 127.9860, "stress_amplitude_mpa": 147.008,
        "stress_mean_mpa": 74.044, "side_force_max_n": 5.67391, "clamp_moment_max_nmm": 60.698,
        "contact_pressure_max_mpa": 0.044506, "friction_power_w": 0.26748,
    }  # fmt: skip
    for name, value in expected.items():
        assert run["result"][name] == pytest.approx(value, rel=2e-5), name
    assert {e["name"]: e["state"] for e in run["effects"]} == {
        **dict.fromkeys(CORE["include"], "active"),
        **dict.fromkeys(CORE["exclude"], "skipped"),
    }
    assert run["accuracy"]["estimated"] <= run["accuracy"]["requested"]


def test_every_run_is_stored_as_answered(client, check_request):
    answer = client.post(CHECKS, json={**check_request, "name": "to be found"})
    assert client.get(answer.headers["location"]).content == answer.content
    listed = client.get("/api/v1/runs", params={"name": "to be found", "kind": "flexible-rod"}).json()["items"]
    assert [item["id"] for item in listed] == [answer.json()["id"]]


def test_a_repeated_spec_is_answered_from_the_store_as_a_new_run(client, check_request):
    request = {**check_request, "effect_tolerance": 0.011}
    first, second = (client.post(CHECKS, json=request).json() for _ in range(2))
    assert not first["cached"]
    assert second["cached"]
    assert first["id"] != second["id"]
    assert first["result"] == second["result"]
    assert first["timing"]["solve_s"] > second["timing"]["solve_s"] == 0.0


@pytest.mark.parametrize("again", ["effect_tolerance", r"effect_toleranc\u0065"], ids=["plain", "escaped"])
def test_a_name_given_twice_is_refused(client, check_request, again):
    once = json.dumps({**check_request, "effect_tolerance": 0.012})
    answer = client.post(
        CHECKS, content=f'{once[:-1]}, "{again}": 0.013}}', headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 422
    assert [each["pointer"] for each in answer.json()["errors"]] == ["/effect_tolerance"]


def test_an_answer_is_compressed_for_those_who_accept_it(client, check_request):
    request = {**check_request, "effect_tolerance": 0.014}
    plain, packed = (client.post(CHECKS, json=request, headers={"Accept-Encoding": to}) for to in ("identity", "gzip"))
    assert "content-encoding" not in plain.headers and packed.headers["content-encoding"] == "gzip"
    assert plain.json()["result"] == packed.json()["result"]


def test_an_idempotency_key_replays_the_response_byte_for_byte(client, check_request):
    headers = {"Idempotency-Key": "one"}
    first = client.post(CHECKS, json=check_request, headers=headers)
    assert client.post(CHECKS, json=check_request, headers=headers).content == first.content
    other = client.post(CHECKS, json={**check_request, "name": "other"}, headers=headers)
    assert other.status_code == 409


def test_a_check_beyond_buckling_has_no_stresses(client, check_request):
    check_request["dimensions"]["h_mm"] = 0.3
    result = client.post(CHECKS, json={**check_request, "effects": CORE}).json()["result"]
    assert result["stability_safety"] < 1
    assert result["fatigue_safety"] is None
    assert result["warnings"]


def test_a_design_meets_its_requirements_and_names_active_constraints(client, design_request):
    run = client.post(DESIGNS, json={**design_request, "effects": CORE}).json()
    assert run["status"] == "succeeded"
    assert run["result"]["fatigue_safety"] >= 2.65
    assert run["result"]["stability_safety"] >= 1.8
    assert run["result"]["mass_g"] == pytest.approx(0.5712093, rel=2e-6)
    active = {item["name"]: item["sensitivity"] for item in run["result"]["active_constraints"]}
    assert active["min_fatigue_safety"] > 0 > active["b_upper"]


def test_a_design_from_stock_is_rounded_and_carries_its_certificate(client, design_request):
    request = {**design_request, "effects": CORE, "stock_h_mm": [0.4, 0.45, 0.5], "step_mm": {"b": 0.5, "l": 0.5}}
    result = client.post(DESIGNS, json=request).json()["result"]
    found = result["dimensions"]
    assert found["h_mm"] in request["stock_h_mm"]
    assert found["b_mm"] % 0.5 == pytest.approx(0, abs=1e-9)
    assert found["l_mm"] % 0.5 == pytest.approx(0, abs=1e-9)
    assert result["fatigue_safety"] >= 2.65
    assert result["certificate"]["bound"] <= result["mass_g"] * (1 + 1e-9)
    assert result["certificate"]["gap"] <= 1e-6
    # One step shorter, the strip fails: the rounding gave nothing away.
    shorter = {"b_mm": found["b_mm"], "h_mm": found["h_mm"], "l_mm": found["l_mm"] - 0.5}
    check = {k: v for k, v in request.items() if k in ("mechanism", "piston", "load", "material", "effects")}
    assert client.post(CHECKS, json={**check, "dimensions": shorter}).json()["result"]["fatigue_safety"] < 2.65


def test_an_infeasible_design_is_an_answer_with_a_diagnosis(client, design_request):
    design_request["requirements"]["min_fatigue_safety"] = 4.0
    answer = client.post(DESIGNS, json={**design_request, "effects": CORE})
    assert answer.status_code == 201
    assert answer.json()["status"] == "infeasible"
    (shortfall,) = answer.json()["result"]["diagnosis"]
    assert shortfall["requirement"] == "min_fatigue_safety"
    assert shortfall["required"] == 4.0
    assert 2.65 < shortfall["attainable"] < 4.0


@pytest.mark.parametrize(
    ("prefer", "status"),
    [
        ("Respond-Async", 202),
        ("wait=10, respond-async; foo=bar", 202),
        ("handling=lenient", 201),
        ('handling="respond-async"', 201),
    ],
)
def test_preferences_are_a_list_of_names_in_any_case(client, check_request, prefer, status):
    answer = client.post(CHECKS, json={**check_request, "effects": CORE}, headers={"Prefer": prefer})
    assert answer.status_code == status


def test_a_preference_may_be_in_a_header_of_its_own(client, check_request):
    headers = [("Prefer", "wait=10"), ("Prefer", "respond-async"), ("Content-Type", "application/json")]
    assert client.post(CHECKS, content=json.dumps(check_request), headers=headers).status_code == 202


def test_a_diagnosis_names_requirements_as_the_request_does(client, design_request):
    design_request["requirements"]["max_contact_pressure_mpa"] = 0.034
    diagnosis = client.post(DESIGNS, json={**design_request, "effects": CORE}).json()["result"]["diagnosis"]
    advice = {entry["requirement"]: entry["advice"] for entry in diagnosis}
    assert "not while max_contact_pressure_mpa holds" in advice["min_fatigue_safety"]


def test_a_design_can_be_solved_asynchronously(client, design_request):
    request = {**design_request, "effects": CORE, "name": "later"}
    answer = client.post(DESIGNS, json=request, headers={"Prefer": "respond-async"})
    assert answer.status_code == 202
    deadline = time.monotonic() + 60
    while (run := client.get(answer.headers["location"]).json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert run["status"] == "succeeded"


@pytest.mark.parametrize("path", ["checks/flexible-rod", "checks/pin-profile", "analyses/crank-masses"])
def test_checks_and_analyses_can_be_solved_asynchronously(client, path):
    kind = KINDS[path.partition("/")[2]]
    mode = Mode.CHECK if path.startswith("checks") else Mode.ANALYSIS
    body = {**kind.example(mode), "name": "later"}
    answer = client.post(f"/api/v1/{path}", json=body, headers={"Prefer": "respond-async"})
    assert (answer.status_code, answer.headers["retry-after"]) == (202, "1")
    deadline = time.monotonic() + 60
    while (run := client.get(answer.headers["location"]).json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert run["result"] == client.post(f"/api/v1/{path}", json=body).json()["result"]


def test_a_study_reports_progress(client, check_request):
    body = {"spec": {**check_request, "effects": CORE}, "study_budget_s": 3.0}
    answer = client.post("/api/v1/accuracy/flexible-rod", json=body, headers={"Prefer": "respond-async"})
    assert answer.status_code == 202
    assert answer.json()["progress"] is None
    deadline, seen = time.monotonic() + 60, []
    while (run := client.get(answer.headers["location"]).json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        seen.append(run["progress"])
        time.sleep(0.05)
    assert run["status"] == "succeeded"
    assert run["progress"] is None
    told = [progress for progress in seen if progress is not None]
    assert told
    assert [p["done"] for p in told] == sorted(p["done"] for p in told)
    assert all(0 <= p["done"] <= p["of"] and p["doing"] for p in told)


def test_excluding_an_effect_that_a_limit_needs_names_both(client, design_request):
    design_request["requirements"]["max_friction_power_w"] = 1.0
    answer = client.post(DESIGNS, json={**design_request, "effects": {"exclude": ["friction"]}})
    assert answer.status_code == 422
    assert "friction" in answer.text
    assert "max_friction_power" in answer.text


def test_plot_effects_health_and_metrics(client, check_request):
    run = client.post(CHECKS, json=check_request).json()
    plot = client.get(f"/api/v1/runs/{run['id']}/plots/stability-map")
    assert plot.headers["content-type"] == "image/svg+xml"
    assert "<circle" in plot.text
    assert client.get(f"/api/v1/runs/{run['id']}/plots/none").status_code == 404
    names = {e["name"] for e in client.get("/api/v1/effects/flexible-rod").json()["effects"]}
    assert names == {*CORE["include"], *CORE["exclude"]}
    assert client.get("/healthz").json() == {"status": "ok"}
    assert client.get("/readyz").status_code == 200
    client.get("/static/style.css")
    client.request("INVENTED", "/healthz")
    counted = client.get("/metrics").text
    solved = [line for line in counted.splitlines() if line.startswith("crankwright_effects_total{")]
    labels = 'effect="shear",kind="flexible-rod",state='
    assert sum(float(line.split()[-1]) for line in solved if labels in line) >= 1
    assert 'method="other",status="4xx"' in counted
    assert "INVENTED" not in counted
    for handler, method in ((CHECKS, "POST"), ("/api/v1/runs/{run_id}/plots/{plot}", "GET"), ("/static", "GET")):
        assert f'http_requests_total{{handler="{handler}",method="{method}",status="2xx"}}' in counted
    paths = client.get("/openapi.json").json()["paths"]
    assert {CHECKS, DESIGNS, "/api/v1/runs", "/api/v1/effects/{kind}"} <= set(paths)
