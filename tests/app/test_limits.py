"""Limits from settings, at their values and one beyond."""

from __future__ import annotations

import asyncio
import hashlib
import io
import json
import re
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from starlette.testclient import TestClient

from app.access.caller import Caller, caller
from app.batches.service import Asked, BatchService
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, job_of
from app.edge.stack import edge
from app.jobs.errors import BudgetExceeded, Busy, ShareUsed
from app.settings import Settings
from app.store.repository import RunStore
from app.store.viewer import seeing_as
from app.submission import Service, ServiceLimits
from tests.app.serving import serving
from tests.databases import sqlite_database

GUIDE = (Path(__file__).parents[2] / "docs" / "service.md").read_text("utf-8")
JSON = {"Content-Type": "application/json"}
SMALL = {"max_body_bytes": 3000, "max_body_names": 120, "max_batch_items": 7, "max_batch_bytes": 4000}
SMALL |= {"max_upload_bytes": 5000, "max_head_bytes": 3000, "max_headers": 30}


@pytest.mark.parametrize("name", Settings.model_fields)
def test_every_setting_is_documented_with_its_default(name):
    default = Settings.model_fields[name].default
    (row,) = re.findall(rf"^\| `CRANKWRIGHT_{name.upper()}` \| ([^|]*)\|", GUIDE, re.MULTILINE)
    shown = row.strip()
    if default is None or default == "":
        assert not re.fullmatch(r"[\d.]+", shown)
    elif isinstance(default, (bool, str)):
        assert shown == str(default).lower()
    else:
        assert float(shown) == default


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with serving(tmp_path_factory.mktemp("limits"), **SMALL) as running:
        yield running


def names(client: TestClient, size: int) -> Any:
    body = json.dumps({f"x{k}": 0 for k in range(size)}).encode()
    return client.post("/api/v1/checks/pin-profile", content=body, headers=JSON)


def items(client: TestClient, size: int) -> Any:
    place = "/api/v1/batches?kind=crank-masses&mode=analysis"
    return client.post(place, content=b"{}\n" * size, headers={"Content-Type": "application/x-ndjson"})


def sized(path: str, form: str) -> Callable[[TestClient, int], Any]:
    def send(client: TestClient, size: int) -> Any:
        return client.post(path, content=b"x" * size, headers={"Content-Type": form})

    return send


def head(client: TestClient, size: int) -> Any:
    own = client.get("/healthz").request
    given = len(own.url.raw_path) + sum(len(name) + len(value) + 4 for name, value in own.headers.raw)
    return client.get("/healthz", headers={"x": "y" * (size - given - 5)})


def headers(client: TestClient, size: int) -> Any:
    own = len(client.get("/healthz").request.headers)
    return client.get("/healthz", headers={f"x-{k}": "y" for k in range(size - own)})


@pytest.mark.parametrize(
    ("setting", "send", "refused", "words"),
    [
        ("max_body_bytes", sized("/api/v1/checks/pin-profile", "application/json"), 413, "3000 bytes"),
        ("max_batch_bytes", sized("/api/v1/batches?kind=pin-profile&mode=check", "text/csv"), 413, "4000 bytes"),
        ("max_upload_bytes", sized("/batches/upload", "multipart/form-data; boundary=b"), 413, "5000 bytes"),
        ("max_body_names", names, 422, "at most 120 fields"),
        ("max_batch_items", items, 413, "at most 7 items"),
        ("max_head_bytes", head, 431, "3000 bytes"),
        ("max_headers", headers, 431, "at most 30 headers"),
    ],
)
def test_request_limits_are_exact(client, setting, send, refused, words):
    assert words not in send(client, SMALL[setting]).text
    beyond = send(client, SMALL[setting] + 1)
    assert beyond.status_code == refused
    assert words in beyond.text


def test_concurrent_requests_are_limited():
    async def waiting(_scope, _receive, send) -> None:
        await asyncio.sleep(0.05)
        await send({"type": "http.response.start", "status": 200, "headers": []})

    guarded, statuses = edge(waiting, Settings(max_requests=3), lambda: False), []

    async def send(message: dict) -> None:
        statuses.extend([message["status"]] if message["type"] == "http.response.start" else [])

    async def ask(number: int) -> None:
        scope = {"type": "http", "method": "GET", "path": "/", "raw_path": b"/", "query_string": b""}
        scope |= {"headers": [(b"host", b"localhost")], "client": ("127.0.0.1", 1)}
        await asyncio.gather(*(guarded(dict(scope), None, send) for _ in range(number)))

    asyncio.run(ask(3))
    assert statuses == [200] * 3
    asyncio.run(ask(4))
    assert sorted(statuses[3:]) == [200, 200, 200, 503]


class Endless:
    """An executor whose solves run until cancelled."""

    ready, warmup_status, background_workers = True, (), 0

    def is_warm(self, *_: str) -> bool:
        return True

    async def run(self, _kind: str, _mode: str, _payload: bytes, budget_s: float = 10.0, *_: Any) -> Any:
        await asyncio.sleep(1e3 if budget_s > 1.0 else budget_s)
        raise BudgetExceeded(budget_s)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    with RunStore(sqlite_database(tmp_path)) as opened:
        yield opened


def request(mode: Mode) -> Any:
    return job_of(KINDS["pin-profile"], mode).request.model_validate(example_of(KINDS["pin-profile"], mode))


async def submit_later(service: Service, who: str) -> None:
    caller.set(Caller(who))
    await service.submit_later(KINDS["pin-profile"], Mode.DESIGN, request(Mode.DESIGN), None, "")


def test_accepted_runs_are_limited_in_total_and_per_caller(store):
    async def story() -> None:
        service = Service(store, Endless(), 10.0, ServiceLimits(accepted=3, accepted_per_caller=2))
        await submit_later(service, "a")
        await submit_later(service, "a")
        with pytest.raises(ShareUsed):
            await submit_later(service, "a")
        await submit_later(service, "b")
        with pytest.raises(Busy):
            await submit_later(service, "c")
        await service.close()

    asyncio.run(story())


@pytest.mark.parametrize("form", ["ndjson", "csv", "parquet"])
def test_a_batch_sent_again_under_its_key_needs_no_share(store, form):
    example = example_of(KINDS["pin-profile"], Mode.CHECK)
    contents = {"ndjson": json.dumps(example).encode(), "csv": b"load.force_n\n1\n"}

    async def submit(service: BatchService, key: str) -> bytes:
        async def body() -> AsyncIterator[bytes]:
            yield contents[form]

        asked = Asked("pin-profile", "check")
        if form == "parquet":
            file = io.BytesIO()
            pyarrow.parquet.write_table(pyarrow.table({"load.force_n": [1.0]}), file)
            return await service.take_parquet(asked, file, key, hashlib.sha256())
        return await service.take_lines(asked, form == "csv", body(), key)

    async def story() -> None:
        service = BatchService(store, Endless(), 0.01, most_open=1)
        first = await submit(service, "key-1")
        assert await submit(service, "key-1") == first
        with pytest.raises(ShareUsed):
            await submit(service, "key-2")

    asyncio.run(story())


def test_open_batches_are_limited_per_owner(store):
    async def submit(service: BatchService, owner: str) -> str:
        async def body() -> AsyncIterator[bytes]:
            yield b"{}\n"

        with seeing_as(owner):
            return json.loads(await service.take_lines(Asked("crank-masses", "analysis"), False, body(), None))["id"]

    async def story() -> None:
        service = BatchService(store, Endless(), 0.01, most_open=2)
        first = await submit(service, "a")
        await submit(service, "a")
        with pytest.raises(ShareUsed):
            await submit(service, "a")
        await submit(service, "b")
        with seeing_as("a"):
            await service.cancel(first)
        await submit(service, "a")

    asyncio.run(story())
