"""A service in its own processes, started with the command, and helpers to inspect them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from tests.child_processes import die_with_test_runner
from tests.databases import sqlite_database

ROOT = Path(__file__).parents[2]
_END_WITH_TESTS = die_with_test_runner()


def parents() -> dict[int, int]:
    """Every living process and its parent, without zombies."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, parent = (entry / "stat").read_text().rpartition(")")[2].split()[:2]
            except (FileNotFoundError, ProcessLookupError):
                continue
            if state != "Z":
                found[int(entry.name)] = int(parent)
    return found


def descendants(pid: int) -> set[int]:
    """The living processes that come from one, itself not among them."""
    parent, found = parents(), set()
    while more := {p for p, above in parent.items() if above in found | {pid}} - found:
        found |= more
    return found


def wait_until(condition: Callable[[], Any], seconds: float = 60.0) -> Any:
    """The condition's value once it holds; AssertionError on timeout."""
    end = time.monotonic() + seconds
    while not (given := condition()):
        assert time.monotonic() < end, condition
        time.sleep(0.02)
    return given


def _started_by_hand() -> None:
    """End with the tests; heed Ctrl-C from the start, although children of a shell's background jobs ignore it."""
    _END_WITH_TESTS()
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Running:
    """``crankwright serve`` on a free port, by default with a database in the folder; ``cold``: with an empty kernel
    cache."""

    def __init__(self, folder: Path, cold: bool = False, url: str = "", **settings: object) -> None:
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # every start would compile what it imports
        environment |= {f"CRANKWRIGHT_{name.upper()}": str(value) for name, value in settings.items()}
        if cold:
            environment["NUMBA_CACHE_DIR"] = str(folder / "kernels")
        self.output = folder / "output.txt"
        database = url or sqlite_database(folder)
        with self.output.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "app.cli", "serve", "--port", "0", "--database-url", database],
                env=environment, cwd=ROOT, stdout=file, stderr=subprocess.STDOUT, start_new_session=True,
                preexec_fn=_started_by_hand,
            )  # fmt: skip

    def __enter__(self) -> Running:
        return self

    def __exit__(self, *_: object) -> None:
        left = self.family()
        for pid in left:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()

    @property
    def pid(self) -> int:
        return self.process.pid

    def family(self) -> set[int]:
        """The service and every process that comes from it."""
        return ({self.pid} if self.process.poll() is None else set()) | descendants(self.pid)

    @property
    def template(self) -> int:
        """The process that workers are forked from: the service's only child."""
        return wait_until(lambda: [pid for pid, parent in parents().items() if parent == self.pid])[0]

    def client(self, timeout: float = 120.0) -> httpx.Client:
        """A client, once the first page can be had."""

        def address() -> str | None:
            assert self.process.poll() is None, self.output.read_text()
            found = re.search(r"http://127\.0\.0\.1:\d+", self.output.read_text())
            return found and found[0]

        return httpx.Client(base_url=wait_until(address, timeout), timeout=timeout)

    def ready(self, client: httpx.Client) -> bool:
        return client.get("/readyz").status_code == 200

    def end(self, sent: signal.Signals) -> float:
        """Send a signal; the seconds until no process of the family lives."""
        family, began = self.family(), time.monotonic()
        self.process.send_signal(sent)
        wait_until(lambda: self.process.poll() is not None and not family & parents().keys(), 30.0)
        return time.monotonic() - began
