"""Latency of quick checks and of ``/healthz`` while 64 clients flood the service, with each kind of request in turn.

    python -m tests.reliability.floods 60 [FLOOD ...]

Every flood starts a service of its own at default settings. The flooding clients share one address; the checks come
from another and each is new, so that no cached answer serves it. Floods are sent by a process of lowest priority: in
reality the clients' work is done elsewhere.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import httpx

from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from tests.app.running import ROOT, Running, wait_until
from tests.reliability.worst import dearest, template, unlike

AT_ONCE = 64
_PROBE_ADDRESS, _PROBE_INTERVAL_S, _WARM_UP = "127.0.0.2", 0.02, 20
_BODY_BYTES, _ROWS = 1_000_000, 2_000
_JSON = {"Content-Type": "application/json"}
_LATER = {"Prefer": "respond-async"}


@dataclass(frozen=True)
class Sent:
    """A POST request."""

    path: str
    body: bytes
    headers: dict[str, str]


Flood = Callable[[int], Sent]
"""The request of a number, unlike that of any other."""


def _dearest(*parts: str, later: bool = False) -> Flood:
    """The most expensive requests whose names contain one of the parts; ``later``: every other one asks for a 202."""
    chosen = [(path, template(body)) for name, (path, body) in dearest().items() if any(part in name for part in parts)]

    def request(number: int) -> Sent:
        path, form = chosen[number % len(chosen)]
        return Sent(path, unlike(form, number), _JSON | (_LATER if later and number // len(chosen) % 2 else {}))

    return request


def _large_bodies() -> Flood:
    """Bodies of the maximum size: a long profile or a long table, unknown fields, empty points, wrong values."""
    (checks, pin), (_, rod) = (dearest()[name] for name in ("pin check", "rod check"))
    rods = checks.replace("pin-profile", "flexible-rod")
    bodies = [
        (checks, pin),
        (rods, rod),
        (checks, pin | {f"x{k}": 0 for k in range(1_000)}),
        (checks, pin | {"profile": [{} for _ in range(200_000)]}),
        (rods, rod | {"load": rod["load"] | {"angle_deg": ["x"] * 100_000}}),
    ]
    forms = [(path, template(body)[:_BODY_BYTES].ljust(_BODY_BYTES)) for path, body in bodies]

    def request(number: int) -> Sent:
        path, form = forms[number % len(forms)]
        return Sent(path, unlike(form, number)[:_BODY_BYTES], _JSON)

    return request


def _batches() -> Flood:
    """Batches of new checks as lines of JSON."""
    example = KINDS["pin-profile"].example(Mode.CHECK)
    rows = [{**example, "load": {"force_n": f"<{k}>"}} for k in range(_ROWS)]
    form = b"".join(json.dumps(row).encode() + b"\n" for row in rows)
    form = re.sub(rb'"<(\d+)>"', lambda found: b"1%06d.<>" % int(found[1]), form)
    place = "/api/v1/batches?kind=pin-profile&mode=check"

    def request(number: int) -> Sent:
        return Sent(place, form.replace(b"<>", b"%06d" % number), {"Content-Type": "application/x-ndjson"})

    return request


def _uploads() -> Flood:
    """Tables as the page sends them."""
    names = ("geometry.outer_diameter_mm", "geometry.boss_length_mm", "geometry.small_end_length_mm",
             "material.allowable_stress_mpa", "bore_mm", "load.force_n")  # fmt: skip
    lines = [",".join(names), *(f"22,24,30,150,13.9,1{k:06d}.<>" for k in range(5 * _ROWS))]
    form = httpx.Request(
        "POST", "http://x", data={"kind": "pin-profile", "mode": "check"},
        files={"cases": ("cases.csv", "\n".join(lines).encode(), "text/csv")},
    )  # fmt: skip
    body, kind = form.read(), {"Content-Type": form.headers["Content-Type"]}

    def request(number: int) -> Sent:
        return Sent("/batches/upload", body.replace(b"<>", b"%06d" % number), kind)

    return request


def _sweeps() -> Flood:
    """Sweeps of 10,000 new checks, listed one by one."""
    base = KINDS["pin-profile"].example(Mode.CHECK)

    def request(number: int) -> Sent:
        values = [1000.0 + k + 1e-6 * number for k in range(10_000)]
        sweep = {"kind": "pin-profile", "mode": "check", "base": base, "vary": {"load.force_n": {"values": values}}}
        return Sent("/api/v1/batches", json.dumps(sweep).encode(), _JSON)

    return request


FLOODS: dict[str, Callable[[], Flood]] = {
    "everything": lambda: _dearest(""),
    "checks": lambda: _dearest("check", "crank"),
    "designs": lambda: _dearest("design", "front", later=True),
    "studies": lambda: _dearest("study", later=True),
    "large bodies": _large_bodies,
    "batches": _batches,
    "uploads": _uploads,
    "sweeps": _sweeps,
}


async def send(address: str, name: str, seconds: float, clients: int = AT_ONCE) -> Counter[str]:
    """Run the clients with back-to-back requests; returns the counts of answers."""
    request, numbers, told = FLOODS[name](), count(1), Counter[str]()
    end = time.monotonic() + seconds
    limits = httpx.Limits(max_connections=None)
    async with httpx.AsyncClient(base_url=address, timeout=120, limits=limits) as client:

        async def one() -> None:
            for turn in count():
                if turn and time.monotonic() > end:
                    return
                sent = request(next(numbers))
                try:
                    status = (await client.post(sent.path, content=sent.body, headers=sent.headers)).status_code
                except httpx.TransportError:  # refused before all was sent
                    status = 0
                told[str(status or "closed")] += 1
                await asyncio.sleep(0.05 if status in (0, 429, 503) else 0)

        await asyncio.gather(*(one() for _ in range(clients)))
    return told


@dataclass(frozen=True)
class Waits:
    """Sorted latencies [s]."""

    seconds: list[float]

    def at(self, share: float) -> float:
        return self.seconds[min(len(self.seconds) - 1, math.ceil(share * len(self.seconds)) - 1)]

    def __str__(self) -> str:
        p50, p99, most = (1000 * each for each in (self.at(0.5), self.at(0.99), self.seconds[-1]))
        return f"{len(self.seconds)}: p50 {p50:.1f} ms, p99 {p99:.1f} ms, at most {most:.0f} ms"


@dataclass(frozen=True)
class Latencies:
    """Latencies of ``/healthz``, each time on a new connection, and of quick checks."""

    health: Waits
    checks: Waits

    def __str__(self) -> str:
        return f"healthz {self.health}; checks {self.checks}"


def probe(port: int, going_on: Iterator[Any]) -> Latencies:
    """Ask in turn for the health and a new check of a pin until the iterator ends."""
    health, checks, example = [], [], example_of(KINDS["pin-profile"], Mode.CHECK)
    transport = httpx.HTTPTransport(local_address=_PROBE_ADDRESS)
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", transport=transport, timeout=60) as client:
        for number, _ in enumerate(going_on):
            began = time.monotonic()
            with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
                connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                assert connection.recv(4096).startswith(b"HTTP/1.1 200")
            health.append(time.monotonic() - began)
            example["load"]["force_n"] *= 1.0 - 1e-9
            began = time.monotonic()
            answer = client.post("/api/v1/checks/pin-profile", json=example)
            assert answer.status_code == 201 and answer.json()["status"] == "succeeded", (number, answer.text)
            checks.append(time.monotonic() - began)
            time.sleep(_PROBE_INTERVAL_S)
    return Latencies(Waits(sorted(health)), Waits(sorted(checks)))


def flooded(name: str, seconds: float, client: httpx.Client, clients: int = AT_ONCE) -> tuple[Latencies, Counter[str]]:
    """Latencies of a running service during a flood, and the answers to the flood."""
    told_to = ["--send", str(client.base_url), "--clients", str(clients)]
    words = [sys.executable, "-m", "tests.reliability.floods", *told_to, str(seconds), name]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        found = probe(client.base_url.port, iter(lambda: process.poll() is None, False))
        told = Counter(json.loads(process.stdout.read()))
    assert process.returncode == 0
    return found, told


def measure(name: str, seconds: float, folder: Path, **settings: object) -> tuple[Latencies, Latencies, Counter[str]]:
    """Latencies of an idle and of a flooded service, and the answers to the flood."""
    with Running(folder, **settings) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        probe(client.base_url.port, iter(range(_WARM_UP)))
        idle = probe(client.base_url.port, iter(range(100)))
        found, told = flooded(name, seconds, client)
        assert "Traceback" not in running.output.read_text(), running.output.read_text()[-3000:]
    return idle, found, told


def main() -> None:
    asked = argparse.ArgumentParser(prog="python -m tests.reliability.floods")
    asked.add_argument("--send", metavar="ADDRESS", help="only send the flood, and print the counts of answers")
    asked.add_argument("--clients", type=int, default=AT_ONCE, help="at once, with --send")
    asked.add_argument("seconds", type=float)
    asked.add_argument("floods", nargs="*", default=list(FLOODS), metavar="FLOOD", help=", ".join(FLOODS))
    given = asked.parse_args()
    if given.send:
        os.nice(19)
        print(json.dumps(asyncio.run(send(given.send, *given.floods, given.seconds, given.clients))))
        return
    for name in given.floods:
        with tempfile.TemporaryDirectory() as folder:
            idle, busy, told = measure(name, given.seconds, Path(folder))
        print(f"{name}, load {os.getloadavg()[0]:.0f}\n  idle: {idle}\n  flooded: {busy}\n  {dict(told)}", flush=True)


if __name__ == "__main__":
    main()
