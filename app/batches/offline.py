"""Command-line batches, on a running service or with local workers. Repeating a command resumes its batch."""

from __future__ import annotations

import asyncio
import hashlib
import json
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlencode
from urllib.request import Request, urlopen

from app.batches import chunk
from app.batches.results import Format, Wanted
from app.batches.service import Asked, BatchService
from app.batches.sweep import Sweep
from app.batches.view import batch_json
from app.jobs.executor import PoolSettings, ProcessPool
from app.settings import Settings
from app.store.migrate import upgrade
from app.store.repository import RunStore

Told = Callable[[dict[str, Any]], None]
_READ_BYTES = 1 << 20
_TYPES = {
    ".csv": "text/csv",
    ".ndjson": "application/x-ndjson",
    ".jsonl": "application/x-ndjson",
    ".parquet": "application/vnd.apache.parquet",
    ".json": "application/json",
}
FORMATS = {".csv": Format.CSV, ".ndjson": Format.NDJSON, ".jsonl": Format.NDJSON, ".parquet": Format.PARQUET}


def form_of(file: Path) -> str | None:
    """The media type of a case file by its extension; None if unknown."""
    return _TYPES.get(file.suffix.lower())


def key_of(file: Path, *asked: str) -> str:
    """The idempotency key of a command: a hash of the case file and the options."""
    digest = hashlib.sha256("\0".join(asked).encode() + b"\0")
    with file.open("rb") as source:
        while part := source.read(_READ_BYTES):
            digest.update(part)
    return f"cli-{digest.hexdigest()[:40]}"


def swept(file: Path, kind: str, mode: str, detail: str) -> bytes:
    """The sweep in a file, with the kind and mode of the command. Raises ValueError."""
    told = json.loads(file.read_bytes())
    if not isinstance(told, dict):
        raise ValueError("a sweep is a JSON object")
    return json.dumps({"detail": detail, **told, "kind": kind, "mode": mode}).encode()


async def here(
    file: Path, kind: str, mode: str, detail: str, output: Path, database_url: str, workers: int, told: Told
) -> dict[str, Any]:
    """Solve a batch with local workers and write ``output``; returns the finished batch. Raises Problem."""
    key, form = key_of(file, kind, mode, detail), form_of(file)
    lanes = PoolSettings(workers=1, background_workers=workers, background_entry=chunk.answer)
    pool = ProcessPool(lanes)
    pool.start()
    upgrade(database_url)
    try:
        with RunStore(database_url) as store:
            limits = Settings()
            service = BatchService(store, pool, limits.solve_budget_s, limits.lease_s, limits.max_batch_items)
            ask = Asked.of(kind, mode, file.name, detail)
            digest = hashlib.sha256()
            if form == "application/json":
                body = swept(file, kind, mode, detail)
                digest.update(body)
                answer = await service.take_sweep(Sweep.read(body), key, digest)
            elif form == _TYPES[".parquet"]:
                digest.update(key.encode())
                answer = await service.take_parquet(ask, file, key, digest)
            else:
                answer = await service.take_lines(ask, form == "text/csv", _parts(file), key, digest)
            service.start()
            try:
                batch_id = json.loads(answer)["id"]
                async for batch in service.progress(batch_id, lambda: False):
                    told(batch_json(batch))
                with _atomic(output) as sink:
                    async for part in service.results(batch, Wanted(), FORMATS[output.suffix.lower()]):
                        sink.write(part)
                return batch_json(batch)
            finally:
                await service.close()
    finally:
        pool.close()


async def _parts(file: Path) -> AsyncIterator[bytes]:
    with file.open("rb") as source:
        while part := await asyncio.to_thread(source.read, _READ_BYTES):
            yield part


def remote(url: str, token: str | None, file: Path, kind: str, mode: str, detail: str, output: Path, told: Told) -> Any:
    """As ``here``, on the service at ``url``. Raises OSError; an HTTPError carries the problem as its body."""
    form = form_of(file)
    headers = {"Content-Type": str(form), "Idempotency-Key": key_of(file, kind, mode, detail)}
    authorization = {"Authorization": f"Bearer {token}"} if token else {}
    base = url.rstrip("/")
    place = f"{base}/api/v1/batches"
    with ExitStack() as opened:
        if form == "application/json":
            data = swept(file, kind, mode, detail)
        else:
            data = opened.enter_context(file.open("rb"))
            headers["Content-Length"] = str(file.stat().st_size)
            place += "?" + urlencode({"kind": kind, "mode": mode, "name": file.name, "detail": detail})
        with urlopen(Request(place, data, {**headers, **authorization})) as response:
            batch = json.loads(response.read())
    while True:
        with urlopen(Request(base + batch["links"]["self"], headers=authorization)) as response:
            batch = json.loads(response.read())
        told(batch)
        if batch["status"] not in ("queued", "running"):
            break
        time.sleep(0.5)
    place = f"{base}{batch['links']['results']}?format={FORMATS[output.suffix.lower()]}"
    with urlopen(Request(place, headers=authorization)) as response, _atomic(output) as sink:
        while part := response.read(_READ_BYTES):
            sink.write(part)
    return batch


@contextmanager
def _atomic(path: Path) -> Iterator[IO[bytes]]:
    """A file that replaces the one at the path once it is complete."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as sink:
            yield sink
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
