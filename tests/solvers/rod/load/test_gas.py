"""Loads against independent evaluations."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad

from solvers import rod
from solvers.errors import InvalidInput


def test_schmidts_mean_pressure():
    load = rod.SchmidtLoad(1.4e6, 0.25, 1.16)
    mean = quad(lambda a: float(load.pressure(a)), 0, 2 * math.pi, epsabs=0, epsrel=1e-13)[0] / (2 * math.pi)
    assert load.reference_pressure() == pytest.approx(mean, rel=1e-13)


def test_schmidts_pressure_keeps_its_digits_near_the_pole():
    delta = 1 - 2.0**-40
    with mp.workdps(50):
        d = mp.mpf(delta)
        for angle in (1.16, 1.16 + 1e-9, 2.0, 4.0):
            exact = (1 + d) / (1 - d * mp.cos(mp.mpf(angle) - mp.mpf(1.16)))
            found = float(rod.SchmidtLoad(1.0, delta, 1.16).pressure(angle))
            assert abs(found / exact - 1) < 1e-14


def test_table_load_is_periodic_monotone_and_has_the_mean_of_its_curve():
    angle = np.radians([10, 80, 170, 200, 300])
    load = rod.TableLoad(tuple(angle), (1.0, 3.0, 2.0, 2.5, 0.5))
    around = np.linspace(0, 2 * np.pi, 4001)
    assert load.pressure(around + 2 * np.pi) == pytest.approx(load.pressure(around), abs=1e-12)
    assert load.pressure(around).min() >= 0.5 - 1e-12
    assert load.pressure(around).max() <= 3.0 + 1e-12
    mean = np.mean(load.pressure((np.arange(200_000) + 0.5) * (2 * np.pi / 200_000)))
    assert load.reference_pressure() == pytest.approx(mean, rel=1e-9)


@pytest.mark.parametrize(
    ("angle", "pressure", "field"),
    [
        ((0.0, 1.0), (1.0, 1.0), "load.angle"),
        ((0.0, 2.0, 1.0), (1.0, 1.0, 1.0), "load.angle.2"),
        ((0.0, 1.0, 6.3), (1.0, 1.0, 1.0), "load.angle.2"),
        ((0.0, 1.0, 2.0), (1.0, 1.0), "load.pressure"),
    ],
)
def test_table_load_names_the_point_it_refuses(angle, pressure, field):
    with pytest.raises(InvalidInput) as caught:
        rod.TableLoad(angle, pressure)
    assert caught.value.field == field


@pytest.mark.parametrize("delta", [0.99, 1 - 1e-6, 1 - 1e-12])
def test_a_narrow_pressure_peak_is_surrounded_by_angles(delta):
    """Between neighbouring angles the pressure changes by less than a sixth of its greatest value."""
    load = rod.SchmidtLoad(1.0, delta, -0.3)
    angle = np.sort(load.sharp_angles())
    pressure = load.pressure(angle)
    assert pressure.max() == load.pressure(-0.3)
    assert np.abs(np.diff(pressure)).max() <= pressure.max() / 6
    assert rod.SchmidtLoad(1.0, 0.5, 0.0).sharp_angles().size == 0
    assert rod.ConstantLoad(1e5).sharp_angles().size == 0


@pytest.mark.parametrize("points", [5, 20_000])
def test_a_tables_sharp_angles_hold_its_extremes(points):
    rng = np.random.default_rng(points)
    angle = np.sort(rng.uniform(0.1, 6.2, points))
    values = rng.normal(size=points)
    chosen = rod.TableLoad(tuple(angle), tuple(values)).sharp_angles()
    assert chosen.size <= 4096
    assert {angle[np.argmax(values)], angle[np.argmin(values)]} <= set(chosen)
