"""The files of cases: one case a line, so that a case is a line of a difference."""

from __future__ import annotations

import json
from pathlib import Path

HERE = Path(__file__).parent
WINGS = ("rod", "crank", "pin", "linkage")


def path_of(wing: str) -> Path:
    return HERE / f"{wing}_cases.json"


def read(wing: str) -> dict:
    """A wing's cases as they stand, groups of lists beside what they share."""
    return json.loads(path_of(wing).read_text("utf-8"))


def write(wing: str, data: dict) -> None:
    parts = []
    for name, value in data.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            told = "[\n" + ",\n".join(json.dumps(case) for case in value) + "\n]"
        else:
            told = json.dumps(value)
        parts.append(f"{json.dumps(name)}: {told}")
    path_of(wing).write_text("{\n" + ",\n".join(parts) + "\n}\n", "utf-8")
