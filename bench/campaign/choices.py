"""Effects: does leaving out what ``auto`` leaves out stay within the tolerance, and was all that it kept needed?

Every scene is solved with all effects, with those that ``auto`` chooses at each tolerance, and with each of these left
out in turn. A skip is false when the results that there are differ from those with all effects by more than the
tolerance; an effect kept is needless when leaving it out as well would have stayed within it and lost no result.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bench.campaign.scenes import Results, Scene, greatest_change

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_ACCURACY = 1e-9
_SLACK = 4e-9
"""What the numerical errors of two solutions may add."""

Chosen = frozenset[str]


@dataclass(frozen=True)
class Verdict:
    """One scene at one tolerance."""

    seed: int
    tolerance: float
    skipped: tuple[str, ...]
    change: float
    kept: tuple[str, ...]
    needless: tuple[str, ...]

    @property
    def kept_promise(self) -> bool:
        return self.change <= self.tolerance + _SLACK


@dataclass(frozen=True)
class Choices:
    """All scenes of a kind at all tolerances."""

    verdicts: tuple[Verdict, ...]
    without_answer: int

    @property
    def false_skips(self) -> tuple[int, ...]:
        return tuple(v.seed for v in self.verdicts if not v.kept_promise)

    @property
    def needless_share(self) -> float:
        kept = sum(len(v.kept) for v in self.verdicts)
        return sum(len(v.needless) for v in self.verdicts) / kept if kept else 0.0

    @property
    def skipped_share(self) -> float:
        skipped = sum(len(v.skipped) for v in self.verdicts)
        every = skipped + sum(len(v.kept) for v in self.verdicts)
        return skipped / every if every else 0.0


def choices(scenes: Iterable[Scene], tolerances: Iterable[float] = TOLERANCES) -> Choices:
    """Judge every scene's choice of effects at every tolerance."""
    verdicts, without = [], 0
    for scene in scenes:
        everything = scene.solve(effects="all", accuracy=_ACCURACY)
        if everything.status != "succeeded":
            without += 1
            continue
        solved = _Solved(scene)
        exact = scene.results(everything)
        for tolerance in tolerances:
            verdicts.append(_verdict(scene, solved, exact, tolerance))
    return Choices(tuple(verdicts), without)


class _Solved:
    """Answers of one scene by the effects that ran: tolerances that choose alike are solved once."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._names = [effect["name"] for effect in scene.kind.effects()]
        self._known: dict[Chosen, Results | None] = {}

    def results(self, chosen: Chosen) -> Results | None:
        if chosen not in self._known:
            settled = {"include": sorted(chosen), "exclude": sorted(set(self._names) - chosen)}
            answer = self._scene.solve(effects=settled, accuracy=_ACCURACY)
            self._known[chosen] = self._scene.results(answer) if answer.status == "succeeded" else None
        return self._known[chosen]


def _verdict(scene: Scene, solved: _Solved, exact: Results, tolerance: float) -> Verdict:
    # The manifest is the same at any accuracy, and a loose one is quickly had.
    manifest = scene.solve(effects="auto", effect_tolerance=tolerance, accuracy=1e-2).effects
    kept = frozenset(e["name"] for e in manifest if e["state"] == "active")
    skipped = tuple(e["name"] for e in manifest if e["state"] == "skipped")
    found = solved.results(kept)
    change = float("inf") if found is None else greatest_change(found, {n: x for n, x in exact.items() if n in found})
    needless = []
    for name in sorted(kept):
        without = solved.results(kept - {name})
        if without is not None and greatest_change(without, exact) <= tolerance:
            needless.append(name)
    return Verdict(scene.seed, tolerance, skipped, change, tuple(sorted(kept)), tuple(needless))
