"""What a bushing must keep: as a pin, with the slope of its outside."""

from __future__ import annotations

from collections.abc import Iterable

from solvers.outcome import Accuracy, EffectReport
from solvers.pin.bushing.check import BushingCheck
from solvers.pin.bushing.scene import BushingScene
from solvers.pin.limits import Limits
from solvers.pin.verdict import not_judged, of_deflection, of_ring, of_shape, of_stresses, of_wall, steepest
from solvers.verdict import Verdict, slack_of


def judge(
    check: BushingCheck, scene: BushingScene, accuracy: Accuracy, limits: Limits, effects: Iterable[EffectReport] = ()
) -> Verdict:
    """The verdict on a bushing; see ``solvers.pin.verdict.judge``."""
    slack = slack_of(accuracy)
    slope = steepest(check.along.x, check.along.outer) if limits.max_slope is not None else None
    return Verdict(
        (
            *of_stresses(check.equivalent_stress_max, check.shear_stress_max, scene.material, slack),
            of_wall(check.least_wall, limits, slack),
            *of_ring(check.ring, scene.force, scene.material, limits, slack),
            *of_shape(check.deflection, slope, limits, slack),
        ),
        (*check.warnings, *not_judged(check.ring), *of_deflection(limits, effects)),
    )
