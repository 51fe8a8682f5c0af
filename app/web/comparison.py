"""Comparison of two runs: verdicts, differing inputs, and results with their changes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.designs.kind import Kind
from app.designs.registry import KINDS
from app.designs.units import figures, split_unit, tidy
from app.words.fields import choice, named_in
from app.words.inputs import Input, differing
from app.words.languages import gettext as _
from app.words.units import told, unit_shown
from app.words.verdicts import reached, required

_RELATIVE_TOLERANCE = 1e-12
"""Relative tolerance below which two numbers count as equal."""


@dataclass(frozen=True)
class Row:
    """A result of both runs; ``change`` is b - a as text, empty for non-numeric results."""

    words: str
    unit: str
    a: str
    b: str
    change: str


@dataclass(frozen=True)
class Comparison:
    inputs: list[tuple[Input, str, str]]
    results: list[Row]
    margins: list[Row]


def compare(a: Mapping[str, Any], b: Mapping[str, Any]) -> Comparison:
    """Compare two runs of the same kind."""
    results = _results(KINDS[a["kind"]], a["result"] or {}, b["result"] or {})
    return Comparison(differing(a, b), results, _margins(a, b))


def _results(kind: Kind, a: Mapping[str, Any], b: Mapping[str, Any]) -> list[Row]:
    left, right = dict(_numbers(a)), dict(_numbers(b))
    return [_row(kind, name, left.get(name), right.get(name)) for name in [*left, *(n for n in right if n not in left)]]


def _numbers(result: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """The scalars of a result, including those of small groups (dimensions, lengths); parts of one quantity have its
    name in theirs."""
    found = []
    for name, value in result.items():
        if isinstance(value, dict) and name not in ("certificate", "closure", "series", "cycle", "front"):
            inner = {n: v for n, v in value.items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
            found += [(f"{name}.{n}" if split_unit(name)[1] else n, v) for n, v in inner.items()]
        elif isinstance(value, (bool, int, float)):
            found.append((name, value))
    return sorted(found, key=lambda item: item[0] not in ("b_mm", "h_mm", "l_mm"))


def _row(kind: Kind, name: str, a: Any, b: Any) -> Row:
    words, unit = named_in(name)
    chosen = [choice(kind, name, value) for value in (a, b)]
    if any(chosen):
        change = _("the same") if a == b else ""
        return Row(words, "", *(text or _text(value) for text, value in zip(chosen, (a, b), strict=True)), change)
    a, b = (told(v, unit) if isinstance(v, float) else v for v in (a, b))
    return Row(words, unit_shown(unit), _text(a), _text(b), difference(a, b))


def difference(a: Any, b: Any) -> str:
    """The change b - a, absolute and in per cent."""
    if any(isinstance(v, bool) or not isinstance(v, (int, float)) for v in (a, b)):
        return ""
    if math.isclose(a, b, rel_tol=_RELATIVE_TOLERANCE, abs_tol=1e-300):
        return _("the same")
    share = f" ({100.0 * (b - a) / abs(a):+.3g} %)" if a else ""
    return tidy(f"{b - a:+.4g}{share}")


def _text(value: Any) -> str:
    if value is None:
        return _("none")
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    return figures(value, 6)


def _margins(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[Row]:
    """Margins of the criteria of both runs."""
    rows = []
    for left, right in _pairs(*((run["verdict"] or {"criteria": []})["criteria"] for run in (a, b))):
        label, unit = ((left or right)[key] for key in ("label", "unit"))
        values = [
            None if not side or side["reached"] is None else told(side["reached"], unit) for side in (left, right)
        ]
        rows.append(Row(_(label), "", *(_criterion(side) for side in (left, right)), difference(*values)))
    return rows


Judged = Mapping[str, Any]
"""A criterion of a stored verdict."""


def _pairs(a: Sequence[Judged], b: Sequence[Judged]) -> Iterator[tuple[Judged | None, Judged | None]]:
    """The criteria of two verdicts side by side: those of one name, else those that judge the same, of which one was
    asked for and the other is required of every part."""
    known, left = {criterion["name"] for criterion in a}, {criterion["name"]: criterion for criterion in b}
    for criterion in a:
        same = (n for n, other in left.items() if n not in known and _judges(other) == _judges(criterion))
        name = criterion["name"] if criterion["name"] in left else next(same, "")
        yield criterion, left.pop(name, None)
    yield from ((None, criterion) for criterion in left.values())


def _judges(criterion: Judged) -> tuple[str, str]:
    """What a criterion judges: bounds of different sense on one quantity are different criteria."""
    return criterion["label"], criterion["sense"]


def _criterion(found: Mapping[str, Any] | None) -> str:
    if found is None:
        return _("not judged")
    said = _("%(reached)s (%(required)s), holds") if found["holds"] else _("%(reached)s (%(required)s), does not hold")
    return said % {"reached": reached(found), "required": required(found)}
