"""Batch throughput of a running service, response times meanwhile, and memory.

python -m bench.batches pin-profile check 10000

Starts a service on a fresh SQLite file, sends random variations of the example as NDJSON, and measures /healthz and
single checks while they are solved. Prints one line of figures; run it on an idle machine.
"""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import httpx
import psutil

from app.designs.kind import Mode
from app.designs.registry import KINDS

_VARIED = {
    "pin-profile": (("load", "force_n"), 0.2),
    "flexible-rod": (("mechanism", "speed_hz"), 0.5),
    "impact-linkage": (("blow_frequency_hz",), 0.5),
    "crank-dynamics": (("mechanism", "speed_hz"), 0.5),
}
"""Varied fields of each kind, with the lower end of the range relative to the example."""


_LONGEST_START_S, _AT_REST, _QUIET_S = 60, 0.1, 3


def bodies(kind: str, mode: str, count: int, without: tuple[str, ...] = ()) -> Iterator[bytes]:
    """Random requests, one per line, ``without`` some fields of the example."""
    chance = random.Random(1)
    body = {name: value for name, value in KINDS[kind].example(Mode(mode)).items() if name not in without}
    path, least = _VARIED[kind]
    here = body
    for step in path[:-1]:
        here = here[step]
    most = here[path[-1]]
    for _ in range(count):
        here[path[-1]] = most * chance.uniform(least, 1.0)
        yield json.dumps(body).encode() + b"\n"


def pieces(rows: Iterator[bytes], count: int = 500) -> Iterator[bytes]:
    """The same bytes in pieces of ``count`` rows, for sending."""
    while piece := b"".join(islice(rows, count)):
        yield piece


def served(folder: Path, workers: int = 2, **settings: str) -> tuple[subprocess.Popen[bytes], httpx.Client]:
    """A warmed-up service with ``workers`` batch workers, and a client."""
    output = folder / "output.txt"
    command = [
        sys.executable,
        "-m",
        "app.cli",
        "serve",
        "--port",
        "0",
        "--database-url",
        f"sqlite:///{folder}/runs.sqlite3",
    ]
    with output.open("wb") as sink:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", "CRANKWRIGHT_BATCH_WORKERS": str(workers), **settings}
        process = subprocess.Popen(command, stdout=sink, stderr=sink, env=environment)
    while not (found := re.search(r"http://127\.0\.0\.1:\d+", output.read_text())):
        time.sleep(0.1)
    client = httpx.Client(base_url=found[0], timeout=600)
    while client.get("/readyz").status_code != 200:
        time.sleep(0.5)
    return process, client


def processor_s() -> float:
    """Processor time [s] of this process and all that it has started."""
    here = psutil.Process()
    return sum(sum(process.cpu_times()[:2]) for process in (here, *here.children(recursive=True)))


def rested() -> None:
    """Wait until what this process has started rests: a new service loads kernels that are not asked for yet.

    Its workers pause between the kinds, some of which take no time, so one quiet second says nothing.
    """
    quiet = 0
    for _ in range(_LONGEST_START_S):
        spent = processor_s()
        time.sleep(1.0)
        quiet = quiet + 1 if processor_s() - spent < _AT_REST else 0
        if quiet == _QUIET_S:
            return


def highest_mb(pid: int) -> float:
    """Peak memory of the service process [MB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1000  # type: ignore[index]


def measured(kind: str, mode: str, count: int) -> dict[str, Any]:
    """The figures of one batch."""
    with tempfile.TemporaryDirectory() as name:
        process, client = served(Path(name))
        try:
            example = KINDS["pin-profile"].example(Mode.CHECK)
            for _ in range(4):  # both interactive workers have it loaded
                example["load"]["force_n"] *= 1.0 - 1e-6 * random.random()
                client.post("/api/v1/checks/pin-profile", json=example).raise_for_status()
            began = time.perf_counter()
            place = f"/api/v1/batches?kind={kind}&mode={mode}"
            form = {"Content-Type": "application/x-ndjson"}
            batch = (
                client.post(place, content=pieces(bodies(kind, mode, count)), headers=form).raise_for_status().json()
            )
            taken_s = time.perf_counter() - began
            health, single = [], []
            while batch["status"] not in ("ended", "cancelled"):
                for _ in range(10):
                    health.append(timed(lambda: client.get("/healthz")))
                    example["load"]["force_n"] *= 1.0 - 1e-6 * random.random()
                    single.append(timed(lambda: client.post("/api/v1/checks/pin-profile", json=example)))
                    time.sleep(0.005)
                batch = client.get(batch["links"]["self"]).json()
            return {
                "kind": kind, "mode": mode, "items": batch["items"], "taken_in_s": taken_s,
                "rate_per_s": batch["rate_per_s"], "samples": len(single), "healthz_p50_ms": 1e3 * share(health, 0.5),
                "healthz_p99_ms": 1e3 * share(health, 0.99), "check_p50_ms": 1e3 * share(single, 0.5),
                "check_p99_ms": 1e3 * share(single, 0.99), "memory_mb": highest_mb(process.pid),
                "file_bytes_per_item": (Path(name) / "runs.sqlite3").stat().st_size / count,
            }  # fmt: skip
        finally:
            process.kill()
            process.wait()


def timed(call: Any) -> float:
    began = time.perf_counter()
    call().raise_for_status()
    return time.perf_counter() - began


def share(values: list[float], part: float) -> float:
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], sys.argv[2], int(sys.argv[3])), indent=1))
