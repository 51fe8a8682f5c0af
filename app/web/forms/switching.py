"""What was typed into a form, in another system of units."""

from __future__ import annotations

from app.web.forms.groups import Group, Range
from app.web.forms.nodes import Node, Number, Texts
from app.web.forms.numbers import ambiguous, number, shown
from app.web.forms.tables import Numbers, Table, cells_of
from app.words.units import System, measuring


def in_units(form: Group, texts: Texts, chosen: System) -> dict[str, str]:
    """The texts with all figures converted from the current units to the ``chosen`` ones.

    A form in those reads the same values from them. What is no number, or means the same in both, stays as typed, such
    as "5 mm".
    """
    return dict(texts) | {
        name: text
        for node in form.every()
        for part in ((node.low, node.high) if isinstance(node, Range) else (node,))
        for name, text in _converted(part, texts, chosen).items()
    }


def _converted(node: Node, texts: Texts, chosen: System) -> dict[str, str]:
    text = texts.get(node.name, "")
    if isinstance(node, Number):
        return {node.name: _figure(text, node.unit, chosen)} if text else {}
    if isinstance(node, Numbers):
        return {node.name: _line(text, [node.unit] * len(cells_of(text)), "; ", chosen)} if text else {}
    if isinstance(node, Table):
        units = [column.unit for column in node.columns]
        units = ["", *units] if node.shape == "groups" else units
        return {node.name: "\n".join(_line(line, units, "\t", chosen, len(units)) for line in text.split("\n"))}
    return {}


def _line(line: str, units: list[str], separator: str, chosen: System, columns: int = 0) -> str:
    cells = cells_of(line, columns)
    # Cells beyond the last column have no unit.
    padded = units + [""] * (len(cells) - len(units))
    converted = [_figure(cell, unit, chosen) for cell, unit in zip(cells, padded, strict=False)]
    return line if converted == cells else separator.join(converted)


def _figure(text: str, unit: str, chosen: System) -> str:
    value = text if ambiguous(text) else number(text, unit)
    if isinstance(value, str):
        return text
    with measuring(chosen):
        return text if number(text, unit) == value else shown(value, unit)
