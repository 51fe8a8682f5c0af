"""Record the kernels called from Python and their argument types, by solving all rehearsals in order.

python scripts/kernel_signatures.py

The list drives compilation ahead of use (`app/designs/entries.py`). A test compares it with the rehearsals.
"""

from __future__ import annotations

from pathlib import Path

from app.designs.entries import called, word_of
from app.designs.rehearsals import PARTS, rehearsals_of

FILE = Path(__file__).parents[1] / "app/designs/signatures.py"
_HEAD = '''"""The kernels that Python calls, and their types. Made by scripts/kernel_signatures.py: not to be edited."""

# ruff: noqa: E501
# fmt: off
'''


def listed() -> tuple[dict[tuple[str, str], list[tuple[str, str]]], dict[str, str]]:
    """The entries that each part is the first to call, with their types; and the fields of named tuples."""
    entries: dict[tuple[str, str], list[tuple[str, str]]] = {}
    tuples: dict[str, str] = {}
    known: set[tuple[str, str]] = set()
    for part in PARTS:
        for job, request in rehearsals_of(*part):
            job.rehearse(request)
        now = {(name, " ".join(word_of(each, tuples) for each in types)) for name, types in called()}
        entries[part] = sorted(now - known)
        known |= now
    return entries, tuples


def written() -> str:
    """The file."""
    entries, tuples = listed()
    lines = [_HEAD, "TUPLES: dict[str, str] = {"]
    lines += [f'    "{name}": "{tuples[name]}",' for name in sorted(tuples)]
    lines += ["}", "", "ENTRIES: dict[tuple[str, str], tuple[tuple[str, str], ...]] = {"]
    for (kind, mode), found in entries.items():
        if found:
            lines += [f'    ("{kind}", "{mode}"): (', *(f'        ("{name}", "{types}"),' for name, types in found)]
            lines += ["    ),"]
    return "\n".join([*lines, "}"]) + "\n"


if __name__ == "__main__":
    FILE.write_text(written(), encoding="utf-8")
