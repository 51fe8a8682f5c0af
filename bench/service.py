"""The service: cost of a durable POST, and time to the first answer.

CPU time of the server process per POST of a check, every request different, over 32 persistent connections; the
solver's answer is precomputed in all three variants, so that only the service is compared. "The usual way" is a sync
endpoint in FastAPI's thread pool with an ORM session and a commit per request. Rounds alternate between the variants;
medians over the rounds.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from app.designs.flexible_rod.kind import FLEXIBLE_ROD
from app.designs.kind import Mode

CONNECTIONS, REQUESTS, ROUNDS = 32, 1500, 3
WAYS = {
    "without_database": "the same app, nothing stored",
    "durable": "durable: one writer, group commit, FULL",
    "orm_in_threads": "the usual way, FULL",
}
_PATH = "/api/v1/checks/flexible-rod"
_TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Row:
    """One variant: server CPU per request [s], and requests per second of wall-clock time."""

    name: str
    cpu: float
    rate: float


def free_port() -> int:
    """A free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def process(*command: str, **environment: str) -> Iterator[subprocess.Popen]:
    """A child process that is terminated at the end."""
    child = subprocess.Popen([sys.executable, *command], env={**os.environ, **environment}, stdout=subprocess.DEVNULL)
    try:
        yield child
    finally:
        child.terminate()
        child.wait(20)


def post(port: int, body: bytes, path: str = _PATH, **headers: str) -> bytes | None:
    """A POST, by default of a check; None while nothing listens or the service is busy. Raises HTTPError."""
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}{path}", body, {"content-type": "application/json", **headers}, method="POST"
    )
    try:
        with urllib.request.urlopen(request, timeout=60) as response:
            return response.read()
    except urllib.error.HTTPError as refused:
        if refused.code not in (429, 503):  # it would be refused for ever
            raise
    except (urllib.error.URLError, ConnectionError):
        pass
    return None


def wait_for_answer(port: int, body: bytes, most: float = 120.0) -> float:
    """Seconds until the first answer; RuntimeError if none comes."""
    started = time.perf_counter()
    while time.perf_counter() - started < most:
        if post(port, body) is not None:
            return time.perf_counter() - started
        time.sleep(0.02)
    raise RuntimeError(f"no answer within {most} s")


def different_bodies() -> Iterator[bytes]:
    """The example's request with another thickness every time: no two have the same spec."""
    request = FLEXIBLE_ROD.example(Mode.CHECK)
    for i in count():
        request["dimensions"]["h_mm"] = 0.46 + i * 1e-9
        yield json.dumps(request).encode()


async def load(port: int, bodies: Iterator[bytes], requests: int) -> None:
    """Send the requests over open connections; RuntimeError at the first that is not 201."""

    async def client(share: int) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for _ in range(share):
            body = next(bodies)
            writer.write(
                b"POST %s HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
                % (_PATH.encode(), len(body)) + body
            )  # fmt: skip
            head = await reader.readuntil(b"\r\n\r\n")
            if not head.startswith(b"HTTP/1.1 201"):
                raise RuntimeError(head.decode())
            size = next(int(line[15:]) for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:"))
            await reader.readexactly(size)
        writer.close()

    await asyncio.gather(*(client(requests // CONNECTIONS) for _ in range(CONNECTIONS)))


def cpu_seconds(pid: int) -> float:
    """User and system time of a process with all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICK


def run() -> list[Row]:
    """Load all variants in turn, round by round."""
    bodies = different_bodies()
    samples: dict[str, list[tuple[float, float]]] = {name: [] for name in WAYS}
    sent = REQUESTS // CONNECTIONS * CONNECTIONS
    with tempfile.TemporaryDirectory() as folder:
        for round_number in range(ROUNDS):
            for name in WAYS:
                port = free_port()
                place = Path(folder) / str(round_number)
                place.mkdir(exist_ok=True)
                with process("-m", "bench.service_apps", name, str(port), str(place)) as child:
                    wait_for_answer(port, next(bodies))
                    asyncio.run(load(port, bodies, 10 * CONNECTIONS))
                    cpu, started = cpu_seconds(child.pid), time.perf_counter()
                    asyncio.run(load(port, bodies, sent))
                    elapsed = time.perf_counter() - started
                    samples[name].append(((cpu_seconds(child.pid) - cpu) / sent, sent / elapsed))
    return [Row(WAYS[name], *map(statistics.median, zip(*rows, strict=True))) for name, rows in samples.items()]


def first_answers(repeats: int = 3) -> float:
    """Median time from starting `crankwright serve` on a fresh database, kernels compiled, to its first answer [s]."""
    times = []
    body = next(different_bodies())
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            port = free_port()
            url = f"sqlite:///{folder}/runs.sqlite3"
            command = ("-m", "app.cli", "serve", "--port", str(port), "--database-url", url)
            with process(*command):
                times.append(wait_for_answer(port, body))
    return statistics.median(times)


def health_under_load(pings: int = 400) -> list[float]:
    """Times of /healthz, sorted [s], while every worker solves designs and more of them wait."""
    request = FLEXIBLE_ROD.example(Mode.DESIGN)
    times = []
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        url = f"sqlite:///{folder}/runs.sqlite3"
        with process("-m", "app.cli", "serve", "--port", str(port), "--database-url", url):
            wait_for_answer(port, next(different_bodies()))
            for i in range(pings):
                if i % 10 == 0:
                    request["requirements"]["min_fatigue_safety"] = 2.0 + i * 1e-4
                    post(port, json.dumps(request).encode(), "/api/v1/designs/flexible-rod", prefer="respond-async")
                started = time.perf_counter()
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=60) as response:
                    response.read()
                times.append(time.perf_counter() - started)
                time.sleep(0.01)
    return sorted(times)


def import_time(module: str, repeats: int = 5) -> float:
    """Median time of a fresh interpreter's `import module` [s]."""
    code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    times = [
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
        for _ in range(repeats)
    ]
    return statistics.median(times)


def table() -> list[str]:
    """The section of docs/benchmarks.md."""
    rows, health = run(), health_under_load()
    base = rows[0].cpu
    lines = ["| way | server CPU per POST | against nothing stored | POSTs/s |", "|---|---|---|---|"]
    lines += [f"| {r.name} | {r.cpu * 1e6:,.0f} µs | {r.cpu / base:.2f} | {r.rate:,.0f} |" for r in rows]
    lines += [
        "",
        f"The usual way costs {rows[2].cpu / rows[1].cpu:.1f} times the durable way. A started service gives its first "
        f"answer after {first_answers():.1f} s; `import solvers` takes {import_time('solvers') * 1e3:.0f} ms, "
        f"`from solvers import rod` {import_time('solvers.rod') * 1e3:.0f} ms. While every worker solves, /healthz "
        f"takes {health[len(health) // 2] * 1e3:.1f} ms in the median, {health[int(0.99 * len(health))] * 1e3:.1f} ms "
        "at the 99th percentile.",
    ]
    return lines
