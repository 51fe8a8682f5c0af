"""`make campaign`: hold the promises against random scenes of every kind and write docs/campaign.md.

python -m bench.campaign [SCENES [KIND ...]]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from app.designs.registry import KINDS
from bench.campaign.choices import TOLERANCES, choices
from bench.campaign.combinations import combinations
from bench.campaign.honesty import honesty
from bench.campaign.scenes import DRAWN, scenes

PAGE = Path(__file__).parents[2] / "docs" / "campaign.md"
SCENES = 10_000
_COMBINED = 20
"""Of each kind's scenes are solved with every combination of effects."""


def sections(slug: str, count: int) -> Iterator[str]:
    """The page's part on one kind."""
    started = time.perf_counter()
    judged = honesty(scenes(slug, count))
    chosen = choices(scenes(slug, count))
    combined = combinations(scenes(slug, min(count, _COMBINED)))
    yield f"## {KINDS[slug].title}"
    yield ""
    yield f"{count:,} scenes, of which {judged.without_answer} have no answer; {time.perf_counter() - started:,.0f} s."
    yield ""
    yield "| promise | held | seeds where it was not |"
    yield "|---|---|---|"
    total = len(judged.judged)
    yield _row("the true error is at most the estimate", total, judged.dishonest)
    yield _row("the accuracy asked for is met", total, judged.missed)
    yield _row("`auto` stays within its tolerance of all effects", len(chosen.verdicts), chosen.false_skips)
    broken = tuple(seed for seed, _ in combined.broken)
    yield _row("every combination of effects has a finite answer, or a reason", combined.run, broken)
    yield ""
    yield (
        f"The estimate is {judged.median_ratio:.3g} times the error in the median. Over the tolerances from "
        f"{TOLERANCES[0]:g} to {TOLERANCES[-1]:g}, `auto` leaves out {chosen.skipped_share:.0%} of the effects; "
        f"{chosen.needless_share:.0%} of those it keeps could have been left out as well."
    )
    yield ""


def _row(promise: str, total: int, seeds: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, sorted(set(seeds))[:10])) or "none"
    return f"| {promise} | {total - len(seeds):,} of {total:,} | {shown} |"


def main(count: int, slugs: list[str]) -> None:
    """Run the campaign and write the page."""
    lines = [
        "# The campaign",
        "",
        f"Written by `make campaign` on {datetime.now(UTC):%Y-%m-%d}. Scenes are random, each made again by its seed; "
        "a quarter of them is hard.",
        "",
    ]
    for slug in slugs:
        lines += sections(slug, count)
    PAGE.write_text("\n".join(lines), "utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SCENES, sys.argv[2:] or list(DRAWN))
