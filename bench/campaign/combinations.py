"""Every combination of a scene's effects gives finite results or a reason."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from bench.campaign.scenes import Scene


@dataclass(frozen=True)
class Combinations:
    """Number of combinations run, and those without a finite answer."""

    run: int
    refused: int
    broken: tuple[tuple[str, ...], ...]


def judge_combinations(scene: Scene) -> Combinations:
    """Solve a scene with every subset of its effects."""
    run, refused, broken = 0, 0, []
    names = [effect["name"] for effect in scene.kind.effects()]
    for size in range(len(names) + 1):
        for chosen in itertools.combinations(names, size):
            settled = {"include": list(chosen), "exclude": [n for n in names if n not in chosen]}
            answer = scene.solve(effects=settled, accuracy=1e-3)
            run += 1
            if answer.status == "refused":
                refused += 1
            elif answer.status != "succeeded" or not all(map(math.isfinite, scene.results(answer).values())):
                broken.append(chosen)
    return Combinations(run, refused, tuple(broken))
