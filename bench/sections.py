"""Sections of a page that a bench writes by itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def put(page: Path, heading: str, lines: Sequence[str]) -> None:
    """Write a section, whose first line is the heading, in the place of its former text, or at the end."""
    before, _, rest = page.read_text("utf-8").partition(heading + "\n")
    _, following, after = rest.partition("\n## ")
    page.write_text(before.rstrip("\n") + "\n\n" + "\n".join(lines) + (following + after if following else ""), "utf-8")
