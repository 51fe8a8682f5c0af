"""Realistic rod designs under relaxed requirements, whose answers must not be worse than those under stricter ones.

The problems of ``bench.rod_problems`` are designed with their requirements as they are and relaxed by each slack. An
answer is beaten if one to stricter requirements with the same effects is better by more than the estimated error: its
strip is admissible here, too. It needs no other search, so that it covers any design.

`python -m bench.rod_relaxations [COUNT] [--first SEED] [--slacks SLACK ...]`. Problems are solved on all processors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

from bench.rod_problems import COUNT, problem
from solvers import rod
from solvers.outcome import EffectState, Status

SLACKS = (0.0, 0.015, 0.03, 0.06)


@dataclass(frozen=True)
class Answer:
    """ln objective and estimated error of a design whose requirements are relaxed by a ``slack``; it cannot be compared
    with answers of other ``effects``."""

    slack: float
    log_cost: float
    estimated: float
    effects: frozenset[str]


@dataclass(frozen=True)
class Beaten:
    """An answer of a problem, and a better one to stricter requirements."""

    seed: int
    answer: Answer
    better: Answer

    @property
    def loss(self) -> float:
        """Difference of ln objective."""
        return self.answer.log_cost - self.better.log_cost


def relaxed(seed: int, slack: float) -> rod.RodProblem:
    """A realistic problem with its requirements relaxed by ``slack``."""
    asked = problem(seed)
    return replace(asked, requirements=asked.requirements.relaxed(slack))


def answers(seed: int, slacks: Sequence[float]) -> list[Answer]:
    """The answers of a problem, strict requirements first; none where it is infeasible."""
    found = []
    for slack in sorted(slacks):
        asked = relaxed(seed, slack)
        outcome = rod.design(asked)
        if outcome.status is Status.SUCCEEDED:
            active = frozenset(effect.name for effect in outcome.effects if effect.state is EffectState.ACTIVE)
            cost = asked.objective.log_cost(outcome.value.check, asked.scene)
            found.append(Answer(slack, cost, outcome.accuracy.estimated, active))
    return found


def beaten(seed: int, found: Sequence[Answer]) -> Iterator[Beaten]:
    """The answers of a problem that are beaten, each with the best of stricter ones."""
    for k, answer in enumerate(found):
        comparable = [other for other in found[:k] if other.effects == answer.effects]
        better = min(comparable, key=lambda other: other.log_cost, default=answer)
        if answer.log_cost - better.log_cost > answer.estimated + better.estimated:
            yield Beaten(seed, answer, better)


def main() -> None:
    """Print every beaten answer, and how many there are."""
    asked = argparse.ArgumentParser(prog="python -m bench.rod_relaxations", description="rods under relaxed limits")
    asked.add_argument("count", nargs="?", type=int, default=COUNT)
    asked.add_argument("--first", type=int, default=0, help="seed of the first problem")
    asked.add_argument("--slacks", nargs="*", type=float, default=SLACKS, help="relative relaxations of requirements")
    given = asked.parse_args()
    seeds, compared, worse = range(given.first, given.first + given.count), 0, 0
    with ProcessPoolExecutor() as workers:
        for seed, found in zip(seeds, workers.map(partial(answers, slacks=given.slacks), seeds), strict=True):
            compared += len(found)
            for one in beaten(seed, found):
                worse += 1
                print(
                    f"{seed}: at {one.answer.slack:g} worse by {one.loss:.2e} than at {one.better.slack:g}", flush=True
                )
    print(f"{worse} of {compared:,} answers are beaten by answers to stricter requirements.")


if __name__ == "__main__":
    main()
