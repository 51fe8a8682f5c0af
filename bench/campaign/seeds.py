"""One seed of a kind, judged in every respect that it is drawn for, each within a bounded time."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from bench.campaign.choices import judge_choice
from bench.campaign.combinations import judge_combinations
from bench.campaign.designs import judge_design
from bench.campaign.honesty import judge_estimate
from bench.campaign.scenes import scene_of

COMBINED_EVERY = 50
"""Of the seeds, those whose scenes are solved with every combination of effects."""
STRONG_EVERY = 5
"""Of the designs, those that meet rivals at their strongest; the others meet fewer."""
NEEDLESS_EVERY: Mapping[str, int] = {"flexible-rod": 10}
"""Where a scene's effects are many and dear, whether one was needless is a share that a part of the scenes tells."""

ESTIMATE, CHOICE, COMBINATIONS, DESIGN = "estimate", "effects", "combinations", "design"


@dataclass(frozen=True)
class Part:
    """One respect of one seed. ``verdict`` is None where there is no answer to judge.

    ``trouble`` says that it took too long, or which error it ended in; empty where it came to its end.
    """

    seed: int
    name: str
    seconds: float
    verdict: object | None
    trouble: str = ""


class _TooLong(BaseException):
    """No ``except Exception`` on the way must swallow it."""


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Ends whatever takes longer; in a process's main thread only."""

    def ring(_signal: int, _frame: FrameType | None) -> None:
        raise _TooLong

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def judge_seed(slug: str, seed: int, limit: float) -> list[Part]:
    """Everything that a seed's scene of a kind is judged by; ``limit`` [s] bounds each part."""
    scene, needless = scene_of(slug, seed), seed % NEEDLESS_EVERY.get(slug, 1) == 0
    judges: dict[str, Callable[[], object | None]] = {
        ESTIMATE: lambda: judge_estimate(scene),
        CHOICE: lambda: judge_choice(scene, needless=needless),
    }
    if seed % COMBINED_EVERY == 0:
        judges[COMBINATIONS] = lambda: judge_combinations(scene)
    return [_part(seed, name, judge, limit) for name, judge in judges.items()]


def judge_designed(slug: str, seed: int, limit: float) -> list[Part]:
    """The design problem of a seed, against its rivals, within ``limit`` [s]."""
    return [_part(seed, DESIGN, lambda: judge_design(slug, seed, quick=seed % STRONG_EVERY != 0), limit)]


def _part(seed: int, name: str, judge: Callable[[], object | None], limit: float) -> Part:
    started, verdict, trouble = time.perf_counter(), None, ""
    try:
        with _limited(limit):
            verdict = judge()
    except _TooLong:
        trouble = f"took more than {limit:g} s"
    except Exception as error:
        trouble = f"{type(error).__name__}: {error}"
    return Part(seed, name, time.perf_counter() - started, verdict, trouble)
