"""What is found wrong with a store."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Damage:
    """One thing that is wrong: in which table, at which key (None: the table or the file itself), and what."""

    table: str
    key: str | None
    what: str
