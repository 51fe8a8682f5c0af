"""Batch engine: poison items are isolated, all others are solved, and kills neither lose nor duplicate items."""

from __future__ import annotations

import asyncio
import json
import os
import random
import signal
import subprocess
import sys
import time
import tracemalloc
from collections.abc import AsyncIterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.batches import engine as engines
from app.batches.service import Asked, BatchService
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.jobs.errors import WorkerCrashed
from app.store.batch_inputs import Row, Source
from app.store.batch_items import packed, unpacked
from app.store.batch_operations import Claim
from app.store.batch_reads import items_after
from app.store.batch_records import BatchRecord, Item
from app.store.repository import RunStore
from app.store.verify import verify
from app.store.viewer import seeing_as
from tests.app.batches import fake
from tests.app.batches.in_process import InProcess
from tests.app.running import descendants, parents, wait_until
from tests.child_processes import die_with_test_runner
from tests.databases import sqlite_database

KILLS, ITEMS = 2, 5000
"""Number of kills, with fake workers; ``tests.reliability.kills`` runs many more with real ones."""


async def submitted(service: BatchService, bodies: list[dict[str, Any]], key: str | None = None) -> str:
    async def stream() -> AsyncIterator[bytes]:
        for body in bodies:
            yield json.dumps(body).encode() + b"\n"

    answer = await service.take_lines(Asked("crank-masses", "analysis"), False, stream(), key)
    return json.loads(answer)["id"]


async def over(service: BatchService, batch_id: str) -> BatchRecord:
    async for batch in service.progress(batch_id, lambda: False):
        last = batch
    return last


async def stored(store: RunStore, batch: BatchRecord) -> list[Item]:
    return await store.query(lambda connection: items_after(connection, batch.number, -1, 10**7))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "_INITIAL_ITEM_S", dict.fromkeys(engines._INITIAL_ITEM_S, 1e-3))


def test_items_are_compressed_with_the_first_of_their_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "_DICTIONARY_S", 60.0)
    example = KINDS["impact-linkage"].example(Mode.CHECK)
    body = {name: value for name, value in example.items() if name not in ("drive", "coupler_stiffness_n_m")}
    first, other = ({**body, "blow_frequency_hz": frequency} for frequency in (21.3, 24.7))
    engine = engines.BatchEngine(None, InProcess(), 10.0)  # type: ignore[arg-type]

    async def story(content: bytes | None) -> bytes:
        row = None if content is None else Row(1, content)
        return await engine.dictionary("impact-linkage", "check", "scalars", Source("ndjson"), row)

    async def solved() -> bytes:
        request = KINDS["impact-linkage"].jobs[Mode.CHECK].request.model_validate(other)
        return await engine._item("impact-linkage", "check", "scalars", request)

    own, general = asyncio.run(story(json.dumps(first).encode())), asyncio.run(story(None))
    assert json.loads(own)["spec"]["blow_frequency_hz"] == 21.3
    assert json.loads(general)["spec"]["name"] == example["name"]
    item = asyncio.run(solved())
    assert len(packed(item, own)) < 0.85 * len(packed(item, general)) < 0.23 * len(item)
    assert unpacked(packed(item, own), own) == json.loads(item)
    # Rows without an answer.
    stalled, refused = {**body, "ratios": None}, {**body, "type": "largest_rocker", "ratios": {"lambda2": 1.1}}
    for content in (b"[1]", b'{"x": ', *(json.dumps(each).encode() for each in (stalled, refused))):
        assert asyncio.run(story(content)) == general


def test_the_first_item_of_slow_jobs_is_not_solved_twice() -> None:
    executor = InProcess()
    engine = engines.BatchEngine(None, executor, 10.0)  # type: ignore[arg-type]
    example = KINDS["impact-linkage"].example(Mode.DESIGN)
    row = Row(1, json.dumps({**example, "blow_frequency_hz": 21.3}).encode())
    for _ in range(2):
        asyncio.run(engine.dictionary("impact-linkage", "design", "scalars", Source("ndjson"), row))
    assert [asked["blow_frequency_hz"] for asked in executor.asked] == [example["blow_frequency_hz"]]


@pytest.mark.parametrize("kind", ["impact-linkage", "flexible-rod"])
@pytest.mark.parametrize("mode", [Mode.CHECK, Mode.DESIGN])
def test_intake_does_not_wait_until_workers_are_free(monkeypatch: pytest.MonkeyPatch, kind: str, mode: Mode) -> None:
    """A batch that arrives while all workers are busy is taken without a solved item; a solve begun serves others."""
    monkeypatch.setattr(engines, "_DICTIONARY_S", 0.05)
    example = KINDS[kind].example(mode)

    async def story() -> None:
        free = asyncio.Event()

        class Busy(InProcess):
            async def run(self, *call: Any) -> Any:
                await free.wait()
                return await super().run(*call)

        engine = engines.BatchEngine(None, Busy(), 10.0)  # type: ignore[arg-type]

        async def dictionary() -> bytes:
            return await engine.dictionary(
                kind, mode, "scalars", Source("ndjson"), Row(1, json.dumps(example).encode())
            )

        async with asyncio.timeout(5.0):
            assert json.loads(await dictionary()) == example
        free.set()
        monkeypatch.setattr(engines, "_DICTIONARY_S", 60.0)
        assert json.loads(await dictionary())["result"]
        await engine.close()

    asyncio.run(story())


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("elapsed_s", "items"), [(1e-3, 500), (5e-3, 500), (5e-2, 100)])
def test_chunks_stay_large_where_workers_wait_for_the_processor(elapsed_s: float, items: int) -> None:
    executor = SimpleNamespace(background_workers=2)
    engine = engines.BatchEngine(None, executor, 10.0)  # type: ignore[arg-type]
    batch = SimpleNamespace(kind="pin-profile", mode="check", detail="scalars", total=10**6)
    for _ in range(3):
        engine._update_estimate(batch, engines._ItemTime(elapsed_s, 1e-3))  # type: ignore[arg-type]
    assert engine._items_of(batch) == pytest.approx(items, abs=1)  # type: ignore[arg-type]


def test_poison_items_are_isolated_by_splitting_and_stored_as_failed(database_url: str, tmp_path: Path) -> None:
    bodies: list[dict[str, Any]] = [{"x": k} for k in range(20)]
    bodies[2] = {"do": "die"}
    bodies[13] = {"do": "hang"}
    bodies[7] = {"do": "die once", "file": str(tmp_path / "died")}

    async def story() -> tuple[BatchRecord, list[Item]]:
        executor = fake.pool()
        executor.start()
        try:
            with RunStore(database_url) as store:
                service = BatchService(store, executor, 0.5, 2.0)
                service.start()
                batch = await asyncio.wait_for(over(service, await submitted(service, bodies)), 100)
                await service.close()
                return batch, await stored(store, batch)
        finally:
            executor.close()

    batch, items = asyncio.run(story())
    assert (batch.status, batch.succeeded, batch.failed) == ("ended", 18, 2)
    assert [item.index for item in items] == list(range(20))
    failed = {item.index: unpacked(item.content, batch.dictionary) for item in items if item.status == "failed"}
    assert {k: parts["problem"]["status"] for k, parts in failed.items()} == {2: 500, 13: 504}
    assert failed[2]["spec"] == bodies[2]
    assert verify(database_url).sound


@pytest.mark.parametrize(("deaths", "status"), [(19, "succeeded"), (20, "failed")])
def test_an_item_survives_the_death_of_nineteen_lease_holders(tmp_path: Path, deaths: int, status: str) -> None:
    url = sqlite_database(tmp_path)

    async def story() -> list[Item]:
        executor = fake.pool()
        with RunStore(url) as store:
            service = BatchService(store, executor, 2.0, 2.0)
            batch = await service.get(await submitted(service, [{"x": 1}]))
            for number in range(deaths):
                assert len(await store.write(Claim(batch.number, f"dead {number}", -1.0, 1, 100))) == 1
            executor.start()
            service.start()
            ended = await asyncio.wait_for(over(service, batch.id), 100)
            await service.close()
            executor.close()
            return await stored(store, ended)

    assert [item.status for item in asyncio.run(story())] == [status]


class Unending:
    """An executor with one batch worker whose solves never end."""

    background_workers = 1

    async def run(self, *_: Any) -> Any:
        raise WorkerCrashed(None)

    async def run_in_background(self, *_: Any) -> Any:
        await asyncio.Event().wait()


def test_owners_of_batches_take_turns(database_url: str) -> None:
    async def story(owners: str) -> str:
        with RunStore(database_url) as store:
            service, named = BatchService(store, Unending(), 1.0), {}
            for owner in owners:
                with seeing_as(owner):
                    number = (await service.get(await submitted(service, [{"x": k} for k in range(9)]))).number
                named[number] = owner
            while await service.engine._claim():
                pass
            for task in service.engine._tasks:
                task.cancel()
            return "".join(named[number] for number in service.engine._tasks.values())

    assert asyncio.run(story("aaab")) == "ab"


def test_kills_neither_lose_nor_duplicate_items(database_url: str) -> None:
    """SIGKILL of the service alone, then of a worker and the service, sometimes right after the start."""

    async def submit() -> str:
        with RunStore(database_url) as store:
            executor = fake.pool(0)
            try:
                service = BatchService(store, executor, 2.0)
                return await submitted(service, [{"x": k} for k in range(ITEMS)])
            finally:
                executor.close()

    batch_id, chance, left = asyncio.run(submit()), random.Random(6), set()
    # Not as __main__: workers import their entry point by module name.
    command = [sys.executable, "-c", "from tests.app.batches.fake import main; main()", database_url, "0.5"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, preexec_fn=die_with_test_runner())
    for _ in range(KILLS):
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(chance.uniform(0.0, 0.6))
        family = descendants(process.pid)
        if chance.random() < 0.3 and family:
            os.kill(chance.choice(sorted(family)), signal.SIGKILL)
            time.sleep(chance.uniform(0.0, 0.3))
        left |= family
        process.kill()
        process.wait()
        process.stdout.close()
        process = subprocess.Popen(command, stdout=subprocess.PIPE, preexec_fn=die_with_test_runner())

    async def end() -> tuple[BatchRecord, list[Item]]:
        with RunStore(database_url) as store:
            service = BatchService(store, fake.pool(0), 2.0)
            batch = await asyncio.wait_for(over(service, batch_id), 120)
            return batch, await stored(store, batch)

    try:
        batch, items = asyncio.run(end())
    finally:
        left |= descendants(process.pid)
        process.kill()
        process.wait()
    assert (batch.status, batch.succeeded, batch.failed) == ("ended", ITEMS, 0)
    assert [item.index for item in items] == list(range(ITEMS))
    assert [unpacked(item.content, batch.dictionary)["spec"]["x"] for item in items] == list(range(ITEMS))
    report = verify(database_url)
    assert (report.damages, report.batch_items) == ((), ITEMS)
    wait_until(lambda: not left & parents().keys(), 10.0)


def test_two_processes_share_a_batch(database_url: str) -> None:
    """The survivor takes over the work of a process that died."""

    async def story() -> tuple[BatchRecord, list[Item]]:
        executors = [fake.pool(1), fake.pool(1)]
        with RunStore(database_url) as one, RunStore(database_url) as two:
            services = [BatchService(store, pool, 2.0, 1.0) for store, pool in zip((one, two), executors, strict=True)]
            try:
                batch_id = await submitted(services[0], [{"x": k} for k in range(5000)])
                for service in services:
                    service.start()
                batch = await asyncio.wait_for(over(services[0], batch_id), 100)
                owners = {service.engine.owner for service in services}
                held = await one.query(
                    lambda c: {row[0] for row in c.exec_driver_sql("SELECT owner FROM batch_chunks")}
                )
                assert held == owners
                return batch, await stored(one, batch)
            finally:
                for service in services:
                    await service.close()
                for executor in executors:
                    executor.close()

    batch, items = asyncio.run(story())
    assert (batch.succeeded, [item.index for item in items]) == (5000, list(range(5000)))
    assert verify(database_url).sound


def test_equal_items_of_a_batch_are_solved_once(
    database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Regardless of position, with chunks solved concurrently."""
    monkeypatch.setattr(engines, "_INITIAL_ITEM_S", dict.fromkeys(engines._INITIAL_ITEM_S, 1e-2))
    monkeypatch.setattr(engines, "_LOOKUP_THRESHOLD_S", 0.0)
    count = tmp_path / "count"

    async def story() -> BatchRecord:
        executor = fake.pool()
        executor.start()
        try:
            with RunStore(database_url) as store:
                service = BatchService(store, executor, 2.0)
                service.start()
                bodies = [{"x": k % 7, "do": "count", "file": str(count)} for k in range(300)]
                batch = await asyncio.wait_for(over(service, await submitted(service, bodies)), 100)
                await service.close()
                return batch
        finally:
            executor.close()

    assert asyncio.run(story()).succeeded == 300
    assert len(count.read_text()) == 7
    assert verify(database_url).sound


def test_memory_is_bounded_for_large_batches(tmp_path: Path) -> None:
    """20 MB of rows pass through a few MB of memory."""
    rows, url = 50_000, sqlite_database(tmp_path)

    async def stream() -> AsyncIterator[bytes]:
        for first in range(0, rows, 100):
            yield b"".join(b'{"x": %d, "filling": "%s"}\n' % (first + k, b"y" * 370) for k in range(100))

    async def story() -> int:
        executor = fake.pool(0)
        with RunStore(url) as store:
            service = BatchService(store, executor, 2.0)
            tracemalloc.start()
            answer = await service.take_lines(Asked("crank-masses", "analysis"), False, stream(), "key")
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        executor.close()
        assert json.loads(answer)["items"]["total"] == rows
        return peak

    assert asyncio.run(story()) < 10e6
