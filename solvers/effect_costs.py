"""Influence and cost of each effect in a given case.

The case is solved with the chosen effects and once more per effect with that one toggled. Runs are interleaved, so that
machine load affects all alike. For a check, the measured change can be compared with the effect's estimated influence;
for a design, it is the change of the design itself.
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
"""Names of the active effects; all others are left out."""


@dataclass(frozen=True)
class EffectCost:
    """Influence and cost of an effect; None if the case has no answer without it, or the time ran out.

    change        maximum relative change of the main results, relative to those with the effect
    brings        main results that exist only with the effect
    time_with     median time [s] with the effect, all others as chosen
    time_without  median time [s] without it
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

    solve   the case with exactly these effects; None if it has no answer
    budget  time [s] after which no further solution is started, except the first
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
    """Over the results that exist in both; a result that only exists with the effect has no change."""
    both = {n: v for n, v in fuller.results.items() if v is not None and plainer.results.get(n) is not None}
    changes = relative_errors(plainer.results, both)
    return max((c for c in changes.values() if math.isfinite(c)), default=0.0)
