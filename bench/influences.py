"""Influences of the rod's effects against the truth.

The influence of an effect is an estimate, made before anything is solved, of how much the results would change without
it; `auto` leaves out effects by it. Here it is compared with the change itself: each scene of the campaign is solved
with all effects and without each in turn, to 1e-6. Ratios are given where the change is at least 20 times what the two
solutions may be off. Where the estimate is unbounded, the effect is always included; such scenes are counted apart.

`python -m bench.influences [COUNT] [--first SEED]` writes the section of docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.campaign.choices import TOLERANCES
from bench.campaign.scenes import greatest_change, scene_of
from bench.campaign.seeds import TooLong, limited
from bench.sections import put
from solvers.rod.effect_bounds.situation import Situation
from solvers.rod.effects import EFFECTS

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"
HEADING = "## Influences of effects"
COUNT = 10_000
_ACCURACY, _CERTAIN, _LEAST, _LIMIT_S = 1e-6, 20.0, 1e-9, 25.0
_LOCAL = "stress_amplitude_mpa"
"""Reported at the governing section, which may switch between equally loaded ones: not an effect."""
_ESTIMATED = tuple(effect for effect in EFFECTS if effect.name != "friction")
"""All whose influence is not known exactly."""

Ratio = tuple[str, int, float, float]
"""An effect's name, the scene's seed, the change without the effect, and its influence."""


def ratios(seed: int) -> list[Ratio]:
    """Those of a scene; none if it takes too long."""
    scene, everything = scene_of("flexible-rod", seed), frozenset(effect.name for effect in EFFECTS)
    request = scene.request()
    situation = Situation(request.scene(), request.strip())

    def solved(names: frozenset[str]) -> tuple[dict[str, float], float]:
        chosen = {"include": sorted(names), "exclude": sorted(everything - names)}
        answer = scene.solve(effects=chosen, accuracy=_ACCURACY)
        results = {name: value for name, value in scene.results(answer).items() if name != _LOCAL}
        return results, answer.accuracy["estimated"]

    found: list[Ratio] = []
    try:
        with limited(_LIMIT_S):
            exact, off = solved(everything)
            for effect in _ESTIMATED:
                without, beside = solved(everything - {effect.name})
                change = greatest_change(without, exact)
                if change > max(_CERTAIN * (off + beside), _LEAST):
                    found.append((effect.name, seed, change, effect.influence(situation)))
    except TooLong:
        return []
    return found


def table(count: int = 300, first: int = 0) -> list[str]:
    """The page's lines: scenes and date, and a line for each effect."""
    with ProcessPoolExecutor() as workers:
        of_scenes = workers.map(ratios, range(first, first + count), chunksize=20)
        found = [ratio for of_scene in of_scenes for ratio in of_scene]
    return [f"{datetime.now(UTC):%Y-%m-%d}: {count:,} scenes from seed {first}.", "", *_lines(found)]


def _lines(found: Sequence[Ratio]) -> list[str]:
    lines = [
        "| effect | changes | influence / change: median | 95 % | 99 % | below 1 | and a choice of `auto` spoiled | "
        "always included |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for effect in _ESTIMATED:
        own = [(seed, change, influence) for name, seed, change, influence in found if name == effect.name]
        finite = [(seed, c, i) for seed, c, i in own if math.isfinite(c) and math.isfinite(i)]
        ratio = np.array([influence / change for _, change, influence in finite])
        low = [(seed, c, i) for seed, c, i in own if i < c]
        spoiled = sorted({seed for seed, c, i in low if any(i <= tolerance < c for tolerance in TOLERANCES)})
        median, most, rare = np.quantile(ratio, [0.5, 0.95, 0.99])
        named = f"{len(spoiled)} (seeds {', '.join(map(str, spoiled))})" if spoiled else "0"
        lines.append(
            f"| {effect.name} | {len(finite):,} | {median:.2f} | {most:.1f} | {rare:.0f} | {len(low)} | {named} | "
            f"{sum(math.isinf(i) for _, _, i in own):,} |"
        )
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
