"""Many at once: the numbers of the single calls, and refusals in their places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers import crank
from solvers.errors import InvalidInput
from tests.solvers.crank.machines import CAR, car, cooler, diagram


def test_many_analyses_are_the_single_ones():
    pressure = diagram()
    speeds = [crank.Case(car(mechanism=replace(CAR, speed=speed), pressure=pressure)) for speed in (5.0, 50.0, 90.0)]
    tilted = crank.Case(car(mechanism=replace(CAR, offset=0.004), pressure=pressure), accuracy=1e-9)
    cases = [*speeds, crank.Case(cooler()), tilted]
    for case, found in zip(cases, crank.analyse_many(cases), strict=True):
        alone = case.evaluate()
        assert found.value.worst == alone.value.worst
        assert found.value.swing == alone.value.swing
        assert found.value.torque_mean == alone.value.torque_mean
        assert found.accuracy == alone.accuracy


def test_what_makes_no_sense_is_refused_in_its_place():
    good, bad = crank.Case(car()), crank.Case(car(), accuracy=0.5)
    found = crank.analyse_many([good, bad, good])
    assert isinstance(found[1], InvalidInput)
    assert found[1].field == "accuracy"
    assert found[0].value.worst == found[2].value.worst


def test_many_pendulums_are_the_single_ones():
    """Where the single one refuses there is no number."""
    rng = np.random.default_rng(3)
    columns = {
        "pivot_distance": rng.uniform(0.1, 0.2, 300),
        "period_small_end": rng.uniform(0.6, 1.0, 300),
        "period_big_end": rng.uniform(0.6, 1.0, 300),
        "rod_mass": rng.uniform(0.3, 1.0, 300),
        "amplitude": rng.uniform(0.0, 0.2, 300),
        "small_end_bore_radius": rng.choice([0.0, 0.01], 300),
    }
    columns["period_small_end"][:3] = -1.0, np.nan, np.inf
    found, refused = crank.swing_many(**columns), 0
    for i in range(300):
        try:
            values = crank.swing(crank.Pendulum(**{name: float(column[i]) for name, column in columns.items()})).values
        except InvalidInput:
            values = dict.fromkeys(found, np.nan)
            refused += 1
        for name, column in found.items():
            assert column[i] == pytest.approx(values[name], rel=1e-12, nan_ok=True), (i, name)
    assert 3 < refused < 250


def test_a_column_must_be_a_quantity_of_a_pendulum():
    with pytest.raises(InvalidInput) as refusal:
        crank.swing_many(period=[0.8])
    assert refusal.value.field == "period"
    with pytest.raises(InvalidInput, match="missing"):
        crank.swing_many(pivot_distance=0.16)
