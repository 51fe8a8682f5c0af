"""Malformed requests over raw sockets: the service must answer with HTTP or close, never with a 5xx or a timeout.

    python -m tests.reliability.attacks 100000 .campaign/attacks

sends that many requests to a local service, a thousand per seed. Each seed appends a line to ``parts.jsonl``; a restart
continues after the last line.
"""

from __future__ import annotations

import base64
import json
import random
import socket
import sys
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, modes_of
from tests.app.running import Running, wait_until

PATIENCE_S = 30.0
AT_ONCE = 16
"""Concurrent connections of a campaign, which mostly waits for timeouts of incomplete requests."""
OF_A_SEED = 1000
_TOKENS = (
    b"NaN", b"-", b"1e999", b"\\ud83d", b'"', b"{", b"]", b"\x00", b"\xff\xfe", b"null", b"[]", b"1" * 400, b"true",
    b"\\u0000", b"\xe2\x80\xae", b"=cmd|", b",", b":", b"e", b"\xed\xa0\x80",
)  # fmt: skip
_MUTATIONS: tuple[Callable[[random.Random, bytearray, int], None], ...] = (
    lambda rng, body, at: body.__delitem__(slice(at, at + rng.randint(1, 40))),
    lambda rng, body, at: body.__setitem__(at, rng.randrange(256)),
    lambda rng, body, at: body.__setitem__(slice(at, at), body[at : at + rng.randint(1, 40)]),
    lambda rng, body, at: body.__setitem__(slice(at, at), rng.choice(_TOKENS)),
)


def spoiled(rng: random.Random, body: bytes) -> bytes:
    """Apply one to six random mutations: deletion, overwrite, duplication or insertion."""
    found = bytearray(body)
    for _ in range(rng.randint(1, 6)):
        if found:
            rng.choice(_MUTATIONS)(rng, found, rng.randrange(len(found)))
    return bytes(found)


def _examples() -> list[tuple[str, bytes]]:
    # No studies and designs: valid ones take seconds, and their bodies extend those of checks.
    kinds = [(kind, mode) for kind in KINDS.values() for mode in modes_of(kind) if mode in (Mode.CHECK, Mode.ANALYSIS)]
    return [(f"/api/v1/{PATHS[mode]}/{kind.slug}", json.dumps(example_of(kind, mode)).encode()) for kind, mode in kinds]


EXAMPLES = _examples()
_TARGETS = (
    b"/", b"/healthz", b"/readyz", b"/api/v1/runs", b"/api/v1/runs?limit=5&created_after=2026-01-01T00:00:00Z",
    b"/api/v1/batches", b"/designs/flexible-rod?mode=check", b"/api/v1/kinds", b"/api/v1/effects/pin-profile",
    b"/docs", b"/runs",
    b"/api/v1/runs/00000000-0000-7000-8000-000000000000", b"/static/style.css", b"/openapi.json",
)  # fmt: skip


def raw_request(rng: random.Random) -> bytes:
    """Wire format of a request with a mutated head, body, both or neither."""
    if rng.random() < 0.5:
        path, body = rng.choice(EXAMPLES)
        body = spoiled(rng, body)
        length = len(body) if rng.random() < 0.9 else rng.randrange(2 * len(body) + 1)
        head = b"POST %s HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" % path.encode()
        framing = b"Content-Length: %d\r\n" % length
        if rng.random() < 0.2:
            framing, body = b"Transfer-Encoding: chunked\r\n", b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body)
        request = head + framing + b"Connection: close\r\n\r\n" + body
        return request if rng.random() < 0.7 else spoiled(rng, request)
    method = rng.choice((b"GET", b"GET", b"HEAD", b"DELETE", b"PUT", b"OPTIONS", b"POST", b"TRACE", b"X"))
    request = b"%s %s HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n" % (method, rng.choice(_TARGETS))
    return spoiled(rng, request)


def sent(address: tuple[str, int], request: bytes) -> str:
    """Outcome of a raw request: the status, ``closed``, or ``silence`` after ``PATIENCE_S``."""
    with socket.create_connection(address, timeout=PATIENCE_S) as connection:
        try:
            connection.sendall(request)
            first = connection.recv(4096)
        except TimeoutError:
            return "silence"
        except OSError:
            return "closed"
    if not first:
        return "closed"
    return first[9:12].decode("ascii", "replace") if first.startswith(b"HTTP/1.") else "no HTTP"


def attack(address: tuple[str, int], seed: int, number: int, at_once: int = 1) -> tuple[Counter[str], list[bytes]]:
    """Send ``number`` random requests, ``at_once`` concurrently; returns the counts of outcomes and the requests with a
    bad one."""
    rng = random.Random(seed)
    requests = [raw_request(rng) for _ in range(number)]
    with ThreadPoolExecutor(at_once) as threads:
        outcomes = list(threads.map(lambda request: sent(address, request), requests))
    bad = [request for request, outcome in zip(requests, outcomes, strict=True) if not good(outcome)]
    return Counter(outcomes), bad


def good(outcome: str) -> bool:
    """Acceptable outcome. 501 and 505: unsupported method or version; 503: kernels not yet compiled."""
    return outcome == "closed" or (outcome.isdigit() and (outcome[0] in "234" or outcome in ("501", "503", "505")))


def told(outcomes: Counter[str]) -> dict[str, Any]:
    return dict(sorted(outcomes.items()))


def campaign(number: int, folder: Path) -> list[dict[str, Any]]:
    """Run until ``number`` requests have been sent in total; returns all reports, earlier included."""
    folder.mkdir(parents=True, exist_ok=True)
    told_to = folder / "parts.jsonl"
    done = [json.loads(line) for line in told_to.read_text().splitlines()] if told_to.exists() else []
    seeds = range(len(done), -(-number // OF_A_SEED))
    with Running(folder, body_idle_s=1, head_timeout_s=1) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        address = ("127.0.0.1", client.base_url.port)
        with ThreadPoolExecutor(AT_ONCE) as threads, told_to.open("a") as sink:
            found = threads.map(lambda seed: attack(address, seed, OF_A_SEED), seeds)
            for seed, (outcomes, bad) in zip(seeds, found, strict=True):
                bad = [base64.b64encode(request).decode() for request in bad]
                line = {"seed": seed, "outcomes": told(outcomes), "bad": bad}
                done.append(line)
                print(json.dumps(line), file=sink, flush=True)
        assert client.get("/healthz").status_code == 200
    assert "Traceback" not in running.output.read_text(), running.output
    return done


if __name__ == "__main__":
    parts = campaign(int(sys.argv[1]), Path(sys.argv[2]))
    print(told(sum((Counter(part["outcomes"]) for part in parts), Counter())))
    sys.exit(any(part["bad"] for part in parts))
