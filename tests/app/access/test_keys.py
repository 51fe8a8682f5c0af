"""Keys: required on every route, limited to their scopes, with separate runs per owner."""

from __future__ import annotations

import asyncio
import json
import re
import time
from collections.abc import Iterator

import pytest
from fastapi.routing import APIRoute

from app.access import keys as keys_module
from app.access.keys import digest_of, new_key
from app.access.scopes import PUBLIC, Scope, granted, needed
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.errors import UnknownRun
from app.store.keys import RevokeKey, list_keys, read_audit
from app.store.viewer import seeing_as
from tests.app.access.keyed import Keyed, bearer, keyed
from tests.app.store.records import make_record

FILLED = {
    "code": "en",
    "export": "csv",
    "kind": "flexible-rod", "slug": "flexible-rod", "plot": "stability-map", "name": "csv", "collection": "checks",
}  # fmt: skip
FORM = {"name": "shear", "state": "on", "sizes": "0.5"}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Keyed]:
    with keyed(tmp_path_factory.mktemp("keyed")) as found:
        found.key(Scope.ADMIN)
        yield found


def routes(service: Keyed) -> list[tuple[str, str]]:
    """Method and path of every route except mounted files."""
    found = []
    for route in _flat(service.client.app.routes):
        for method in sorted(route.methods - {"HEAD"}):
            found.append((method, route.path))
    return [*found, ("GET", "/openapi.json"), ("GET", "/metrics")]


def _flat(given) -> Iterator[APIRoute]:
    """Routers may be nested."""
    for route in given:
        if isinstance(route, APIRoute):
            yield route
        else:
            inner = getattr(route, "original_router", None) or getattr(route, "router", None)
            if inner is not None:
                yield from _flat(inner.routes)


def filled(path: str, run_id: str) -> str:
    def value(found: re.Match[str]) -> str:
        return run_id if found[1].endswith("id") else FILLED[found[1]]

    return re.sub(r"\{(\w+)(?::\w+)?\}", value, path)


def ask(service: Keyed, method: str, path: str, headers: dict[str, str]):
    data = FORM if method == "POST" and not path.startswith("/api/") else None
    return service.client.request(method, path, headers=headers, data=data)


def test_the_list_of_routes_is_complete(service):
    found = routes(service)
    assert ("GET", "/api/v1/runs/{run_id}") in found and ("POST", "/api/v1/designs/flexible-rod") in found
    assert len(found) > 25


def test_only_public_routes_are_open(service):
    for method, path in routes(service):
        answer = ask(service, method, filled(path, "0" * 36), {})
        if needed(method, filled(path, "x")) is None:
            assert path in PUBLIC or path == "/language/{code}", path
            assert answer.status_code != 401, path
        else:
            assert answer.status_code == 401, (method, path)
            assert answer.headers["www-authenticate"] == "Bearer"
            assert answer.json()["status"] == 401
            assert ask(service, method, filled(path, "0" * 36), bearer("cw_wrong")).status_code == 401


def test_every_route_checks_its_scope(service):
    given = {scope: service.key(scope)[0] for scope in Scope}
    for method, path in routes(service):
        lowest = needed(method, filled(path, "0" * 36))
        if lowest is None:
            continue
        for scope, key in given.items():
            refused = ask(service, method, filled(path, "0" * 36), bearer(key)).status_code == 403
            assert refused == (lowest not in granted(scope)), (method, path, scope)


def test_no_route_shows_runs_of_others(service):
    mine, my_id = service.key(Scope.DESIGN, Scope.BATCH)
    other, _ = service.key(Scope.DESIGN, Scope.BATCH)
    run = make_record(owner=my_id, name="the owner's alone", status="failed", result=None)
    service.put([run])
    assert service.client.get(f"/api/v1/runs/{run.id}", headers=bearer(mine)).json()["id"] == run.id
    met = 0
    for method, path in routes(service):
        if "run_id" in path:
            met += 1
            answer = ask(service, method, filled(path, run.id), bearer(other))
            assert answer.status_code == 404, (method, path)
            assert "alone" not in answer.text
    assert met >= 6
    for path in ("/api/v1/runs", "/runs", "/", f"/runs/compare?a={run.id}", f"/designs/flexible-rod?from={run.id}"):
        assert "the owner's alone" not in ask(service, "GET", path, bearer(other)).text.replace("&#39;", "'"), path
    reference = {"load": {"kind": "run", "run_id": run.id, "instant": "x"}}
    answer = service.client.post("/api/v1/checks/pin-profile", json=reference, headers=bearer(other))
    assert "alone" not in answer.text
    assert service.client.get(f"/api/v1/runs/{run.id}", headers=bearer(mine)).json()["status"] == "failed"


def test_no_route_shows_batches_of_others(service):
    mine, other = (service.key(Scope.DESIGN, Scope.BATCH)[0] for _ in range(2))
    line = json.dumps(KINDS["pin-profile"].example(Mode.CHECK)).encode() + b"\n"

    def send(key: str):
        headers = {**bearer(key), "Content-Type": "application/x-ndjson", "Idempotency-Key": "shared"}
        query = {"kind": "pin-profile", "mode": "check", "name": "the sender's alone"}
        return service.client.post("/api/v1/batches", content=line, params=query, headers=headers)

    answer = send(mine)
    assert answer.status_code == 202, answer.text
    batch = answer.json()["id"]
    (item,) = service.client.get("/api/v1/runs", params={"batch_id": batch}, headers=bearer(mine)).json()["items"]
    assert service.client.get(f"/api/v1/batches/{batch}", headers=bearer(mine)).json()["items"]["total"] == 1
    met = 0
    for method, path in routes(service):
        if "batch_id" in path:
            met += 1
            refused = ask(service, method, filled(path, batch), bearer(other))
            assert refused.status_code == 404 and "alone" not in refused.text, (method, path)
        elif "run_id" in path:
            assert ask(service, method, filled(path, item["id"]), bearer(other)).status_code == 404, (method, path)
    assert met >= 5
    for path in ("/api/v1/batches", "/batches", f"/api/v1/runs?batch_id={batch}"):
        assert batch[:13] not in ask(service, "GET", path, bearer(other)).text, path
    assert send(other).json()["id"] != batch, "the same idempotency key of two owners is two"
    assert send(mine).content == answer.content


def test_background_work_acts_as_its_owner(service):
    run = make_record(owner="one key", status="failed", result=None)
    service.put([run])

    async def seen(owner: str | None) -> bool:
        with seeing_as(owner):
            try:
                return (await service.store.get(run.id)).id == run.id
            except UnknownRun:
                return False

    assert [asyncio.run(seen(owner)) for owner in ("one key", "another", None)] == [True, False, True]


def test_an_admin_sees_everything_including_runs_without_owner(service):
    admin, reader = service.key(Scope.ADMIN)[0], service.key(Scope.READ)[0]
    run = make_record(name="made before", status="failed", result=None)
    service.put([run])
    assert service.client.get(f"/api/v1/runs/{run.id}", headers=bearer(admin)).status_code == 200
    assert service.client.get(f"/api/v1/runs/{run.id}", headers=bearer(reader)).status_code == 404


def test_idempotency_keys_are_separate_per_owner(service):
    service.warm()
    body = KINDS["crank-masses"].example(Mode.ANALYSIS)
    ids = set()
    for _ in range(2):
        headers = {**bearer(service.key(Scope.DESIGN)[0]), "Idempotency-Key": "shared"}
        answers = [service.client.post("/api/v1/analyses/crank-masses", json=body, headers=headers) for _ in range(2)]
        assert answers[0].status_code == 201, answers[0].text
        assert answers[0].content == answers[1].content and not answers[0].json()["cached"]
        ids.add(answers[0].json()["id"])
    assert len(ids) == 2


def test_a_revoked_key_is_refused_within_seconds(service, monkeypatch):
    monkeypatch.setattr(keys_module, "_CACHE_S", 0.1)
    key, key_id = service.key(Scope.READ)
    assert service.client.get("/api/v1/runs", headers=bearer(key)).status_code == 200
    service.store.write_and_wait(RevokeKey(key_id, "a test"))
    time.sleep(0.15)
    assert service.client.get("/api/v1/runs", headers=bearer(key)).status_code == 401
    noted = service.store.read(lambda connection: read_audit(connection, 5))
    assert (noted[0].action, noted[0].subject) == ("key.revoke", key_id)


def test_the_store_contains_no_secret(service):
    key, key_id = service.key(Scope.READ)
    (record,) = [each for each in service.store.read(list_keys) if each.id == key_id]
    assert key.startswith("cw_") and len(key) == 46
    assert record.digest == digest_of(key) and key not in repr(record)
    assert new_key("a", [Scope.READ])[0] != new_key("a", [Scope.READ])[0]


# -- pages ------------------------------------------------------------------------------------------------------


HTML = {"Accept": "text/html"}


def test_a_page_redirects_to_the_login_and_back(service):
    key, key_id = service.key(Scope.DESIGN)
    client = service.client
    first = client.get("/runs?kind=flexible-rod", headers=HTML)
    assert (first.status_code, first.headers["location"]) == (303, "/login?next=/runs%3Fkind%3Dflexible-rod")
    assert 'value="/runs?kind=flexible-rod"' in client.get(first.headers["location"]).text
    sent = client.post("/designs/flexible-rod?mode=check", data={"name": "mine"}, headers=HTML)
    assert (sent.status_code, sent.headers["location"]) == (303, "/login?next=/designs/flexible-rod%3Fmode%3Dcheck")
    refused = client.post("/login", data={"key": "cw_wrong", "next": "/runs"})
    assert refused.status_code == 401 and "set-cookie" not in refused.headers
    answer = client.post("/login", data={"key": key, "next": "/runs"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/runs")
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie and "samesite=strict" in cookie.lower()
    try:
        page = client.get("/designs/flexible-rod", headers=HTML)
        assert page.status_code == 200
        (token, *_) = re.findall(r'name="csrf_token" value="([\w-]+)"', page.text)
        assert page.text.count("csrf_token") == page.text.count('<form method="post"')
        run = make_record(owner=key_id, status="queued", result=None)
        service.put([run])
        cancel = f"/runs/{run.id}/cancel"
        for data in ({}, {"csrf_token": "wrong"}, {"csrf_token": token + "é"}):
            assert client.post(cancel, data=data).status_code == 403
        assert client.delete(f"/api/v1/runs/{run.id}").status_code == 403, "a cookie changes nothing without the token"
        assert client.get(f"/api/v1/runs/{run.id}").json()["status"] == "queued"
        assert client.post(cancel, data={"csrf_token": token}).status_code == 303
        assert client.get(f"/api/v1/runs/{run.id}").json()["status"] == "cancelled"
        drawn = client.post("/designs/flexible-rod/drawing?mode=design", data={"csrf_token": token})
        assert drawn.status_code == 200 and "csrf_token" not in drawn.text
        assert client.post("/logout", data={"csrf_token": token}).headers["location"] == "/login"
        assert client.get("/runs", headers=HTML).status_code == 303
    finally:
        client.cookies.clear()


def test_who_may_not_send_a_form_is_told_so_by_a_page(service):
    shown = service.client.post("/login", data={"key": service.key(Scope.READ)[0]})
    headers = {"Accept": "text/html", "Accept-Language": "uk", "Cookie": shown.headers["set-cookie"].split(";")[0]}
    for path in ("/designs/pin-profile", "/api/v1/checks/pin-profile"):
        answer = service.client.post(path, data={"name": "a pin"}, headers=headers)
        assert answer.status_code == 403
        if path.startswith("/api/"):
            assert answer.json()["title"] == "Beyond the key's scope"
        else:
            assert '<html lang="uk">' in answer.text and "потрібен ключ з правом design" in answer.text.lower()
    service.client.cookies.clear()


def test_a_login_leads_to_the_page_of_every_form(service):
    """Whose session has ended is redirected from the address that the form is sent to."""
    key, key_id = service.key(Scope.ADMIN)
    run = make_record(owner=key_id, status="queued", result=None)
    service.put([run])
    found = routes(service)
    fetched = ("/login", "/logout", "/designs/{slug}/drawing", "/designs/{slug}/answer")
    for path in {path for method, path in found if method == "POST" and not path.startswith("/api/")} - {*fetched}:
        assert ("GET", path) in found, path
        if path.startswith("/runs/"):
            answer = ask(service, "GET", filled(path, run.id), {**bearer(key), **HTML})
            assert answer.headers["location"] == f"/runs/{run.id}", path
    for path in ("/batches/sweep", "/batches/upload"):
        assert ask(service, "GET", path, {**bearer(key), **HTML}).headers["location"] == "/batches"


@pytest.mark.parametrize("place", ["https://evil.example", "//evil.example", "/\\evil.example", "/\tx", "evil"])
def test_the_login_redirects_only_within_the_service(service, place):
    key, _ = service.key(Scope.READ)
    answer = service.client.post("/login", data={"key": key, "next": place})
    service.client.cookies.clear()
    assert answer.headers["location"] == "/"
