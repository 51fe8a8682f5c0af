"""Selection of effects: does omitting what ``auto`` omits stay within the tolerance, and was everything kept needed?

Every scene is solved with all effects, with those ``auto`` selects at each tolerance, and with each of these omitted in
turn. An omission is wrong if a result is lost or differs by more than the tolerance; a kept effect is unnecessary if
omitting it, too, would have stayed within it without losing a result.

Solutions are only as accurate as the verdict requires: a rough one suffices if the difference is clearly above or below
the tolerance.

If a solution reports that it missed its accuracy, a difference within the combined uncertainty is inconclusive; such
verdicts are counted separately.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from app.designs.kind import Answer
from bench.campaign.scenes import Results, Scene, greatest_change
from solvers.effects import AUTO, choose

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_TIGHTEST = 1e-9
_SHARES = (0.2, 1e-2, 1e-3)
"""Accuracies relative to the tolerance, tried in order while the verdict is open."""
_ROUGH_ACCURACY = 1e-3
"""First accuracy for omitting a kept effect, which usually changes a lot."""
_CLEAR = 0.5
"""Fraction of the tolerance below which no second solution is needed."""
_SLACK = 4e-3
"""Combined error of two of the most accurate solutions as a fraction of the tolerance."""

_LOCAL_RESULTS = frozenset({"stress_amplitude_mpa"})
"""Reported at the governing section, which may switch between equally loaded ones: not an effect."""

Chosen = frozenset[str]


@dataclass(frozen=True)
class Verdict:
    """One scene at one tolerance. ``needless`` is None if not tested.

    ``doubt``: combined error of the two compared solutions, as far as it exceeds the requested accuracy; 0 if both are
    accurate.
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
        """Whether the result is conclusive: within the tolerance, or outside by more than the uncertainty."""
        return self.kept_promise or self.change > self._allowed + self.doubt

    @property
    def _allowed(self) -> float:
        return self.tolerance * (1.0 + _SLACK)


def judge_choice(
    scene: Scene, tolerances: Iterable[float] = TOLERANCES, needless: bool = True
) -> tuple[Verdict, ...] | None:
    """Judge a scene's choice of effects at every tolerance; None if it has no answer with all effects."""
    # From tight to loose, so that accurate solutions are reused.
    tolerances = sorted(tolerances)
    solved = _Solved.of(scene, tolerances[0])
    return None if solved is None else tuple(_verdict(solved, tolerance, needless) for tolerance in tolerances)


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
    """Results of an answer and their estimated error; ``asked`` is the requested accuracy."""

    results: Results
    asked: float
    estimated: float

    def doubt(self, accuracy: float) -> float:
        """The estimate where that is above this accuracy."""
        return self.estimated if self.estimated > accuracy else 0.0

    def serves(self, accuracy: float) -> bool:
        return min(self.asked, self.estimated) <= max(accuracy, _TIGHTEST)

    def next_asked(self, accuracy: float) -> float:
        """The accuracy to request; a solution that missed its own gets one retry."""
        return _TIGHTEST if self.estimated > self.asked else accuracy


@dataclass(frozen=True)
class _Difference:
    """A comparison of two solutions and their combined error; ``missed`` is the part above the requested accuracy."""

    change: float
    off: float
    missed: float

    def settles(self, tolerance: float) -> bool:
        """Whether no more exact solutions are needed, or none that would show less of a difference can be had."""
        if self.missed and self.change <= _CLEAR * tolerance:
            return True
        within, beyond = self.change + self.off <= tolerance, self.change - self.off > tolerance
        return self.change == 0.0 or within or beyond


class _Solved:
    """Cache of one scene's solutions by active effects; re-solved only for a tighter accuracy."""

    def __init__(self, scene: Scene, bounded: list[_Bounded], known: dict[Chosen, _Solution | None]) -> None:
        self._scene, self._bounded, self._known = scene, bounded, known
        self.names = frozenset(e.name for e in bounded)

    @staticmethod
    def of(scene: Scene, tolerance: float) -> _Solved | None:
        """Initialise with the solution with all effects at the first accuracy; None if it has no answer."""
        accuracy = _SHARES[0] * tolerance
        everything = scene.solve(effects="all", accuracy=accuracy)
        if everything.status != "succeeded":
            return None
        bounded = [_Bounded(e["name"], e["influence"]) for e in everything.effects]
        names = frozenset(e.name for e in bounded)
        return _Solved(scene, bounded, {names: _solution_of(scene, everything, accuracy)})

    def automatic(self, tolerance: float) -> tuple[Chosen, _Difference]:
        """The effects kept by ``auto``, and the difference from all effects."""
        kept = frozenset(e.name for e in choose(self._bounded, None, AUTO, tolerance).active)
        if kept not in self._known:
            accuracy = max(_TIGHTEST, _SHARES[0] * tolerance)
            answer = self._scene.solve(effects="auto", effect_tolerance=tolerance, accuracy=accuracy)
            kept = _active_effects(answer)
            self._known.setdefault(kept, _solution_of(self._scene, answer, accuracy))
        return kept, self.difference(kept, tolerance, [share * tolerance for share in _SHARES])

    def spares(self, chosen: Chosen, tolerance: float) -> bool:
        """Whether the chosen effects alone stay within the tolerance."""
        tight = [share * tolerance for share in _SHARES]
        rough = [_ROUGH_ACCURACY] if tight[0] < _ROUGH_ACCURACY else []
        return self.difference(chosen, tolerance, rough + tight).change <= tolerance

    def difference(self, chosen: Chosen, tolerance: float, accuracies: list[float]) -> _Difference:
        """Difference from all effects, at the first of the accuracies that makes it conclusive."""
        if chosen == self.names:
            return _Difference(0.0, 0.0, 0.0)
        for accuracy in accuracies:
            pair = self._solution(chosen, accuracy), self._solution(self.names, accuracy)
            if None in pair:
                return _Difference(math.inf, 0.0, 0.0)
            found, exact = pair
            off, missed = found.estimated + exact.estimated, found.doubt(accuracy) + exact.doubt(accuracy)
            difference = _Difference(greatest_change(found.results, exact.results), off, missed)
            if difference.settles(tolerance):
                break
        return difference

    def _solution(self, chosen: Chosen, accuracy: float) -> _Solution | None:
        known = self._known.get(chosen)
        if chosen in self._known and (known is None or known.serves(accuracy)):
            return known
        accuracy = max(_TIGHTEST, known.next_asked(accuracy) if known else accuracy)
        settled = {"include": sorted(chosen), "exclude": sorted(self.names - chosen)}
        answer = self._scene.solve(effects="all" if chosen == self.names else settled, accuracy=accuracy)
        self._known[chosen] = _solution_of(self._scene, answer, accuracy)
        return self._known[chosen]


def _active_effects(answer: Answer) -> Chosen:
    return frozenset(e["name"] for e in answer.effects if e["state"] == "active")


def _solution_of(scene: Scene, answer: Answer, accuracy: float) -> _Solution | None:
    if answer.status != "succeeded":
        return None
    told = {name: value for name, value in scene.results(answer).items() if name not in _LOCAL_RESULTS}
    return _Solution(told, accuracy, answer.accuracy["estimated"])


def _verdict(solved: _Solved, tolerance: float, judge_needless: bool) -> Verdict:
    kept, difference = solved.automatic(tolerance)
    needless = None
    if judge_needless:
        needless = tuple(name for name in sorted(kept) if solved.spares(kept - {name}, tolerance))
    skipped = len(solved.names - kept)
    return Verdict(tolerance, skipped, len(kept), difference.change, needless, difference.missed)
