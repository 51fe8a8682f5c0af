"""Cost of omitted effects.

Every kind's example is checked with all effects excluded, compared with the same kind without any effects in its list.
The solver's own time shows the cost of an omitted effect; the whole answer's time also includes its manifest entry,
first without its bound, then with it, as in the service. Runs are interleaved, medians compared.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from types import ModuleType
from typing import Any

from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS
from solvers.crank import check as crank_check
from solvers.linkage import effects as linkage_effects
from solvers.outcome import EffectReport
from solvers.pin import effects as pin_effects
from solvers.rod import effects as rod_effects

_ASKED: tuple[tuple[str, Mode, ModuleType], ...] = (
    ("flexible-rod", Mode.CHECK, rod_effects),
    ("pin-profile", Mode.CHECK, pin_effects),
    ("impact-linkage", Mode.CHECK, linkage_effects),
    ("crank-dynamics", Mode.ANALYSIS, crank_check),
)
_ROUNDS = 600


@contextmanager
def _listed(wing: ModuleType, effects: Sequence[Any]) -> Iterator[None]:
    """The module with a different list of effects."""
    whole = wing.EFFECTS
    wing.EFFECTS = tuple(effects)
    try:
        yield
    finally:
        wing.EFFECTS = whole


@contextmanager
def _unread() -> Iterator[None]:
    """With manifests whose bounds are not evaluated."""
    read = EffectReport.influence
    EffectReport.influence = 0.0
    try:
        yield
    finally:
        EffectReport.influence = read


def _time(kind: Kind, mode: Mode, wing: ModuleType, effects: Sequence[Any]) -> tuple[float, float]:
    """Seconds of the solver and of the whole answer."""
    job = kind.jobs[mode]
    settled = {"include": [], "exclude": [effect.name for effect in effects]}
    with _listed(wing, effects):
        request = job.request.model_validate({**kind.example(mode), "effects": settled})
        started = time.perf_counter()
        answer = job.run(request)
        taken = time.perf_counter() - started
    if answer.status != "succeeded":
        raise RuntimeError(f"{kind.slug} without effects: {answer.status}")
    return answer.timing["solve_s"], taken


def table(rounds: int = _ROUNDS) -> list[str]:
    """The page's lines."""
    lines = [
        "| kind | solved that never had them | solved, excluded | answered that never had them | "
        "answered, excluded | answered with their bounds | the bounds |",
        "|---|---|---|---|---|---|---|",
    ]
    for slug, mode, wing in _ASKED:
        ways = (_unread, ()), (_unread, wing.EFFECTS), (nullcontext, wing.EFFECTS)
        times: tuple[list[tuple[float, float]], ...] = ([], [], [])
        for _ in range(rounds):
            for (reading, effects), taken in zip(ways, times, strict=True):
                with reading():
                    taken.append(_time(KINDS[slug], mode, wing, effects))
        medians = [[statistics.median(part) for part in zip(*taken, strict=True)] for taken in times]
        (solved, absent), (left_out, excluded), (_, read) = medians
        lines.append(
            f"| {KINDS[slug].title} | {solved * 1e3:.2f} ms | {left_out / solved:.3f} times | {absent * 1e3:.2f} ms | "
            f"{excluded / absent:.3f} times | {read / absent:.3f} times | {(read - excluded) * 1e3:.2f} ms |"
        )
    return lines
