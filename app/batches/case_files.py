"""Case files of commands and the files of their results."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import IO

from app.batches.results import Format
from app.errors import Problem

READ_BYTES = 1 << 20
CSV, PARQUET, SWEEP = "text/csv", "application/vnd.apache.parquet", "application/json"
_NDJSON = "application/x-ndjson"
_TYPES = {".csv": CSV, ".ndjson": _NDJSON, ".jsonl": _NDJSON, ".parquet": PARQUET, ".json": SWEEP}
FORMATS = {".csv": Format.CSV, ".ndjson": Format.NDJSON, ".jsonl": Format.NDJSON, ".parquet": Format.PARQUET}
"""Formats of tables by the extension of their files."""


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


def _no_cases(detail: str) -> Problem:
    return Problem(400, "No cases", detail)


def _no_results(detail: str) -> Problem:
    return Problem(400, "No results", detail)


def keys_of(file: Path, *asked: str) -> Iterator[str]:
    """The idempotency keys of a command: a hash of its case file, by name and content, and of what is asked, then the
    same numbered, each for a repetition after the batch of the one before was cancelled."""
    digest = hashlib.sha256("\0".join((file.name, *asked)).encode() + b"\0")
    with file.open("rb") as source:
        while part := source.read(READ_BYTES):
            digest.update(part)
    key = f"cli-{digest.hexdigest()[:40]}"
    yield key
    yield from (f"{key}-{number}" for number in count(2))


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


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A file that replaces the one at the path once it is complete."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as sink:
            yield sink
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
