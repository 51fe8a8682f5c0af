"""The synchronous ``Client`` and the asynchronous ``AsyncClient``, with the same methods."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Mapping
from itertools import count
from os import PathLike
from pathlib import Path
from typing import Any

import httpx

from crankwright_client import wire
from crankwright_client.errors import NoAnswer, Problem
from crankwright_client.retries import MAY_PASS, Retries, asked_wait_s, may_succeed
from crankwright_client.run import OPEN, Run
from crankwright_client.types import Batch

SOLVE_TIMEOUT_S = 120.0
"""Longer than any solve that the service answers synchronously."""
_POLL_S = 0.5
Progress = Callable[[Run], None]


class _Settings:
    """Address and credentials of the service. Raises ValueError, without the key, for one that no header can carry."""

    def __init__(self, url: str, key: str | None, timeout_s: float, retries: Retries | None) -> None:
        self.retries = retries or Retries()
        key = (key or "").strip()
        if not (key.isascii() and key.isprintable()):
            raise ValueError("the key has characters that no key has: allowed is printable ASCII")
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        self.http: dict[str, Any] = {"base_url": url, "headers": headers, "timeout": timeout_s}


class Client:
    """Client of the service at ``url``, with an API ``key`` if required; white space around the key is ignored.

    Temporary failures (429, 502, 503, 504, lost connections) are retried, safely thanks to idempotency keys; while
    waiting for a run or a batch and for a batch's results for longer, so that the service may restart meanwhile (see
    ``Retries``). Responses
    other than 2xx are raised as ``Problem``, runs that end without an answer as ``RunFailed``, exhausted retries as
    ``NoAnswer``; a request's own ``key`` that no header can carry as ValueError, other requests that cannot be sent as
    httpx's errors. An infeasible design is an answer: ``run.status`` is "infeasible" and ``run.result`` the diagnosis.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        key: str | None = None,
        timeout_s: float = SOLVE_TIMEOUT_S,
        retries: Retries | None = None,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        settings = _Settings(url, key, timeout_s, retries)
        self._retries, self._http = settings.retries, httpx.Client(transport=transport, **settings.http)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def design(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """Find dimensions: of "flexible-rod", "pin-profile" or "impact-linkage"."""
        return self.submit("designs", kind, spec, key=key)

    def check(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """Evaluate given dimensions with the same physics."""
        return self.submit("checks", kind, spec, key=key)

    def analyse(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """A supporting analysis: "crank-dynamics" or "crank-masses"."""
        return self.submit("analyses", kind, spec, key=key)

    def study(self, kind: str, spec: Mapping[str, Any], *, progress: Progress | None = None) -> Run:
        """Accuracy study of a check, design or analysis of this kind; waits for the result."""
        return self.wait(self.submit("accuracy", kind, {"spec": spec}, later=True), progress=progress)

    def submit(
        self, collection: str, kind: str, spec: Mapping[str, Any], *, key: str | None = None, later: bool = False
    ) -> Run:
        """POST a request; with ``later``, return immediately with a queued run."""
        return wire.run_of(self._send(wire.submission(collection, kind, spec, key, later)))

    def wait(self, run: Run, timeout_s: float | None = None, progress: Progress | None = None) -> Run:
        """Wait for a run to end; ``progress`` is called with it at every poll."""
        ends = None if timeout_s is None else time.monotonic() + timeout_s
        while not run.ended:
            if ends is not None and time.monotonic() > ends:
                raise NoAnswer(f"run {run.id} is still {run.status}")
            time.sleep(_POLL_S)
            run = wire.run_of(self._send(wire.look(run.id), self._retries.until(ends)))
            if progress is not None:
                progress(run)
        return run

    def run(self, run_id: str) -> Run:
        """A run, whatever its status."""
        return wire.run_of(self._send(wire.look(run_id)))

    def cancel(self, run_id: str) -> Run:
        """Cancel a queued or running run. One that is cancelled already is returned as it is; raises Problem with
        status 409 if it has ended otherwise."""
        return Run(self._cancelled(f"{wire.PREFIX}/runs/{run_id}"))

    def runs(self, **filters: Any) -> Iterator[dict[str, Any]]:
        """All runs matching the filters (kind, mode, status, name, holds, created_after, batch_id),
        newest first, page after page; from a ``cursor`` on if one is given."""
        cursor: str | None = None
        while True:
            page = self._send(wire.listing(filters, cursor)).json()
            yield from page["items"]
            cursor = page["next_cursor"]
            if cursor is None:
                return

    def batch(
        self,
        kind: str,
        mode: str,
        specs: Iterable[Mapping[str, Any]] | PathLike[str] | str,
        *,
        name: str = "",
        detail: str = "scalars",
        key: str | None = None,
    ) -> Batch:
        """Start a batch of requests of one kind and mode ("design", "check", "analysis"): mappings, or the rows of
        a file (.csv, .ndjson, .parquet). Raises TypeError for a single mapping, ValueError for another file."""
        return self._send(wire.rows(kind, mode, specs, name, detail, key)).json()

    def sweep(self, told: Mapping[str, Any], *, key: str | None = None) -> Batch:
        """Start a batch expanded by the service: {kind, mode, base, vary, combine, …}."""
        return self._send(wire.sweep(told, key)).json()

    def wait_for_batch(
        self, batch: Batch, timeout_s: float | None = None, progress: Callable[[Batch], None] | None = None
    ) -> Batch:
        """Wait for a batch to end; ``progress`` is called with it at every poll."""
        ends = None if timeout_s is None else time.monotonic() + timeout_s
        while batch["status"] in OPEN:
            if ends is not None and time.monotonic() > ends:
                raise NoAnswer(f"batch {batch['id']} is still {batch['status']}")
            time.sleep(_POLL_S)
            batch = self._send(wire.Call("GET", batch["links"]["self"]), self._retries.until(ends)).json()
            if progress is not None:
                progress(batch)
        return batch

    def cancel_batch(self, batch: Batch) -> Batch:
        """Cancel a batch; finished items are kept. One that is cancelled already is returned as it is; raises Problem
        with status 409 if it has ended otherwise."""
        return self._cancelled(batch["links"]["self"])

    def results(
        self, batch: Batch, *, status: str | None = None, fields: Iterable[str] = ()
    ) -> Iterator[dict[str, Any]]:
        """The results of finished items, in order."""
        call = wire.results(batch, "ndjson", status, fields)
        return wire.rows_of(self._send(call, self._retries.until(None)))

    def frame(self, batch: Batch, *, status: str | None = None, fields: Iterable[str] = ()) -> Any:
        """The results as a pandas DataFrame indexed by item; requires pandas."""
        import pandas

        found = pandas.DataFrame(list(self.results(batch, status=status, fields=fields)))
        return found.set_index("index") if "index" in found else found

    def plot(self, run: Run, name: str) -> bytes:
        """A plot from ``run.links["plots"]``, as SVG."""
        return self._send(wire.Call("GET", run.links["plots"][name])).content

    def export(self, run: Run, name: str, **options: str) -> bytes:
        """An export from ``run.links["exports"]``; waits for slow ones."""
        call = wire.Call("GET", run.links["exports"][name], params=options)
        while (answer := self._send(call)).status_code == 202:
            time.sleep(asked_wait_s(answer) or _POLL_S)
        return answer.content

    def save(self, run: Run, name: str, path: str | PathLike[str], **options: str) -> Path:
        """Write an export to a file."""
        file = Path(path)
        file.write_bytes(self.export(run, name, **options))
        return file

    def _cancelled(self, place: str) -> Any:
        try:
            return self._send(wire.Call("DELETE", place)).json()
        except Problem as problem:
            # The answer to a first DELETE may have been lost.
            if problem.status != 409:
                raise
            found = self._send(wire.Call("GET", place)).json()
            if found["status"] != "cancelled":
                raise
            return found

    def _send(self, call: wire.Call, until: float = 0.0) -> httpx.Response:
        for attempt in count(1):
            response, why = None, ""
            try:
                response = self._http.request(
                    call.method, call.path, content=call.content, headers=call.headers, params=call.params or None
                )
            except MAY_PASS as error:
                why = str(error) or type(error).__name__
            if response is not None and not may_succeed(response):
                return wire.checked(response)
            if self._retries.used_up(attempt, until):
                raise NoAnswer(_why(call, attempt, response, why))
            time.sleep(self._retries.wait_s(attempt, response))


class AsyncClient:
    """The asynchronous counterpart of ``Client``."""

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        key: str | None = None,
        timeout_s: float = SOLVE_TIMEOUT_S,
        retries: Retries | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        settings = _Settings(url, key, timeout_s, retries)
        self._retries, self._http = settings.retries, httpx.AsyncClient(transport=transport, **settings.http)

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def design(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """Find dimensions: of "flexible-rod", "pin-profile" or "impact-linkage"."""
        return await self.submit("designs", kind, spec, key=key)

    async def check(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """Evaluate given dimensions with the same physics."""
        return await self.submit("checks", kind, spec, key=key)

    async def analyse(self, kind: str, spec: Mapping[str, Any], *, key: str | None = None) -> Run:
        """A supporting analysis: "crank-dynamics" or "crank-masses"."""
        return await self.submit("analyses", kind, spec, key=key)

    async def study(self, kind: str, spec: Mapping[str, Any], *, progress: Progress | None = None) -> Run:
        """Accuracy study of a check, design or analysis of this kind; waits for the result."""
        return await self.wait(await self.submit("accuracy", kind, {"spec": spec}, later=True), progress=progress)

    async def submit(
        self, collection: str, kind: str, spec: Mapping[str, Any], *, key: str | None = None, later: bool = False
    ) -> Run:
        """POST a request; with ``later``, return immediately with a queued run."""
        return wire.run_of(await self._send(wire.submission(collection, kind, spec, key, later)))

    async def wait(self, run: Run, timeout_s: float | None = None, progress: Progress | None = None) -> Run:
        """Wait for a run to end; ``progress`` is called with it at every poll."""
        ends = None if timeout_s is None else time.monotonic() + timeout_s
        while not run.ended:
            if ends is not None and time.monotonic() > ends:
                raise NoAnswer(f"run {run.id} is still {run.status}")
            await asyncio.sleep(_POLL_S)
            run = wire.run_of(await self._send(wire.look(run.id), self._retries.until(ends)))
            if progress is not None:
                progress(run)
        return run

    async def run(self, run_id: str) -> Run:
        """A run, whatever its status."""
        return wire.run_of(await self._send(wire.look(run_id)))

    async def cancel(self, run_id: str) -> Run:
        """Cancel a queued or running run. One that is cancelled already is returned as it is; raises Problem with
        status 409 if it has ended otherwise."""
        return Run(await self._cancelled(f"{wire.PREFIX}/runs/{run_id}"))

    async def runs(self, **filters: Any) -> AsyncIterator[dict[str, Any]]:
        """All runs matching the filters (kind, mode, status, name, holds, created_after, batch_id),
        newest first, page after page; from a ``cursor`` on if one is given."""
        cursor: str | None = None
        while True:
            page = (await self._send(wire.listing(filters, cursor))).json()
            for line in page["items"]:
                yield line
            cursor = page["next_cursor"]
            if cursor is None:
                return

    async def batch(
        self,
        kind: str,
        mode: str,
        specs: Iterable[Mapping[str, Any]] | PathLike[str] | str,
        *,
        name: str = "",
        detail: str = "scalars",
        key: str | None = None,
    ) -> Batch:
        """Start a batch of requests of one kind and mode ("design", "check", "analysis"): mappings, or the rows of
        a file (.csv, .ndjson, .parquet). Raises TypeError for a single mapping, ValueError for another file."""
        return (await self._send(wire.rows(kind, mode, specs, name, detail, key))).json()

    async def sweep(self, told: Mapping[str, Any], *, key: str | None = None) -> Batch:
        """Start a batch expanded by the service: {kind, mode, base, vary, combine, …}."""
        return (await self._send(wire.sweep(told, key))).json()

    async def wait_for_batch(
        self, batch: Batch, timeout_s: float | None = None, progress: Callable[[Batch], None] | None = None
    ) -> Batch:
        """Wait for a batch to end; ``progress`` is called with it at every poll."""
        ends = None if timeout_s is None else time.monotonic() + timeout_s
        while batch["status"] in OPEN:
            if ends is not None and time.monotonic() > ends:
                raise NoAnswer(f"batch {batch['id']} is still {batch['status']}")
            await asyncio.sleep(_POLL_S)
            batch = (await self._send(wire.Call("GET", batch["links"]["self"]), self._retries.until(ends))).json()
            if progress is not None:
                progress(batch)
        return batch

    async def cancel_batch(self, batch: Batch) -> Batch:
        """Cancel a batch; finished items are kept. One that is cancelled already is returned as it is; raises Problem
        with status 409 if it has ended otherwise."""
        return await self._cancelled(batch["links"]["self"])

    async def results(
        self, batch: Batch, *, status: str | None = None, fields: Iterable[str] = ()
    ) -> list[dict[str, Any]]:
        """The results of finished items, in order."""
        call = wire.results(batch, "ndjson", status, fields)
        return list(wire.rows_of(await self._send(call, self._retries.until(None))))

    async def frame(self, batch: Batch, *, status: str | None = None, fields: Iterable[str] = ()) -> Any:
        """The results as a pandas DataFrame indexed by item; requires pandas."""
        import pandas

        found = pandas.DataFrame(await self.results(batch, status=status, fields=fields))
        return found.set_index("index") if "index" in found else found

    async def plot(self, run: Run, name: str) -> bytes:
        """A plot from ``run.links["plots"]``, as SVG."""
        return (await self._send(wire.Call("GET", run.links["plots"][name]))).content

    async def export(self, run: Run, name: str, **options: str) -> bytes:
        """An export from ``run.links["exports"]``; waits for slow ones."""
        call = wire.Call("GET", run.links["exports"][name], params=options)
        while (answer := await self._send(call)).status_code == 202:
            await asyncio.sleep(asked_wait_s(answer) or _POLL_S)
        return answer.content

    async def save(self, run: Run, name: str, path: str | PathLike[str], **options: str) -> Path:
        """Write an export to a file."""
        file = Path(path)
        file.write_bytes(await self.export(run, name, **options))
        return file

    async def _cancelled(self, place: str) -> Any:
        try:
            return (await self._send(wire.Call("DELETE", place))).json()
        except Problem as problem:
            # The answer to a first DELETE may have been lost.
            if problem.status != 409:
                raise
            found = (await self._send(wire.Call("GET", place))).json()
            if found["status"] != "cancelled":
                raise
            return found

    async def _send(self, call: wire.Call, until: float = 0.0) -> httpx.Response:
        for attempt in count(1):
            response, why = None, ""
            try:
                response = await self._http.request(
                    call.method, call.path, content=call.content, headers=call.headers, params=call.params or None
                )
            except MAY_PASS as error:
                why = str(error) or type(error).__name__
            if response is not None and not may_succeed(response):
                return wire.checked(response)
            if self._retries.used_up(attempt, until):
                raise NoAnswer(_why(call, attempt, response, why))
            await asyncio.sleep(self._retries.wait_s(attempt, response))


def _why(call: wire.Call, attempts: int, response: httpx.Response | None, why: str) -> str:
    told = why if response is None else f"{response.status_code} {response.reason_phrase}"
    return f"{call.method} {call.path}: {told}, {attempts} times"
