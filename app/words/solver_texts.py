"""What solvers say in English sentences, in the language spoken; those with figures by their patterns.

So a sentence that was stored years ago is still translated, and a solver knows nothing of languages. The patterns are
read from the solvers' own sources (`scripts.sentences`).
"""

from __future__ import annotations

import re
from functools import cache, lru_cache

from app.words.fields import named
from app.words.languages import LOCALE, gettext, language

PATTERNS_FILE = LOCALE / "patterns.txt"
"""A pattern a line, the most definite first; ``{}`` holds the place of what is put in. `make messages` writes it."""
_NAME = re.compile(r"[a-z]\w*(?:[._]\w+)+")
_ENGLISH = re.compile(r"[A-Za-z]{2}")


def spoken(text: str) -> str:
    """A text made elsewhere, in the language spoken; what the catalogue does not have stays as it is."""
    return text if language() == "en" else _spoken(text, language())


def is_foreign(text: str) -> bool:
    """Whether a text stays English where another language is spoken."""
    return language() != "en" and bool(_ENGLISH.search(text)) and spoken(text) == text


@lru_cache(4096)
def _spoken(text: str, code: str) -> str:
    """As the catalogue has it, else by a pattern; else, where it is a list, item by item."""
    if _NAME.fullmatch(text):
        return named(text.rpartition(".")[2])[0]
    said = gettext(text)
    if said != text:
        return said
    # Semicolons part what else a vague pattern would take for one.
    for separator in (";", ""):
        for pattern, compiled in _patterns(separator):
            found = compiled.fullmatch(text)
            if found is not None and (said := gettext(pattern)) != pattern:
                return said.format(*(_part(part, code) for part in found.groups()))
        items = re.split(rf"([{separator or ':,'}] )", text)
        if len(items) > 1:
            return "".join(_part(item, code) for item in items)
    return text


def _part(text: str, code: str) -> str:
    """What stands in a sentence: a figure, the name of a field, another sentence."""
    plain = text.strip()
    return text.replace(plain, _spoken(plain, code)) if plain else text


@cache
def _patterns(separator: str) -> list[tuple[str, re.Pattern[str]]]:
    """Those with the separator in them."""
    patterns = [each for each in PATTERNS_FILE.read_text("utf-8").splitlines() if separator in each]
    return [(pattern, re.compile("(.*?)".join(map(re.escape, pattern.split("{}"))))) for pattern in patterns]
