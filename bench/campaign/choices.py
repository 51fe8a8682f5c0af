"""Effects: does leaving out what ``auto`` leaves out stay within the tolerance, and was all that it kept needed?

Every scene is solved with all effects, with those that ``auto`` chooses at each tolerance, and with each of these left
out in turn. A skip is false when a result that there is with all effects is lost, or differs by more than the
tolerance; an effect kept is needless when leaving it out as well would have stayed within it and lost no result.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from app.designs.kind import Answer
from bench.campaign.scenes import Results, Scene, greatest_change
from solvers.effects import AUTO, choose

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_TIGHTEST = 1e-9
_SHARE = 1e-3
_SLACK = 4e-3
"""Solutions are as exact as this share of the tolerance they are judged by; what two of them may add."""

Chosen = frozenset[str]


@dataclass(frozen=True)
class Verdict:
    """One scene at one tolerance. ``needless`` is None where that was not asked."""

    tolerance: float
    skipped: int
    kept: int
    change: float
    needless: tuple[str, ...] | None

    @property
    def kept_promise(self) -> bool:
        return self.change <= self.tolerance * (1.0 + _SLACK)


def judge_choice(
    scene: Scene, tolerances: Iterable[float] = TOLERANCES, needless: bool = True
) -> tuple[Verdict, ...] | None:
    """Judge a scene's choice of effects at every tolerance; None where it has no answer with all effects."""
    everything = scene.solve(effects="all", accuracy=_TIGHTEST)
    if everything.status != "succeeded":
        return None
    solved = _Solved(scene, everything)
    # From tight to loose: what a tight tolerance was judged by is good enough for a loose one.
    return tuple(_verdict(solved, tolerance, needless) for tolerance in sorted(tolerances))


@dataclass(frozen=True)
class _Bounded:
    """An effect whose bound in this scene is known."""

    name: str
    bound: float
    summary: str = ""
    measure: str = ""

    def influence(self, _situation: object) -> float:
        return self.bound


class _Solved:
    """Answers of one scene by the effects that ran: tolerances that choose alike are solved once."""

    def __init__(self, scene: Scene, everything: Answer) -> None:
        self._scene = scene
        self._bounded = [_Bounded(e["name"], e["influence"]) for e in everything.effects]
        self.names = frozenset(e.name for e in self._bounded)
        self.exact = scene.results(everything)
        self._known: dict[Chosen, Results | None] = {self.names: self.exact}

    def automatic(self, tolerance: float) -> tuple[Chosen, Results | None]:
        """What ``auto`` keeps, and the results with that; the same choice is not solved twice."""
        expected = choose(self._bounded, None, AUTO, tolerance)
        kept = frozenset(e.name for e in expected.active)
        if kept not in self._known:
            answer = self._answer("auto", tolerance)
            kept = frozenset(e["name"] for e in answer.effects if e["state"] == "active")
            self._known.setdefault(kept, self._results(answer))
        return kept, self._known[kept]

    def results(self, chosen: Chosen, tolerance: float) -> Results | None:
        if chosen not in self._known:
            settled = {"include": sorted(chosen), "exclude": sorted(self.names - chosen)}
            self._known[chosen] = self._results(self._answer(settled, tolerance))
        return self._known[chosen]

    def _answer(self, effects: Any, tolerance: float) -> Answer:
        accuracy = max(_TIGHTEST, _SHARE * tolerance)
        return self._scene.solve(effects=effects, effect_tolerance=tolerance, accuracy=accuracy)

    def _results(self, answer: Answer) -> Results | None:
        return self._scene.results(answer) if answer.status == "succeeded" else None


def _verdict(solved: _Solved, tolerance: float, judge_needless: bool) -> Verdict:
    kept, found = solved.automatic(tolerance)
    change = math.inf if found is None else greatest_change(found, solved.exact)
    needless = None
    if judge_needless:
        without = {name: solved.results(kept - {name}, tolerance) for name in sorted(kept)}
        needless = tuple(n for n, r in without.items() if r is not None and _spared(r, solved.exact, tolerance))
    return Verdict(tolerance, len(solved.names - kept), len(kept), change, needless)


def _spared(without: Results, exact: Results, tolerance: float) -> bool:
    return greatest_change(without, exact) <= tolerance
