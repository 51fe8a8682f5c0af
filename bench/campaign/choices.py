"""Effects: does leaving out what ``auto`` leaves out stay within the tolerance, and was all that it kept needed?

Every scene is solved with all effects, with those that ``auto`` chooses at each tolerance, and with each of these left
out in turn. A skip is false when a result that there is with all effects is lost, or differs by more than the
tolerance; an effect kept is needless when leaving it out as well would have stayed within it and lost no result.

Where a solution says of itself that it is less exact than was asked, a difference that is no greater than what the two
solutions may be off tells nothing about effects: such a verdict could not be judged, and is counted apart.
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
    """One scene at one tolerance. ``needless`` is None where that was not asked.

    ``doubt`` is what the two solutions compared may be off by their own estimates, as far as these are above what was
    asked of them: 0 where both are as exact as asked.
    """

    tolerance: float
    skipped: int
    kept: int
    change: float
    needless: tuple[str, ...] | None
    doubt: float = 0.0

    @property
    def kept_promise(self) -> bool:
        return self.change <= self._allowed

    @property
    def judged(self) -> bool:
        """Whether the difference tells: it stays within the tolerance, or is beyond all doubt outside."""
        return self.kept_promise or self.change > self._allowed + self.doubt

    @property
    def _allowed(self) -> float:
        return self.tolerance * (1.0 + _SLACK)


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


@dataclass(frozen=True)
class _Solution:
    """The results of an answer; its own estimate where that is above the accuracy asked for, else 0."""

    results: Results
    doubt: float


class _Solved:
    """Answers of one scene by the effects that ran: tolerances that choose alike are solved once."""

    def __init__(self, scene: Scene, everything: Answer) -> None:
        self._scene = scene
        self._bounded = [_Bounded(e["name"], e["influence"]) for e in everything.effects]
        self.names = frozenset(e.name for e in self._bounded)
        self.exact = self._told(everything, _TIGHTEST)
        self._known: dict[Chosen, _Solution | None] = {self.names: self.exact}

    def automatic(self, tolerance: float) -> tuple[Chosen, _Solution | None]:
        """What ``auto`` keeps, and the results with that; the same choice is not solved twice."""
        expected = choose(self._bounded, None, AUTO, tolerance)
        kept = frozenset(e.name for e in expected.active)
        if kept not in self._known:
            answer, accuracy = self._answer("auto", tolerance)
            kept = frozenset(e["name"] for e in answer.effects if e["state"] == "active")
            self._known.setdefault(kept, self._told(answer, accuracy))
        return kept, self._known[kept]

    def with_only(self, chosen: Chosen, tolerance: float) -> _Solution | None:
        if chosen not in self._known:
            settled = {"include": sorted(chosen), "exclude": sorted(self.names - chosen)}
            self._known[chosen] = self._told(*self._answer(settled, tolerance))
        return self._known[chosen]

    def _answer(self, effects: Any, tolerance: float) -> tuple[Answer, float]:
        """An answer, and the accuracy that was asked of it."""
        accuracy = max(_TIGHTEST, _SHARE * tolerance)
        return self._scene.solve(effects=effects, effect_tolerance=tolerance, accuracy=accuracy), accuracy

    def _told(self, answer: Answer, accuracy: float) -> _Solution | None:
        if answer.status != "succeeded":
            return None
        estimated = answer.accuracy["estimated"]
        return _Solution(self._scene.results(answer), estimated if estimated > accuracy else 0.0)


def _verdict(solved: _Solved, tolerance: float, judge_needless: bool) -> Verdict:
    exact = solved.exact
    kept, found = solved.automatic(tolerance)
    change = math.inf if found is None else greatest_change(found.results, exact.results)
    doubt = 0.0 if found is None else found.doubt + exact.doubt
    needless = None
    if judge_needless:
        without = {name: solved.with_only(kept - {name}, tolerance) for name in sorted(kept)}
        needless = tuple(n for n, s in without.items() if s is not None and _spared(s, exact, tolerance))
    return Verdict(tolerance, len(solved.names - kept), len(kept), change, needless, doubt)


def _spared(without: _Solution, exact: _Solution, tolerance: float) -> bool:
    return greatest_change(without.results, exact.results) <= tolerance
