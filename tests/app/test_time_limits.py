"""Time limits from settings: just below and just above each."""

from __future__ import annotations

import asyncio
import math
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import uvicorn
from typer.testing import CliRunner
from uvicorn.server import ServerState

from app.access import sessions as sessions_module
from app.access.sessions import Sessions
from app.cli import app as command
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, job_of
from app.edge import bodies
from app.edge.connections import ConnectionLimits, Connections
from app.edge.stack import edge
from app.jobs.errors import BudgetExceeded, Busy, MemoryExceeded
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.fair_queue import FairQueue, JobLength, QueueLimits
from app.settings import Settings
from app.store import leases, repository
from app.store.batch_operations import Claim
from app.store.record import RunStatus, utc_now
from app.store.repository import RunStore
from app.store.run_leases import TakeOverExpired
from app.submission import Service, ServiceLimits
from tests.app.jobs import fake_entry
from tests.app.running import Running, wait_until
from tests.app.store.records import make_record, make_response
from tests.app.store.test_batches import received
from tests.app.test_time_budget import Recording, example_result
from tests.clockwork import by_clockwork
from tests.databases import sqlite_database

MOMENT = 0.01
BESIDE = [(-MOMENT, True), (MOMENT, False)]
"""Offset from the limit, and whether it should hold."""


@pytest.fixture
def url(tmp_path: Path) -> str:
    return sqlite_database(tmp_path)


# -- what is waited for ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
@pytest.mark.parametrize("max_wait_s", [0.1, 30.0, 3600.0])
def test_the_wait_for_a_worker_times_out(max_wait_s, beside, holds):
    async def story() -> bool:
        queue = FairQueue(QueueLimits(workers=1))

        async def first() -> None:
            async with queue.slot(JobLength.SHORT, "a"):
                await asyncio.sleep(max_wait_s + beside)

        other = asyncio.create_task(first())
        await asyncio.sleep(0)
        try:
            async with queue.slot(JobLength.SHORT, "b", max_wait_s):
                return True
        except Busy as busy:
            assert f"within {max_wait_s:g} s" in str(busy)
            return False
        finally:
            await other

    assert by_clockwork(story()) == holds


class Wire:
    """A transport that records what is written."""

    def __init__(self) -> None:
        self.written, self.closed = b"", False

    def write(self, data: bytes) -> None:
        self.written += data

    def close(self) -> None:
        self.closed = True

    abort = close

    def is_closing(self) -> bool:
        return self.closed

    def get_extra_info(self, name: str) -> Any:
        return {"peername": ("192.0.2.1", 1), "sockname": ("192.0.2.2", 80)}.get(name)

    def pause_reading(self) -> None: ...

    resume_reading = pause_reading


async def answering(_scope, _receive, send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


def connected(limits: ConnectionLimits) -> tuple[asyncio.Protocol, Wire]:
    config, wire = uvicorn.Config(answering, log_config=None, timeout_keep_alive=5), Wire()
    config.load()
    make = Connections(limits).protocol()
    protocol = make(config=config, server_state=ServerState(), app_state={}, _loop=asyncio.get_running_loop())
    protocol.connection_made(wire)
    return protocol, wire


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
@pytest.mark.parametrize("begun", [b"", b"GET / HTTP/1.1\r\n"])
def test_an_incomplete_head_times_out(begun, beside, holds):
    async def story() -> Wire:
        limits = ConnectionLimits(head_s=Settings().head_timeout_s)
        protocol, wire = connected(limits)
        if begun:
            protocol.data_received(begun)
        await asyncio.sleep(limits.head_s + beside)
        protocol.data_received((b"" if begun else b"GET / HTTP/1.1\r\n") + b"Host: localhost\r\n\r\n")
        await asyncio.sleep(MOMENT)
        return wire

    wire = by_clockwork(story())
    assert wire.closed != holds
    assert wire.written.startswith(b"HTTP/1.1 200" if holds else b"HTTP/1.1 408" if begun else b"")
    assert holds or begun or not wire.written


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_an_unread_response_times_out(beside, holds):
    async def story() -> Wire:
        limits = ConnectionLimits(head_s=1e6, unread_s=Settings().unread_timeout_s)
        protocol, wire = connected(limits)
        protocol.pause_writing()
        await asyncio.sleep(limits.unread_s + beside)
        protocol.resume_writing()
        return wire

    assert by_clockwork(story()).closed != holds


async def reader(_scope, receive, send) -> None:
    while (message := await receive())["type"] == "http.request" and message["more_body"]:
        pass
    if message["type"] == "http.request":
        await send({"type": "http.response.start", "status": 201, "headers": []})
        await send({"type": "http.response.body", "body": b""})


def status_of_body(monkeypatch, pauses: list[float], size: int) -> int:
    """The status for a body sent in parts of ``size`` bytes after each pause."""

    async def story() -> int:
        loop, left, due, statuses = asyncio.get_running_loop(), list(pauses), [], []
        monkeypatch.setattr(bodies, "time", SimpleNamespace(monotonic=loop.time))

        async def receive() -> dict:
            """As the server's: a part whose wait is cancelled arrives when it would have."""
            due[:] = due or [loop.time() + left.pop(0)]
            await asyncio.sleep(due[0] - loop.time())
            due.clear()
            return {"type": "http.request", "body": b"x" * size, "more_body": bool(left)}

        async def send(message: dict) -> None:
            statuses.extend([message["status"]] if message["type"] == "http.response.start" else [])

        scope = {"type": "http", "method": "POST", "path": "/", "raw_path": b"/", "query_string": b""}
        scope |= {"headers": [(b"host", b"localhost")], "client": ("127.0.0.1", 1)}
        await edge(reader, Settings(), lambda: False)(scope, receive, send)
        (status,) = statuses
        return status

    return by_clockwork(story())


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_a_stalled_body_times_out(monkeypatch, beside, holds):
    assert status_of_body(monkeypatch, [0.0, Settings().body_idle_s + beside], 100_000) == (201 if holds else 408)


@pytest.mark.parametrize(("parts", "holds"), [(39, True), (41, False)])
def test_any_rate_is_allowed_during_the_grace_period(monkeypatch, parts, holds):
    """A byte every half second: any rate is allowed for 20 s."""
    assert status_of_body(monkeypatch, [0.5] * parts, 1) == (201 if holds else 408)


@pytest.mark.parametrize(("share", "holds"), [(1.01, True), (0.99, False)])
def test_the_minimum_rate_applies_after_the_grace_period(monkeypatch, share, holds):
    """After t, rate x (t - 20 s) must have arrived; the last bytes of a 400 s body are the critical ones."""
    size = round(share * Settings().body_least_bytes_per_s * 380 / 400)
    assert status_of_body(monkeypatch, [1.0] * 400, size) == (201 if holds else 408)


# -- what is solved ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pool():
    with_limits = ProcessPool(PoolSettings(workers=2, memory_bytes=256 << 20, **fake_entry.SETTINGS))
    with_limits.start()
    yield with_limits
    with_limits.close()


def test_the_time_limit_of_a_solve(pool):
    """0.5 s on either side, for loaded machines; the test of overruns has the tight bound."""

    async def story() -> list[Any]:
        await asyncio.gather(*(pool.run("rod", "echo", b"0", 30.0) for _ in range(2)))
        asked = (pool.run("rod", "sleep", str(seconds).encode(), 1.0) for seconds in (0.5, 1.5))
        return await asyncio.gather(*asked, return_exceptions=True)

    below, above = asyncio.run(story())
    assert not isinstance(below, Exception)
    assert isinstance(above, BudgetExceeded)


def test_the_memory_limit_of_a_solve(pool):
    async def story() -> list[Any]:
        # The worker's allocator holds a few megabytes in reserve.
        asked = (pool.run("rod", "hog", str(megabytes << 20).encode(), 30.0) for megabytes in (240, 257))
        return await asyncio.gather(*asked, return_exceptions=True)

    below, above = asyncio.run(story())
    assert not isinstance(below, Exception), below
    assert isinstance(above, MemoryExceeded)


@pytest.mark.parametrize(("takes_s", "status"), [(0.1, "succeeded"), (1.5, "queued")])
def test_the_wait_for_a_forms_answer(url, takes_s, status):
    example_result()

    class Taking(Recording):
        async def run(self, *given: Any) -> Any:
            await asyncio.sleep(takes_s)
            return await super().run(*given)

    async def story() -> str:
        with RunStore(url) as store:
            service = Service(store, Taking(), 10.0)
            rod = KINDS["flexible-rod"]
            request = job_of(rod, Mode.DESIGN).request.model_validate(example_of(rod, Mode.DESIGN))
            run_id = await service.submit_within(rod, Mode.DESIGN, request, 0.8)
            found = (await store.get(run_id)).status
            await service.close()
            return found

    assert asyncio.run(story()) == status


@pytest.mark.parametrize(("beside", "budgets"), [(-MOMENT, [0.2]), (MOMENT, [0.2, 0.2, 5.0])])
def test_a_short_job_gives_way_twice_and_continues_as_a_long_one(beside, budgets):
    limits, given = ServiceLimits(short_s=Settings().short_solve_s), []

    async def call(budget_s: float, _report: Any) -> None:
        given.append(budget_s)
        takes_s = limits.short_s + beside
        await asyncio.sleep(min(takes_s, budget_s))
        if takes_s > budget_s:
            raise BudgetExceeded(budget_s)

    by_clockwork(Service(None, None, 5.0, limits).admission.run(call, 5.0, short=True))
    assert given == budgets


# -- what is kept ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_the_lifetime_of_a_session(monkeypatch, beside, holds):
    now = [1000.0]
    monkeypatch.setattr(sessions_module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    life_s = 3600.0 * Settings().session_hours
    known = Sessions(life_s)
    token, begun = known.begin("digest")
    now[0] += life_s + beside
    assert known.find(token) == (begun if holds else None)


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_the_lifetime_of_an_idempotency_key(url, monkeypatch, beside, holds):
    run, kept = make_record(), Settings().key_lifetime
    with RunStore(url, key_lifetime=kept) as store:
        store.put_and_wait(run, make_response(run, "key"))
        moment = run.created_at + kept + timedelta(seconds=beside)
        monkeypatch.setattr(repository, "utc_now", lambda: moment)
        found = asyncio.run(store.find_response("key", "a" * 64))
        assert (found is not None) == holds
        assert asyncio.run(store.expire_keys()) == (0 if holds else 1)


def test_pruning_respects_the_day_boundary(url):
    day = (utc_now() - timedelta(days=10)).replace(hour=0, minute=0, second=0, microsecond=0)
    before, after = (make_record(k, created_at=day + timedelta(microseconds=k)) for k in (-1, 0))
    with RunStore(url) as store:
        store.put_and_wait(before)
        store.put_and_wait(after)
    words = ["prune", "--before", day.strftime("%Y-%m-%d"), "--yes", "--database-url", url]
    assert "1 runs were deleted" in CliRunner().invoke(command, words).stdout
    with RunStore(url) as store:
        assert asyncio.run(store.get(after.id)).id == after.id


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_the_lease_duration_of_runs(url, monkeypatch, beside, holds):
    now, run = [time.time()], make_record(status=RunStatus.QUEUED, result=None)
    monkeypatch.setattr(leases, "time", SimpleNamespace(time=lambda: now[0]))
    lease_s = Settings().lease_s

    async def story() -> list[Any]:
        with RunStore(url) as store:
            await store.put_leased(run, None, "silent", lease_s)
            now[0] += lease_s + beside
            return await store.write(TakeOverExpired("other", lease_s, 9))

    assert [taken.run.id for taken in asyncio.run(story())] == ([] if holds else [run.id])


@pytest.mark.parametrize(("beside", "holds"), BESIDE)
def test_the_lease_duration_of_chunks(url, monkeypatch, beside, holds):
    now = [time.time()]
    monkeypatch.setattr(leases, "time", SimpleNamespace(time=lambda: now[0]))
    lease_s = Settings().lease_s

    async def story() -> list[Any]:
        with RunStore(url) as store:
            batch = await received(store, blocks=1)
            assert len(await store.write(Claim(batch.number, "silent", lease_s, 9, 100))) == 1
            now[0] += lease_s + beside
            return await store.write(Claim(batch.number, "other", lease_s, 9, 100))

    assert len(asyncio.run(story())) == (0 if holds else 1)


# -- the end -----------------------------------------------------------------------------------------------------


def test_requests_that_finish_within_the_drain_are_answered_and_others_refused(tmp_path):
    """Two studies during shutdown with a drain of 8 s: one of 0.3 s, and one that takes some 20 s of its 60 s."""
    short = example_of(KINDS["flexible-rod"], Mode.ACCURACY)
    angles = [5 * k for k in range(72)]
    pressures = [2 + 0.5 * math.cos(math.radians(angle)) + 0.05 * (-1) ** k for k, angle in enumerate(angles)]
    load = {"kind": "table", "angle_deg": angles, "pressure_mpa": pressures}
    long = short | {"spec": short["spec"] | {"load": load, "effects": "all"}}
    running = Running(tmp_path, workers=3, batch_workers=0, drain_s=8, solve_budget_s=90)
    with running, running.client() as client, ThreadPoolExecutor() as threads:
        wait_until(lambda: running.ready(client), 170.0)
        ask = partial(client.post, "/api/v1/accuracy/flexible-rod")
        above = threads.submit(ask, json=long | {"study_budget_s": 60.0})
        below = threads.submit(ask, json=short | {"study_budget_s": 0.3})
        solving = 'crankwright_queue_running{length="long"}'
        wait_until(lambda: f"{solving} {1 if below.done() else 2}.0" in client.get("/metrics").text)
        took = running.end(signal.SIGTERM)
        assert below.result().status_code == 201
        assert above.result().status_code == 503
        assert 5.0 < took < 8.0 + 5.0
