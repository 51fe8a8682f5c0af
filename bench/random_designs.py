"""Random feasible problems: how often a design is correct, and how often a single-start local search is.

Every problem has a feasible strip by construction: a random machine with that strip, bounds around it, limits that it
meets with some reserve (four of five also limit contact pressure, friction power or stress), and the six objectives in
turn. A design is correct if it meets its limits at 720 angles and 201 sections, its gap is at most 1e-6, and an
independent dense search finds nothing better than it or than its bound within 1e-4 (peaks between samples). SLSQP
starts from the middle of the bounds of the same machines for minimum mass under the two safeties only, which is less
restrictive. `python -m bench.random_designs COUNT` takes a second per problem.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from bench.design import CORE, Model, slsqp
from solvers import rod
from solvers.outcome import Outcome, Status
from tests.solvers.rod.dense_search import dense_search, random_problem, sample
from tests.solvers.rod.machines import random_machine

FIRST_SEED = 1000
_SAME = 1e-3
_LOOSE = 1e-4
_SAMPLED = 1e-6
_FINE = 1e-4


@dataclass(frozen=True)
class Tally:
    """Counts over the problems: designs that are right, local searches that end admissible, and at the optimum."""

    problems: int
    right: int
    admissible: int
    optimal: int
    wrong_seeds: tuple[int, ...]


def is_right(problem: rod.RodProblem, known: rod.Dimensions, outcome: Outcome[rod.RodDesign]) -> bool:
    """Whether the design holds against the dense search, which begins at a strip ``known`` to solve the problem too."""
    if outcome.status is not Status.SUCCEEDED or not 0.0 <= outcome.certificate.gap <= 1e-6:
        return False
    sign, d = problem.objective.sign, outcome.value.check.dimensions
    cost = problem.objective.read(outcome.value.check) ** sign
    _, *found = dense_search(problem, problem.objective.name, problem.requirements, known=known)
    # The search's own strip as finely sampled as this one, so that no peak between samples decides.
    both = [np.array(sizes) for sizes in zip((d.b, d.h, d.l), found, strict=True)]
    seen = sample(problem.scene, *both, angles=720, sections=201)
    sampled = float(seen.cost(problem.objective.name)[1])
    return bool(
        seen.admissible(problem.requirements, -_SAMPLED)[0]
        and cost <= sampled * (1 + _FINE)
        and outcome.certificate.bound**sign <= sampled * (1 + _FINE)
    )


def local_search(problem: rod.RodProblem) -> tuple[bool, bool]:
    """Whether SLSQP from the middle of the bounds ends admissible, and at the least mass within 0.1 %."""
    asked = rod.Requirements(problem.requirements.min_fatigue_safety, problem.requirements.min_stability_safety)
    lightest = replace(problem, objective=rod.OBJECTIVES["mass"], requirements=asked)
    model = Model(lightest)
    found = slsqp(model, np.full(3, 0.5))
    if not np.all(np.isfinite(found)) or not model.admissible(found, _LOOSE):
        return False, False
    return True, model.results(found)[0] <= rod.design(lightest, CORE).certificate.bound * (1 + _SAME)


def _judged(seed: int) -> tuple[bool, bool, bool]:
    """Of one problem: whether the design is right, and whether the local search ends admissible, and at the optimum."""
    names = list(rod.OBJECTIVES)
    problem, known = random_problem(np.random.default_rng(seed), names[seed % len(names)], random_machine)
    return is_right(problem, known, rod.design(problem, CORE)), *local_search(problem)


def run(count: int) -> Tally:
    """The first ``count`` problems, on all processors: nothing is timed here."""
    seeds = range(FIRST_SEED, FIRST_SEED + count)
    with ProcessPoolExecutor(mp_context=get_context("forkserver")) as pool:
        right, admissible, optimal = zip(*pool.map(_judged, seeds, chunksize=4), strict=True)
    wrong = tuple(seed for seed, good in zip(seeds, right, strict=True) if not good)
    return Tally(count, sum(right), sum(admissible), sum(optimal), wrong)


def table(count: int = 200) -> list[str]:
    """The page's lines."""
    tally = run(count)
    lines = [
        "| way | problems | right |",
        "|---|---|---|",
        f"| this design | {count:,} | {tally.right:,} |",
        f"| SLSQP from one start: ends within the limits | {count:,} | {tally.admissible:,} |",
        f"| SLSQP from one start: within 0.1 % of the least mass | {count:,} | {tally.optimal:,} |",
    ]
    if tally.wrong_seeds:
        lines += ["", f"Not right: the problems of the seeds {', '.join(map(str, tally.wrong_seeds))}."]
    return lines


if __name__ == "__main__":
    print("\n".join(table(int(sys.argv[1]))))
