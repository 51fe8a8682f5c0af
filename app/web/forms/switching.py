"""What was typed into a form, in another system of units or another language."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from app.web.forms.groups import Group, Range
from app.web.forms.nodes import Node, Number, Texts
from app.web.forms.numbers import number, shown
from app.web.forms.tables import Numbers, Table, cells_of
from app.words.languages import Language
from app.words.units import System, measuring

Figure = Callable[[str, str], str]
"""The new text of a figure, from its text and its unit."""


def in_units(form: Group, texts: Texts, chosen: System) -> dict[str, str]:
    """The texts with all figures converted from the current units to the ``chosen`` ones.

    A form in those reads the same values from them. What is no number, or means the same in both, stays as typed, such
    as "5 mm".
    """
    return _rewritten(form, texts, partial(_in_units, chosen=chosen))


def in_language(form: Group, texts: Texts, chosen: Language) -> dict[str, str]:
    """The texts as a form in the ``chosen`` language reads them the same: in English a comma separates numbers, so
    decimal commas become points; everywhere lists with commas get other separators."""
    return _rewritten(form, texts, _with_point if chosen == Language.EN else lambda text, _unit: text)


def _rewritten(form: Group, texts: Texts, figure: Figure) -> dict[str, str]:
    return dict(texts) | {
        node.name: text
        for each in form.every()
        for node in ((each.low, each.high) if isinstance(each, Range) else (each,))
        for text in _texts_of(node, texts.get(node.name, ""), figure)
    }


def _texts_of(node: Node, text: str, figure: Figure) -> list[str]:
    """The new text of a node with figures; nothing for others."""
    if isinstance(node, Number) and text:
        return [figure(text, node.unit)]
    if isinstance(node, Numbers) and text:
        return [_line(text, [node.unit] * len(cells_of(text)), "; ", figure)]
    if isinstance(node, Table):
        units = [column.unit for column in node.columns]
        units = ["", *units] if node.shape == "groups" else units
        return ["\n".join(_line(line, units, "\t", figure, len(units)) for line in text.split("\n"))]
    return []


def _line(line: str, units: list[str], separator: str, figure: Figure, columns: int = 0) -> str:
    cells = cells_of(line, columns)
    # Cells beyond the last column have no unit.
    padded = units + [""] * (len(cells) - len(units))
    new = [figure(cell, unit) for cell, unit in zip(cells, padded, strict=False)]
    return line if new == cells and "," not in line else separator.join(new)


def _with_point(text: str, unit: str) -> str:
    return text.replace(",", ".") if isinstance(number(text, unit), float) else text


def _in_units(text: str, unit: str, chosen: System) -> str:
    value = number(text, unit)
    if isinstance(value, str):
        return text
    with measuring(chosen):
        return text if number(text, unit) == value else shown(value, unit)
