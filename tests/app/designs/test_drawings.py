"""Drawings are to scale, match the request, and tolerate invalid requests."""

from __future__ import annotations

import copy
import math
from xml.etree import ElementTree

import pytest

from app.designs.drawing import Circle, Layer
from app.designs.kind import Mode
from app.designs.pictures.drawing_svg import drawing_svg
from app.designs.registry import KINDS

JOBS = [(kind.slug, mode) for kind in KINDS.values() for mode in kind.jobs]


def leaves(value, path=()):
    if isinstance(value, (dict, list)):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(inner, (*path, key))
    else:
        yield path


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_a_drawing_tolerates_any_value_anywhere(slug, mode):
    kind = KINDS[slug]
    example = kind.example(mode)
    paths = [path for path in leaves(example) if path[0] not in ("pressure", "name")]
    for path in paths:
        for wrong in (None, "", "text", -1.0, 0, 1e-300, 1e300, math.nan, True, [], {}):
            request = copy.deepcopy(example)
            holder = request
            for step in path[:-1]:
                holder = holder[step]
            holder[path[-1]] = wrong
            drawing = kind.drawing(request)
            if drawing is not None:
                assert "nan" not in drawing_svg(drawing)
    assert kind.drawing({}) is None


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_dimensions_match_their_length_and_the_svg_is_well_formed(slug, mode):
    drawing = KINDS[slug].drawing(KINDS[slug].example(mode))
    ElementTree.fromstring(drawing_svg(drawing))
    assert drawing.dimensions
    for dimension in drawing.dimensions:
        (x1, y1), (x2, y2) = dimension.start, dimension.end
        long = {"x": abs(x2 - x1), "y": abs(y2 - y1), "free": math.hypot(x2 - x1, y2 - y1)}[dimension.axis]
        if dimension.words.startswith("cg") or dimension.path == "pivot_distance_mm":
            continue
        assert long == pytest.approx(float(dimension.words.rpartition(" ")[2]), rel=2e-3)


def test_the_linkage_closes_as_drawn():
    request = KINDS["impact-linkage"].example(Mode.CHECK)
    request["lengths_mm"] = {"base": 60.0, "crank": 20.0, "coupler": 50.0, "rocker": 30.0}
    drawing = KINDS["impact-linkage"].drawing(request)
    ends = {d.words.partition(" ")[0]: d for d in drawing.dimensions}
    assert ends["crank"].end == ends["coupler"].start
    assert ends["rocker"].end == ends["coupler"].end
    assert ends["base"].path == "lengths_mm.base"
    assert any(isinstance(shape, Circle) and shape.layer is Layer.CENTER for shape in drawing.shapes)


def test_the_drawing_of_a_free_bushing_has_its_greatest_diameter():
    """It is neither at the end nor in the middle."""
    kind = KINDS["pin-profile"]
    request = kind.jobs[Mode.DESIGN].request.model_validate(
        {**kind.others(Mode.DESIGN)["a bushing"], "form": {"kind": "free"}}
    )
    answer = kind.jobs[Mode.DESIGN].solve(request)
    run = {"mode": "design", "status": answer.status, "result": answer.result, "spec": request.model_dump(mode="json")}
    drawing = kind.part(run, None).drawing
    greatest = max(float(point["outer_diameter_mm"]) for point in answer.result["profile"])
    sizes = [float(each.words.removeprefix("ø ")) for each in drawing.dimensions if each.words.startswith("ø ")]
    assert max(sizes) == pytest.approx(greatest, rel=1e-4)
    assert len(sizes) == 4  # end, middle, greatest, bore


@pytest.mark.parametrize(
    ("points", "sizes"),
    [
        ([(0, 10), (20, 13), (40, 11)], ["ø 10", "ø 11", "ø 13", "ø 21.99"]),
        ([(0, 10), (15, 10), (15, 14), (25, 14), (25, 11)], ["ø 10", "ø 10 × 15", "ø 11", "ø 14 × 25", "ø 21.99"]),
    ],
    ids=["cones", "steps, whose sizes stand at their lengths"],
)
def test_the_drawing_of_a_given_profile_has_its_greatest_bore(points, sizes):
    kind = KINDS["pin-profile"]
    given = kind.example(Mode.CHECK) | {"profile": [{"x_mm": x, "bore_mm": d} for x, d in points]}
    del given["bore_mm"]
    request = kind.jobs[Mode.CHECK].request.model_validate(given)
    answer = kind.jobs[Mode.CHECK].solve(request)
    run = {"mode": "check", "status": answer.status, "result": answer.result, "spec": request.model_dump(mode="json")}
    drawn = kind.part(run, None).drawing.dimensions
    assert sorted(each.words for each in drawn if each.words.startswith("ø ")) == sizes
