"""A rod's load from an indicator diagram, over HTTP."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

CHECKS, DESIGNS = "/api/v1/checks/flexible-rod", "/api/v1/designs/flexible-rod"
DYNAMICS = "/api/v1/analyses/crank-dynamics"
SWEPT = math.pi * 2.0**2 / 4 * 0.3
QUICK = {"effects": {"exclude": ["rod_inertia"]}, "accuracy": 1e-4}


def indicator() -> dict:
    volume = SWEPT * (2.0 + 0.5 * (1 - np.cos(np.linspace(0, math.pi, 25))))
    volume[0], volume[-1] = 2.0 * SWEPT, 3.0 * SWEPT
    squeezed = 1.6 * volume[-1] / volume
    pairs = [(volume, 1.05 * squeezed), (volume[::-1], squeezed[::-1])]
    strokes = [{"volume_cm3": v.tolist(), "pressure_mpa": p.tolist()} for v, p in pairs]
    return {"kind": "indicator", "clearance_volume_cm3": 2.0 * SWEPT, "strokes": strokes}


def test_the_pressures_are_those_that_crank_dynamics_unrolls(client, check_request):
    told = {**check_request, **QUICK, "load": {**indicator(), "back_pressure_mpa": 1.8}}
    run = client.post(CHECKS, json=told).json()
    assert run["status"] == "succeeded", run
    assert run["result"]["repairs"] == []
    dynamics = {
        "mechanism": check_request["mechanism"],
        "cylinder": {
            "bore_mm": 20.0, "clearance_volume_cm3": 2.0 * SWEPT, "crankcase_pressure_mpa": 1.8, "strokes": 2
        },
        "pressure": {k: v for k, v in indicator().items() if k != "clearance_volume_cm3"},
        "masses": {"piston_kg": 0.0, "rod_kg": 0.0, "rod_cg_from_pin_mm": 0.0},
    }  # fmt: skip
    source = client.post(DYNAMICS, json=dynamics).json()
    assert source["status"] == "succeeded", source
    area = math.pi * 20.0**2 / 4
    assert run["result"]["axial_force_max_n"] == pytest.approx((1.8 - 1.6) * area, rel=1e-4)
    assert -run["result"]["axial_force_min_n"] == pytest.approx(source["result"]["gas_force_max_n"], rel=1e-4)


def test_a_design_takes_the_diagram_too_and_records_repairs(client, design_request):
    told = indicator()
    first = told["strokes"][0]
    for column in first.values():
        column[3], column[4] = column[4], column[3]
    refused = client.post(DESIGNS, json={**design_request, "load": told})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/load/strokes/0/volume_cm3/4"
    run = client.post(DESIGNS, json={**design_request, **QUICK, "load": {**told, "repair": True}}).json()
    assert run["status"] in ("succeeded", "infeasible"), run
    expected = [{"pointer": "/load/strokes/0/volume_cm3/4", "what": "points sorted by volume"}]
    assert run["result"]["repairs"] == expected


def test_four_strokes_are_refused_with_the_reason(client, check_request):
    load = indicator()
    load["strokes"] = load["strokes"] * 2
    for repair in (False, True):
        refused = client.post(CHECKS, json={**check_request, "load": {**load, "repair": repair}})
        assert refused.status_code == 422
        (entry,) = refused.json()["errors"]
        assert entry["pointer"] == "/load/strokes"
        assert "one turn" in entry["detail"]


def test_faults_are_named_in_the_units_and_names_that_were_sent(client, check_request):
    outside = copy.deepcopy(indicator())
    outside["strokes"][1]["volume_cm3"][0] = 9.0 * SWEPT
    short = copy.deepcopy(indicator())
    short["strokes"][0]["pressure_mpa"].pop()
    for load, pointer in ((outside, "/load/strokes/1/volume_cm3/0"), (short, "/load/strokes/0/pressure_mpa")):
        refused = client.post(CHECKS, json={**check_request, "load": load})
        assert refused.status_code == 422
        assert [e["pointer"] for e in refused.json()["errors"]] == [pointer]


def test_the_documents_example_is_answered(client, check_request):
    (example,) = client.app.openapi()["components"]["schemas"]["IndicatorLoad"]["examples"]
    run = client.post(CHECKS, json={**check_request, **QUICK, "load": example}).json()
    assert run["status"] == "succeeded", run
