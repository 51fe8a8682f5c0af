"""Escaping of text for the HTML and typst renderers."""

from __future__ import annotations

import re
from html import escape

_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
"""Control, surrogate and bidirectional formatting characters."""


def plain(text: str) -> str:
    """The text on one line, without characters that affect the surrounding text."""
    return _CONTROL.sub(" ", text)


def for_html(text: str) -> str:
    """Escape for element content or a quoted attribute."""
    return escape(plain(text), quote=True)


def for_typst(text: str) -> str:
    """Quote as a typst string literal, in which nothing is markup."""
    return '"' + plain(text).replace("\\", "\\\\").replace('"', '\\"') + '"'
