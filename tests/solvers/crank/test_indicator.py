"""Unrolling indicator diagrams, and data as users have it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from solvers import crank
from solvers.crank.motion import slider_crank as kinematics
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import InvalidInput
from tests.solvers.crank.cycles import GAMMA, four_stroke
from tests.solvers.crank.machines import CAR, CYLINDER, car, cooler, diagram

SWEPT = CYLINDER.area * 0.08
LOW = CYLINDER.clearance_volume


def test_pressures_follow_the_stroke_that_the_angle_belongs_to():
    curve = diagram().unroll(CAR.motion, CYLINDER)
    for index, (volume, pressure) in enumerate(four_stroke(CAR, CYLINDER, 900.0)):
        angle = index * math.pi + np.linspace(0.05, 3.09, 9)
        v = LOW + CYLINDER.area * CAR.motion.displacement(angle)
        order = np.argsort(volume)
        expected = PchipInterpolator(volume[order], pressure[order])(np.clip(v, volume.min(), volume.max()))
        assert curve.pressure(angle) == pytest.approx(expected, rel=1e-13)
        assert curve.pressure(angle + 4 * math.pi) == pytest.approx(expected, rel=1e-9)
        assert curve.pressure(angle - 8 * math.pi) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.004, -0.004])
def test_breaks_are_the_angles_of_the_points(offset):
    motion = ExactMotion(0.04, 0.14, offset)
    swept = CYLINDER.area * motion.stroke
    along = LOW + swept * np.linspace(0, 1, 7)
    strokes = tuple(crank.Stroke(tuple(along), tuple(np.linspace(1e5, 2e5, 7))) for _ in range(4))
    curve = crank.IndicatorPressure(strokes).unroll(motion, CYLINDER)
    assert curve.breaks.size == pytest.approx(25, abs=4)  # a point in a dead centre may stand twice, rounded
    volumes = LOW + CYLINDER.area * motion.displacement(curve.breaks)
    assert np.max(np.min(np.abs(volumes[:, None] - along), axis=1)) < 1e-12 * swept


def test_jumps_at_the_dead_centres_are_told():
    jumps = dict(diagram().unroll(CAR.motion, CYLINDER).jumps)
    assert jumps[0.0] == pytest.approx(0.09e6 - 0.11e6)
    assert jumps[2 * math.pi] == pytest.approx(0.0, abs=1e-6)
    assert jumps[3 * math.pi] < -1e5


def test_an_otto_cycle_has_the_work_of_the_textbook():
    """Isochoric jumps at both dead centres, isentropes between: W = (1 - eps^(1-gamma)) Q."""
    ratio = (LOW + SWEPT) / LOW
    volume = LOW * ratio ** np.linspace(0, 1, 400)
    squeezed = 0.1e6 * ((LOW + SWEPT) / volume) ** GAMMA
    fired = squeezed + 2e6 * (LOW / volume) ** GAMMA
    flat = np.full_like(volume, 0.1e6)
    strokes = tuple(crank.Stroke(tuple(volume), tuple(p)) for p in (flat, squeezed, fired, flat))
    found = crank.analyse(car(pressure=crank.IndicatorPressure(strokes))).value
    heat = 2e6 * LOW / (GAMMA - 1)
    assert found.indicated_power / 25.0 == pytest.approx((1 - ratio ** (1 - GAMMA)) * heat, rel=1e-6)
    assert dict(found.cycle.curve.jumps)[2 * math.pi] == pytest.approx(2e6, rel=1e-9)


def test_brix_unrolling_differs_by_what_the_curve_falls_in_the_error_of_the_displacement():
    exact = diagram().unroll(CAR.motion, CYLINDER)
    angle = np.linspace(0, 4 * math.pi, 2000)[:-1]
    volumes = LOW + CYLINDER.area * kinematics.brix_displacement(angle, 0.04, 0.14)
    brix = np.empty_like(angle)
    for index, (volume, pressure) in enumerate(four_stroke(CAR, CYLINDER, 900.0)):
        order, here = np.argsort(volume), angle // math.pi == index
        inside = np.clip(volumes[here], volume.min(), volume.max())
        brix[here] = PchipInterpolator(volume[order], pressure[order])(inside)
    assert exact.pressure(angle, brix=True) == pytest.approx(brix, rel=1e-13)
    found = crank.analyse(car()).value.brix_pressure_error
    assert found == pytest.approx(np.max(np.abs(exact.pressure(angle) - brix)), rel=1e-3)
    assert kinematics.brix_error(0.04 / 0.14) == pytest.approx(0.0030408909, rel=1e-6)
    short = kinematics.two_harmonic_acceleration(angle, 0.04, 0.14, 1.0)
    off = np.max(np.abs(CAR.motion.acceleration(angle) - short)) / 0.04 / (1 + 0.04 / 0.14)
    assert kinematics.two_harmonic_error(0.04 / 0.14) == pytest.approx(off, rel=1e-4)


def stroke(index, **parts):
    strokes = list(diagram().strokes)
    strokes[index] = replace(strokes[index], **parts)
    return crank.IndicatorPressure(tuple(strokes))


def swapped(values, i, j):
    out = list(values)
    out[i], out[j] = out[j], out[i]
    return tuple(out)


INTAKE, COMPRESSION = diagram().strokes[:2]
BAD_STROKES = {
    "turns back": (stroke(1, volume=swapped(COMPRESSION.volume, 9, 10)), "pressure.strokes.1.volume.10", "sorted"),
    "repeated": (
        stroke(0, volume=(*INTAKE.volume, INTAKE.volume[-1]), pressure=(*INTAKE.pressure, 0.095e6)),
        "pressure.strokes.0.volume.9",
        "mean",
    ),
    "outside": (
        stroke(0, volume=(*INTAKE.volume, 2 * INTAKE.volume[-1]), pressure=(*INTAKE.pressure, 1e5)),
        "pressure.strokes.0.volume.9",
        "left out",
    ),
    "short": (
        stroke(0, volume=INTAKE.volume[1:], pressure=INTAKE.pressure[1:]),
        "pressure.strokes.0.volume.0",
        "held to the dead centre",
    ),
}


@pytest.mark.parametrize(("bad", "field", "done"), BAD_STROKES.values(), ids=BAD_STROKES)
def test_a_faulty_stroke_is_refused_with_the_point_named_or_repaired_on_record(bad, field, done):
    with pytest.raises(InvalidInput) as refusal:
        crank.analyse(car(pressure=bad))
    assert refusal.value.field == field
    mended, repairs = crank.repaired_indicator(bad, CYLINDER, CAR.motion)
    assert repairs[0].field == field
    assert done in repairs[0].what
    assert crank.analyse(car(pressure=mended)).value.indicated_power == pytest.approx(11121.95, rel=0.01)


def test_volumes_in_another_unit_cannot_be_repaired():
    tiny = crank.IndicatorPressure(
        tuple(replace(s, volume=tuple(v * 1e3 for v in s.volume)) for s in diagram().strokes)
    )
    with pytest.raises(InvalidInput, match="cannot be repaired") as refusal:
        crank.repaired_indicator(tiny, CYLINDER, CAR.motion)
    low, high = CYLINDER.clearance_volume * 1e6, (CYLINDER.clearance_volume + CYLINDER.area * CAR.motion.stroke) * 1e6
    assert refusal.value.allowed.startswith(f"between {low:.5g} and {high:.5g} cm³")


DEG = math.pi / 180
ANGLE = np.arange(0, 720, 10.0)
VALUE = 1e5 * (2 + np.sin(ANGLE * DEG / 2) + 0.3 * np.cos(ANGLE * DEG))


def table(degrees, pressure=VALUE):
    return crank.TablePressure(tuple(np.asarray(degrees) * DEG), tuple(pressure))


BAD_TABLES = {
    "unsorted": (table(swapped(ANGLE, 20, 21), swapped(VALUE, 20, 21)), "pressure.angle.21", "sorted"),
    "repeated": (table(np.insert(ANGLE, 5, 50.0), np.insert(VALUE, 5, VALUE[5])), "pressure.angle.6", "mean"),
    "radians": (table(ANGLE * DEG), "pressure.angle.71", "radians"),
    "relabelled": (table(ANGLE % 360), "pressure.angle.36", "turn added"),
    "squeezed": (table(ANGLE / 2), "pressure.angle.71", "doubled"),
    "not closed": (table([*ANGLE, 720.0], [*VALUE, VALUE[0] + 2e4]), "pressure.angle.72", "first and last"),
    "too long": (table([*ANGLE, 725.0], [*VALUE, 1e5]), "pressure.angle.72", "left out"),
}


@pytest.mark.parametrize(("bad", "field", "done"), BAD_TABLES.values(), ids=BAD_TABLES)
def test_a_faulty_table_is_refused_with_the_point_named_or_repaired_on_record(bad, field, done):
    with pytest.raises(InvalidInput) as refusal:
        crank.analyse(car(pressure=bad))
    assert refusal.value.field == field
    mended, repairs = crank.repaired_table(bad, CYLINDER)
    assert (repairs[0].field, len(repairs)) == (field, 1)
    assert done in repairs[0].what
    right = table(ANGLE).unroll(CAR.motion, CYLINDER)
    at = np.linspace(1.0, 11.0, 50)
    assert mended.unroll(CAR.motion, CYLINDER).pressure(at) == pytest.approx(right.pressure(at), abs=1.0)


def test_several_faults_at_once_are_all_recorded():
    wrapped = np.insert(ANGLE % 360, 10, 100.0) * DEG  # radians, a repeated point, the second turn relabelled
    mended, repairs = crank.repaired_table(table(wrapped, np.insert(VALUE, 10, VALUE[10])), CYLINDER)
    assert len(repairs) == 3
    assert np.degrees(mended.angle) == pytest.approx(ANGLE, abs=1e-9)


def test_a_closed_table_may_say_its_first_point_twice():
    closed, open_ = table([*ANGLE, 720.0], [*VALUE, VALUE[0]]), table(ANGLE)
    at = np.linspace(0, 12, 50)
    one, other = (t.unroll(CAR.motion, CYLINDER).pressure(at) for t in (closed, open_))
    assert np.array_equal(one, other)


def test_half_a_cycle_without_a_point_is_beyond_repair():
    with pytest.raises(InvalidInput, match="cannot be repaired"):
        crank.repaired_table(table(ANGLE[:20], VALUE[:20]), CYLINDER)
    with pytest.raises(InvalidInput, match="more than half"):
        crank.analyse(cooler(pressure=table(ANGLE[:10], VALUE[:10])))


def test_a_table_agrees_with_the_diagram_it_was_read_from():
    curve = diagram().unroll(CAR.motion, CYLINDER)
    angle = np.linspace(0, 4 * math.pi, 2881)[:-1]
    read = crank.TablePressure(tuple(angle), tuple(curve.pressure(angle)))
    assert crank.analyse(car(pressure=read)).value.indicated_power == pytest.approx(
        crank.analyse(car()).value.indicated_power, rel=1e-3
    )
