"""Text that people wrote, made harmless for the form it goes into."""

from __future__ import annotations

import unicodedata

_RUN_BY_SHEETS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
LONGEST = 200


def plain(text: object) -> str:
    """One line without control characters, lone surrogates and what turns the direction of writing."""
    kept = "".join(" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in str(text))
    return "".join(c for c in kept if unicodedata.category(c) not in ("Cs", "Cf", "Co", "Cn")).strip()


def cell(value: object) -> str:
    """A cell of a table: numbers as they are, text such that no spreadsheet runs it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    text = str(value)
    return f"'{text}" if text.lstrip().startswith(_RUN_BY_SHEETS) or text.startswith(_RUN_BY_SHEETS) else text


def word(text: str) -> str:
    """A name that every CAD program takes: letters, digits and underscores, a letter first."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in text)
    return kept if kept[:1].isalpha() else f"p_{kept}"
