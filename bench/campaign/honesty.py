"""Error estimates: is the true error of the main results ever above the estimate, and how far below?

Every scene is solved at one random accuracy and judged by a solution to 1e-12, every fiftieth one by the kind's
independent reference where available. Scenes without an answer are counted.

A reference states its own uncertainty. A difference above the estimate by no more than that is inconclusive; such
verdicts are counted separately.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bench.campaign.scenes import Results, Scene, greatest_change
from solvers.watch import OutOfTime, Watch

ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
_TIGHTEST = 1e-12
ROUNDING = 1e-13
JUDGED_INDEPENDENTLY = 50
_REFERENCE_LIMIT_S = 20.0


@dataclass(frozen=True)
class Judged:
    """One scene at one accuracy: estimate, and distance from a reference with uncertainty ``doubt``."""

    requested: float
    estimated: float
    error: float
    doubt: float

    @property
    def honest(self) -> bool:
        """Not above the estimate by more than rounding."""
        return self.error <= self.estimated + ROUNDING

    @property
    def honesty_judged(self) -> bool:
        """Whether the reference is exact enough to tell."""
        return self.honest or self.error > self.estimated + ROUNDING + self.doubt

    @property
    def met(self) -> bool:
        """Not above the requested accuracy."""
        return self.error <= self.requested

    @property
    def meeting_judged(self) -> bool:
        """Whether the reference is exact enough to tell."""
        return self.met or self.error > self.requested + self.doubt

    @property
    def told(self) -> bool:
        """Whether a missed accuracy is reported as missed."""
        return self.met or self.estimated > self.requested

    @property
    def ratio(self) -> float:
        """Ratio of the estimate to the error; errors below rounding count as rounding."""
        return self.estimated / max(self.error, ROUNDING)


def judge_estimate(scene: Scene) -> Judged | None:
    """Judge a scene's estimate at a random accuracy; None if the scene or its reference has no answer."""
    return judge_estimate_at(scene, float(np.random.default_rng(scene.seed).choice(ACCURACIES)))


def judge_estimate_at(scene: Scene, accuracy: float) -> Judged | None:
    """Judge a scene's estimate at an accuracy; None if the scene or its reference has no answer."""
    answer = scene.solve(accuracy=accuracy)
    reference = _reference(scene) if answer.status == "succeeded" else None
    if reference is None:
        return None
    exact, doubt = reference
    return Judged(accuracy, answer.accuracy["estimated"], greatest_change(scene.results(answer), exact), doubt)


def _reference(scene: Scene) -> tuple[Results, float] | None:
    """Main results of the tightest solution with its own uncertainty, and for every fiftieth scene of an independent
    reference, if available in time.

    None if the tightest solution is refused.
    """
    request = scene.request(accuracy=_TIGHTEST)
    answer = scene.job.run(request)
    if answer.status != "succeeded":
        return None
    exact, doubt = scene.results(answer), answer.accuracy["estimated"]
    independent = scene.job.reference(request, answer) if scene.seed % JUDGED_INDEPENDENTLY == 0 else None
    if independent is not None:
        with suppress(OutOfTime):
            told = {n: e for n, e in independent.results(Watch(_REFERENCE_LIMIT_S)).items() if n in exact}
            exact |= {n: e.value for n, e in told.items() if e.value is not None}
            doubt = max([doubt, *(e.accuracy for e in told.values())])
    return exact, doubt
