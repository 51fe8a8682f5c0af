"""Command-line batches, on a running service or with local workers. Repeating a command resumes its batch."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlencode, urlsplit
from urllib.request import Request, urlopen

from app.batches import chunk
from app.batches.results import Format, Wanted
from app.batches.service import Asked, BatchService
from app.batches.sweep import Sweep
from app.batches.view import batch_json
from app.errors import Problem
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


def check_files(cases: Path, output: Path) -> None:
    """Check before solving that the cases are there and the results can be written. Raises Problem."""
    if form_of(cases) is None:
        raise _no_cases(f"{cases} is not a .csv, .ndjson, .parquet or .json file")
    if not cases.is_file():
        raise _no_cases(f"there is no file {cases}")
    folder = output.parent
    if output.suffix.lower() not in FORMATS:
        raise _no_results(f"{output} is not a .csv, .ndjson or .parquet file")
    if not folder.is_dir():
        raise _no_results(f"there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise _no_results(f"the folder {folder} cannot be written to")
    if output.is_dir():
        raise _no_results(f"{output} is a folder")
    if output.exists() and output.samefile(cases):
        raise _no_results(f"{output} has the cases and is not overwritten")


def check_service(url: str, token: str) -> None:
    """Check the address and the API key of a service. Raises Problem, which does not show the key."""
    try:
        parts = urlsplit(url)
        known = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
    except ValueError:
        known = False
    if not known or not url.isprintable() or " " in url:
        raise Problem(400, "No service", f"{url!r} is no address: allowed is one such as https://host:8000")
    if not (token.isascii() and token.isprintable()):
        raise Problem(400, "No API key", "the key has characters that no key has: allowed is printable ASCII")


def _no_cases(detail: str) -> Problem:
    return Problem(400, "No cases", detail)


def _no_results(detail: str) -> Problem:
    return Problem(400, "No results", detail)


def key_of(file: Path, *asked: str) -> str:
    """The idempotency key of a command: a hash of all that it asks for, which are the case file, its name, which the
    batch has too, and the options."""
    digest = hashlib.sha256("\0".join((file.name, *asked)).encode() + b"\0")
    with file.open("rb") as source:
        while part := source.read(_READ_BYTES):
            digest.update(part)
    return f"cli-{digest.hexdigest()[:40]}"


def swept(file: Path, kind: str, mode: str, detail: str) -> bytes:
    """The sweep in a file, with the kind and mode of the command. Raises Problem."""
    try:
        told = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as error:
        raise _no_sweep(str(error)) from None
    if not isinstance(told, dict):
        raise _no_sweep("a sweep is a JSON object")
    return json.dumps({"detail": detail, **told, "kind": kind, "mode": mode}).encode()


def _no_sweep(detail: str) -> Problem:
    return Problem(422, "The sweep cannot be read", detail)


async def here(
    file: Path, kind: str, mode: str, detail: str, output: Path, database_url: str, workers: int, told: Told
) -> dict[str, Any]:
    """Solve a batch with local workers and write ``output``; returns the finished batch. Raises Problem."""
    key, form = key_of(file, kind, mode, detail), form_of(file)
    lanes = PoolSettings(workers=1, background_workers=workers, background_entry=chunk.answer)
    pool = ProcessPool(lanes)
    pool.start()
    try:
        upgrade(database_url)
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
    """As ``here``, on the service at ``url``. Raises Problem, HTTPException and OSError; an HTTPError carries the
    problem as its body."""
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
        batch = _batch_from(Request(place, data, {**headers, **authorization}))
    while True:
        batch = _batch_from(Request(base + batch["links"]["self"], headers=authorization))
        told(batch)
        if batch["status"] not in ("queued", "running"):
            break
        time.sleep(0.5)
    place = f"{base}{batch['links']['results']}?format={FORMATS[output.suffix.lower()]}"
    with urlopen(Request(place, headers=authorization)) as response, _atomic(output) as sink:
        while part := response.read(_READ_BYTES):
            sink.write(part)
    return batch


def _batch_from(request: Request) -> dict[str, Any]:
    with urlopen(request) as response:
        content = response.read()
    try:
        batch = json.loads(content)
        batch["links"]["results"]
    except (ValueError, TypeError, KeyError):
        raise Problem(502, "No service", f"{request.host} does not answer as Crankwright does") from None
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
