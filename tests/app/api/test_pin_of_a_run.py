"""A pin whose force is that of a stored crank-dynamics run."""

from __future__ import annotations

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS

PIN = KINDS["pin-profile"]
PATHS = {Mode.CHECK: "/api/v1/checks/pin-profile", Mode.DESIGN: "/api/v1/designs/pin-profile"}


@pytest.fixture
def source(client) -> dict:
    return client.post("/api/v1/analyses/crank-dynamics", json=KINDS["crank-dynamics"].example(Mode.ANALYSIS)).json()


def force_of(source: dict, instant: str) -> float:
    return next(worst["force_n"] for worst in source["result"]["worst"] if worst["name"] == instant)


def strong(mode: Mode) -> dict:
    """The example in a steel that carries the example engine's force."""
    request = PIN.example(mode)
    request["material"]["allowable_stress_mpa"] = 600.0
    request["limits"]["max_ring_stress_mpa"] = None
    return request


def of_run(mode: Mode, run_id: str, **more: str) -> dict:
    return {**strong(mode), "load": {"kind": "run", "run_id": run_id, **more}}


@pytest.mark.parametrize("mode", PATHS)
def test_a_pins_force_may_be_a_stored_runs(client, source, mode):
    force = force_of(source, "wrist_pin_load_max")
    run = client.post(PATHS[mode], json=of_run(mode, source["id"])).json()
    assert run["status"] == "succeeded", run
    assert run["spec"]["load"] == {
        "kind": "run",
        "run_id": source["id"],
        "instant": "wrist_pin_load_max",
        "force_n": force,
        "taken_from": f"crank-dynamics {source['spec_hash']}",
    }
    told = client.post(PATHS[mode], json={**strong(mode), "load": {"force_n": force}}).json()
    assert run["result"] == told["result"]
    # The stored request can be sent again as it is, drawn, and studied.
    assert client.post(PATHS[mode], json=run["spec"]).json()["result"] == run["result"]
    for plot in PIN.plots:
        assert client.get(f"/api/v1/runs/{run['id']}/plots/{plot}").status_code == 200
    assert client.get(f"/runs/{run['id']}").status_code == 200
    study = client.post(
        "/api/v1/accuracy/pin-profile", json={"spec": of_run(mode, source["id"]), "time_budget_s": 0.1}
    ).json()
    assert study["spec"]["spec"]["load"]["force_n"] == force


def test_another_instant_and_a_bushing(client, source):
    force = force_of(source, "rod_tension_max")
    request = of_run(Mode.DESIGN, source["id"], instant="rod_tension_max") | {"variable": "outer", "bore_mm": 14}
    del request["geometry"]["outer_diameter_mm"]
    run = client.post(PATHS[Mode.DESIGN], json=request).json()
    assert run["spec"]["load"]["force_n"] == force
    told = client.post(PATHS[Mode.DESIGN], json={**request, "load": {"force_n": force}}).json()
    assert run["result"] == told["result"]


def test_unsuitable_runs_are_refused_with_their_location(client, source):
    pin = client.post(PATHS[Mode.CHECK], json=PIN.example(Mode.CHECK)).json()["id"]
    for run_id, words in ((pin, "pin-profile"), ("none", "no run has this id")):
        refused = client.post(PATHS[Mode.CHECK], json=of_run(Mode.CHECK, run_id))
        assert refused.status_code == 422
        (entry,) = refused.json()["errors"]
        assert entry["pointer"] == "/load/run_id"
        assert words in entry["detail"]
    for load, pointer in (
        ({}, "/load/force_n"),
        ({"force_n": -1}, "/load/force_n"),
        ({"kind": "run"}, "/load/run_id"),
        ({"run_id": source["id"]}, "/load/kind"),
        ({"kind": "runs", "run_id": source["id"]}, "/load/kind"),
    ):
        refused = client.post(PATHS[Mode.CHECK], json={**PIN.example(Mode.CHECK), "load": load})
        assert [e["pointer"] for e in refused.json()["errors"]] == [pointer]
