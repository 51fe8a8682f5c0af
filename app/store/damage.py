"""Findings of a verification."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Damage:
    """One finding: the table, the key of the row (None: the table or the file itself), and a description."""

    table: str
    key: str | None
    what: str

    def __str__(self) -> str:
        place = f"{self.table} {'' if self.key is None else self.key}".strip()
        return f"{place}: {self.what}" if place else self.what
