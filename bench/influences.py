"""Influences of the rod's effects against the truth.

The influence of an effect is an estimate, made before anything is solved, of how much the results would change without
it; `auto` leaves out effects by it. Here it is compared with the change itself: each scene of the campaign is solved
with all effects and without each in turn, to 1e-6. Ratios are given where the change is at least 20 times what the two
solutions may be off. Where the estimate is unbounded, the effect is always included; such scenes are counted apart.
The second table counts the effects that `auto` includes at each tolerance, of which those are needless that change no
result by more than the tolerance.

`python -m bench.influences [COUNT] [--first SEED]` writes the section of docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.campaign.choices import TOLERANCES
from bench.campaign.scenes import greatest_change, scene_of
from bench.campaign.seeds import TooLong, limited
from bench.sections import put
from solvers.rod.effects import EFFECTS
from solvers.rod.influences.situation import Situation

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"
HEADING = "## Influences of effects"
COUNT = 10_000
_ACCURACY, _CERTAIN, _LEAST, _LIMIT_S = 1e-6, 20.0, 1e-9, 25.0
_LOCAL = "stress_amplitude_mpa"
"""Reported at the governing section, which may switch between equally loaded ones: not an effect."""
_ESTIMATED = tuple(effect for effect in EFFECTS if effect.name != "friction")
"""All whose influence is not known exactly."""


class _Refused(Exception):
    """The check has no answer."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """The change of a scene's results without an effect, what both solutions may be off, and the effect's influence."""

    effect: str
    seed: int
    change: float
    off: float
    influence: float

    @property
    def is_certain(self) -> bool:
        return self.change > max(_CERTAIN * self.off, _LEAST)


def comparisons(seed: int) -> list[Comparison]:
    """Those of a scene; none if it takes too long, or if its vibration cannot be found."""
    scene, everything = scene_of("flexible-rod", seed), frozenset(effect.name for effect in EFFECTS)
    request = scene.request()
    situation = Situation(request.scene(), request.strip())

    def solved(names: frozenset[str]) -> tuple[dict[str, float], float]:
        chosen = {"include": sorted(names), "exclude": sorted(everything - names)}
        answer = scene.solve(effects=chosen, accuracy=_ACCURACY)
        if answer.accuracy is None:
            raise _Refused
        results = {name: value for name, value in scene.results(answer).items() if name != _LOCAL}
        return results, answer.accuracy["estimated"]

    found: list[Comparison] = []
    try:
        with limited(_LIMIT_S):
            exact, off = solved(everything)
            for effect in _ESTIMATED:
                without, beside = solved(everything - {effect.name})
                change = greatest_change(without, exact)
                found.append(Comparison(effect.name, seed, change, off + beside, effect.influence(situation)))
    except (TooLong, _Refused):
        return []
    return found


def table(count: int = 300, first: int = 0) -> list[str]:
    """The page's lines: scenes and date, a line for each effect, and a line for each tolerance."""
    with ProcessPoolExecutor() as workers:
        of_scenes = workers.map(comparisons, range(first, first + count), chunksize=20)
        found = [comparison for of_scene in of_scenes for comparison in of_scene]
    told = f"{datetime.now(UTC):%Y-%m-%d}: {count:,} scenes from seed {first}."
    return [told, "", *_by_effect([c for c in found if c.is_certain]), "", *_by_tolerance(found)]


def _by_effect(found: Sequence[Comparison]) -> list[str]:
    lines = [
        "| effect | changes | influence / change: median | 95 % | 99 % | below 1 | and a choice of `auto` spoiled | "
        "always included |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for effect in _ESTIMATED:
        own = [c for c in found if c.effect == effect.name]
        finite = [c for c in own if math.isfinite(c.change) and math.isfinite(c.influence)]
        low = [c for c in own if c.influence < c.change]
        spoiled = sorted({c.seed for c in low if any(c.influence <= t < c.change for t in TOLERANCES)})
        median, most, rare = np.quantile([c.influence / c.change for c in finite], [0.5, 0.95, 0.99])
        named = f"{len(spoiled)} (seeds {', '.join(map(str, spoiled))})" if spoiled else "0"
        lines.append(
            f"| {effect.name} | {len(finite):,} | {median:.2f} | {most:.1f} | {rare:.0f} | {len(low)} | {named} | "
            f"{sum(math.isinf(c.influence) for c in own):,} |"
        )
    return lines


def _by_tolerance(found: Sequence[Comparison]) -> list[str]:
    lines = ["| tolerance of effects | included | needless | |", "|---|---|---|---|"]
    for tolerance in TOLERANCES:
        included = [c for c in found if c.influence > tolerance and abs(c.change - tolerance) > c.off]
        needless = sum(c.change <= tolerance for c in included)
        lines.append(f"| {tolerance:g} | {len(included):,} | {needless:,} | {needless / len(included):.1%} |")
    return lines


def main() -> None:
    """Compare and write the section."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("count", nargs="?", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    asked = parser.parse_args()
    lines = [HEADING, "", __doc__.split("\n\n")[1].strip(), "", *table(asked.count, asked.first), ""]
    put(PAGE, HEADING, lines)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
