"""Sanitising of user-supplied names."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

_SPACES = "\t\n\r\v\f\x85\u2028\u2029"
_JOINERS = "\u200c\u200d"
"""Zero-width joiners are part of some scripts and emoji."""


def cleaned(name: str) -> str:
    """Remove invisible characters that affect display: control characters, bidirectional controls and outer spaces.
    Line ends and tabs become spaces."""
    if name.isascii() and name.isprintable():
        return name.strip()
    kept = (" " if each in _SPACES else each for each in name)
    return "".join(each for each in kept if each in _JOINERS or unicodedata.category(each) not in ("Cc", "Cf")).strip()


Cleaned = Annotated[str, AfterValidator(cleaned)]
