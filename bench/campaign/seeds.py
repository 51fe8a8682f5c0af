"""Evaluation of one seed of a kind in all respects, each with a time limit."""

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
from bench.campaign.rod_contests import judge_contest
from bench.campaign.scenes import scene_of

COMBINED_EVERY = 50
"""Interval of seeds whose scenes are solved with every combination of effects."""
STRONG_EVERY = 5
"""Interval of designs with the strongest competitors; the others have fewer."""
NEEDLESS_EVERY: Mapping[str, int] = {"flexible-rod": 10}
"""Interval of scenes for testing unnecessary effects, for kinds with many expensive ones."""

_AGAIN_S = 1e-3
"""Between two tries to end a part."""

ESTIMATE, CHOICE, COMBINATIONS, DESIGN, CONTEST = "estimate", "effects", "combinations", "design", "contest"


@dataclass(frozen=True)
class Part:
    """One aspect of one seed. ``verdict`` is None if there is no answer to judge.

    ``trouble``: a timeout or error; empty if completed.
    """

    seed: int
    name: str
    seconds: float
    verdict: object | None
    trouble: str = ""


class TooLong(BaseException):
    """A BaseException, so that no ``except Exception`` swallows it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """A time limit; in a process's main thread only.

    A compiled kernel calls functions of numba to make arrays of its results and does not ask whether they succeeded: an
    exception raised there comes as a SystemError, wherever that is noticed. Until they have returned the end waits.
    """

    def ring(_signal: int, frame: FrameType | None) -> None:
        while frame is not None:
            if frame.f_globals.get("__name__", "").startswith("numba."):
                signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
                return
            frame = frame.f_back
        raise TooLong

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def judge_seed(slug: str, seed: int, limit: float) -> list[Part]:
    """All aspects of a seed's scene; ``limit`` [s] bounds each."""
    scene, needless = scene_of(slug, seed), seed % NEEDLESS_EVERY.get(slug, 1) == 0
    judges: dict[str, Callable[[], object | None]] = {
        ESTIMATE: lambda: judge_estimate(scene),
        CHOICE: lambda: judge_choice(scene, needless=needless),
    }
    if seed % COMBINED_EVERY == 0:
        judges[COMBINATIONS] = lambda: judge_combinations(scene)
    return [_part(seed, name, judge, limit) for name, judge in judges.items()]


def judge_designed(slug: str, seed: int, limit: float) -> list[Part]:
    """The design problem of a seed with its competitors, within ``limit`` [s]."""
    return [_part(seed, DESIGN, lambda: judge_design(slug, seed, quick=seed % STRONG_EVERY != 0), limit)]


def judge_contested(slug: str, seed: int, limit: float) -> list[Part]:
    """The realistic rod design of a seed with its competitors, within ``limit`` [s]."""
    return [_part(seed, CONTEST, lambda: judge_contest(seed), limit)]


def _part(seed: int, name: str, judge: Callable[[], object | None], limit: float) -> Part:
    started, verdict, trouble = time.perf_counter(), None, ""
    try:
        with limited(limit):
            verdict = judge()
    except TooLong:
        trouble = f"took more than {limit:g} s"
    except Exception as error:
        trouble = f"{type(error).__name__}: {error}"
    return Part(seed, name, time.perf_counter() - started, verdict, trouble)
