"""Results of the latest searches (tests/hard_cases/hunts.json), and their section of the page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

PATH = Path(__file__).parents[1] / "hunts.json"


def read() -> dict:
    return json.loads(PATH.read_text("utf-8")) if PATH.exists() else {}


def note(wing: str, stem: str, entry: dict) -> None:
    """``entry``: seed, scenes, seconds, worst, median, value, kept."""
    whole = read() | {f"{wing}.{stem}": {"date": f"{datetime.now(UTC):%Y-%m-%d}", **entry}}
    PATH.write_text(json.dumps(whole, indent=1) + "\n", "utf-8")


def told() -> Iterator[str]:
    """The section of the page: one row per quarry."""
    yield "## The hunt"
    yield ""
    yield (
        "`python -m tests.hard_cases.hunt` looks for the scenes on which a core function errs most: differential "
        "evolution over a bounded space of scenes, each judged in ε max(1, κ) against the makers of the references. "
        "Its worst finds stay among the cases below, as found_...; the last hunts:"
    )
    yield ""
    yield "| hunted | date | seed | scenes | median error | worst error | in | cases kept |"
    yield "|---|---|---|---|---|---|---|---|"
    for name, e in read().items():
        hunted = name.replace(".", ": ")
        kept = ", ".join(e["kept"]) or "none: no worse than those already kept"
        yield (
            f"| {hunted} | {e['date']} | {e['seed']} | {e['scenes']:,} | {e['median']:.2g} | {e['worst']:.3g} | "
            f"{e['value']} | {kept} |"
        )
    yield ""
