"""Names that people give, as they are kept."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

_SPACES = "\t\n\r\v\f\x85\u2028\u2029"
_JOINERS = "\u200c\u200d"
"""Of no width, but part of how some languages and pictures are written."""


def cleaned(name: str) -> str:
    """The name without what is not seen but changes how it, or what stands beside it, is shown: control characters and
    those that turn the direction of writing. Line ends and tabs become spaces."""
    if name.isascii() and name.isprintable():
        return name
    kept = (" " if each in _SPACES else each for each in name)
    return "".join(each for each in kept if each in _JOINERS or unicodedata.category(each) not in ("Cc", "Cf"))


Cleaned = Annotated[str, AfterValidator(cleaned)]
