"""Translation of the English sentences of solvers; those with figures are matched by patterns.

Translation at display time covers stored sentences and keeps the solvers independent of languages. The patterns are
extracted from the solver sources (``scripts.sentences``).
"""

from __future__ import annotations

import re
from functools import cache, lru_cache

from app.words.fields import named
from app.words.languages import LOCALE, gettext, language
from app.words.units import in_sentence

PATTERNS_FILE = LOCALE / "patterns.txt"
"""One pattern per line, the most specific first, with ``{}`` as placeholder. Written by ``make messages``."""
_NAME = re.compile(r"[a-z]\w*(?:[._]\w+)+")
_NAME_INSIDE = re.compile(r"(?<![\w./])[a-z]{2}\w*(?:[._][a-z]\w+)+(?![\w/])")
_ENGLISH = re.compile(r"[A-Za-z]{2}")
_CYRILLIC = re.compile(r"[А-Яа-яЁёЄєІіЇїҐґ]")


def spoken(text: str, keep_names: bool = False) -> str:
    """A solver text in the current language and units, untranslated if the catalogue lacks it.

    Field names in it become words, unless they are those of a file's columns or of JSON.
    """
    if language() != "en":
        return in_sentence(_spoken(text, language(), keep_names))
    return in_sentence(text if keep_names else _NAME_INSIDE.sub(_in_words, text))


def _in_words(name: re.Match[str]) -> str:
    return named(name[0].rpartition(".")[2])[0]


def is_foreign(text: str) -> bool:
    """Whether a text has no translation in the current, non-English language and is none itself."""
    if language() == "en" or _CYRILLIC.search(text):
        return False
    return bool(_ENGLISH.search(text)) and _spoken(text, language()) == text


@lru_cache(4096)
def _spoken(text: str, code: str, keep_names: bool = False) -> str:
    """Translate by catalogue entry, else by pattern, else item by item if the text is a list."""
    if (name := _NAME.fullmatch(text)) is not None:
        return text if keep_names else _in_words(name)
    said = gettext(text)
    if said != text:
        return said
    # Split at semicolons first: a generic pattern would match across them.
    for separator in (";", ""):
        for pattern, compiled in _patterns(separator):
            found = compiled.fullmatch(text)
            if found is not None and (said := gettext(pattern)) != pattern:
                return said.format(*(_part(part, code, keep_names) for part in found.groups()))
        items = re.split(rf"([{separator or ':,'}] )", text)
        if len(items) > 1:
            return "".join(_part(item, code, keep_names) for item in items)
    return text


def _part(text: str, code: str, keep_names: bool) -> str:
    """Translate a placeholder's content: a figure, a field name or another sentence."""
    plain = text.strip()
    return text.replace(plain, _spoken(plain, code, keep_names)) if plain else text


@cache
def _patterns(separator: str) -> list[tuple[str, re.Pattern[str]]]:
    """The compiled patterns that contain the separator."""
    patterns = [each for each in PATTERNS_FILE.read_text("utf-8").splitlines() if separator in each]
    return [(pattern, re.compile("(.*?)".join(map(re.escape, pattern.split("{}"))))) for pattern in patterns]
