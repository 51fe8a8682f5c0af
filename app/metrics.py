"""Prometheus metrics of the service, in addition to the HTTP metrics of the instrumentation."""

from __future__ import annotations

import collections
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from prometheus_client import REGISTRY, Counter, Gauge, Histogram, Metric
from prometheus_client.core import CounterMetricFamily
from prometheus_client.registry import Collector

from app.jobs.fair_queue import FairQueue, JobLength
from app.store.faults import StoreFault

_SECONDS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)

SOLVES = Counter("crankwright_solves", "Finished solves", ["kind", "mode", "status"])
SOLVE_SECONDS = Histogram(
    "crankwright_solve_seconds", "Seconds from request to answer", ["kind", "mode"], buckets=_SECONDS
)
ENDED = Counter("crankwright_solves_cut", "Solves without an answer, by reason", ["reason"])
STORE_SECONDS = Histogram("crankwright_store_seconds", "Seconds per group of writes, commit included", buckets=_SECONDS)
STORE_FAULTS = Counter("crankwright_store_faults", "Groups of writes that failed", ["trouble"])
WAITING = Gauge("crankwright_queue_waiting", "Solves waiting for a worker", ["length"])
RUNNING = Gauge("crankwright_queue_running", "Solves running in a worker", ["length"])
BATCH_ITEMS = Counter("crankwright_batch_items", "Items of batches answered here", ["kind", "mode", "status"])
OPEN_BATCH_ITEMS = Gauge("crankwright_batch_items_open", "Items of all batches in the store that have no answer yet")
ACCEPTED = Gauge("crankwright_runs_promised", "Open runs accepted with 202")


Effects = tuple[tuple[str, str], ...]
"""Name and state of each effect of a scene."""


class _EffectsCollector(Collector):
    """Counts the effects of solved scenes: each scene once when it is solved, each of its effects at a scrape."""

    def __init__(self) -> None:
        self.solved: collections.Counter[tuple[str, Effects]] = collections.Counter()

    def collect(self) -> Iterator[Metric]:
        counted: collections.Counter[tuple[str, ...]] = collections.Counter()
        for (kind, effects), times in self.solved.items():
            for effect in effects:
                counted[kind, *effect] += times
        labels = ("kind", "effect", "state")
        found = CounterMetricFamily("crankwright_effects", "Effects of solved scenes", labels=labels)
        for values, times in counted.items():
            found.add_metric(values, times)
        yield found


EFFECTS = _EffectsCollector()
REGISTRY.register(EFFECTS)


@cache
def labelled(metric: Any, *values: str) -> Any:
    """A metric's child for these labels, cached, because the library's look-up validates and locks; there are few of
    them."""
    return metric.labels(*values)


def record_solve(kind: str, mode: str, status: str, seconds: float, effects: Effects) -> None:
    """Record a finished solve, with the name and the state of each effect."""
    labelled(SOLVES, kind, mode, status).inc()
    labelled(SOLVE_SECONDS, kind, mode).observe(seconds)
    EFFECTS.solved[kind, effects] += 1


def record_items(kind: str, mode: str, number: Mapping[str, int]) -> None:
    """Record stored items of a batch, their number by status."""
    for status, count in number.items():
        labelled(BATCH_ITEMS, kind, mode, status).inc(count)


def record_write(seconds: float, fault: StoreFault | None) -> None:
    """Record a group of writes, committed or failed."""
    STORE_SECONDS.observe(seconds)
    if fault is not None:
        STORE_FAULTS.labels(fault.kind.name.lower()).inc()


def watch(queue: FairQueue, accepted: Mapping[str, int]) -> None:
    """Collect the queue lengths at every scrape."""
    for length in JobLength:
        WAITING.labels(length).set_function(lambda length=length: queue.waiting(length))
        RUNNING.labels(length).set_function(lambda length=length: queue.running(length))
    ACCEPTED.set_function(lambda: sum(accepted.values()))
