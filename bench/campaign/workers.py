"""Parallel evaluation of seeds in order, until seeds or time run out."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import islice

from bench.campaign.seeds import Part, judge_seed

Judge = Callable[[str, int, float], list[Part]]

_QUEUED_BATCHES = 3
"""Batches queued per process; those are still judged when the time is up."""


def _judge(judge: Judge, slug: str, seeds: list[int], limit: float) -> list[Part]:
    return [part for seed in seeds for part in judge(slug, seed, limit)]


def _batches(seeds: Iterable[int], size: int) -> Iterator[list[int]]:
    remaining = iter(seeds)
    while batch := list(islice(remaining, size)):
        yield batch


def judged(
    slug: str,
    seeds: Iterable[int],
    limit: float,
    seconds: float,
    processes: int | None = None,
    batch: int = 4,
    clock: Callable[[], float] = time.perf_counter,
    judge: Judge = judge_seed,
) -> Iterator[list[Part]]:
    """Yield the seeds' results in batches as they finish. Seeds are started in order; none is started after
    ``seconds``."""
    processes = processes or os.cpu_count() or 1
    ended, waiting = clock() + seconds, _batches(seeds, batch)
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        running: set[Future[list[Part]]] = set()
        while True:
            room = _QUEUED_BATCHES * processes - len(running)
            if clock() < ended:
                running |= {pool.submit(_judge, judge, slug, seeds, limit) for seeds in islice(waiting, room)}
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
