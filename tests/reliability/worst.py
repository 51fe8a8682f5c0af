"""Overload test: 64 concurrent clients with the most expensive valid requests, and the latency of ``/healthz``.

    python -m tests.reliability.worst 60

The most expensive request of a kind has the smallest accuracy and effect tolerance allowed, the longest tables and the
most steps, points, cylinders and stock sizes. Each is made unique to bypass the cache; settings are the defaults.
"""

from __future__ import annotations

import asyncio
import copy
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import httpx

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from tests.app.running import ROOT, Running, wait_until

AT_ONCE = 64
LEAST = 1e-12
_POLL_INTERVAL_S = 0.02


def _table(period_deg: float, number: int = 10_000) -> dict[str, Any]:
    """A periodic pressure table [MPa over deg] of maximum length."""
    angles = [round(k * period_deg / number, 6) for k in range(number)]
    pressures = [round(1.0 + 0.3 * math.sin(math.radians(angle)) + 0.1 * math.cos(math.radians(5 * angle)), 6)
                 for angle in angles]  # fmt: skip
    return {"kind": "table", "angle_deg": angles, "pressure_mpa": pressures}


def _profile(pin: dict[str, Any], number: int = 5000) -> list[dict[str, float]]:
    """A half-pin bore profile [mm], widening towards the end, of maximum length."""
    geometry = pin["geometry"]
    half = geometry["boss_length_mm"] + geometry["gap_mm"] + geometry["small_end_length_mm"] / 2
    least, rest = 0.6 * geometry["outer_diameter_mm"], 0.1 * geometry["outer_diameter_mm"]
    share = [k / (number - 1) for k in range(number)]
    return [{"x_mm": round(each * half, 6), "bore_mm": round(least + rest * (1 - each) ** 2, 6)} for each in share]


def dearest() -> dict[str, tuple[str, dict[str, Any]]]:
    """Path and body of each expensive request, by name."""
    found: dict[str, tuple[str, dict[str, Any]]] = {}

    def put(name: str, slug: str, mode: Mode, **changes: Any) -> None:
        body = copy.deepcopy(example_of(KINDS[slug], mode)) | {"accuracy": LEAST, "effect_tolerance": LEAST} | changes
        found[name] = (f"/api/v1/{PATHS[mode]}/{slug}", body)

    rod, pin = "flexible-rod", "pin-profile"
    put("rod check", rod, Mode.CHECK, load=_table(360.0))
    put("rod design", rod, Mode.DESIGN, load=_table(360.0))
    put("rod design from stock", rod, Mode.DESIGN, stock_h_mm=[round(0.2 + 0.004 * k, 3) for k in range(200)])
    put("pin check", pin, Mode.CHECK, bore_mm=None, profile=_profile(example_of(KINDS[pin], Mode.CHECK)))
    for form in ("free", "drillable", "double_cone"):
        put(f"pin design, {form}", pin, Mode.DESIGN, form={"kind": form})
    put("pin design, 12 steps", pin, Mode.DESIGN, form={"kind": "stepped", "steps": 12})
    put("linkage check", "impact-linkage", Mode.CHECK)
    put("linkage front", "impact-linkage", Mode.DESIGN, front={"against": "pin_force", "points": 25},
        coupler_stiffness_n_m=2e7)  # fmt: skip
    engine = {
        "cylinders": 64,
        "phases_deg": [11.25 * k for k in range(64)],
        "positions_mm": [90.0 * k for k in range(64)],
    }
    put("crank", "crank-dynamics", Mode.ANALYSIS, pressure=_table(720.0), engine=engine)
    put("masses", "crank-masses", Mode.ANALYSIS)
    for slug in (rod, "impact-linkage"):
        put(f"study of {slug}", slug, Mode.ACCURACY)
        path, body = found[f"study of {slug}"]
        found[f"study of {slug}"] = (path, {"spec": body["spec"] | {"accuracy": LEAST}})
    return found


def unlike(body: dict[str, Any], number: int) -> bytes:
    """The request made unique, so that no cached answer serves it."""
    tolerance = {"effect_tolerance": LEAST * (1.0 + 1e-6 * number)}
    spec = body["spec"] | tolerance if "spec" in body else None
    return json.dumps(body | ({"spec": spec} if spec else tolerance)).encode()


async def flood(address: str, seconds: float) -> Counter[str]:
    """Run 64 clients with back-to-back requests; returns the counts of answers."""
    requests, numbers, told = list(dearest().values()), count(1), Counter[str]()
    end = time.monotonic() + seconds
    limits = httpx.Limits(max_connections=None)
    async with httpx.AsyncClient(base_url=address, timeout=120, limits=limits) as client:

        async def one(at: int) -> None:
            for turn in count():
                if turn and time.monotonic() > end:
                    return
                path, body = requests[at % len(requests)]
                headers = {"Content-Type": "application/json"}
                answer = await client.post(path, content=unlike(body, next(numbers)), headers=headers)
                told[f"{answer.status_code} {answer.json().get('status', '')}".strip()] += 1
                at += 1
                await asyncio.sleep(0.05 if answer.status_code in (429, 503) else 0)

        await asyncio.gather(*map(one, range(AT_ONCE)))
    return told


@dataclass(frozen=True)
class Waits:
    """Sorted latencies [s]."""

    seconds: list[float]

    def at(self, share: float) -> float:
        return self.seconds[min(len(self.seconds) - 1, math.ceil(share * len(self.seconds)) - 1)]

    def __str__(self) -> str:
        p50, p99, most = (1000 * each for each in (self.at(0.5), self.at(0.99), self.seconds[-1]))
        return f"{len(self.seconds)} looks: p50 {p50:.1f} ms, p99 {p99:.1f} ms, at most {most:.0f} ms"


def look(port: int, going_on: Iterator[Any]) -> Waits:
    """Poll ``/healthz``, each time on a new connection, until the iterator ends."""
    waits = []
    for _ in going_on:
        began = time.monotonic()
        with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            assert connection.recv(4096).startswith(b"HTTP/1.1 200")
        waits.append(time.monotonic() - began)
        time.sleep(_POLL_INTERVAL_S)
    return Waits(sorted(waits))


def measure(seconds: float, folder: Path, **settings: object) -> tuple[Waits, Waits, Counter[str]]:
    """Latency of ``/healthz`` on an idle and on a flooded service, and the answers to the flood."""
    with Running(folder, **settings) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        address, port = str(client.base_url), client.base_url.port
        idle = look(port, iter(range(100)))
        # In a separate process: sending megabytes must not delay the polls.
        words = [sys.executable, "-m", "tests.reliability.worst", "flood", address, str(seconds)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
            busy = look(port, iter(lambda: process.poll() is None, False))
            told = Counter(json.loads(process.stdout.read()))
        assert process.returncode == 0
        assert "Traceback" not in running.output.read_text(), running.output.read_text()[-3000:]
    return idle, busy, told


def each_alone() -> None:
    """Print the solve time of each request on an otherwise idle service."""
    with tempfile.TemporaryDirectory() as folder, Running(Path(folder)) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        for name, (path, body) in dearest().items():
            for number in range(2):
                began = time.monotonic()
                sent = unlike(body, number)
                answer = client.post(path, content=sent, headers={"Content-Type": "application/json"})
                took = time.monotonic() - began
            told = f"{answer.status_code} {answer.json()['status']}"
            print(f"{name}: {told}, {took:.2f} s, {len(sent)} bytes", flush=True)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["flood", address, seconds]:
            print(json.dumps(asyncio.run(flood(address, float(seconds)))))
        case ["alone"]:
            each_alone()
        case [seconds]:
            with tempfile.TemporaryDirectory() as scratch:
                idle, busy, told = measure(float(seconds), Path(scratch))
            print(f"load {os.getloadavg()[0]:.0f}\nidle: {idle}\nbusy: {busy}\n{dict(told)}")
