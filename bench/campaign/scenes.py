"""Random requests of every kind, run through the service's jobs."""

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
"""Generator of a random check (or analysis) request per kind."""

_SHARES: Mapping[str, Callable[[Body], Results]] = {"impact-linkage": impact_linkage.shares}
"""Values of results that exist only above a threshold, per kind."""


@dataclass(frozen=True)
class Scene:
    """A random request of a kind, reproducible from its seed."""

    kind: Kind
    seed: int
    body: Body

    def __reduce__(self) -> tuple[Callable[..., Scene], tuple[str, int, Body]]:
        """Pickle the kind by name."""
        return _of_kind, (self.kind.slug, self.seed, self.body)

    @property
    def mode(self) -> Mode:
        return Mode.CHECK if Mode.CHECK in self.kind.jobs else Mode.ANALYSIS

    @property
    def job(self) -> Job:
        return self.kind.jobs[self.mode]

    def request(self, **settings: Any) -> Any:
        """The request with some common fields replaced."""
        return self.job.request.model_validate_json(json.dumps({**self.body, **settings}))

    def solve(self, **settings: Any) -> Answer:
        """Solve such a request."""
        return self.job.run(self.request(**settings))

    def results(self, answer: Answer) -> Results:
        """The main results that exist, by name."""
        found = self.kind.judged_values(answer.result or {}, self.mode)
        shares = _SHARES.get(self.kind.slug, lambda _: {})(answer.result or {})
        return {name: value for name, value in found.items() if value is not None} | shares


def _of_kind(slug: str, seed: int, body: Body) -> Scene:
    return Scene(KINDS[slug], seed, body)


def scene_of(slug: str, seed: int) -> Scene:
    """The scene of a seed."""
    return Scene(KINDS[slug], seed, DRAWN[slug](np.random.default_rng(seed)))


def scenes(slug: str, count: int, first_seed: int = 0) -> Iterator[Scene]:
    """Random scenes of a kind, one per seed."""
    return (scene_of(slug, seed) for seed in range(first_seed, first_seed + count))


def greatest_change(found: Results, exact: Results) -> float:
    """Maximum relative difference of the results; inf if one exists on one side only."""
    if found.keys() != exact.keys():
        return math.inf
    return max((abs(found[n] - x) / abs(x) if x else abs(found[n]) for n, x in exact.items()), default=0.0)
