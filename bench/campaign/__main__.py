"""`make campaign`: hold the promises against random scenes of every kind and write docs/campaign.md.

python -m bench.campaign [--scenes N] [--designs N] [--minutes M] [--limit S] [--processes P] [KIND ...]

Each kind stops at so many scenes or minutes, and at so many designs or minutes, whichever comes first; the page says
how many there were, and how long they took together. A section is written again every minute, the others stay.

What was judged is kept in `.campaign/`: a campaign that was interrupted, or ran out of its minutes, goes on where it
stopped when it is started again, as long as the sources that its verdicts depend on are the same; with others it starts
anew, kind by kind (see ``kept``). The page tells of all scenes asked for that have been judged, in whichever run.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime

# Before numpy is there, here and in the processes that inherit this: one process a processor, one thread each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bench.campaign.designs import DESIGNED
from bench.campaign.designs_page import designs_section
from bench.campaign.kept import Kept, kept
from bench.campaign.page import PAGE, section, written
from bench.campaign.scenes import DRAWN
from bench.campaign.seeds import Part, judge_designed
from bench.campaign.workers import judged

Section = Callable[[str, Sequence[Part], str], str]

SCENES, DESIGNS = 10_000, 2_000
LIMIT_S = 300.0
_WRITTEN_EVERY_S = 60.0


def run(slug: str, count: int, first: int, limit: float, seconds: float, processes: int) -> None:
    """One kind, its section written as it grows."""
    known, asked = kept(slug, limit), range(first, first + count)
    _keep(known, judged(slug, _further(known, asked), limit, seconds, processes), slug, asked, section)


def run_designs(slug: str, count: int, first: int, limit: float, seconds: float, processes: int) -> None:
    """A kind's designs, likewise."""
    known, asked = kept(slug, limit, "-designs"), range(first, first + count)
    found = judged(slug, _further(known, asked), limit, seconds, processes, batch=1, judge=judge_designed)
    _keep(known, found, slug, asked, designs_section)


def _further(known: Kept, asked: range) -> Iterator[int]:
    done = known.seeds
    return (seed for seed in asked if seed not in done)


def _keep(known: Kept, judged: Iterator[list[Part]], slug: str, asked: range, section: Section) -> None:
    last = time.perf_counter()
    for found in judged:
        known.add(found)
        if time.perf_counter() - last > _WRITTEN_EVERY_S:
            last = time.perf_counter()
            _write(slug, known.parts, asked, section)
    _write(slug, known.parts, asked, section)


def _write(slug: str, parts: list[Part], asked: range, section: Section) -> None:
    told = sorted((part for part in parts if part.seed in asked), key=lambda part: part.seed)
    text = section(slug, told, f"{datetime.now(UTC):%Y-%m-%d}")
    PAGE.write_text(written(PAGE.read_text("utf-8") if PAGE.exists() else "", text), "utf-8")
    print(text, flush=True)


def main() -> None:
    """Run the campaign and write the page."""
    asked = argparse.ArgumentParser(prog="python -m bench.campaign", description="hold the promises to random scenes")
    asked.add_argument("--scenes", type=int, default=SCENES, help="of each kind, at most")
    asked.add_argument("--designs", type=int, default=DESIGNS, help="of each kind, at most")
    asked.add_argument("--first", type=int, default=0, help="seed of the first scene")
    asked.add_argument("--minutes", type=float, default=math.inf, help="for each kind, at most")
    asked.add_argument("--limit", type=float, default=LIMIT_S, help="seconds for each part of a scene")
    asked.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    asked.add_argument("kinds", nargs="*", default=list(DRAWN), metavar="KIND", help=", ".join(DRAWN))
    given = asked.parse_args()
    for unknown in set(given.kinds) - DRAWN.keys():
        asked.error(f"there is no kind {unknown}")
    for slug in given.kinds:
        if given.scenes:
            run(slug, given.scenes, given.first, given.limit, 60.0 * given.minutes, given.processes)
        if given.designs and slug in DESIGNED:
            run_designs(slug, given.designs, given.first, given.limit, 60.0 * given.minutes, given.processes)


if __name__ == "__main__":
    main()
