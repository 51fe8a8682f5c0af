"""No malformed request breaks the service or is stored."""

from __future__ import annotations

import asyncio
import json
import random

import pytest

from app.api.one_by_one import OneByOne

CHECKS = "/api/v1/checks/flexible-rod"
JSON = {"content-type": "application/json"}


def change(request: dict, path: str, value: object) -> bytes:
    here = request
    *parents, last = path.split("/")
    for name in parents:
        here = here[name]
    here[last] = value
    return json.dumps(request).encode()


@pytest.mark.parametrize(
    ("path", "value", "pointer"),
    [
        ("mechanism/crank_radius_mm", 50, "/mechanism/crank_radius_mm"),
        ("mechanism/crank_radius_mm", True, "/mechanism/crank_radius_mm"),
        ("mechanism/rod_length_mm", "9", "/mechanism/rod_length_mm"),
        ("mechanism/speed_hz", 0, "/mechanism/speed_hz"),
        ("mechanism/speed_hz", -1, "/mechanism/speed_hz"),
        ("mechanism/speed_hz", float("nan"), "/mechanism/speed_hz"),
        ("mechanism/speed_hz", float("inf"), "/mechanism/speed_hz"),
        ("dimensions/l_mm", 46, "/dimensions/l_mm"),
        ("dimensions/h_mm", 0, "/dimensions/h_mm"),
        ("load/delta", 1, "/load/delta"),
        ("load/extra", 1, "/load/extra"),
        ("load/kind", "other", "/load/kind"),
        ("name", "x" * 201, "/name"),
        ("name", "a\x00b", "/name"),
        ("accuracy", 1e-13, "/accuracy"),
        ("effect_tolerance", 0, "/effect_tolerance"),
        ("effects", {"include": ["no such effect"]}, "/effects/include"),
        ("effects", {"exclude": [1]}, "/effects/exclude/0"),
        ("material/fatigue_reduction", 0.5, "/material/fatigue_reduction"),
        ("fatigue_criterion", "goodman", "/material/ultimate_strength_mpa"),
    ],
)
def test_every_bad_field_is_named(client, check_request, path, value, pointer):
    answer = client.post(CHECKS, content=change(check_request, path, value), headers=JSON)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert pointer in [entry["pointer"] for entry in problem["errors"]]
    assert all(entry["detail"] and entry["allowed"] for entry in problem["errors"])


LOADS = "schmidt, table, constant, indicator, run"


@pytest.mark.parametrize(
    ("path", "value", "pointer", "detail", "allowed"),
    [
        ("mechanism/crank_radius", 5, "/mechanism/crank_radius", "is no field; did you mean crank_radius_mm?",
         "crank_radius_mm, rod_length_mm, speed_hz"),
        ("load/p_min", -1, "/load/p_min", "is no field; did you mean p_min_mpa?",
         "kind, p_min_mpa, delta, theta_rad, back_pressure_mpa"),
        ("load", {"kind": "schmit"}, "/load/kind", "is none of the values it can have; did you mean schmidt?", LOADS),
        ("load", {"kind": 7}, "/load/kind", "is none of the values it can have", LOADS),
        ("load", {"kind": None}, "/load/kind", "is none of the values it can have", LOADS),
        ("load", {"p_min_mpa": 1.4}, "/load/kind", "is missing", LOADS),
        ("load", 5, "/load", "is none of the forms this field can have", f'an object whose "kind" is one of {LOADS}'),
        ("load", {"kind": "table", "angle_deg": [0.0, 180.0, 360.0], "pressure_mpa": "x"}, "/load/pressure_mpa",
         "is not an array", "an array"),
        ("effects", "al", "/effects", "is none of the values it can have; did you mean all?", "'auto' or 'all'"),
        ("effects", {"inclde": []}, "/effects/inclde", "is no field; did you mean include?", "include, exclude"),
        ("fatigue_criterion", "godman", "/fatigue_criterion",
         "is none of the values it can have; did you mean goodman?", None),
    ],
)  # fmt: skip
def test_a_refusal_states_error_allowed_values_and_suggestion_once(
    client, check_request, path, value, pointer, detail, allowed
):
    entries = client.post(CHECKS, content=change(check_request, path, value), headers=JSON).json()["errors"]
    assert [(entry["pointer"], entry["detail"]) for entry in entries] == [(pointer, detail)]
    assert allowed is None or entries[0]["allowed"] == allowed


@pytest.mark.parametrize("criterion", ["goodman", "gerber"])
def test_a_missing_strength_is_asked_for_without_a_unit_of_the_solvers(client, check_request, criterion):
    (entry,) = client.post(CHECKS, json={**check_request, "fatigue_criterion": criterion}).json()["errors"]
    assert entry["pointer"] == "/material/ultimate_strength_mpa"
    assert entry["allowed"] == "a strength not below the yield strength"


def test_a_stock_outside_the_bounds_is_refused(client, design_request):
    (entry,) = client.post("/api/v1/designs/flexible-rod", json={**design_request, "stock_h_mm": [9.0]}).json()[
        "errors"
    ]
    assert (entry["pointer"], entry["allowed"]) == ("/stock_h_mm", "one within the bounds of h")


BODIES = {
    "empty": b"",
    "no JSON": b"hello",
    "open array": b"[",
    "an array": b"[]",
    "null": b"null",
    "NaN": b'{"mechanism": NaN}',
    "huge number": b'{"mechanism": {"crank_radius_mm": 1e400}}',
    "lone surrogate": b'{"name": "\\ud800"}',
    "lone surrogate in a key": b'{"\\udfff": 1}',
    "NUL in a name": b'{"name": "a\\u0000b"}',
    "deep array": b"[" * 5000 + b"]" * 5000,
    "deep object": b'{"a":' * 5000 + b"1" + b"}" * 5000,
    "not UTF-8": b'{"name": "\xff\xfe"}',
    "BOM": b"\xef\xbb\xbf{}",
    "many digits": b'{"accuracy": ' + b"1" * 5000 + b"}",
}


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())
def test_malformed_bodies_are_refused(client, body):
    answer = client.post(CHECKS, content=body, headers=JSON)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"


def test_too_large_and_not_json(client):
    assert client.post(CHECKS, content=b" " * 2_000_000, headers=JSON).status_code == 413
    assert client.post(CHECKS, content=b"{}", headers={"content-type": "text/plain"}).status_code == 415
    assert client.post(CHECKS, content=b"{}").status_code == 415


def test_a_thousand_mutated_bodies(client, check_request):
    """Bytes cut, doubled, swapped and overwritten: refused as problems, or understood; never a server error."""
    rng, original = random.Random(1), json.dumps(check_request).encode()
    before = count_runs(client)
    understood = 0
    for _ in range(1000):
        body = bytearray(original)
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(body))
            match rng.randrange(4):
                case 0:
                    del body[at : at + rng.randint(1, 20)]
                case 1:
                    body[at] = rng.randrange(256)
                case 2:
                    body[at:at] = body[at : at + rng.randint(1, 20)]
                case _:
                    body[at:at] = rng.choice([b"NaN", b"-", b"1e999", b"\\ud83d", b'"', b"{", b"]", b"\x00"])
        answer = client.post(CHECKS, content=bytes(body), headers=JSON)
        assert answer.status_code in (201, 422), bytes(body)
        understood += answer.status_code == 201
    assert understood < 300
    assert count_runs(client) == before + understood


def count_runs(client) -> int:
    total, cursor = 0, None
    while True:
        page = client.get("/api/v1/runs", params={"limit": 200, **({"cursor": cursor} if cursor else {})}).json()
        total += len(page["items"])
        cursor = page["next_cursor"]
        if cursor is None:
            return total


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/v1/runs/none", 404),
        ("GET", "/api/v1/runs?limit=0", 422),
        ("GET", "/api/v1/runs?cursor=!!", 422),
        ("GET", "/api/v1/batches?cursor=zz", 422),
        ("GET", "/api/v1/runs?created_after=2026-01-01T00:00:00", 422),
        ("GET", "/api/v1/effects/none", 404),
        ("GET", "/nowhere", 404),
        ("DELETE", "/api/v1/runs", 405),
        ("POST", "/api/v1/checks/none", 404),
        ("POST", "/api/v1/nothing/flexible-rod", 404),
    ],
)
def test_every_refusal_has_the_same_shape(client, method, path, status):
    answer = client.request(method, path)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert {"type", "title", "status", "detail"} <= set(answer.json())
    assert answer.json()["status"] == status


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("PUT", "/api/v1/batches", "GET, POST"),
        ("PUT", "/api/v1/runs/none", "GET, DELETE"),
        ("GET", "/api/v1/checks/flexible-rod", "POST"),
    ],
)
def test_a_method_not_allowed_is_told_all_that_are(client, method, path, allowed):
    answer = client.request(method, path)
    assert (answer.status_code, answer.headers["allow"]) == (405, allowed)


def test_the_number_of_fields_is_limited(client):
    most = client.app.state.settings.max_body_names
    for number, told in ((most, "100 fields"), (most + 1, f"at most {most}")):
        body = json.dumps(dict.fromkeys((f"n{k}" for k in range(number)), 1)).encode()
        answer = client.post(CHECKS, content=body, headers=JSON)
        assert answer.status_code == 422
        assert ("at most" in answer.json()["detail"]) == ("at most" in told)


def test_other_requests_pass_between_two_large_bodies():
    async def story() -> str:
        bodies, order = OneByOne(), []

        async def large() -> None:
            await bodies.turn()
            order.append("L")

        async def small() -> None:
            for _ in range(20):
                await asyncio.sleep(0)
                order.append("s")

        await asyncio.gather(*(large() for _ in range(5)), small())
        return "".join(order)

    order = asyncio.run(story())
    assert order.count("L") == 5 and "LL" not in order


def test_only_large_bodies_wait_for_their_turn(client, check_request, monkeypatch):
    waited, turn = [], client.app.state.large_bodies.turn
    monkeypatch.setattr(client.app.state.large_bodies, "turn", lambda: waited.append(1) or turn())
    for padding, number in ((0, 0), (20_000, 1)):
        body = json.dumps(check_request).encode() + b" " * padding
        assert client.post(CHECKS, content=body, headers=JSON).status_code == 201
        assert len(waited) == number


@pytest.mark.parametrize("field", ["created_after", "created_before"])
@pytest.mark.parametrize(
    ("value", "status"),
    [
        ("0001-01-01T00:00:00+14:00", 422), ("9999-12-31T23:59:59-14:00", 422),
        ("0001-01-01T00:00:00Z", 200), ("9999-12-31T23:59:59Z", 200),
    ],
)  # fmt: skip
def test_times_at_the_ends_of_the_calendar(client, field, value, status):
    answer = client.get("/api/v1/runs", params={field: value})
    assert answer.status_code == status
    assert status == 200 or answer.json()["errors"][0]["pointer"] == f"/{field}"


def test_invisible_characters_are_removed_from_names(client, check_request):
    name = " a\x1b[31m\u202egnp.\u2066b\tc\nd\u200b \x9b=cmd|é\U0001f469\u200d\U0001f527\n"
    answer = client.post(CHECKS, json={**check_request, "name": name})
    assert answer.json()["name"] == "a[31mgnp.b c d =cmd|é\U0001f469\u200d\U0001f527"


@pytest.mark.parametrize("path", ["/api/v1/runs/a%00b", "/runs/a%00b", "/api/v1/runs/a%00b/plots/x"])
def test_an_id_with_nul_is_not_found(client, path):
    assert client.get(path).status_code == 404


@pytest.mark.parametrize(
    ("path", "pointer", "detail"),
    [
        ("runs?stauts=failed", "/stauts", "is no parameter of this address; did you mean status?"),
        ("runs?limit=5&limit=6", "/limit", "appears more than once"),
        ("runs?kind=flexible-rods", "/kind", "is none of the kinds; did you mean flexible-rod?"),
        ("batches?kind=pin", "/kind", "is none of the kinds"),
        ("batches?staus=ended", "/staus", "is no parameter of this address; did you mean status?"),
        ("runs/none?name=x", "/name", "is no parameter of this address"),
        ("runs/none/exports/step?angle=30", "/angle", "is no parameter of this address; did you mean angle_deg?"),
    ],
)
def test_a_misspelt_query_is_refused_at_its_name(client, path, pointer, detail):
    answer = client.get(f"/api/v1/{path}")
    assert answer.status_code == 422
    assert [(error["pointer"], error["detail"]) for error in answer.json()["errors"]] == [(pointer, detail)]


def test_a_name_in_capitals_is_recognised(client, check_request):
    body = {**check_request, "Dimensions": check_request["dimensions"]}
    del body["dimensions"]
    errors = {e["pointer"]: e["detail"] for e in client.post(CHECKS, json=body).json()["errors"]}
    assert errors == {"/dimensions": "is missing", "/Dimensions": "is no field; did you mean dimensions?"}
