"""Honest estimates: is the true error of the main results ever above the estimate, and how far below?

Every scene is solved at one random accuracy and judged by a solution to 1e-12, every eighth one by the kind's
independent reference, as far as there is such a one. Scenes without an answer are counted, not hidden.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bench.campaign.scenes import Results, Scene, greatest_change
from solvers.watch import OutOfTime, Watch

_ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
_TIGHTEST = 1e-12
_ROUNDING = 1e-13
_JUDGED_INDEPENDENTLY = 8
_PATIENCE = 20.0


@dataclass(frozen=True)
class Judged:
    """One scene at one accuracy: what was estimated, and what was true."""

    seed: int
    requested: float
    estimated: float
    error: float
    doubt: float

    @property
    def honest(self) -> bool:
        """Not above the estimate by more than rounding and the reference's own doubt."""
        return self.error <= self.estimated + self.doubt + _ROUNDING

    @property
    def met(self) -> bool:
        return self.error <= self.requested


@dataclass(frozen=True)
class Honesty:
    """All scenes of a kind."""

    judged: tuple[Judged, ...]
    without_answer: int

    @property
    def dishonest(self) -> tuple[int, ...]:
        return tuple(j.seed for j in self.judged if not j.honest)

    @property
    def missed(self) -> tuple[int, ...]:
        return tuple(j.seed for j in self.judged if not j.met)

    @property
    def median_ratio(self) -> float:
        """Median of estimate/error; errors below rounding count as rounding."""
        return statistics.median(j.estimated / max(j.error, _ROUNDING) for j in self.judged)


def honesty(scenes: Iterable[Scene]) -> Honesty:
    """Judge every scene's estimate."""
    judged, without = [], 0
    for scene in scenes:
        accuracy = float(np.random.default_rng(scene.seed).choice(_ACCURACIES))
        answer = scene.solve(accuracy=accuracy)
        if answer.status != "succeeded":
            without += 1
            continue
        reference = _reference(scene)
        if reference is None:
            without += 1
            continue
        exact, doubt = reference
        error = greatest_change(scene.results(answer), exact)
        judged.append(Judged(scene.seed, accuracy, answer.accuracy["estimated"], error, doubt))
    return Honesty(tuple(judged), without)


def _reference(scene: Scene) -> tuple[Results, float] | None:
    """The main results by the tightest solution, with the doubt that it has of itself, and of every eighth scene by
    independent means, where they tell them in time.

    None where the tightest solution is refused.
    """
    request = scene.request(accuracy=_TIGHTEST)
    answer = scene.job.run(request)
    if answer.status != "succeeded":
        return None
    exact, doubt = scene.results(answer), answer.accuracy["estimated"]
    independent = scene.job.reference(request, answer) if scene.seed % _JUDGED_INDEPENDENTLY == 0 else None
    if independent is not None:
        with suppress(OutOfTime):
            told = {n: e for n, e in independent.results(Watch(_PATIENCE)).items() if n in exact}
            exact |= {n: e.value for n, e in told.items() if e.value is not None}
            doubt = max([doubt, *(e.accuracy for e in told.values())])
    return exact, doubt
