"""Collect all texts of the pages and update the translation catalogues.

    python -m scripts.messages          # write app/words/locale/*/LC_MESSAGES/crankwright.po and .mo
    python -m scripts.messages --todo   # print the texts without a translation

Texts are collected from the templates (``{% trans %}`` and ``_("…")``), from the Python sources of the pages and of the
verdict, and from the registry, for forms, drawings and pages: labels, help texts, field names, criteria, captions.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from gettext import NullTranslations
from io import BytesIO
from pathlib import Path
from typing import Any, get_args

from babel.messages import Catalog, Message
from babel.messages.extract import extract_from_file
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po
from pydantic import BaseModel

from app.access.scopes import Scope
from app.designs import claims
from app.designs.crank_dynamics.chain import INSTANTS
from app.designs.drawing import sentences_of, worded
from app.designs.kind import Kind, Mode
from app.designs.problems import DAMAGED, DISK_FULL, NO_ROOM, NOT_SHOWN, OUT_OF_TIME, SOLVER_FAILED
from app.designs.refusals import ALLOWED_BY_TYPE, LIMITS
from app.designs.registry import KINDS
from app.exports.registry import EXPORTS
from app.store.batch_records import BatchStatus
from app.store.faults import FaultKind
from app.store.record import RunStatus
from app.web import listing
from app.web.forms.faults import SAYS
from app.web.forms.tree import build
from app.web.rendering import templates
from app.words import captions, inputs, shaping
from app.words.fields import split_unit
from app.words.languages import DOMAIN, LANGUAGES, LOCALE, gettext, speaking
from app.words.solver_texts import PATTERNS_FILE
from app.words.units import System, measuring
from scripts.sentences import patterns, sentences
from solvers.effects import EffectState

ROOT = Path(__file__).parent.parent
TEMPLATES = ROOT / "app" / "web" / "templates"
_APP = ROOT / "app"
SOURCES = (
    *(path for folder in ("web", "words", "reports") for path in sorted((_APP / folder).rglob("*.py"))),
    _APP / "api" / "exports.py",
    _APP / "designs" / "verdict.py",
    *(
        path
        for names in ("*/chain.py", "*/*picture*.py", "*/feasible_region.py", "pictures/*.py")
        for path in sorted((_APP / "designs").glob(names))
    ),
)
KEYWORDS: dict[str, Any] = {
    "_": None, "gettext": None, "say": None, "noted": None, "ngettext": (1, 2),
    # The second argument of a Problem is its title.
    "Problem": (2,),
    # Hand calculations: descriptions of given numbers and of steps.
    "title": None, "remark": None, "given": (2,), "step": (3,), "Column": (2,),
}  # fmt: skip
_ELSEWHERE = (
    "Not Found",
    "Internal Server Error",
    "no run has this id",
    "no batch has this id",
    "there is no such kind or mode",
    claims.NOT_IN_THE_GAP,
    "one unknown",
    "recommended accuracy",
    "governed by",
    "engine.indicated power",
    "status",
    "holds",
    "thin ring with load factor",
    "the solid section",
    "linear",
    "Monte Carlo",
    "any",
    "pin",
    "bushing",
    OUT_OF_TIME,
    SOLVER_FAILED,
    DAMAGED,
    NOT_SHOWN,
    DISK_FULL,
    NO_ROOM,
    "The memory bound was reached",
    "The result is not finite",
    "The service stopped",
    "The store cannot be used",
    *FaultKind,
    "nothing was stored",
    "Beyond the key's scope",
    *(f"a key with the scope {scope} is required" for scope in Scope),
    "The request is too large",
    "Too many requests",
    "transmission angle least",
    "transmission angle greatest",
    *INSTANTS.values(),
)
"""Texts on pages that come from frameworks and other parts of the service."""
_EVIDENCE = (
    "angles", "bound", "boxes", "closed", "cone share", "core", "core bound", "core gap", "core optimum",
    "deflection as constrained", "effects beyond the core", "free directions", "full model", "full model bound",
    "gain still promised", "kkt residual", "least curvature", "least violation", "local optima", "local searches",
    "multiplier", "narrowing", "parts", "pieces", "ranges largest base", "ranges largest coupler",
    "ranges largest rocker", "rests on", "ripple", "rounds", "searched", "sections", "stations", "steps",
    "transfer points", "widening", "work",
)  # fmt: skip
"""Names of a certificate's evidence and of numerical settings."""
_FIELDS_DEEP = 5
_WORD = re.compile(r"[^\W\d_]{3}|\b(?:at|by)\b")
"""A text without three consecutive letters is a symbol, the same in every language, unless a preposition is in it."""


class Hearing(NullTranslations):
    """A catalogue that records every text looked up in it."""

    def __init__(self) -> None:
        super().__init__()
        self.heard: set[str] = set()

    def gettext(self, message: str) -> str:
        self.heard.add(message)
        return message


def written() -> set[str | tuple[str, str]]:
    """The texts of templates and sources; a pair (singular, plural) for a text with a count."""
    found: set[str | tuple[str, str]] = set()
    for path in TEMPLATES.rglob("*.html"):
        for _line, function, message in templates.env.extract_translations(path.read_text("utf-8")):
            found.add(_text(function, message))
    for path in SOURCES:
        for _line, message, _comments, _context in extract_from_file("python", path, KEYWORDS):
            found.add(_text("" if isinstance(message, str) or not all(message) else "ngettext", message))
    return found - {""}


def _text(function: str, message: Any) -> str | tuple[str, str]:
    """The text of an extracted call, or both forms of a text with a count; None if the argument is not a literal."""
    if isinstance(message, str):
        return message
    if function == "ngettext":
        return message[0], message[1]
    return message[0] or ""


def registered() -> set[str]:
    """The texts from the registry: those of forms and drawings as built, field names, criteria, captions."""
    hearing = Hearing()
    with speaking("en", hearing):
        for kind in KINDS.values():
            for mode in kind.jobs:
                build(kind, mode)
                for request in _requests(kind, mode):
                    inputs.groups({"kind": kind.slug, "mode": mode, "spec": _filled(kind, mode, request)})
                    drawing = kind.drawing(request)
                    for units in System if drawing is not None else ():
                        with measuring(units):
                            worded(drawing, gettext)
    found = hearing.heard | set(_names()) | set(_of_kinds()) | set(_ELSEWHERE)
    for kind in KINDS.values():
        for texts in (kind.labels, kind.denials, *kind.form.options.values()):
            found |= set(texts.values())
    found |= {*captions.CAPTIONS.values(), *captions.OF_A_KIND.values(), *shaping.SIZES.values()}
    found |= {*sentences(), *_EVIDENCE, inputs.MORE}
    found |= {text for texts in claims.FIXED for text in texts.values()}
    found |= {part for export in EXPORTS.values() for part in export.title.split(": ", 1)} | set(captions.PART_TITLES)
    found |= {sentence for caption in captions.PARTS.values() for sentence in sentences_of(caption)}
    found |= {*SAYS.values(), *ALLOWED_BY_TYPE.values(), *(text for text in LIMITS.values() if text != "{}")}
    found |= {words for choices in listing.CHOICES.values() for words in choices.values()}
    found |= {_plain(each) for values in (RunStatus, BatchStatus, EffectState, Mode) for each in values}
    return {text for text in found if _WORD.search(text)}


def _requests(kind: Kind, mode: Mode) -> Iterator[dict[str, Any]]:
    """The example requests; for a linkage, one per type."""
    for request in (kind.example(mode), *kind.others(mode).values()):
        yield request
        for one in request.get("types") or ():
            yield {**request, "types": [one]}


def _filled(kind: Kind, mode: Mode, request: dict[str, Any]) -> dict[str, Any]:
    """The request with defaults filled in, as a run stores it."""
    return kind.jobs[mode].request.model_validate(request).model_dump(mode="json")


def _of_kinds() -> Iterator[str]:
    for kind in KINDS.values():
        yield from (kind.title, *kind.titles.values())
        yield kind.summary
        yield from (_plain(effect.name) for effect in kind.known_effects)
        for mode in kind.jobs:
            yield from kind.others(mode)


def _names() -> Iterator[str]:
    """All field names as words (of a range also without min and max), and all values of enumerations."""
    for kind in KINDS.values():
        for job in kind.jobs.values():
            for root in filter(None, (job.request, job.result, job.infeasible)):
                for name, annotation in _fields(root, 0):
                    words = split_unit(name)[0].removeprefix("± ")
                    yield from (words, words.removeprefix("min ").removeprefix("max "), words.removesuffix(" max"))
                    yield from (_plain(value) for value in _values(annotation))


def _fields(model: type[BaseModel], depth: int) -> Iterator[tuple[str, Any]]:
    for name, field in model.model_fields.items():
        yield name, field.annotation
        if depth < _FIELDS_DEEP:
            for inner in _models(field.annotation):
                yield from _fields(inner, depth + 1)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _values(annotation: Any) -> Iterator[str]:
    for part in get_args(annotation):
        if isinstance(part, str):
            yield part
        yield from _values(part)


def _plain(name: object) -> str:
    return str(name).replace("_", " ").replace("-", " ")


def catalogue(code: str) -> Catalog:
    """The stored catalogue; empty for a new language."""
    path = path_of(code, "po")
    return read_po(BytesIO(path.read_bytes()), code, DOMAIN) if path.exists() else Catalog(code, domain=DOMAIN)


def path_of(code: str, ending: str) -> Path:
    return LOCALE / code / "LC_MESSAGES" / f"{DOMAIN}.{ending}"


def updated(code: str) -> Catalog:
    """The catalogue with the current texts: translations are kept, obsolete texts removed."""
    old = catalogue(code)
    new = Catalog(code, domain=DOMAIN, fuzzy=False, header_comment="# What the pages say. Made by scripts.messages.")
    new.revision_date = new.creation_date = old.creation_date
    for text in sorted(written() | registered(), key=lambda each: each if isinstance(each, str) else each[0]):
        known: Message | None = old.get(text if isinstance(text, str) else text[0])
        new.add(text, string=known.string if known is not None else None)
    return new


def todo(found: Catalog) -> list[Any]:
    """The texts without a translation."""
    return [
        each.id for each in found if each.id and not (all(each.string) if isinstance(each.id, tuple) else each.string)
    ]


def write(code: str, found: Catalog) -> None:
    """Write the .po and the .mo file of a catalogue."""
    path_of(code, "po").parent.mkdir(parents=True, exist_ok=True)
    with path_of(code, "po").open("wb") as po:
        write_po(po, found, width=120, omit_header=False)
    with path_of(code, "mo").open("wb") as mo:
        write_mo(mo, found)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--todo", action="store_true", help="print what lacks a translation, write nothing")
    only_todo = parser.parse_args().todo
    lacking = 0
    if not only_todo:
        PATTERNS_FILE.write_text("".join(f"{pattern}\n" for pattern in patterns(sentences())), "utf-8")
    for code in LANGUAGES:
        if code == "en":
            continue
        found = updated(code)
        missing = todo(found)
        lacking += len(missing)
        if not only_todo:
            write(code, found)
        print(f"{code}: {len(found)} texts, {len(missing)} without a translation")
        for text in missing:
            print(f"  {text!r}")
    return 1 if lacking else 0


if __name__ == "__main__":
    sys.exit(main())
