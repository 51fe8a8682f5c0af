"""Exhaustion of file descriptors: many connections under a low limit must not lose acknowledged runs."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import socket
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.verify import verify
from tests.app.running import Running, wait_until

CHECK = KINDS["pin-profile"].example(Mode.CHECK)
CHECKS = "/api/v1/checks/pin-profile"
PATIENCE_S = 20.0
"""Within this time a request on an open connection is answered or refused, whatever cannot be started."""


def held(pid: int) -> int:
    """Number of open descriptors of a process."""
    return len(os.listdir(f"/proc/{pid}/fd"))


@contextlib.contextmanager
def exhausted(running: Running, port: int, spare: int) -> Iterator[None]:
    """Limit the process to ``spare`` further descriptors and occupy them all with connections."""
    before = resource.prlimit(running.pid, resource.RLIMIT_NOFILE)
    most = held(running.pid) + spare
    resource.prlimit(running.pid, resource.RLIMIT_NOFILE, (most, before[1]))
    taken: list[socket.socket] = []
    try:
        for _ in range(4 * spare):
            with contextlib.suppress(OSError):
                taken.append(socket.create_connection(("127.0.0.1", port), timeout=1))
        wait_until(lambda: held(running.pid) >= most - 1, 10.0)
        yield
    finally:
        for connection in taken:
            connection.close()
        resource.prlimit(running.pid, resource.RLIMIT_NOFILE, before)


@dataclass
class Asked:
    """Counts of answers, and acknowledged runs."""

    statuses: Counter[str] = field(default_factory=Counter)
    acknowledged: dict[str, bytes] = field(default_factory=dict)

    def ask(self, client: httpx.Client, times: int, label: str) -> None:
        for _ in range(times):
            number, asked = self.statuses.total(), time.monotonic()
            body: dict[str, Any] = {**CHECK, "effect_tolerance": 0.01 + 1e-6 * number}
            try:
                answer = client.post(CHECKS, json=body, headers={"Idempotency-Key": f"{number}"})
                assert time.monotonic() - asked < PATIENCE_S, f"{label}: {answer.status_code} after that time"
            except httpx.TransportError:
                self.statuses[f"{label}: no answer"] += 1
                time.sleep(0.05)
                continue
            self.statuses[f"{label}: {answer.status_code}"] += 1
            if answer.status_code == 201:
                self.acknowledged[answer.json()["id"]] = answer.content


def exhaust(folder: Path, rounds: int, spare: int = 12) -> Counter[str]:
    """Exhaust the descriptors ``rounds`` times while killing a worker or the template; returns counts of answers.

    Asserts that all answers are documented ones and in time, no acknowledged run is lost, and the service recovers.
    """
    asked = Asked()
    with Running(folder, workers=2, batch_workers=0, head_timeout_s=60) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        asked.ask(client, 3, "before")
        for turn in range(rounds):
            with exhausted(running, client.base_url.port, spare):
                asked.ask(client, 4, "on a connection that is open")
                with httpx.Client(base_url=client.base_url, timeout=3) as another:
                    asked.ask(another, 2, "on a new connection")
                victims = [running.template] if turn % 2 else running.family() - {running.pid, running.template}
                os.kill(min(victims), signal.SIGKILL)
                time.sleep(1.2)  # so that a restart attempt fails
                asked.ask(client, 4, "with the template killed" if turn % 2 else "with a worker killed")
            wait_until(lambda: running.ready(client), 30.0)
            asked.ask(client, 3, "after")
        for run_id, content in asked.acknowledged.items():
            assert client.get(f"/api/v1/runs/{run_id}").content == content
        running.end(signal.SIGTERM)
    assert "Traceback" not in running.output.read_text(), running.output.read_text()[-4000:]
    report = verify(f"sqlite:///{folder}/runs.sqlite3")
    assert report.sound and report.runs >= len(asked.acknowledged)
    told = asked.statuses
    assert all(each.rpartition(" ")[2] in ("201", "503", "507", "answer") for each in told), told
    assert all(each.endswith("201") for each in told if each.startswith(("before", "after"))), told
    return told
