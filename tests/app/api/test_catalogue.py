"""The catalogue of kinds and materials is sufficient to build a request."""

from __future__ import annotations

import json
import re

import pytest

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, modes_of, plots_of
from app.exports.export import ExportOptions
from app.exports.registry import EXPORTS
from solvers import pin
from solvers.materials import CATALOGUE


def leaves(value, path=""):
    """(path as in fields, value) of every scalar in a request; a list of numbers counts as one value."""
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


def test_every_kind_and_mode_is_listed(client, kinds):
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


def test_fields_cover_every_example(kinds):
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
def test_listed_limits_are_enforced(client, kinds, edge):
    """A value slightly beyond a field's limit is refused at that field."""
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


def test_units_match_the_names_of_fields(kinds):
    for told in kinds.values():
        for request in told["requests"]:
            for field in request["fields"]:
                if re.search(r"_(mm|mpa|gpa|hz|kg|deg|um)$", field["path"]):
                    assert field["unit"], field["path"]
                assert field["label"]


def test_materials_have_a_source_for_every_number(client):
    items = client.get("/api/v1/materials").json()["items"]
    listed = {**CATALOGUE, **pin.CATALOGUE}
    assert [item["name"] for item in items] == list(listed)
    for item in items:
        numbers = {name for name, value in item.items() if isinstance(value, float)} - {"shear_modulus_gpa"}
        assert set(item["sources"]) == numbers, item["name"]
        own = listed[item["name"]]
        assert item["kinds"] == (["pin-profile"] if item["name"] in pin.CATALOGUE else ["flexible-rod"])
        assert item["elastic_modulus_gpa"] * 1e9 == pytest.approx(own.elastic_modulus)
        for name, scale in (("fatigue_limit", 1e6), ("allowable_stress", 1e6)):
            told = item[f"{name}_mpa"]
            assert (told is None) == (not hasattr(own, name))
            assert told is None or told * scale == pytest.approx(getattr(own, name))


def materials_of(client, kind):
    return [item for item in client.get("/api/v1/materials").json()["items"] if kind in item["kinds"]]


def test_a_request_can_name_each_material(client, check_request):
    for item in materials_of(client, "flexible-rod"):
        answer = client.post("/api/v1/checks/flexible-rod", json={**check_request, "material": {"name": item["name"]}})
        assert answer.status_code == 201
        assert answer.json()["result"]["mass_g"] == pytest.approx(
            item["density_kg_m3"] * check_request["dimensions"]["b_mm"] * check_request["dimensions"]["h_mm"]
            * check_request["dimensions"]["l_mm"] * 1e-6
        )  # fmt: skip


@pytest.mark.parametrize("name", list(pin.CATALOGUE))
@pytest.mark.parametrize("variable", ["bore", "outer"])
def test_a_pin_of_a_named_steel_is_the_pin_of_its_figures(name, variable):
    job, example = KINDS["pin-profile"].jobs[Mode.DESIGN], KINDS["pin-profile"].example("design")
    base = {**example, "limits": {"min_wall_mm": 2}, "form": {"kind": "free"}, "variable": variable}
    if variable == "outer":
        base |= {"bore_mm": 12.0, "geometry": {**example["geometry"], "outer_diameter_mm": None}}
    steel = pin.CATALOGUE[name]
    for own in (None, 160.0):
        figures = {
            "allowable_stress_mpa": own or steel.allowable_stress / 1e6,
            "elastic_modulus_gpa": steel.elastic_modulus / 1e9,
            "poisson": steel.poisson,
            "density_kg_m3": steel.density,
        }
        by_name, by_figures = (
            job.run(job.request.model_validate({**base, "material": material}))
            for material in ({"name": name, "allowable_stress_mpa": own}, figures)
        )
        assert by_name.status == "succeeded"
        assert by_name.result == by_figures.result


def test_a_pin_of_a_named_steel_is_drawn_and_reported(client):
    request = {**KINDS["pin-profile"].example("design"), "material": {"name": "pin-steel-31CrMoV9"}}
    run = client.post("/api/v1/designs/pin-profile", json=request).json()
    assert run["spec"]["material"]["name"] == "pin-steel-31CrMoV9"
    for name in ("dxf", "html", "parameters"):
        assert EXPORTS[name].file(KINDS["pin-profile"], run, ExportOptions()).content
    for plot in run["links"]["plots"].values():
        assert client.get(plot).status_code == 200


def test_an_unknown_steel_is_refused_with_the_known_ones(client):
    request = {**KINDS["pin-profile"].example("design"), "material": {"name": "butter"}}
    answer = client.post("/api/v1/designs/pin-profile", json=request)
    assert answer.status_code == 422
    told = answer.json()["errors"][0]
    assert told["pointer"] == "/material/name" and "pin-steel-16MnCr5" in told["allowed"]


def test_the_greatest_time_of_a_design_is_the_services(client, kinds):
    longest = client.app.state.settings.solve_budget_s
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    for slug, told in kinds.items():
        for request in told["requests"]:
            for field in request["fields"]:
                if field["path"].endswith("time_budget_s") and (request["mode"], field["path"]) != (
                    "accuracy",
                    "time_budget_s",
                ):
                    assert field["maximum"] == longest, (slug, request["mode"])
        if "design" in told["modes"]:
            name = "".join(word.capitalize() for word in slug.split("-")) + "DesignRequest"
            number = schemas[name]["properties"]["time_budget_s"]["anyOf"][0]
            assert (number["type"], number["maximum"]) == ("number", longest)
            asked = KINDS[slug].example(Mode.DESIGN) | {"time_budget_s": 1.01 * longest}
            answer = client.post(f"/api/v1/designs/{slug}", json=asked)
            assert answer.status_code == 422
            assert answer.json()["errors"][0]["allowed"] == f"at most {longest:g}"
