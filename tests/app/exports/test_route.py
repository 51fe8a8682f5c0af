"""The route of exports: file names, waiting, and every way to be refused."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import pytest

from app.exports import registry
from app.exports.export import Export, ExportProcess, Tool


def stored(client, request, path="/api/v1/checks/flexible-rod"):
    answer = client.post(path, json=request)
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.fixture
def run(client, check_request):
    return stored(client, check_request)


def test_every_link_is_a_file_named_by_kind_and_id(client, run):
    assert "json" in run["links"]["exports"]
    for link in run["links"]["exports"].values():
        assert link.startswith(f"/api/v1/runs/{run['id']}/exports/")
    got = client.get(run["links"]["exports"]["json"])
    assert got.headers["content-disposition"] == f'attachment; filename="flexible-rod-{run["id"]}.json"'
    assert json.loads(got.content)["result"] == run["result"]


def test_no_two_files_of_a_run_have_the_same_name(client, run):
    links = run["links"]["exports"]
    asked = [links["csv"], links["json"], *(f"{links['parameters']}?for={tool}" for tool in Tool)]
    names = [client.get(link).headers["content-disposition"] for link in asked]
    assert len(set(names)) == len(names)
    assert f'"flexible-rod-{run["id"]}-parameters-fusion.csv"' in "".join(names)


def test_the_page_offers_them(client, run):
    page = client.get(run["links"]["page"]).text
    for name, link in run["links"]["exports"].items():
        assert f'href="{link}' in page, name


def test_no_such_run_or_export(client, run):
    assert client.get("/api/v1/runs/nothing/exports/json").status_code == 404
    refused = client.get(f"/api/v1/runs/{run['id']}/exports/dwg")
    assert refused.status_code == 404
    assert "json" in refused.json()["detail"]


def test_a_run_without_a_result_has_none(client, design_request):
    # A study takes seconds, so it is cancelled before it ends.
    study = {"spec": {**design_request, "name": "to be given up"}, "study_budget_s": 8.0}
    queued = client.post("/api/v1/accuracy/flexible-rod", json=study, headers={"Prefer": "respond-async"}).json()
    client.delete(queued["links"]["self"])
    ended = client.get(queued["links"]["self"]).json()
    assert ended["result"] is None
    assert ended["links"]["exports"] == {}
    refused = client.get(f"{queued['links']['self']}/exports/json")
    assert refused.status_code == 409
    assert refused.headers["content-type"] == "application/problem+json"


def slow(_kind, _run, _options):
    return b"made at last"


def test_what_the_installation_lacks_is_named(client, run, monkeypatch):
    lacking = Export("odd", "Odd: one", "text/plain", "odd", slow, module="no_such_module_at_all", extra="oddities")
    monkeypatch.setitem(registry.EXPORTS, "odd", lacking)
    refused = client.get(f"/api/v1/runs/{run['id']}/exports/odd")
    assert refused.status_code == 501
    assert "crankwright[oddities]" in refused.json()["detail"]


def test_a_slow_file_is_promised_then_there(client, run, monkeypatch):
    """The file is made in a worker, which has a registry of its own; so the format is a real one, and only the waiting
    time is changed."""
    monkeypatch.setattr("app.run_exports.WAIT_S", 0.0)
    in_a_worker = replace(registry.EXPORTS["json"], where=ExportProcess.WORKER)
    monkeypatch.setitem(registry.EXPORTS, "json", in_a_worker)
    first = client.get(f"/api/v1/runs/{run['id']}/exports/json")
    assert first.status_code == 202
    assert float(first.headers["retry-after"]) > 0
    end = time.monotonic() + 30
    while (answer := client.get(f"/api/v1/runs/{run['id']}/exports/json")).status_code == 202:
        assert time.monotonic() < end
        time.sleep(0.05)
    assert answer.status_code == 200
    assert answer.json()["id"] == run["id"]
    browser = client.get(f"/api/v1/runs/{run['id']}/exports/json?angle_deg=1", headers={"Accept": "text/html"})
    assert browser.status_code == 202
    assert "refresh" in browser.headers
    assert "The file is being made" in browser.text and f'href="/runs/{run["id"]}"' in browser.text
    # With this attribute a browser asks for any media type and saves the promise as the file.
    assert " download>" not in client.get(f"/runs/{run['id']}").text


def test_the_page_that_promises_a_file_is_in_the_readers_language(client, run, monkeypatch):
    monkeypatch.setattr("app.run_exports.WAIT_S", 0.0)
    monkeypatch.setitem(registry.EXPORTS, "json", replace(registry.EXPORTS["json"], where=ExportProcess.WORKER))
    for code, said in (("uk", "Файл створюється"), ("ru", "Файл создаётся")):
        headers = {"Accept": "text/html", "Accept-Language": code}
        page = client.get(f"/api/v1/runs/{run['id']}/exports/json?angle_deg={len(code)}{ord(code[0])}", headers=headers)
        assert page.status_code == 202
        assert f'<html lang="{code}">' in page.text and said in page.text


def test_angles_are_numbers_and_tools_are_known(client, run):
    for query in ("angle_deg=nan", "angle_deg=1e9", "for=paintbrush"):
        refused = client.get(f"/api/v1/runs/{run['id']}/exports/json?{query}")
        assert refused.status_code == 422, query
        assert refused.json()["errors"]
