"""Realistic rod designs against rivals from twenty starts.

The problems of ``bench.rod_problems`` are designed as users do, with every setting at its default. The answer is put to
``oracles.rivals.rod.scouted_contest``: SLSQP and COBYQA on the project's own check with the answer's effects, from the
answer, from strips along its limits, from the core's optimum and from random strips; where sizes come in steps, from
all those next to the answer's. Where there is said to be no strip, they look for any.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from bench.rod_problems import problem
from oracles.rivals.rod import Contest, scouted_contest, settled
from solvers import rod
from solvers.outcome import Status


@dataclass(frozen=True)
class Contested:
    """What became of an answer.

    rings    whether the strip's inertia is among its effects
    stepped  whether sizes come in steps or from a stock
    met      whether it claims the accuracy asked for
    seconds  processor time of the design
    """

    objective: str
    infeasible: bool
    rings: bool
    stepped: bool
    met: bool
    seconds: float
    contest: Contest


def judge_contest(seed: int) -> Contested | None:
    """Design a realistic problem and put the answer to its rivals; None where the design failed."""
    asked, started = problem(seed), time.process_time()
    outcome = rod.design(asked)
    seconds = time.process_time() - started
    if outcome.status is Status.FAILED:
        return None
    return Contested(
        asked.objective.name,
        outcome.status is Status.INFEASIBLE,
        "rod_inertia" in settled(outcome.effects).include,
        any(size is not None for size in (asked.stock_h, asked.step_b, asked.step_l)),
        outcome.accuracy.met,
        seconds,
        scouted_contest(asked, outcome, seed),
    )
