"""Sanitising of user text for export formats."""

from __future__ import annotations

import unicodedata

_FORMULA_PREFIXES = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
MAX_LENGTH = 200


def plain(text: object) -> str:
    """A single line without control characters, lone surrogates and bidirectional controls."""
    kept = "".join(" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in str(text))
    return "".join(c for c in kept if unicodedata.category(c) not in ("Cs", "Cf", "Co", "Cn")).strip()


def cell(value: object) -> str:
    """A table cell: numbers unchanged, text protected against formula injection."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    text = str(value)
    return f"'{text}" if text.lstrip().startswith(_FORMULA_PREFIXES) or text.startswith(_FORMULA_PREFIXES) else text


def word(text: str) -> str:
    """A name valid in every CAD program: letters, digits and underscores, starting with a letter."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in text)
    return kept if kept[:1].isalpha() else f"p_{kept}"
