"""Kinds and materials as the service tells them: enough to build a request without knowing anything else."""

from __future__ import annotations

import json
import re

import pytest

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, modes_of, plots_of
from app.exports.registry import EXPORTS
from solvers.materials import CATALOGUE


def leaves(value, path=""):
    """(path as fields tell it, value) of everything single in a request; lists of numbers are one value."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for inner in value:
            yield from leaves(inner, f"{path}[]")
    else:
        yield path, value


@pytest.fixture
def kinds(client):
    items = client.get("/api/v1/kinds").json()["items"]
    return {item["kind"]: client.get(item["links"]["self"]).json() for item in items}


def test_every_kind_and_mode_is_there(client, kinds):
    assert list(kinds) == list(KINDS)
    for slug, told in kinds.items():
        kind = KINDS[slug]
        assert told["modes"] == [str(mode) for mode in modes_of(kind)]
        assert [effect["name"] for effect in told["effects"]] == [effect.name for effect in kind.known_effects]
        assert client.get(told["links"]["page"]).status_code == 200
        for request in told["requests"]:
            mode = Mode(request["mode"])
            assert request["path"] == f"/api/v1/{PATHS[mode]}/{slug}"
            assert request["plots"] == list(plots_of(kind, mode))
    assert kinds["flexible-rod"]["objectives"][0] == "mass"
    assert "peak_torque" in kinds["impact-linkage"]["objectives"]
    assert {export["name"] for export in kinds["pin-profile"]["exports"]} == set(EXPORTS)
    assert "step" not in {export["name"] for export in kinds["crank-masses"]["exports"]}
    assert client.get("/api/v1/kinds/steam-engine").status_code == 404


def test_fields_cover_every_example_and_hold_it(kinds):
    for slug, told in kinds.items():
        for request in told["requests"]:
            if request["mode"] == "accuracy":
                continue
            fields: dict[str, list] = {}
            for field in request["fields"]:
                fields.setdefault(field["path"], []).append(field)
            for example in (request["example"], *request["examples"].values()):
                for path, value in leaves(example):
                    assert path in fields or value is None, (slug, path)
                    if value is not None:
                        assert any(_holds(field, value) for field in fields[path]), (slug, path, value)


def _holds(field, value):
    values = value if field["type"] == "list" else [value]
    if field["choices"] is not None:
        return all(each in field["choices"] for each in values)
    if isinstance(values[0], bool | str):
        return field["type"] in ("boolean", "string") or field["items"] == "string"
    low, high = field["minimum"], field["maximum"]
    return all((low is None or each >= low) and (high is None or each <= high) for each in values)


@pytest.mark.parametrize("edge", ["minimum", "maximum"])
def test_limits_are_those_that_requests_are_held_to(client, kinds, edge):
    """A step beyond what a field tells is refused at that very field."""
    told = next(r for r in kinds["flexible-rod"]["requests"] if r["mode"] == "check")
    for field in told["fields"]:
        if field["type"] != "number" or field["when"] or field[edge] is None:
            continue
        request = json.loads(json.dumps(told["example"]))
        *above, last = field["path"].split(".")
        at = request
        for name in above:
            at = at.setdefault(name, {})
        limit = field[edge]
        at[last] = (
            limit if field[f"exclusive_{edge}"] else limit + (1e-3 if edge == "maximum" else -1e-3) * max(1, limit)
        )
        refused = client.post(told["path"], json=request)
        assert refused.status_code == 422, field["path"]
        pointers = [entry["pointer"] for entry in refused.json()["errors"]]
        assert "/" + field["path"].replace(".", "/") in pointers


def test_fields_say_their_units_as_their_names_do(kinds):
    for told in kinds.values():
        for request in told["requests"]:
            for field in request["fields"]:
                if re.search(r"_(mm|mpa|gpa|hz|kg|deg|um)$", field["path"]):
                    assert field["unit"], field["path"]
                assert field["label"]


def test_materials_have_a_source_for_every_number(client):
    items = client.get("/api/v1/materials").json()["items"]
    assert [item["name"] for item in items] == list(CATALOGUE)
    for item in items:
        numbers = {name for name, value in item.items() if isinstance(value, float)} - {"shear_modulus_gpa"}
        assert set(item["sources"]) == numbers, item["name"]
        assert item["kinds"] == ["flexible-rod"]
        own = CATALOGUE[item["name"]]
        assert item["fatigue_limit_mpa"] * 1e6 == pytest.approx(own.fatigue_limit)
        assert item["elastic_modulus_gpa"] * 1e9 == pytest.approx(own.elastic_modulus)


def test_a_request_can_name_each_material(client, check_request):
    for item in client.get("/api/v1/materials").json()["items"]:
        answer = client.post("/api/v1/checks/flexible-rod", json={**check_request, "material": {"name": item["name"]}})
        assert answer.status_code == 201
        assert answer.json()["result"]["mass_g"] == pytest.approx(
            item["density_kg_m3"] * check_request["dimensions"]["b_mm"] * check_request["dimensions"]["h_mm"]
            * check_request["dimensions"]["l_mm"] * 1e-6
        )  # fmt: skip
