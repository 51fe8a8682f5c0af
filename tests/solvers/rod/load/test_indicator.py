"""An indicator diagram as a rod's load, against the same pressures worked out otherwise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from solvers import rod
from solvers.crank import IndicatorPressure, Stroke
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.materials import Material

MECHANISM, PISTON = rod.Mechanism(1.5e-3, 45.5e-3, 50.0), rod.Piston(20e-3, 27e-3, friction_coefficient=0.15)
SWEPT = math.pi * 0.02**2 / 4 * 3e-3
CLEARANCE = 1.5 * SWEPT
VOLUME = CLEARANCE + SWEPT * 0.5 * (1 - np.cos(np.linspace(0, math.pi, 25)))
COMPRESSION = 1.4e6 * VOLUME[-1] / VOLUME


def diagram(lift: float = 1.1, strokes: int = 2) -> IndicatorPressure:
    down = Stroke(tuple(VOLUME.tolist()), tuple((lift * COMPRESSION).tolist()))
    up = Stroke(tuple(VOLUME[::-1].tolist()), tuple(COMPRESSION[::-1].tolist()))
    return IndicatorPressure((down, up) * (strokes // 2))


def load(lift: float = 1.1, **parts: object) -> rod.IndicatorLoad:
    return rod.IndicatorLoad(diagram(lift), CLEARANCE, MECHANISM, PISTON, **parts)


def expected(angle: float, lift: float = 1.1) -> float:
    r, length = MECHANISM.crank_radius, MECHANISM.rod_length
    x = r + length - r * math.cos(angle) - math.sqrt(length**2 - (r * math.sin(angle)) ** 2)
    pressure = float(PchipInterpolator(VOLUME, COMPRESSION)(min(CLEARANCE + PISTON.area * x, VOLUME[-1])))
    return (lift if angle % (2 * math.pi) < math.pi else 1.0) * pressure


def test_the_pressure_is_the_diagrams_at_the_volume_of_the_angle():
    angle = np.linspace(0.01, 6.27, 203)
    assert load().pressure(angle) == pytest.approx([expected(a) for a in angle], rel=1e-11)
    assert load().pressure(angle - 2 * math.pi) == pytest.approx(load().pressure(angle), rel=1e-11)


def test_behind_the_piston_stands_the_mean_of_the_cycle_or_what_was_given():
    parts = [quad(expected, a, b, epsabs=0, epsrel=1e-11, limit=400)[0] for a, b in ((0, math.pi), (math.pi, 6.283185))]
    assert load().reference_pressure() == pytest.approx(sum(parts) / (2 * math.pi), rel=1e-6)
    assert load(back_pressure=2e6).reference_pressure() == 2e6


@pytest.mark.parametrize(("centre", "at"), [(0.0, 0), (math.pi, -1)])
def test_a_step_at_a_dead_centre_reaches_both_limits_and_passes_none(centre, at):
    around = load().pressure(centre + np.linspace(-3e-6, 3e-6, 601))
    low, high = COMPRESSION[at], 1.1 * COMPRESSION[at]
    assert (around.min(), around.max()) == pytest.approx((low, high), rel=1e-10)
    assert np.all(np.diff(around) * (1 if at == 0 else -1) >= -1e-9 * high)


def test_no_step_where_the_strokes_meet():
    around = load(lift=1.0).pressure(np.linspace(-3e-6, 3e-6, 601))
    assert around == pytest.approx(np.full(601, COMPRESSION[0]), rel=1e-10)


def test_the_check_finds_the_limits_beside_the_steps():
    material = Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0)
    scene = rod.Scene(MECHANISM, PISTON, load(), material)
    at_rest = EffectSelection(exclude=frozenset({"rod_inertia", "friction_feedback"}))
    found = rod.check(scene, rod.Dimensions(9e-3, 0.46e-3, 23e-3), at_rest)
    back, area = scene.load.reference_pressure(), PISTON.area
    assert found.value.axial_force_min == pytest.approx(-(1.1 * COMPRESSION[0] - back) * area, rel=1e-6)
    assert found.value.axial_force_max == pytest.approx(-(COMPRESSION[-1] - back) * area, rel=1e-6)
    assert found.accuracy.estimated <= 1e-6


def test_a_diagram_of_four_strokes_is_no_load_of_a_rod():
    with pytest.raises(InvalidInput, match="a flexible rod's cycle is one turn") as refused:
        rod.IndicatorLoad(diagram(strokes=4), CLEARANCE, MECHANISM, PISTON)
    assert refused.value.field == "load.strokes"


def test_points_with_a_fault_are_refused_under_the_loads_own_names():
    with pytest.raises(InvalidInput) as refused:
        rod.IndicatorLoad(diagram(), 2 * CLEARANCE, MECHANISM, PISTON)
    assert refused.value.field.startswith("load.strokes.0.volume.")
