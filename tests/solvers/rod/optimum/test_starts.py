"""Where the searches on the full model start."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench.rod_problems import problem as realistic
from solvers import rod
from solvers.outcome import Status
from tests.solvers.rod.machines import PAPER
from tests.solvers.rod.optimum.test_answers import settled
from tests.solvers.rod.test_design import REFERENCE


def test_a_stiffer_strip_is_found_where_the_core_s_optimum_resonates():
    """A fast machine: the core's optimum has its natural frequency at 1.5 times the speed, the stiffest strip at 3."""
    scene = rod.Scene(
        rod.Mechanism(crank_radius=86e-6, rod_length=105.6e-3, speed=190.0),
        rod.Piston(diameter=25.6e-3, skirt_length=53e-3, reciprocating_mass=0.108, friction_coefficient=0.0),
        rod.SchmidtLoad(p_min=0.23e6, delta=0.047, theta=5.65),
        rod.Material(111.5e9, 480e6, 1.15, 0.27, 1200e6, 5585.0),
    )
    bounds = rod.Bounds((11.2e-3, 21.2e-3), (0.56e-3, 0.85e-3), (47.7e-3, 91e-3))
    outcome = rod.design(rod.RodProblem(scene, bounds, rod.Requirements(64.0, 8.3), rod.OBJECTIVES["fatigue_safety"]))
    assert outcome.status is Status.SUCCEEDED
    stiff = rod.check(scene, bounds.stiffest, settled(outcome)).value
    assert outcome.value.check.stresses.fatigue_safety > stiff.stresses.fatigue_safety > 100.0


@pytest.mark.parametrize("speed", [122.0, 123.0, 123.5, 124.0])
def test_the_safety_of_the_example_at_other_speeds_has_no_dips(speed):
    """The core's objective is flat along the length: its optimum lies at the upper bound, a better gap between
    resonances at lengths 14 to 22 % shorter. The rivals were found by grids and local searches on the check."""
    scene = replace(PAPER, mechanism=replace(PAPER.mechanism, speed=speed))
    wanted = rod.Requirements(2.0, 1.8)
    outcome = rod.design(
        replace(REFERENCE, scene=scene, requirements=wanted, objective=rod.OBJECTIVES["fatigue_safety"])
    )
    for h, l in (
        (0.43057e-3, 20.3341e-3),
        (0.42941e-3, 20.2066e-3),
        (0.44995e-3, 22.3539e-3),
        (0.44915e-3, 22.2757e-3),
    ):
        rival = rod.check(scene, rod.Dimensions(9e-3, h, l), settled(outcome)).value
        assert rival.stability_safety > 1.8
        assert outcome.value.check.stresses.fatigue_safety >= rival.stresses.fatigue_safety * (1.0 - 1e-6)


def test_lengths_beyond_the_paths_over_gaps_are_searched():
    """An answer to stricter requirements was once better by 5.4e-3 than the answer to these."""
    problem = realistic(316)
    outcome = rod.design(replace(problem, requirements=problem.requirements.relaxed(0.01)))
    assert problem.objective.log_cost(outcome.value.check, problem.scene) <= -1.8980988 + 1e-6
