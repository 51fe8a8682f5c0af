"""The files of cases, one case per line, so that a changed case is a single line of a diff."""

from __future__ import annotations

import json
from pathlib import Path

HERE = Path(__file__).parent
WINGS = ("rod", "crank", "pin", "linkage")


def path_of(wing: str) -> Path:
    return HERE / f"{wing}_cases.json"


def read(wing: str) -> dict:
    """The contents of a wing's file: groups of cases, and the data that they share."""
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
