"""Random requests of every kind, and what a campaign needs to put them to the service's own jobs."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.registry import KINDS
from bench.campaign import crank_dynamics, flexible_rod, impact_linkage, pin_profile

Body = dict[str, Any]
Results = dict[str, float]

DRAWN: Mapping[str, Callable[[np.random.Generator], Body]] = {
    "flexible-rod": flexible_rod.request,
    "impact-linkage": impact_linkage.request,
    "crank-dynamics": crank_dynamics.request,
    "pin-profile": pin_profile.request,
}
"""For every kind, how a random check (or analysis) request is made."""

_SHARES: Mapping[str, Callable[[Body], Results]] = {"impact-linkage": impact_linkage.shares}
"""What results that are only there when they are large enough stand for, where a kind has such."""


@dataclass(frozen=True)
class Scene:
    """A random request of a kind; the seed makes it again."""

    kind: Kind
    seed: int
    body: Body

    @property
    def mode(self) -> Mode:
        return Mode.CHECK if Mode.CHECK in self.kind.jobs else Mode.ANALYSIS

    @property
    def job(self) -> Job:
        return self.kind.jobs[self.mode]

    def request(self, **settings: Any) -> Any:
        """The request with some of its common fields set anew."""
        return self.job.request.model_validate_json(json.dumps({**self.body, **settings}))

    def solve(self, **settings: Any) -> Answer:
        """The answer to such a request."""
        return self.job.run(self.request(**settings))

    def results(self, answer: Answer) -> Results:
        """The main results that exist, by name."""
        found = self.kind.judged_values(answer.result or {}, self.mode)
        shares = _SHARES.get(self.kind.slug, lambda _: {})(answer.result or {})
        return {name: value for name, value in found.items() if value is not None} | shares


def scene_of(slug: str, seed: int) -> Scene:
    """The random scene of a kind that belongs to a seed."""
    return Scene(KINDS[slug], seed, DRAWN[slug](np.random.default_rng(seed)))


def scenes(slug: str, count: int, first_seed: int = 0) -> Iterator[Scene]:
    """So many random scenes of a kind, each from a seed of its own."""
    return (scene_of(slug, seed) for seed in range(first_seed, first_seed + count))


def greatest_change(found: Results, exact: Results) -> float:
    """The greatest relative difference over the results; inf where one exists on one side only."""
    if found.keys() != exact.keys():
        return math.inf
    return max((abs(found[n] - x) / abs(x) if x else abs(found[n]) for n, x in exact.items()), default=0.0)
