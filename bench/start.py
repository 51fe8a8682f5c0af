"""Start-up: from a fresh clone to the first page and answer, warm starts, the command line, and shutdown.

A fresh clone is set up and started by `make run`; packages come from the client's warm cache, kernels are compiled from
scratch. Then it is repeated warm, with Python's bytecode cached. Times are wall-clock seconds of one run on a possibly
busy machine, from the command to the event in the row; goals are for two idle cores. Below, the compilation time of the
most expensive kernels in seconds of processor time.

python -m bench.start        measures, and updates the section of docs/benchmarks.md
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

from bench import kernel_costs
from bench.sections import put


def free_port() -> int:
    """A free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"
TITLE = "## The start"
PORT = free_port()
BASE = f"http://127.0.0.1:{PORT}"
TIMEOUT_S = 1800.0
_SHORT_S = 5.0


@dataclass(frozen=True)
class Row:
    """A stage: its description, duration [s] and goal [s]."""

    name: str
    seconds: float
    goal_s: float | None = None


def answered(path: str, body: bytes | None = None) -> bool:
    """Whether the service answers with success."""
    try:
        with urlopen(Request(BASE + path, body, {"Content-Type": "application/json"}), timeout=60) as answer:
            return 200 <= answer.status < 300
    except (HTTPError, URLError, OSError):
        return False


@dataclass
class Made:
    """A running `make run`."""

    process: subprocess.Popen[bytes]
    output: Path
    began: float

    def moments(self, *conditions: Callable[[], bool]) -> list[float]:
        """Seconds from the command until each of the conditions holds, in whichever order they come to hold."""
        moments = [0.0] * len(conditions)
        while waiting := [k for k, moment in enumerate(moments) if not moment]:
            if self.process.poll() is not None or time.monotonic() - self.began > TIMEOUT_S:
                raise RuntimeError(self.output.read_text())
            for k in waiting:
                if conditions[k]():
                    moments[k] = time.monotonic() - self.began
            # a low rate, so as not to disturb the measurement
            time.sleep(0.02 if time.monotonic() - self.began < _SHORT_S else 0.5)
        return moments

    def printed(self, pattern: str) -> Callable[[], bool]:
        """Whether the text has appeared in the terminal."""
        return lambda: re.search(pattern, self.output.read_text()) is not None

    def stop(self) -> float:
        """Send SIGTERM; returns the seconds until the service has stopped."""
        began = time.monotonic()
        os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait()
        return time.monotonic() - began


def plain_environment() -> dict[str, str]:
    """A new user's environment: bytecode caching, and no other projects."""
    unwanted = ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "PYTHONPYCACHEPREFIX")
    return {name: value for name, value in os.environ.items() if name not in unwanted}


@contextmanager
def made(folder: Path, log: Path, kernels: Path) -> Iterator[Made]:
    """`make run` in a folder."""
    environment = {**plain_environment(), "CRANKWRIGHT_PORT": str(PORT), "NUMBA_CACHE_DIR": str(kernels)}
    began = time.monotonic()
    with log.open("wb") as file:
        process = subprocess.Popen(
            ["make", "run"], cwd=folder, env=environment, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
        )
    run = Made(process, log, began)
    try:
        yield run
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def least(command: list[str], folder: Path, environment: dict[str, str], runs: int = 5) -> float:
    """Minimum wall-clock time of a command [s]."""
    times = []
    for _ in range(runs):
        began = time.monotonic()
        subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
        times.append(time.monotonic() - began)
    return min(times)


def measure() -> list[Row]:
    """All stages in chronological order."""
    with tempfile.TemporaryDirectory() as held:
        base = Path(held)
        clone, kernels = base / "clone", base / "kernels"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        body = (clone / "app/designs/examples/flexible-rod-check.json").read_bytes()

        def check_answered() -> bool:
            return answered("/api/v1/checks/flexible-rod", body)

        rows = []
        with made(clone, base / "first.txt", kernels) as run:
            installed, page, check, design, ready = run.moments(
                run.printed(r"installed"), lambda: answered("/"), check_answered,
                run.printed(r"flexible-rod · design · succeeded"), lambda: answered("/readyz"),
            )  # fmt: skip
            rows.append(Row("`make run`, fresh: packages installed", installed))
            rows.append(Row("`make run`, fresh: first page", page, 20))
            rows.append(Row("`make run`, fresh: first design printed", design, 45))
            rows.append(Row("`make run`, fresh: first check answered", check))
            rows.append(Row("`make run`, fresh: all kernels there", ready))
            rows.append(Row("all kernels, from the first page on", ready - page, 30))
            rows.append(Row("SIGTERM, idle", run.stop(), 2))
        with made(clone, base / "second.txt", kernels) as run:
            page, check = run.moments(lambda: answered("/"), check_answered)
            rows.append(Row("`make run`, again: first page", page, 3))
            rows.append(Row("`make run`, again: first check answered", check, 3))
        command = str(clone / ".venv/bin/crankwright")
        environment = {**plain_environment(), "NUMBA_CACHE_DIR": str(kernels)}
        environment["CRANKWRIGHT_DATABASE_URL"] = f"sqlite:///{base}/runs.sqlite3"
        began = time.monotonic()
        warm_start = subprocess.Popen(
            [command, "serve", "--port", str(PORT)], env=environment, cwd=clone, stdout=subprocess.DEVNULL
        )
        while not check_answered():
            time.sleep(0.01)
        rows.append(Row("warm start: first check answered", time.monotonic() - began, 1.5))
        warm_start.send_signal(signal.SIGTERM)
        warm_start.wait()
        file = "app/designs/examples/flexible-rod-check.json"
        rows.append(
            Row("`crankwright check`", least([command, "check", "flexible-rod", file], clone, environment), 1.0)
        )
        rows.append(Row("`crankwright --help`", least([command, "--help"], clone, environment), 0.3))
        python = str(clone / ".venv/bin/python")
        rows.append(Row("`import solvers`", least([python, "-c", "import solvers"], clone, environment), 0.3))
        return rows


def table() -> list[str]:
    """The rows of the page."""
    lines = ["| what | took | goal |", "|---|---|---|"]
    for row in measure():
        lines.append(f"| {row.name} | {row.seconds:.1f} s | {'' if row.goal_s is None else f'{row.goal_s:g} s'} |")
    load = os.getloadavg()
    lines += ["", f"Load of the machine's {os.cpu_count()} cores at the end: {load[0]:.1f}.", ""]
    return [*lines, *kernel_costs.table()]


def section() -> list[str]:
    """The whole section."""
    assert __doc__
    return [TITLE, "", __doc__.partition("\n\n")[2].partition("\n\npython -m")[0].strip(), "", *table(), ""]


def main() -> None:
    """Measure and replace or append the section."""
    found = section()
    put(PAGE, TITLE, found)
    print("\n".join(found))


if __name__ == "__main__":
    sys.exit(main())
