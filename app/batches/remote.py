"""Batches of the command line solved by a running service."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from http.client import HTTPException, HTTPResponse
from io import IOBase
from pathlib import Path
from typing import Any, TypeVar
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import Request, urlopen

from app.batches.case_files import FORMATS, READ_BYTES, SWEEP, form_of, keys_of, replacing, swept
from app.errors import Problem

_FIRST_POLL_S, _LONGEST_POLL_S = 0.5, 5.0
_LOOK_TIMEOUT_S = 60.0
_ROWS_TIMEOUT_S = 600.0
"""For the rows and the results: up to ten million are stored or read before the service answers."""
_PATIENCE_S = 300.0
"""How long a request is repeated while the service is busy or restarts, from its first failure."""
_RETRY_S = 2.0
_TEMPORARY = frozenset({429, 502, 503, 504})
_LOST = (URLError, ConnectionError, TimeoutError, HTTPException)
"""Connections that cannot be made or break; a full disk for the results is none."""
T = TypeVar("T")


def check_service(url: str, token: str) -> None:
    """Check the address and the API key of a service. Raises Problem, which shows neither the key nor a password."""
    try:
        parts = urlsplit(url)
        known = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0 and "@" not in parts.netloc
        (parts.hostname or "").encode("idna")
    except ValueError:
        known = False
    if not (known and url.isascii() and url.isprintable() and " " not in url):
        shown = url.rpartition("@")[2]
        allowed = "allowed is one of ASCII characters without a user, such as https://host:8000"
        raise Problem(400, "No service", f"{shown!r} is no address: {allowed}")
    if not (token.isascii() and token.isprintable()):
        raise Problem(400, "No API key", "the key has characters that no key has: allowed is printable ASCII")


def there(
    url: str,
    token: str | None,
    file: Path,
    kind: str,
    mode: str,
    detail: str,
    output: Path,
    told: Callable[[dict[str, Any]], None],
) -> dict[str, Any]:
    """Solve a batch on the service at ``url`` and write ``output``; returns the finished batch, which is a resumed one
    unless that was cancelled. ``told`` is called with the batch at every poll.

    A busy service is waited for, and once it has the batch a restarting one. Raises Problem if the service refuses, and
    HTTPException or OSError if it cannot be reached in time.
    """
    base, headers = url.rstrip("/"), {"Authorization": f"Bearer {token}"} if token else {}

    def look(batch: dict[str, Any]) -> dict[str, Any]:
        return _answered(Request(base + batch["links"]["self"], headers=headers), _LOOK_TIMEOUT_S, _batch_from)

    for key in keys_of(file, kind, mode, detail):
        batch = look(_submitted(base, {**headers, "Idempotency-Key": key}, file, kind, mode, detail))
        if batch["status"] != "cancelled":
            break
    told(batch)
    pause = _FIRST_POLL_S
    while batch["status"] in ("queued", "running"):
        time.sleep(pause)
        pause = min(1.5 * pause, _LONGEST_POLL_S)
        batch = look(batch)
        told(batch)
    results = Request(f"{base}{batch['links']['results']}?format={FORMATS[output.suffix.lower()]}", headers=headers)
    _answered(results, _ROWS_TIMEOUT_S, lambda response: _save(response, output))
    return batch


def _submitted(base: str, headers: dict[str, str], file: Path, kind: str, mode: str, detail: str) -> dict[str, Any]:
    form, place = str(form_of(file)), f"{base}/api/v1/batches"
    headers = {**headers, "Content-Type": form}
    if form == SWEEP:
        return _answered(Request(place, swept(file, kind, mode, detail), headers), _ROWS_TIMEOUT_S, _batch_from)
    place += "?" + urlencode({"kind": kind, "mode": mode, "name": file.name, "detail": detail})
    headers["Content-Length"] = str(file.stat().st_size)
    with file.open("rb") as rows:
        return _answered(Request(place, rows, headers), _ROWS_TIMEOUT_S, _batch_from)


def _answered(request: Request, timeout_s: float, taken: Callable[[HTTPResponse], T]) -> T:
    """What is taken from the response to a request, which is repeated while that may help. Raises Problem for a
    refusal."""
    ends = None
    while True:
        if isinstance(request.data, IOBase):
            request.data.seek(0)
        try:
            with urlopen(request, timeout=timeout_s) as response:
                return taken(response)
        except HTTPError as error:
            if error.code not in _TEMPORARY:
                raise _refusal(error) from None
            asked = error.headers.get("Retry-After", "")
            wait, last = max(1.0, float(asked)) if asked.isdecimal() else _RETRY_S, error
        except _LOST as error:
            # Where no batch was sent yet, the address may be wrong.
            if request.data is not None:
                raise
            wait, last = _RETRY_S, error
        ends = ends or time.monotonic() + _PATIENCE_S
        if time.monotonic() + wait > ends:
            raise last
        time.sleep(wait)


def _refusal(error: HTTPError) -> Problem:
    try:
        told = json.loads(error.read())
        return Problem(error.code, told["title"], told["detail"], told.get("errors"))
    except (ValueError, TypeError, KeyError):
        return Problem(error.code, "The service refused", f"HTTP status {error.code}")


def _batch_from(response: HTTPResponse) -> dict[str, Any]:
    content = response.read()
    try:
        batch = json.loads(content)
        batch["links"]["results"]
    except (ValueError, TypeError, KeyError):
        place = urlsplit(response.url).netloc
        raise Problem(502, "No service", f"{place} does not answer as Crankwright does") from None
    return batch


def _save(response: HTTPResponse, output: Path) -> None:
    with replacing(output) as sink:
        while part := response.read(READ_BYTES):
            sink.write(part)
