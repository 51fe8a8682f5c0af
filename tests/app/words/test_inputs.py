"""Inputs of a run as texts, and what differs between two runs."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of
from app.web.forms.tree import form_of
from app.words.inputs import differing, groups
from app.words.units import System, measuring


def run_of(kind: str, mode: Mode, spec: dict[str, Any]) -> dict[str, Any]:
    """A stored run as far as its inputs are concerned."""
    request = job_of(KINDS[kind], mode).request.model_validate(spec)
    return {"kind": kind, "mode": mode, "spec": request.model_dump(mode="json")}


def texts(run: dict[str, Any]) -> dict[str, str]:
    return {each.name: each.text for group in groups(run) for each in group.inputs}


def beside(a: dict[str, Any], b: dict[str, Any]) -> dict[str, tuple[str, str]]:
    return {each.name: (left, right) for each, left, right in differing(a, b)}


def test_a_list_of_two_items_is_no_range():
    rod = {**KINDS["flexible-rod"].example(Mode.DESIGN), "stock_h_mm": [0.4, 0.5]}
    shown = texts(run_of("flexible-rod", Mode.DESIGN, rod))
    low, high = rod["bounds"]["b_mm"]
    assert (shown["stock_h_mm"], shown["bounds.b_mm"]) == ("0.4, 0.5 mm", f"{low:g} … {high:g} mm")
    linkage = KINDS["impact-linkage"].example(Mode.DESIGN)
    assert texts(run_of("impact-linkage", Mode.DESIGN, linkage))["limits.transmission_angle_deg"] == "40 … 140°"


def test_figures_of_a_steel_are_in_the_units_of_the_page():
    spec = {**KINDS["flexible-rod"].example(Mode.CHECK), "material": {"name": "spring-steel-1.1274"}}
    with measuring(System.INCH):
        steel = texts(run_of("flexible-rod", Mode.CHECK, spec))["material.name"]
        form = form_of(KINDS["flexible-rod"], Mode.CHECK)
    assert steel == "spring steel 1.1274: E 29.88 Msi, fatigue limit 89923 psi, yield 210305 psi"
    assert steel in [words for each in form.every() for words in getattr(each, "options", {}).values()]


def test_points_of_a_long_table_that_differ_are_named():
    spec = KINDS["crank-dynamics"].others(Mode.ANALYSIS)["one cylinder of two strokes, pressures from a table"]
    other = copy.deepcopy(spec)
    pressures = other["pressure"]["pressure_mpa"]
    pressures[6] = 1.5
    pressures[-1] *= 1.0 + 1e-12
    first = spec["pressure"]["pressure_mpa"]
    a, b = (run_of("crank-dynamics", Mode.ANALYSIS, each) for each in (spec, other))
    place = len(pressures)
    assert beside(a, b) == {
        "pressure.pressure_mpa": (
            f"value 7: {first[6]:.10g}, value {place}: {first[-1]!r} MPa",
            f"value 7: 1.5, value {place}: {pressures[-1]!r} MPa",
        )
    }
    assert beside(a, a) == {}
    every = {**other["pressure"], "pressure_mpa": [first[0], *(1.01 * each for each in first[1:-1]), first[-1]]}
    told = beside(a, run_of("crank-dynamics", Mode.ANALYSIS, {**spec, "pressure": every}))
    assert told["pressure.pressure_mpa"][0].endswith(f"value 7: {first[6]:.10g} MPa, …")


@pytest.mark.parametrize(("units", "share"), [(System.METRIC, 1e-12), (System.INCH, 1e-8)])
def test_values_that_rounding_would_make_equal_are_told_apart(units, share):
    spec = KINDS["pin-profile"].example(Mode.CHECK)
    other = {**spec, "bore_mm": spec["bore_mm"] * (1.0 + share)}
    with measuring(units):
        a, b = beside(*(run_of("pin-profile", Mode.CHECK, each) for each in (spec, other)))["bore_mm"]
    assert a != b
    assert {text.rpartition(" ")[2] for text in (a, b)} == {"mm" if units is System.METRIC else "in"}


def test_what_only_one_run_has_is_not_given_in_the_other():
    spec = KINDS["pin-profile"].example(Mode.CHECK)
    other = {**spec, "limits": {**spec["limits"], "max_slope": 0.001}}
    told = beside(*(run_of("pin-profile", Mode.CHECK, each) for each in (spec, other)))
    assert told["limits.max_slope"] == ("not given", "0.001")
