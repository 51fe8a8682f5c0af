"""The swept outline against areas in closed form and against the links."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.designs.drawing import Layer
from app.designs.impact_linkage import swept
from app.designs.impact_linkage.part import part
from app.designs.impact_linkage.pictures import bar_of
from app.designs.impact_linkage.swept import outline, segments_of
from app.designs.kind import Mode
from app.designs.registry import KINDS

KIND = KINDS["impact-linkage"]


def area(places: np.ndarray) -> float:
    x, y = places.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def turned(angles: np.ndarray, length: float) -> np.ndarray:
    ends = length * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.stack([np.zeros_like(ends), ends], axis=1)


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e4])
def test_a_bar_at_rest_has_a_slot_as_outline(scale):
    found = outline(scale * np.array([[[0.0, 0.0], [4.0, 3.0]]]), 0.5 * scale)
    assert area(found) == pytest.approx(scale**2 * (5.0 * 1.0 + math.pi * 0.25), rel=1e-3)


def test_a_rotating_bar_sweeps_a_disc_and_an_oscillating_one_a_sector():
    full = outline(turned(np.linspace(0.0, 2.0 * math.pi, 721), 3.0), 0.5)
    assert area(full) == pytest.approx(math.pi * 3.5**2, rel=1e-3)
    swung = outline(turned(np.linspace(-0.4, 0.4, 241), 3.0), 0.5)
    # The area of the sector, of a strip along its edge, of the corners at the tip (together half a disc), and of the
    # part behind the pivot.
    exact = 0.5 * 9.0 * 0.8 + 0.5 * (2.0 * 3.0 + 0.8 * 3.0) + 0.25 * math.pi
    assert area(swung) == pytest.approx(exact, rel=2e-3)


def test_every_link_stays_inside_and_the_outline_is_inside_the_box():
    job = KIND.jobs[Mode.DESIGN]
    result = job.run(job.request.model_validate(KIND.example(Mode.DESIGN))).result
    lengths, eye = result["lengths_mm"], 6.0
    pins, joints = (lengths["crank"] * p for p in bar_of(result).joints(np.linspace(-math.pi, math.pi, 720)))
    segments = segments_of(pins, joints, lengths["base"])
    found = outline(segments, eye)
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    for place in found[::40]:
        off = place - start
        off -= np.clip(np.sum(off * way, axis=1) / np.sum(way * way, axis=1), 0.0, 1.0)[:, None] * way
        assert float(np.hypot(*off.T).min()) == pytest.approx(eye, rel=2e-4)
    turn = math.radians(result["box_mm"]["angle_deg"])
    along = found @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    sides = sorted(np.ptp(along, axis=0))
    wanted = sorted((result["box_mm"]["width"], result["box_mm"]["height"]))
    assert sides == pytest.approx(wanted, rel=1e-3)
    assert area(found) < wanted[0] * wanted[1]


def test_the_part_draws_it():
    job = KIND.jobs[Mode.DESIGN]
    request = job.request.model_validate(KIND.example(Mode.DESIGN))
    run = {
        "status": "succeeded", "mode": "design", "result": job.run(request).result,
        "spec": request.model_dump(mode="json"),
    }  # fmt: skip
    assert "the outline of what they sweep" in part(run).drawing.caption


def test_a_walk_that_does_not_close_gives_none_and_the_part_is_drawn_without_it(monkeypatch):
    segments = turned(np.linspace(0.0, 6.0, 100), 3.0)
    monkeypatch.setattr(swept, "_MAX_STEPS", 50)
    assert outline(segments, 0.5) is None
    job = KIND.jobs[Mode.CHECK]
    request = job.request.model_validate(KIND.example(Mode.CHECK))
    spec = request.model_dump(mode="json")
    drawing = part({"status": "succeeded", "mode": "check", "result": job.run(request).result, "spec": spec}).drawing
    assert drawing.shapes
    assert not any(shape.layer is Layer.HIDDEN for shape in drawing.shapes)
    assert "dashed" not in drawing.caption


@pytest.mark.parametrize("radius", [1e-3, 0.3, 3.0])
def test_the_few_near_segments_give_the_nearest_of_all(radius):
    rng = np.random.default_rng(17)
    segments = rng.normal(size=(400, 2, 2))
    few = swept._Near(segments, radius)
    place = np.array([4.0, 0.0])
    for _ in range(60):
        place = place + rng.normal(scale=0.4 * radius, size=2)
        start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
        share = np.clip(np.sum((place - start) * way, axis=1) / np.sum(way * way, axis=1), 0.0, 1.0)
        every = np.hypot(*(place - start - share[:, None] * way).T)
        assert few.nearest(place)[0] == pytest.approx(every.min(), rel=1e-12)
