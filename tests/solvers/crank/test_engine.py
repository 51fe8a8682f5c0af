"""Several cylinders: the textbook's balanced engines, the flywheel against brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import crank
from solvers.effects import ALL
from solvers.errors import InvalidInput
from tests.solvers.crank.machines import CAR, MASSES, car, in_line

FORCE = MASSES.reciprocating * 0.04 * CAR.angular_speed**2
RATIO = 0.04 / 0.14
DEG = math.pi / 180


def balance(engine, **parts):
    return crank.analyse(car(engine=engine, **parts), ALL).value.balance


def test_an_in_line_four_has_second_order_forces_alone():
    found = balance(in_line(4, (1, 3, 4, 2)))
    first, second, _ = found.reciprocating
    assert first.force == 0.0
    assert second.force == pytest.approx(4 * FORCE * (RATIO + RATIO**3 / 4 + 15 * RATIO**5 / 128), rel=1e-4)
    # Exactly nothing, not what rounding leaves.
    assert [u.couple for u in found.reciprocating] == [0.0] * len(found.reciprocating)
    assert found.rotating_force == 0.0


def test_an_in_line_six_has_none():
    found = balance(in_line(6, (1, 5, 3, 6, 2, 4)))
    assert max(u.force for u in found.reciprocating) < 1e-9 * FORCE
    assert max(u.couple for u in found.reciprocating) < 1e-9 * FORCE


def test_an_in_line_three_has_a_first_order_couple():
    """sqrt(3) m_j r omega^2 a with cylinders a apart."""
    found = balance(in_line(3, (1, 3, 2)))
    assert found.reciprocating[0].force < 1e-9 * FORCE
    assert found.reciprocating[0].couple == pytest.approx(math.sqrt(3) * FORCE * 0.09, rel=1e-9)


def test_a_v_twin_of_90_degrees_has_a_turning_first_order_force():
    """Constant m_j r omega^2 with the crank: a counterweight can take all of it."""
    engine = crank.Engine((0.0, 90 * DEG), (-45 * DEG, 45 * DEG))
    found = balance(engine)
    assert found.reciprocating[0].force == pytest.approx(FORCE, rel=1e-9)
    counter = FORCE / CAR.angular_speed**2
    heavy = replace(MASSES, rods_per_pin=2)
    whole = heavy.rotating(0.04)
    balanced = replace(
        heavy, throw=replace(heavy.throw, counterweight=heavy.throw.counterweight + (counter + whole * 0.04) / 0.03)
    )
    assert balance(engine, masses=balanced).rotating_force == pytest.approx(FORCE, rel=1e-9)


def test_unbalance_against_summed_forces():
    """The harmonics' greatest force against a sampling of all cylinders' first order."""
    engine = crank.Engine((0.0, 1.9, 4.0), (-0.4, 0.3, 0.9), (0.0, 0.05, 0.2))
    found = balance(engine)
    angle = np.linspace(0, 2 * math.pi, 20001)
    for order, harmonic in ((1, 1.0), (2, RATIO + RATIO**3 / 4 + 15 * RATIO**5 / 128 + 35 * RATIO**7 / 512)):
        vector = sum(
            FORCE * harmonic * np.cos(order * (angle - psi)) * np.exp(1j * alpha)
            for psi, alpha in zip(engine.phases, engine.axes, strict=True)
        )
        assert found.reciprocating[order - 1].force == pytest.approx(np.max(np.abs(vector)), rel=2e-5)


@pytest.mark.parametrize("offset", [0.0, 0.5, -0.5])
def test_unbalance_of_a_rod_hardly_longer_than_the_crank(offset):
    """In the limit of equal lengths the piston is at r (cos phi + |cos phi|), whose harmonics are known."""
    length = 0.04 * (1.0 + 1e-11)
    mechanism = replace(CAR, rod_length=length, offset=offset * (length - 0.04))
    masses = replace(MASSES, rod=replace(MASSES.rod, length=length, cg_from_pin=0.0))
    table = crank.TablePressure(tuple(np.linspace(0.0, 12.0, 8).tolist()), (1e5,) * 8)
    found = balance(in_line(1, (1,)), mechanism=mechanism, masses=masses, pressure=table)
    force = masses.reciprocating * 0.04 * mechanism.angular_speed**2
    for unbalance, exact in zip(found.reciprocating, (1.0, 16 / (3 * math.pi), 64 / (15 * math.pi)), strict=True):
        assert unbalance.force == pytest.approx(force * exact, rel=2e-8)


@pytest.mark.parametrize(("cylinders", "order"), [(1, (1,)), (4, (1, 3, 4, 2)), (5, (1, 2, 4, 5, 3))])
def test_the_swing_of_the_speed_against_brute_force(cylinders, order):
    engine = replace(in_line(cylinders, order), flywheel_inertia=0.2, wanted_irregularity=0.01)
    found = crank.analyse(car(engine=engine), ALL, series_angles=7200).value
    angle, single = found.angle, found.series.torque
    total = sum(np.roll(single, round(psi / (4 * math.pi) * 7200)) for psi in engine.phases)
    step = angle[1]
    work = np.cumsum(total - total.mean()) * step
    assert found.speed_fluctuation.torque_mean == pytest.approx(total.mean(), rel=1e-4)
    assert found.speed_fluctuation.torque_max == pytest.approx(total.max(), rel=1e-4)
    assert found.speed_fluctuation.work_fluctuation == pytest.approx(np.ptp(work), rel=2e-3)
    assert found.speed_fluctuation.irregularity == pytest.approx(
        found.speed_fluctuation.work_fluctuation / found.speed_fluctuation.inertia / CAR.angular_speed**2
    )
    wanted = replace(engine, flywheel_inertia=found.speed_fluctuation.flywheel_inertia_wanted)
    again = crank.analyse(car(engine=wanted), ALL).value.speed_fluctuation
    assert again.irregularity == pytest.approx(0.01, rel=1e-9)


def test_more_cylinders_run_more_evenly():
    swings = [
        crank.analyse(car(engine=in_line(n, order)), ALL).value.speed_fluctuation.torque_irregularity
        for n, order in ((1, (1,)), (4, (1, 3, 4, 2)), (6, (1, 5, 3, 6, 2, 4)))
    ]
    assert swings == sorted(swings, reverse=True)


def test_a_shared_crank_pin_carries_both_rods():
    engine = crank.Engine((0.0, 450 * DEG), (-45 * DEG, 45 * DEG))
    found = crank.analyse(car(engine=engine, masses=replace(MASSES, rods_per_pin=2)), ALL, series_angles=2880).value
    f, lag = found.series, 1800  # 450 of 720 degrees
    big_ends = 2 * MASSES.rod.at_crank_pin * 0.04 * CAR.angular_speed**2
    load = np.hypot(f.tangential + np.roll(f.tangential, lag), f.radial + np.roll(f.radial, lag) - big_ends)
    assert found.shared_pin[0] == pytest.approx(load.max(), rel=1e-4)
    assert found.shared_pin[0] >= load.max() * (1 - 1e-12)


def test_cylinders_that_cannot_share_a_pin_are_named():
    engine = crank.Engine((0.0, math.pi), (-45 * DEG, 45 * DEG))
    with pytest.raises(InvalidInput) as refusal:
        crank.analyse(car(engine=engine, masses=replace(MASSES, rods_per_pin=2)))
    assert refusal.value.field == "engine.phases.1"


@pytest.mark.parametrize("seed", [2, 4])
def test_what_many_cylinders_with_noisy_pressures_may_hide_is_in_the_estimate(seed):
    """A quarter of a million data points of all cylinders together: extremes may lie between two looks."""
    random = np.random.default_rng(seed)
    angle = np.arange(4000) * (4.0 * math.pi / 4000)
    pressure = 1e5 + 1e4 * np.cos(angle) + 3e3 * random.standard_normal(4000)
    phases = np.append(0.0, random.uniform(0.0, 4.0 * math.pi, 63))
    engine = crank.Engine(tuple(phases.tolist()), (0.0,) * 64)
    table = crank.TablePressure(tuple(angle.tolist()), tuple(pressure.tolist()))
    outcome = crank.analyse(car(engine=engine, pressure=table), ALL, series_angles=1)
    found, close = outcome.value, np.linspace(0.0, 4.0 * math.pi, 60_000)
    total = sum(found.cycle.forces(close - phase).torque for phase in phases)
    swing, missed = found.speed_fluctuation, outcome.accuracy.estimated * np.abs(total).max()
    assert total.max() <= swing.torque_max + missed
    assert total.min() >= swing.torque_min - missed
