"""Many at once: the numbers of the single calls, and refusals in their places."""

from __future__ import annotations

from dataclasses import replace

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
        assert found.value.speed_fluctuation == alone.value.speed_fluctuation
        assert found.value.torque_mean == alone.value.torque_mean
        assert found.accuracy == alone.accuracy


def test_what_makes_no_sense_is_refused_in_its_place():
    good, bad = crank.Case(car()), crank.Case(car(), accuracy=0.5)
    found = crank.analyse_many([good, bad, good])
    assert isinstance(found[1], InvalidInput)
    assert found[1].field == "accuracy"
    assert found[0].value.worst == found[2].value.worst
