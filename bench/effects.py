"""What effects cost that are left out.

Every kind's example is checked with all of its effects excluded, beside the same kind without any effect in its list,
which is the physics that never had them; and once more with the bounds of the excluded effects not asked for, which the
manifest tells so that a user sees what an exclusion may change. Runs are interleaved, medians compared.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS
from solvers.crank import effects as crank_effects
from solvers.linkage import effects as linkage_effects
from solvers.pin import effects as pin_effects
from solvers.rod import effects as rod_effects

_ASKED: tuple[tuple[str, Mode, ModuleType], ...] = (
    ("flexible-rod", Mode.CHECK, rod_effects),
    ("pin-profile", Mode.CHECK, pin_effects),
    ("impact-linkage", Mode.CHECK, linkage_effects),
    ("crank-dynamics", Mode.ANALYSIS, crank_effects),
)
_ROUNDS = 200


@dataclass(frozen=True)
class _Unasked:
    """An effect's name without its bound: what is left of it when it is excluded and nobody asks what that changes."""

    name: str

    def influence(self, _situation: object) -> float:
        return 0.0

    def can_run(self, _scene: object) -> bool:
        return True


@contextmanager
def _listed(wing: ModuleType, effects: Sequence[Any]) -> Iterator[None]:
    """The wing with other effects in its list."""
    whole = wing.EFFECTS
    wing.EFFECTS = tuple(effects)
    try:
        yield
    finally:
        wing.EFFECTS = whole


def _time(kind: Kind, mode: Mode, wing: ModuleType, effects: Sequence[Any]) -> float:
    job = kind.jobs[mode]
    settled = {"include": [], "exclude": [effect.name for effect in effects]}
    with _listed(wing, effects):
        request = job.request.model_validate({**kind.example(mode), "effects": settled})
        started = time.perf_counter()
        answer = job.run(request)
        taken = time.perf_counter() - started
    if answer.status != "succeeded":
        raise RuntimeError(f"{kind.slug} without effects: {answer.status}")
    return taken


def table(rounds: int = _ROUNDS) -> list[str]:
    """The page's lines."""
    lines = [
        "| kind | never had them | excluded, bounds not asked for | excluded | of which bounds |",
        "|---|---|---|---|---|",
    ]
    for slug, mode, wing in _ASKED:
        whole = wing.EFFECTS
        ways = ((), [_Unasked(effect.name) for effect in whole], whole)
        times: tuple[list[float], ...] = ([], [], [])
        for _ in range(rounds):
            for way, taken in zip(ways, times, strict=True):
                taken.append(_time(KINDS[slug], mode, wing, way))
        absent, unasked, excluded = map(statistics.median, times)
        lines.append(
            f"| {KINDS[slug].title} | {absent * 1e3:.2f} ms | {unasked / absent:.3f} times | "
            f"{excluded / absent:.3f} times | {(excluded - unasked) * 1e3:.2f} ms |"
        )
    return lines
