"""Where the searches on the full model start."""

from __future__ import annotations

from solvers import rod
from solvers.outcome import Status
from tests.solvers.rod.optimum.test_answers import settled


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
