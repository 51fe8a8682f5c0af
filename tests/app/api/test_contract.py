"""The OpenAPI document matches the service."""

from __future__ import annotations

import json
import re

import pytest
from jsonschema import Draft202012Validator

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, modes_of
from tests.reliability.document import DOCUMENT, OPERATIONS, known_values, part

EVERYTHING = [(kind, mode) for kind in KINDS.values() for mode in modes_of(kind)]


def valid(instance: object, pointer: str) -> None:
    schema = {"$ref": f"#/components/schemas/{pointer}", "components": DOCUMENT["components"]}
    Draft202012Validator(schema).validate(instance)


def schema_of(path: str, status: str, media_type: str = "application/json") -> str:
    content = DOCUMENT["paths"][path]["post"]["responses"][status]["content"]
    return content[media_type]["schema"]["$ref"].rpartition("/")[2]


def test_every_reference_resolves():
    named = set(re.findall(r'"#/components/schemas/([^"]+)"', json.dumps(DOCUMENT)))
    assert named
    assert named <= set(DOCUMENT["components"]["schemas"])


@pytest.mark.parametrize(("kind", "mode"), EVERYTHING, ids=lambda value: getattr(value, "slug", str(value)))
def test_examples_are_answered_as_documented(client, kind, mode):
    path = f"/api/v1/{PATHS[mode]}/{kind.slug}"
    example = example_of(kind, mode)
    body = DOCUMENT["paths"][path]["post"]["requestBody"]["content"]["application/json"]
    assert body["example"] == example
    valid(example, body["schema"]["$ref"].rpartition("/")[2])
    answer = client.post(path, json=example)
    assert answer.status_code == 201, answer.text
    assert answer.json()["status"] == "succeeded"
    valid(answer.json(), schema_of(path, "201"))
    valid(client.get(answer.headers["location"]).json(), "Run")


def test_infeasible_and_refused_answers_are_as_documented(client, design_request):
    path = "/api/v1/designs/flexible-rod"
    design_request["requirements"]["min_fatigue_safety"] = 4.0
    infeasible = client.post(path, json=design_request)
    assert infeasible.json()["status"] == "infeasible"
    valid(infeasible.json(), schema_of(path, "201"))
    refused = client.post(path, json={**design_request, "objective": "beauty"})
    valid(refused.json(), schema_of(path, "422", "application/problem+json"))
    assert refused.status_code == 422
    valid(client.get("/api/v1/runs").json(), "RunPage")


def test_a_study_reports_the_cost_of_accuracy(client, check_request):
    effects = {
        "include": ["beam_column"],
        "exclude": ["friction_feedback", "large_displacement", "rod_inertia", "shear"],
    }
    request = {"spec": {**check_request, "accuracy": 1e-4, "effects": effects}, "study_budget_s": 2.0}
    result = client.post("/api/v1/accuracy/flexible-rod", json=request).json()["result"]
    asked = [level["accuracy"] for level in result["levels"]]
    assert asked == sorted(asked, reverse=True)
    for level in result["levels"]:
        assert level["error"] <= level["accuracy"], level["accuracy"]
        assert 0 < level["time_min_s"] <= level["time_median_s"]
    assert result["recommended"]["error"] <= 1e-4


def test_a_study_reports_the_influence_and_cost_of_effects(client, check_request):
    request = {"spec": {**check_request, "accuracy": 1e-3}, "study_budget_s": 20.0}
    run = client.post("/api/v1/accuracy/flexible-rod", json=request).json()
    costs = run["result"]["effect_costs"]
    assert [cost["name"] for cost in costs] == [effect["name"] for effect in run["effects"]]
    measured = {cost["name"]: cost["change"] for cost in costs if cost["change"] is not None}
    assert {"reciprocating_inertia", "beam_column", "shear"} <= measured.keys()
    for effect in run["effects"]:
        bound = effect["influence"]
        assert bound is None or measured.get(effect["name"], 0.0) <= bound, effect["name"]
    assert "<rect" in client.get(f"/api/v1/runs/{run['id']}/plots/effects").text


def test_a_study_of_a_bad_case_points_into_the_case(client, check_request):
    check_request["dimensions"]["l_mm"] = 50.0
    answer = client.post("/api/v1/accuracy/flexible-rod", json={"spec": check_request})
    assert answer.status_code == 422
    assert [e["pointer"] for e in answer.json()["errors"]] == ["/spec/dimensions/l_mm"]


@pytest.fixture(scope="module")
def known(client):
    return known_values(client)


@pytest.mark.parametrize("operation", OPERATIONS, ids=lambda operation: operation.label)
def test_generated_requests_are_answered_as_documented(client, known, operation):
    """``python -m tests.reliability.document`` makes thousands."""
    number = 2 if "/accuracy/" in operation.path else 4
    assert sum(part(client, operation, known, turn, number).total() for turn in (0, 1)) > 0


def test_modes_have_their_place_in_the_path():
    assert set(PATHS) == set(Mode)
