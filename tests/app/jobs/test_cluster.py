"""Batch chunks on a Dask cluster: the same answers and errors as locally."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator

import distributed
import pytest

from app.jobs.cluster import ClusterPool, close_host
from app.jobs.errors import BudgetExceeded, SolveFailed, WorkerCrashed
from app.jobs.executor import PoolSettings
from tests.app.jobs import fake_entry


@pytest.fixture(scope="module")
def pool() -> Iterator[ClusterPool]:
    common = {
        **fake_entry.SETTINGS,
        "background_entry": fake_entry.answer,
        "niceness": 0,
        "background_niceness": 0,
    }
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="tcp://"
    ) as cluster:
        here, there = PoolSettings(workers=1, **common), PoolSettings(workers=0, **common)
        pool = ClusterPool(here, cluster.scheduler_address, there, None)
        pool.start()
        yield pool
        pool.close()
        close_host()


def test_answers_and_errors_come_back(pool: ClusterPool) -> None:
    async def ask(mode: str, wish: object, budget_s: float = 20.0) -> dict:
        return (await pool.run_in_background("rod", mode, json.dumps(wish).encode(), budget_s)).result

    async def scenario() -> None:
        assert pool.background_workers == 2
        assert (await ask("echo", [1, 2]))["payload"] == [1, 2]
        for mode, wish, error in (
            ("sleep", 60, BudgetExceeded),
            ("die", 3, WorkerCrashed),
            ("raise", 0, SolveFailed),
        ):
            with pytest.raises(error):
                await ask(mode, wish, 0.5)
        assert (await ask("echo", "again"))["payload"] == "again"
        # Interactive requests stay local.
        assert (await pool.run("rod", "echo", b"1")).result["payload"] == 1

    asyncio.run(scenario())
