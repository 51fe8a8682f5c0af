"""What each effect is worth in one very case: what it changes, and what it costs in time.

The case is solved with its effects as chosen, and once more for every effect with that one turned about: left out if it
ran, taken in if it did not. Runs are interleaved, one of each in turn, so that a machine that slows down slows all of
them alike. Of a check, the measured change stands beside the effect's a-priori bound, which it must not exceed; of a
design, it tells by how much the design itself would be another.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from solvers.accuracy import Clock, Solved, relative_errors

RUNS = 7

Chosen = frozenset[str]
"""The names of the effects that run; all others are left out."""


@dataclass(frozen=True)
class EffectCost:
    """One effect in one case; None where the case has no answer without it, or where the time was over.

    change        greatest relative change of the main results between the two, relative to those with the effect
    brings        the main results that exist only with the effect
    time_with     median time [s] of a solution that has it, all other effects as chosen
    time_without  median time [s] of one that has not
    """

    name: str
    active: bool
    change: float | None
    brings: tuple[str, ...]
    time_with: float | None
    time_without: float | None
    runs: int


def effect_costs(
    solve: Callable[[Chosen], Solved | None],
    effects: Sequence[str],
    chosen: Chosen,
    budget: float,
    runs: int = RUNS,
    clock: Clock = time.perf_counter,
) -> tuple[EffectCost, ...]:
    """Measure every effect of a case.

    solve   the case with just these effects; None where it has no answer with them
    budget  time [s] after which no further solution begins, apart from the first
    """
    pairings = [chosen, *(chosen ^ {name} for name in effects)]
    started = clock()
    answers: dict[Chosen, Solved | None] = {}
    times: dict[Chosen, list[float]] = {pairing: [] for pairing in pairings}
    for turn in range(runs):
        for pairing in pairings:
            over = clock() - started > budget
            if (answers and over) or (turn and answers.get(pairing) is None):
                continue
            begun = clock()
            answer = solve(pairing)
            times[pairing].append(clock() - begun)
            answers.setdefault(pairing, answer)
    return tuple(_cost(name, chosen, answers, times) for name in effects)


def _cost(
    name: str, chosen: Chosen, answers: dict[Chosen, Solved | None], times: dict[Chosen, list[float]]
) -> EffectCost:
    active = name in chosen
    with_it, without = (chosen, chosen ^ {name}) if active else (chosen ^ {name}, chosen)
    fuller, plainer = answers.get(with_it), answers.get(without)
    if fuller is None or plainer is None:
        return EffectCost(name, active, None, (), None, None, 0)
    return EffectCost(
        name,
        active,
        _change(plainer, fuller),
        tuple(n for n, v in fuller.results.items() if v is not None and plainer.results.get(n) is None),
        statistics.median(times[with_it]),
        statistics.median(times[without]),
        min(len(times[with_it]), len(times[without])),
    )


def _change(plainer: Solved, fuller: Solved) -> float | None:
    """Over the results that both have: a result that exists only with the effect has nothing to differ from."""
    both = {n: v for n, v in fuller.results.items() if v is not None and plainer.results.get(n) is not None}
    changes = relative_errors(plainer.results, both)
    return max((c for c in changes.values() if math.isfinite(c)), default=0.0)
