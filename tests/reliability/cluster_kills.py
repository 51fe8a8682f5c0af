"""SIGKILL of the scheduler and the workers of a Dask cluster while a service solves a batch on it.

    python -m tests.reliability.cluster_kills 100

Every acknowledged item must be stored exactly once and whole, and none as failed.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.verify import verify
from tests.app.running import ROOT, Running, wait_until
from tests.child_processes import die_with_test_runner

_SCHEDULER = ("scheduler", "-m", "distributed.cli.dask_scheduler", "--no-dashboard", "--host", "127.0.0.1", "--port")
_WORKER = ("worker", "-m", "app.cli", "worker", "--cluster")


class Cluster:
    """A scheduler and a worker as processes of their own, which can be killed and started again."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self._folder, self._processes = folder, dict[str, subprocess.Popen[bytes]]()
        for name in ("scheduler", "worker"):
            self.start(name)

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self._port}"

    def start(self, name: str) -> None:
        words = (*_SCHEDULER, str(self._port)) if name == "scheduler" else (*_WORKER, self.address)
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "CRANKWRIGHT_BATCH_WORKERS": "1"}
        with (self._folder / f"{name}.txt").open("a") as output:
            self._processes[name] = subprocess.Popen(
                [sys.executable, *words[1:]], env=environment, cwd=self._folder, stdout=output, stderr=output,
                preexec_fn=die_with_test_runner(),
            )  # fmt: skip

    def kill(self, name: str) -> None:
        self._processes[name].send_signal(signal.SIGKILL)
        self._processes[name].wait()

    def close(self) -> None:
        for name in self._processes:
            self.kill(name)


def kill_in_turn(folder: Path, kills: int, items: int, seed: int = 1) -> Counter[str]:
    """Send a batch, kill scheduler and worker in turn while it is solved; returns the counts of items by status."""
    rng, url = random.Random(seed), f"sqlite:///{folder}/runs.sqlite3"
    body = KINDS["pin-profile"].example(Mode.CHECK)
    rows = [json.dumps({**body, "effect_tolerance": 0.01 + 1e-7 * k}).encode() + b"\n" for k in range(items)]
    with (
        contextlib.closing(Cluster(folder)) as cluster,
        Running(folder, cluster=cluster.address, lease_s=2) as running,
        running.client() as client,
    ):
        wait_until(lambda: running.ready(client), 170.0)
        place, form = "/api/v1/batches?kind=pin-profile&mode=check", {"Content-Type": "application/x-ndjson"}
        batch = client.post(place, content=b"".join(rows), headers=form).raise_for_status().json()

        def done(least: int) -> bool:
            return client.get(batch["links"]["self"]).json()["items"]["done"] >= least

        for kill in range(kills):
            # Each time something of the batch has been solved since the latest kill.
            wait_until(lambda kill=kill: done(1 + kill * items // (kills + 1)), 170.0)
            time.sleep(rng.uniform(0.0, 0.5))
            name = ("scheduler", "worker")[kill % 2]
            cluster.kill(name)
            cluster.start(name)
        wait_until(lambda: done(items), 170.0)
        answer = client.get(f"{batch['links']['self']}/results", params={"format": "ndjson"})
        found = [json.loads(line) for line in answer.text.splitlines()]
        running.end(signal.SIGTERM)
    assert [item["index"] for item in found] == list(range(items))
    assert verify(url).sound
    return Counter(item["status"] for item in found)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        print(dict(kill_in_turn(Path(scratch), int(sys.argv[1]), 2_000 * int(sys.argv[1]))))
