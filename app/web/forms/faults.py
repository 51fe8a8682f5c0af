"""Validation errors of a form, mapped to its inputs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from app.designs.refusals import LIMITS, REQUIRED
from app.errors import Problem
from app.web.forms.groups import Group
from app.web.forms.nodes import Node, Texts
from app.web.forms.schemas import bound
from app.words.languages import gettext as _
from app.words.solver_texts import spoken
from app.words.units import unit_shown

SAYS = {
    "is out of range": "is out of range",
    "is missing": "is missing",
    "is text": "is not a number; 1.5, 1,5 and 1 500 are",
    "is text with a decimal comma": "has a comma that may separate thousands or decimals; 1500 and 1.5 are clear",
    "is not a number": "is not a number; 1.5, 1,5 and 1 500 are",
    "is not a whole number": "is not a whole number",
    "is not a finite number": "is no finite number",
    "has too few items": "has too few values",
    "has too many items": "has too many values",
    "has too many characters": "has too many characters",
}
_COUNTS = (LIMITS["min_length"], LIMITS["max_length"])
"""Limits that are counts, without a unit."""
_REPLACED_BY_ALLOWED = ("is none of the values it can have", "is not an ")
_REDUNDANT_LIMITS = {
    "a number", "a number, without quotes", "a number with a decimal point and without quotes", REQUIRED,
    "a whole number", "a finite number",
}  # fmt: skip


@dataclass(frozen=True)
class Faults:
    """``at``: messages by input name; ``labels``: input labels for a summary; ``elsewhere``: other messages."""

    at: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    elsewhere: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.at or self.elsewhere)


_PATH = re.compile(r"\b[a-z]\w*(?:\.\w+)+")


def said(entry: Mapping[str, str], named: Mapping[str, str], unit: str = "", keep_names: bool = False) -> str:
    """Translated message of a problem-details entry, with field labels in place of paths.

    ``keep_names``: with the fields' own names, for who writes files.
    """

    def label(found: re.Match[str]) -> str:
        return f"“{named[found[0]]}”" if found[0] in named else found[0]

    detail, allowed = entry["detail"], entry["allowed"]
    words = _PATH.sub(label, spoken(SAYS.get(detail, detail), keep_names))
    if allowed in _REDUNDANT_LIMITS or allowed == "see the contract":
        return words
    limits = _PATH.sub(label, _limits(allowed, unit, keep_names))
    if detail.startswith(_REPLACED_BY_ALLOWED):
        return _("must be %(allowed)s") % {"allowed": limits}
    if detail == "is out of range":
        return f"{words}: {limits}"
    return _("%(words)s (allowed: %(allowed)s)") % {"words": words, "allowed": limits}


def faults_of(problem: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Dotted field and translated message of each error of a problem, for who writes files."""
    errors = (problem or {}).get("errors") or ()
    return [(entry["pointer"][1:].replace("/", "."), said(entry, {}, keep_names=True)) for entry in errors]


def _limits(allowed: str, unit: str, keep_names: bool) -> str:
    """The allowed values: a translated sentence, or comma-separated limits."""
    if (whole := _(allowed)) != allowed:
        return whole
    return ", ".join(_limit(text, unit, keep_names) for text in allowed.split(", "))


def _limit(text: str, unit: str, keep_names: bool) -> str:
    """A limit in the wording of ``app.errors``, translated with its figure in the displayed unit."""
    for pattern in sorted(LIMITS.values(), key=len, reverse=True):
        before, _sep, behind = pattern.partition("{}")
        figure = text.removeprefix(before).removesuffix(behind)
        if before and f"{before}{figure}{behind}" == text:
            return _(pattern).format(figure if pattern in _COUNTS else _shown(figure, unit))
    return spoken(text, keep_names)


def _shown(limit: str, unit: str) -> str:
    """A limit as in the field's hint; text if it is none."""
    try:
        return bound(float(limit), unit) if unit_shown(unit) != unit else limit
    except ValueError:
        return limit


def placed(form: Group, texts: Texts, problem: Problem) -> Faults:
    """Assign each entry of a problem to the nearest visible input."""
    parts = [part for part in form.parts(texts) if part.pointer]
    named = {part.path: part.label for part in parts if "." in part.path and part.label}
    at: dict[str, str] = {}
    labels: dict[str, str] = {}
    elsewhere: list[str] = []
    for entry in problem.body.get("errors", [{"pointer": "", "detail": problem.body["detail"], "allowed": "a number"}]):
        part = _nearest(parts, entry["pointer"])
        if part is None:
            elsewhere.append(f"{entry['pointer'].strip('/')} {said(entry, named)}".strip())
            continue
        words = part.fault(entry["pointer"], said(entry, named, getattr(part, "unit", "")), texts)
        if words not in at.get(part.name, ""):
            at[part.name] = f"{at[part.name]}; {words}" if part.name in at else words
        labels[part.name] = part.label
    return Faults(at, labels, tuple(elsewhere))


def _nearest(parts: list[Node], pointer: str) -> Node | None:
    """The part with the longest pointer that is a prefix of ``pointer``; of equals the last, i.e. innermost."""
    above = [part for part in parts if pointer == part.pointer or pointer.startswith(part.pointer + "/")]
    return max(enumerate(above), key=lambda pair: (len(pair[1].pointer), pair[0]))[1] if above else None
