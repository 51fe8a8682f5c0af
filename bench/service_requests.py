"""One request after another: the processor time of a solve over HTTP, beside the solve itself.

A started service with its default settings on a fresh database; every request has another number in it, so that each
is solved and stored. Processor time is that of all the service's processes: itself, its fork server and its workers,
with what they take when there is nothing to do, which is shown below the table as well. The solve is the same requests
answered in the bench's own process, from the validated request to the answer; what lies between is HTTP, validation,
the hand-over to a worker that can be killed, and a commit that survives a power cut. Of several rounds the least
disturbed counts: on a busy machine every change of process empties the caches, and the same request takes twice the
time. So does a solve that does not follow at once on another: how much is seen by solving the same requests with a
pause before each, as long as a worker waits between two.
"""

from __future__ import annotations

import json
import os
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of
from bench.service import free_port, process, wait_for_answer

REQUESTS, ROUNDS = 50, 10
GOAL_S = 1.5e-3


def _rod(request: dict[str, Any], small: float) -> None:
    request["dimensions"]["h_mm"] += small


def _pin(request: dict[str, Any], small: float) -> None:
    request["bore_mm"] -= small


def _linkage(request: dict[str, Any], small: float) -> None:
    request["impact_speed_m_s"] += small


def _crank(request: dict[str, Any], small: float) -> None:
    request["mechanism"]["speed_hz"] += small


KINDS_ASKED: dict[str, tuple[Mode, str, Callable[[dict[str, Any], float], None]]] = {
    "flexible-rod": (Mode.CHECK, "checks", _rod),
    "pin-profile": (Mode.CHECK, "checks", _pin),
    "impact-linkage": (Mode.CHECK, "checks", _linkage),
    "crank-dynamics": (Mode.ANALYSIS, "analyses", _crank),
}


@dataclass(frozen=True)
class Row:
    """One kind: processor time per request of the service, of the solve, and of the solve after a pause [s]; and of the
    clock [s]."""

    title: str
    service: float
    solve: float
    rested: float
    elapsed: float

    @property
    def more(self) -> float:
        return self.service - self.solve


def family(pid: int) -> list[int]:
    """A process and all its descendants."""
    found = [pid]
    for each in found:
        for task in Path(f"/proc/{each}/task").iterdir():
            found += map(int, (task / "children").read_text().split())
    return found


def processor_time(pids: list[int]) -> dict[int, float]:
    """Processor time of each process with all its threads [s]; without those that have ended."""
    found = {}
    for pid in pids:
        with suppress(OSError):
            tasks = Path(f"/proc/{pid}/task").iterdir()
            found[pid] = 1e-9 * sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)
    return found


def bodies(slug: str) -> Iterator[bytes]:
    """Requests of a kind that no two share."""
    mode, _, change = KINDS_ASKED[slug]
    request = KINDS[slug].example(mode)
    for _ in count():
        change(request, 1e-9)
        yield json.dumps(request).encode()


def send(port: int, slug: str, asked: list[bytes]) -> None:
    """Post one body after another on a connection kept open. Raises RuntimeError at the first that is not 201."""
    path = f"/api/v1/{KINDS_ASKED[slug][1]}/{slug}"
    with socket.create_connection(("127.0.0.1", port)) as connection, connection.makefile("rb") as reader:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for body in asked:
            head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            connection.sendall(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
            status, size = reader.readline(), 0
            while (line := reader.readline()) != b"\r\n":
                if line.lower().startswith(b"content-length:"):
                    size = int(line.partition(b":")[2])
            answer = reader.read(size)
            if not status.startswith(b"HTTP/1.1 201"):
                raise RuntimeError(answer.decode())


def solved_alone(slug: str, asked: list[bytes], pause_s: float = 0.0) -> float:
    """Processor time of the solves in this process, each after a pause [s]."""
    job = job_of(KINDS[slug], KINDS_ASKED[slug][0])
    requests = [job.request.model_validate_json(body) for body in asked]
    job.solve(requests[0])
    spent = 0.0
    for request in requests:
        time.sleep(pause_s)
        began = time.process_time()
        job.solve(request)
        spent += time.process_time() - began
    return spent


def idle_share(pid: int, seconds: float = 4.0) -> float:
    """Processor time that a service with nothing to do takes per second."""
    before = processor_time(family(pid))
    time.sleep(seconds)
    after = processor_time(family(pid))
    return sum(spent - before.get(each, 0.0) for each, spent in after.items()) / seconds


def run(requests: int = REQUESTS, rounds: int = ROUNDS) -> tuple[list[Row], float]:
    """Every kind in turn, round by round; of each kind the round of least processor time. And the idle service's."""
    samples: dict[str, list[tuple[float, ...]]] = {slug: [] for slug in KINDS_ASKED}
    different = {slug: bodies(slug) for slug in KINDS_ASKED}
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        command = ("-m", "app.cli", "serve", "--port", str(port), "--database-url", f"sqlite:///{folder}/runs.sqlite3")
        with process(*command, CRANKWRIGHT_LOG_LEVEL="error") as child:
            wait_for_answer(port, next(different["flexible-rod"]))
            for slug, bodies_of in different.items():
                send(port, slug, [next(bodies_of) for _ in range(100)])
            time.sleep(8.0)  # workers load what is left of the kernels while they are idle
            idle = idle_share(child.pid)
            for _ in range(rounds):
                for slug, bodies_of in different.items():
                    asked = [next(bodies_of) for _ in range(requests)]
                    before, began = processor_time(family(child.pid)), time.perf_counter()
                    send(port, slug, asked)
                    elapsed = time.perf_counter() - began
                    after = processor_time(family(child.pid))
                    cpu = sum(spent - before.get(pid, 0.0) for pid, spent in after.items())
                    alone, rested = (solved_alone(slug, asked, pause_s) for pause_s in (0.0, elapsed / requests))
                    samples[slug].append(tuple(s / requests for s in (cpu, alone, rested, elapsed)))
    return [Row(KINDS[slug].title, *min(taken)) for slug, taken in samples.items()], idle


def table() -> list[str]:
    """The section's table."""
    lines = [
        f"| kind | service, processor | the solve alone | after a pause | more than alone (goal {GOAL_S * 1e3:g} ms) "
        "| by the clock |",
        "|---|---|---|---|---|---|",
    ]
    rows, idle = run()
    for row in rows:
        figures = (row.service, row.solve, row.rested, row.more, row.elapsed)
        lines.append(f"| {row.title} | {' | '.join(f'{1e3 * figure:.2f} ms' for figure in figures)} |")
    lines += ["", f"With nothing to do, the service takes {1e3 * idle:.1f} ms of processor time a second."]
    return [*lines, "", f"Load of the machine's {os.cpu_count()} cores at the end: {os.getloadavg()[0]:.1f}."]
