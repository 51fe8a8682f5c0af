"""Plots agree with the results."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from app.designs.crank_dynamics.pictures import indicator_diagram
from app.designs.flexible_rod.cycle_pictures import _fibres, _turn
from app.designs.flexible_rod.feasible_region import feasible_region
from app.designs.flexible_rod.pictures import stability_map
from app.designs.kind import Mode
from app.designs.pictures.chart import BLUE
from app.designs.pictures.contours import inside, level_lines
from app.designs.registry import KINDS


def run_of(slug: str, mode: Mode, **other: object) -> dict:
    kind = KINDS[slug]
    request = kind.jobs[mode].request.model_validate({**kind.example(mode), **other})
    answer = kind.jobs[mode].run(request)
    return {"mode": mode, "spec": request.model_dump(mode="json"), "result": answer.result, "effects": answer.effects}


def test_the_plotted_stresses_match_the_check():
    run = run_of("flexible-rod", Mode.CHECK)
    _, turn = _turn(run)
    result = run["result"]
    fibre = _fibres(turn, np.array([1e-3 * result["worst_section_mm"]]))[(1 - result["worst_fibre"]) // 2][0]
    assert 0.5 * (fibre.max() - fibre.min()) == pytest.approx(result["stress_amplitude_mpa"], rel=1e-4)
    assert 0.5 * (fibre.max() + fibre.min()) == pytest.approx(result["stress_mean_mpa"], rel=1e-4)
    assert turn.force.min() == pytest.approx(result["axial_force_min_n"], rel=1e-4)
    # Drawn at whole degrees, between which the greatest may lie.
    assert np.abs(turn.side_force()).max() == pytest.approx(result["side_force_max_n"], rel=1e-3)


@pytest.mark.parametrize("h_mm", np.arange(0.2, 0.5, 0.02))
def test_the_word_beside_the_buckling_boundary_is_not_under_the_strips(h_mm):
    run = run_of("flexible-rod", Mode.CHECK, dimensions={"b_mm": 9, "h_mm": float(h_mm), "l_mm": 23})
    lines = re.findall(r'<text x="[\d.]+" y="([\d.]+)"[^>]*>(buckles|n = [\d.]+)<', stability_map(run))
    (first, _), (second, _) = lines
    assert {text.split()[0] for _, text in lines} == {"buckles", "n"}
    assert abs(float(first) - float(second)) > 12


def test_the_indicator_diagram_has_the_volumes_of_the_cylinder():
    run = run_of("crank-dynamics", Mode.ANALYSIS)
    cylinder, stroke = run["spec"]["cylinder"], run["result"]["stroke_mm"]
    swept = 1e-3 * 0.25 * math.pi * cylinder["bore_mm"] ** 2 * stroke
    path = indicator_diagram(run).rpartition(' d="M')[2].partition('"')[0]
    across = [float(point.split(",")[0]) for point in path.split("L")]
    # The axis reaches from below zero to beyond the greatest volume, a sixteenth more on either side.
    most = cylinder["clearance_volume_cm3"] + swept
    place = lambda volume: 70 + 390 * (volume + 0.06 * most) / (1.12 * most)  # noqa: E731
    assert min(across) == pytest.approx(place(cylinder["clearance_volume_cm3"]), abs=0.1)
    assert max(across) == pytest.approx(place(most), abs=0.1)


def test_regions_and_their_lines_are_those_of_a_circle():
    x, y = np.meshgrid(np.linspace(-2.0, 2.0, 81), np.linspace(-2.0, 2.0, 81))
    values = 1.0 - np.hypot(x, y)

    def area(xs, ys):
        return 0.5 * abs(np.dot(xs, np.roll(ys, 1)) - np.dot(ys, np.roll(xs, 1)))

    assert sum(area(*polygon) for polygon in inside(x, y, values)) == pytest.approx(math.pi, rel=2e-3)
    (line,) = level_lines(x, y, values)
    assert np.allclose(np.hypot(*line), 1.0, atol=1e-3)
    assert (line[0][0], line[1][0]) == (line[0][-1], line[1][-1])
    values[40, 40:] = np.nan
    (open_line,) = level_lines(x, y, values)
    assert len(open_line[0]) < len(line[0])


@pytest.mark.parametrize("longest", [45.5, 100.0])
def test_the_region_is_drawn_where_the_strip_is_as_long_as_the_rod(longest):
    bounds = {"b_mm": [4, 9], "h_mm": [0.2, 3], "l_mm": [45.5, longest]}
    run = run_of("flexible-rod", Mode.DESIGN, bounds=bounds, requirements={"min_stability_safety": 1.8})
    assert run["result"]["dimensions"]["l_mm"] == pytest.approx(45.5)
    assert "the design" in feasible_region(run)


@pytest.mark.parametrize("name", ["serensen", "goodman", "soderberg", "fkm"])
def test_the_fatigue_line_of_the_region_is_that_of_the_criterion(name):
    """A strip that has just the fatigue safety required lies on the line, whatever the criterion."""
    kind = KINDS["flexible-rod"]
    material = {"name": "spring-steel-1.1274"}
    dimensions = {"b_mm": 9.0, "h_mm": 0.46, "l_mm": 23.0}
    check = kind.example(Mode.CHECK) | {"material": material, "fatigue_criterion": name, "dimensions": dimensions}
    own = kind.jobs[Mode.CHECK].run(kind.jobs[Mode.CHECK].request.model_validate(check))
    safety = own.result["fatigue_safety"]
    spec = kind.jobs[Mode.DESIGN].request.model_validate(
        kind.example(Mode.DESIGN)
        | {
            "material": material,
            "fatigue_criterion": name,
            "requirements": {"min_fatigue_safety": safety, "min_stability_safety": 1.0},
        }
    )
    result = {"dimensions": dimensions, "objective": "mass"}
    run = {"mode": "design", "spec": spec.model_dump(mode="json"), "result": result, "effects": own.effects}
    svg = feasible_region(run)
    # Behind the dots of the legend.
    mark = [float(value) for value in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="5"', svg)[-1]]
    lines = re.findall(rf'<path d="M([^"]*)" fill="none" stroke="{BLUE}"', svg)
    points = [np.array([[float(v) for v in p.split(",")] for p in line.split("L")]) for line in lines]
    gaps = [_distance(line, np.array(mark)) for line in points]
    assert min(gaps) < 2.0, "two of some five hundred units of the picture"


def _distance(line, place):
    """Of a place from a line of straight pieces."""
    start, way = line[:-1], np.diff(line, axis=0)
    along = np.clip(((place - start) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(start + along[:, None] * way - place).T).min())
