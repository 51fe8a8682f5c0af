"""Requests and responses, shared by the synchronous and the asynchronous client."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import httpx

from crankwright_client.errors import Problem, RunFailed
from crankwright_client.run import Run
from crankwright_client.types import Batch

PREFIX = "/api/v1"


@dataclass(frozen=True)
class Call:
    """A request that may be retried."""

    method: str
    path: str
    content: bytes | None = None
    headers: Mapping[str, str | bytes] = field(default_factory=dict)
    params: Mapping[str, str] = field(default_factory=dict)


def submission(
    collection: str, kind: str, spec: Mapping[str, Any], key: str | None = None, later: bool = False
) -> Call:
    """A POST with an idempotency key, generated unless given. Raises ValueError for a key that cannot be sent."""
    prefer = {"Prefer": "respond-async"} if later else {}
    body = json.dumps(spec, allow_nan=False).encode()
    return Call("POST", f"{PREFIX}/{collection}/{kind}", body, {**_posted("application/json", key), **prefer})


def _posted(form: str, key: str | None) -> dict[str, str | bytes]:
    """Headers of a POST; the key as UTF-8, which httpx would only send of ASCII."""
    key = key or uuid.uuid4().hex
    if not key.isprintable() or key != key.strip():
        raise ValueError("key: cannot be sent in a header (allowed: printable characters, without spaces at the ends)")
    return {"Content-Type": form, "Idempotency-Key": key.encode()}


ROWS = {
    ".csv": "text/csv",
    ".ndjson": "application/x-ndjson",
    ".jsonl": "application/x-ndjson",
    ".parquet": "application/vnd.apache.parquet",
}
"""Media types of batch files by suffix."""


def rows(
    kind: str,
    mode: str,
    specs: Iterable[Mapping[str, Any]] | PathLike[str] | str,
    name: str,
    detail: str,
    key: str | None,
) -> Call:
    """A POST of many requests: a file (.csv, .ndjson, .parquet), or mappings sent as NDJSON. Raises ValueError for any
    other file, and TypeError or ValueError for a mapping that JSON cannot carry."""
    form, content = "application/x-ndjson", b""
    if isinstance(specs, Mapping):
        raise TypeError("specs: is a single request (allowed: several mappings, such as a list of them, or a file)")
    if isinstance(specs, str | PathLike):
        file = Path(specs)
        if file.suffix.lower() not in ROWS:
            allowed = f"allowed are files in {', '.join(ROWS)}; a sweep is sent by sweep()"
            raise ValueError(f"specs: {file} is no batch: {allowed}")
        form, content = ROWS[file.suffix.lower()], file.read_bytes()
    else:
        content = b"\n".join(_line(k, spec) for k, spec in enumerate(specs))
    asked = _given(kind=kind, mode=mode, name=name, detail=detail)
    return Call("POST", f"{PREFIX}/batches", content, _posted(form, key), asked)


def _line(index: int, spec: Mapping[str, Any]) -> bytes:
    try:
        return json.dumps(spec, allow_nan=False).encode()
    except (TypeError, ValueError) as error:
        raise type(error)(f"specs[{index}]: {error}") from None


def sweep(told: Mapping[str, Any], key: str | None) -> Call:
    """A POST of a sweep."""
    body = json.dumps(told, allow_nan=False).encode()
    return Call("POST", f"{PREFIX}/batches", body, _posted("application/json", key))


def results(batch: Batch, form: str, status: str | None = None, fields: Iterable[str] = ()) -> Call:
    """The results of finished items; a text as ``fields`` is a name, or names separated by commas."""
    names = fields if isinstance(fields, str) else ",".join(fields)
    return Call("GET", batch["links"]["results"], params=_given(format=form, status=status, fields=names))


def rows_of(answer: httpx.Response) -> Iterator[dict[str, Any]]:
    """The rows of an answer in NDJSON, whose strings may contain every line separator of Unicode but the line feed."""
    return (json.loads(line) for line in answer.content.split(b"\n") if line)


def _given(**values: Any) -> dict[str, str]:
    return {name: str(value) for name, value in values.items() if value}


def look(run_id: str) -> Call:
    """A run, whatever its status."""
    return Call("GET", f"{PREFIX}/runs/{run_id}")


def listing(filters: Mapping[str, Any], cursor: str | None) -> Call:
    """A page of runs matching all filters, which may have the cursor of the first one."""
    given = filters if cursor is None else {**filters, "cursor": cursor}
    shown = {name: _shown(value) for name, value in given.items() if value is not None}
    return Call("GET", f"{PREFIX}/runs", params=shown)


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return value.isoformat() if hasattr(value, "isoformat") else str(value)


def checked(response: httpx.Response) -> httpx.Response:
    """The response; raises its problem if it is none of success: redirects are not followed."""
    if response.is_success:
        return response
    try:
        body = response.json()
    except ValueError:
        body = {}
    if not isinstance(body, dict):
        body = {}
    raise Problem({"status": response.status_code, "title": response.reason_phrase, **body})


def run_of(response: httpx.Response) -> Run:
    """The run in a response; raises RunFailed if it ended without an answer."""
    run = Run(response.json())
    if run.status == "failed":
        raise RunFailed(run.id, run.json["problem"] or {})
    return run
