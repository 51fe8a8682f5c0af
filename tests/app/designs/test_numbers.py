"""Numbers of requests: nothing else is taken for one."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator
from functools import reduce
from operator import getitem

import pytest
from pydantic import BaseModel, ValidationError

from app.designs.kind import Mode
from app.designs.refusals import summarize
from app.designs.registry import KINDS

JOBS = [(slug, mode) for slug, kind in KINDS.items() for mode in kind.jobs if mode is not Mode.ACCURACY]


def leaves(value, path=()) -> Iterator[tuple]:
    """The paths of what a JSON value consists of; of a list only the first three."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from leaves(part, (*path, name))
    elif isinstance(value, list):
        for k, part in enumerate(value[:3]):
            yield from leaves(part, (*path, k))
    else:
        yield path


def numbers(value) -> Iterator[tuple]:
    """The paths of all numbers."""
    for path in leaves(value):
        found = reduce(getitem, path, value)
        if isinstance(found, (int, float)) and not isinstance(found, bool):
            yield path


def changed(body, path, value):
    body = copy.deepcopy(body)
    inner = body
    for name in path[:-1]:
        inner = inner[name]
    inner[path[-1]] = value
    return body


def accepted(model: type[BaseModel], body) -> bool:
    try:
        model.model_validate_json(json.dumps(body))
    except ValidationError:
        return False
    return True


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_a_number_is_a_number(slug, mode):
    kind = KINDS[slug]
    model = kind.jobs[mode].request
    for example in (kind.example(mode), *kind.others(mode).values()):
        whole = model.model_validate(example).model_dump(mode="json")
        assert accepted(model, whole)
        paths = list(numbers(whole))
        assert paths
        for path in paths:
            for value in (True, False, "1", {}, float("nan"), float("inf")):
                assert not accepted(model, changed(whole, path, value)), (path, value)


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_a_value_of_another_type_is_told_what_is_allowed(slug, mode):
    kind = KINDS[slug]
    model = kind.jobs[mode].request
    for example in (kind.example(mode), *kind.others(mode).values()):
        whole = model.model_validate(example).model_dump(mode="json")
        for path in leaves(whole):
            for value in (True, 7, 1.5, "\0", None, [], {}):
                try:
                    model.model_validate_json(json.dumps(changed(whole, path, value)))
                except ValidationError as error:
                    _, entries = summarize(error.errors(), 0, model)
                    for entry in entries:
                        assert entry["allowed"] != "see the contract", entry
                        assert not entry["detail"].startswith("Input"), entry


@pytest.mark.parametrize(
    ("path", "value", "allowed"),
    [
        (("limits", "min_wall_mm"), -1.0, "at least 0"),
        (("geometry", "boss_length_mm"), 0.0, "at least 1e-6"),
        (("geometry", "boss_length_mm"), 1e7, "at most 1000000"),
        (("load", "force_n"), 1e13, "at most 1e12"),
    ],
)
def test_limits_are_written_plainly(path, value, allowed):
    kind = KINDS["pin-profile"]
    model = kind.jobs[Mode.DESIGN].request
    with pytest.raises(ValidationError) as refused:
        model.model_validate(changed(kind.example(Mode.DESIGN), path, value))
    assert summarize(refused.value.errors(), 0, model)[1][0]["allowed"] == allowed


@pytest.mark.parametrize(
    ("slug", "mode", "path"),
    [
        ("crank-dynamics", Mode.ANALYSIS, ("masses", "rods_per_pin")),
        ("crank-dynamics", Mode.ANALYSIS, ("cylinder", "strokes")),
        ("crank-dynamics", Mode.ANALYSIS, ("series_angles",)),
    ],
)
def test_a_whole_number_has_no_fraction(slug, mode, path):
    kind = KINDS[slug]
    model = kind.jobs[mode].request
    whole = model.model_validate(kind.example(mode)).model_dump(mode="json")
    assert not accepted(model, changed(whole, path, 2.5))


def answered(slug, mode, **changes):
    job = KINDS[slug].jobs[mode]
    return job.run(job.request.model_validate({**KINDS[slug].example(mode), **changes}))


@pytest.mark.parametrize(
    "form", [{"kind": "free"}, {"kind": "drillable"}, {"kind": "constant"}, {"kind": "stepped", "steps": 3}]
)
def test_a_bushing_with_hardly_a_bore_is_a_shaft(form):
    example = KINDS["pin-profile"].example(Mode.DESIGN)
    outside = {"variable": "outer", "form": form, "geometry": {**example["geometry"], "outer_diameter_mm": None}}
    shaft, tiny, small = (answered("pin-profile", Mode.DESIGN, **outside, bore_mm=bore) for bore in (0.0, 1e-300, 1e-9))
    assert tiny.result == shaft.result
    assert small.result["mass_g"] == pytest.approx(shaft.result["mass_g"], rel=1e-6)


@pytest.mark.parametrize(("mode", "given"), [(Mode.CHECK, {}), (Mode.DESIGN, {"form": {"kind": "double_cone"}})])
def test_a_force_whose_stresses_underflow_is_none(mode, given):
    none, tiny = (answered("pin-profile", mode, **given, load={"force_n": force}) for force in (0.0, 5e-324))
    assert tiny.result == none.result


def test_an_amplitude_is_not_as_uncertain_as_a_right_angle():
    """Samples beyond a half turn, where the period is not finite, made the uncertainties no numbers."""
    example = KINDS["crank-masses"].example(Mode.ANALYSIS)
    result = answered(
        "crank-masses", Mode.ANALYSIS, uncertainty={**example["uncertainty"], "amplitude_deg": 15.0}
    ).result
    assert all(math.isfinite(value) for name, value in result.items() if name.endswith("_u") and value is not None)
    with pytest.raises(ValidationError, match="less than or equal to 15"):
        answered("crank-masses", Mode.ANALYSIS, uncertainty={"amplitude_deg": 45.0})
