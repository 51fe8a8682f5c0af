"""Entry functions for test workers; module-level, so that a worker can import them by name."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator

from app.designs.kind import Answer
from app.designs.progress import Progress, Report


def load(kind_slug: str, mode: str) -> None:
    pass


LOADED: list[str] = []
"""What this process has loaded, or the one it was forked from."""


def load_step_by_step() -> Iterator[None]:
    for name in ("kernels", "a library"):
        LOADED.append(name)
        yield
    raise ImportError("a library that is damaged")


def failing_load(kind_slug: str, mode: str) -> None:
    raise RuntimeError("this worker cannot load what a call needs")


def answer(kind_slug: str, mode: str, payload: bytes, report: Report) -> Answer:
    wish = json.loads(payload)
    match mode:
        case "echo":
            own = {"pid": os.getpid(), "nice": os.nice(0), "loaded": LOADED}
            return _answer({"kind": kind_slug, "payload": wish, **own})
        case "sleep":
            time.sleep(wish)
        case "spin":
            end = time.monotonic() + wish
            while time.monotonic() < end:
                pass
        case "mark":
            with open(wish, "w") as file:
                file.write(str(os.getpid()))
            time.sleep(60)
        case "die":
            os._exit(wish)
        case "hog":
            return _answer({"length": len(bytearray(wish))})
        case "raise":
            raise ZeroDivisionError("a secret detail")
        case "tell":
            for step in range(wish):
                report(Progress(step, wish, "steps"))
                time.sleep(0.05)
        case "flood":
            end = time.monotonic() + wish
            while time.monotonic() < end:
                report(Progress(0, 1, "x" * 1000))
        case "tell-and-die":
            report(Progress(1, 2, "the last thing it says"))
            os._exit(wish)
        case "large":
            return _answer({"text": "x" * wish})
    return _answer({"pid": os.getpid()})


def _answer(result: dict) -> Answer:
    return Answer("succeeded", result, [], None, {})


SETTINGS = {
    "entry": answer,
    "load": load,
    "preload": __name__,
    "kernels": False,
}
"""Settings of a pool whose workers run these functions."""
