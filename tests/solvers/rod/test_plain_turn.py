"""The compiled turn and the composed one, which share brackets but neither samples nor evaluations, agree."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from solvers import rod
from solvers.fatigue import serensen
from solvers.fatigue.kernels import GREATEST
from solvers.rod.cycle.composition import BeamColumn, Composition, Cycle, PlainBending
from solvers.rod.cycle.extremes_in_time import ComposedTurn
from solvers.rod.cycle.plain_extremes import PlainTurn, turn_of
from solvers.rod.cycle.quantities import CURVATURE, DEFLECTION, FORCE, MOMENT, SIDE, TANGENT, Gauges, weights
from solvers.rod.cycle.worst_section import Contest, greatest, worst
from solvers.rod.effects import ReciprocatingInertia
from solvers.rod.piston.friction import FrictionFeedback
from tests.solvers.rod.machines import PAPER, STRIP, random_machine

TABLE = rod.TableLoad((0.3, 1.1, 2.0, 3.7, 5.9), (1.1e5, 2.4e5, 1.9e5, 0.6e5, 0.9e5))


def machines():
    yield PAPER, STRIP
    yield dataclasses.replace(PAPER, load=TABLE), STRIP
    # Strong tension, where V'' comes from both ends.
    yield dataclasses.replace(PAPER, load=rod.ConstantLoad(-2e7)), STRIP
    for seed in range(4):
        yield random_machine(np.random.default_rng(seed), (1.02, 6.0))


@pytest.mark.parametrize("beam", [BeamColumn(), PlainBending()])
@pytest.mark.parametrize("moving", [(), (ReciprocatingInertia(),)])
def test_gauges_at_the_piston_and_along_the_strip_agree(beam, moving):
    composition = Composition(moving=moving, beam=beam)
    for scene, strip in machines():
        scene = dataclasses.replace(scene, piston=dataclasses.replace(scene.piston, reciprocating_mass=0.01))
        cycle = Cycle(scene, strip, composition)
        plain, composed = PlainTurn(cycle, 1e-10), ComposedTurn(cycle, 1e-10)
        every = weights({FORCE: 1.0}, {SIDE: -1.0, MOMENT: 300.0}, {CURVATURE: 1.0, TANGENT: 1e-2}, {DEFLECTION: -1.0})
        gauges = Gauges(np.tile(every, (5, 1)), np.repeat(np.linspace(0.0, strip.l, 5), 4))
        for found, expected in zip(plain.sampled(gauges), composed.sampled(gauges), strict=True):
            assert found == pytest.approx(expected, rel=1e-12, abs=1e-14 * np.abs(expected).max())
        found, error = plain.greatest(gauges, 1e-10, 1.0)
        expected, other = composed.greatest(gauges, 1e-10, 1.0)
        assert np.all(np.abs(found - expected) <= error + other + 1e-14 * np.abs(expected))
        high, low, _, _ = plain.extremes(gauges, 1e-10)
        assert high == pytest.approx(found, rel=1e-9, abs=1e-9 * np.abs(found).max())
        assert np.all(low <= high)


def test_contests_along_the_strip_agree():
    contests = (
        Contest(serensen(PAPER.material).diagram(), (0, 1), located=True),
        Contest(GREATEST, (0,)),
    )
    layers = weights({TANGENT: 1.0, CURVATURE: 2.0}, {TANGENT: 1.0, CURVATURE: -2.0})
    for scene, strip in machines():
        cycle = Cycle(scene, strip, Composition(beam=BeamColumn()))
        found, expected = (worst(turn(cycle, 1e-9), layers, contests) for turn in (PlainTurn, ComposedTurn))
        for one, other in zip(found, expected, strict=True):
            assert abs(one.value - other.value) <= one.error + other.error + 1e-14 * abs(other.value)
            assert one.relative_error <= 1e-8
        assert found[0].station == pytest.approx(expected[0].station, abs=1e-7 * strip.l)


def test_only_a_plain_cycle_gets_the_compiled_turn():
    plain, fed = Composition(beam=BeamColumn()), Composition(beam=BeamColumn(), feedback=FrictionFeedback())
    assert isinstance(turn_of(Cycle(PAPER, STRIP, plain), 1e-6), PlainTurn)
    assert isinstance(turn_of(Cycle(PAPER, STRIP, fed), 1e-6), ComposedTurn)
    side = greatest(turn_of(Cycle(PAPER, STRIP, plain), 1e-6), weights({SIDE: 1.0}))[0]
    assert side.relative_error <= 1e-6
