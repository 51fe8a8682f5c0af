"""Text of users and of the service, made harmless for either renderer."""

from __future__ import annotations

import re
from html import escape

_UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
"""Control characters, and those that turn the direction of whatever follows."""


def plain(text: str) -> str:
    """The text in one line, without characters that act on what stands around it."""
    return _UNSEEN.sub(" ", text)


def for_html(text: str) -> str:
    """As the inside of an element or of an attribute in quotes."""
    return escape(plain(text), quote=True)


def for_typst(text: str) -> str:
    """As a string of typst's code: nothing in it is markup."""
    return '"' + plain(text).replace("\\", "\\\\").replace('"', '\\"') + '"'
