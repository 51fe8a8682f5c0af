"""`make campaign`: test estimates, effect choices and certificates on random scenes of every kind, and write
docs/campaign.md.

python -m bench.campaign [--scenes N] [--designs N] [--realistic N] [--seeds S ...] [--minutes M] [--limit S]
                         [--processes P] [KIND ...]

Each kind stops after a number of scenes or minutes, and of designs or minutes, whichever comes first; the page states
how many there were and how long they took. Sections are updated every minute.

Realistic rods with seeds beyond the benchmark's are contested as well: they are printed, the page covers the
benchmark's.

Results are stored in `.campaign/`: an interrupted campaign is resumed as long as the sources its results depend on are
unchanged, and restarted kind by kind otherwise (see ``kept``). The page covers all requested scenes judged so far, in
any run.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime

# Before importing numpy, here and in child processes: one process per processor, one thread each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bench.campaign.designs import DESIGNED
from bench.campaign.designs_page import designs_section
from bench.campaign.kept import Kept, kept
from bench.campaign.page import PAGE, section, written
from bench.campaign.rod_contests_page import contests_section
from bench.campaign.scenes import DRAWN
from bench.campaign.seeds import Part, judge_contested, judge_designed
from bench.campaign.workers import judged

Section = Callable[[str, Sequence[Part], str], str]

SCENES, DESIGNS, REALISTIC = 10_000, 2_000, 1_000
_ROD = "flexible-rod"
LIMIT_S = 300.0
_WRITE_INTERVAL_S = 60.0


def run(slug: str, count: int, first: int, limit: float, seconds: float, processes: int) -> None:
    """Run the scenes of a kind, updating its section."""
    known, asked = kept(slug, limit), range(first, first + count)
    _keep(known, judged(slug, _further(known, asked), limit, seconds, processes), slug, asked, section)


def run_designs(slug: str, count: int, first: int, limit: float, seconds: float, processes: int) -> None:
    """Run the designs of a kind, updating its section."""
    known, asked = kept(slug, limit, "-designs"), range(first, first + count)
    found = judged(slug, _further(known, asked), limit, seconds, processes, batch=1, judge=judge_designed)
    _keep(known, found, slug, asked, designs_section)


def run_contests(seeds: Sequence[int], limit: float, seconds: float, processes: int) -> None:
    """Put realistic rod designs to their rivals. Their section covers all of the benchmark's problems judged so far;
    where others are among the seeds, these alone are told, and printed."""
    known, of_page = kept(_ROD, limit, "-contests"), max(seeds) < REALISTIC
    found = judged(_ROD, _further(known, seeds), limit, seconds, processes, batch=1, judge=judge_contested)
    _keep(known, found, _ROD, range(REALISTIC) if of_page else seeds, contests_section, of_page)


def _further(known: Kept, asked: Sequence[int]) -> Iterator[int]:
    done = known.seeds
    return (seed for seed in asked if seed not in done)


def _keep(
    known: Kept, judged: Iterator[list[Part]], slug: str, asked: Sequence[int], section: Section, of_page: bool = True
) -> None:
    last = time.perf_counter()
    for found in judged:
        known.add(found)
        if time.perf_counter() - last > _WRITE_INTERVAL_S:
            last = time.perf_counter()
            _write(slug, known.parts, asked, section, of_page)
    _write(slug, known.parts, asked, section, of_page)


def _write(slug: str, parts: list[Part], asked: Sequence[int], section: Section, of_page: bool) -> None:
    told = sorted((part for part in parts if part.seed in asked), key=lambda part: part.seed)
    text = section(slug, told, f"{datetime.now(UTC):%Y-%m-%d}")
    if of_page:
        PAGE.write_text(written(PAGE.read_text("utf-8") if PAGE.exists() else "", text), "utf-8")
    print(text, flush=True)


def main() -> None:
    """Run the campaign and write the page."""
    asked = argparse.ArgumentParser(prog="python -m bench.campaign", description="hold the promises to random scenes")
    asked.add_argument("--scenes", type=int, default=SCENES, help="of each kind, at most")
    asked.add_argument("--designs", type=int, default=DESIGNS, help="of each kind, at most")
    asked.add_argument("--realistic", type=int, default=REALISTIC, help="realistic rods with many rivals, at most")
    asked.add_argument("--seeds", type=int, nargs="+", help="of the realistic rods, any, instead of the first ones")
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
        if given.realistic and slug == _ROD:
            seeds = given.seeds or range(given.first, given.first + given.realistic)
            run_contests(seeds, given.limit, 60.0 * given.minutes, given.processes)


if __name__ == "__main__":
    main()
