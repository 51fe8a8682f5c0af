"""A report as a typst document. User text only appears as string literals, never as markup."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources import files

from app.designs.calculation.expression import written
from app.designs.calculation.notations import Typst
from app.reports import content
from app.reports.text import for_typst
from app.reports.writer import Writer
from app.words.languages import gettext

_MATH = Typst()


def typst_source(report: content.Report) -> str:
    """The complete document; ``style.typ`` defines its layout functions."""
    style = (files("app.reports") / "style.typ").read_text("utf-8")
    about = _array(f"({for_typst(name)}, {for_typst(value)})" for name, value in report.about)
    named = f"{for_typst(report.title)}, {for_typst(report.subtitle)}, {about}, language: {for_typst(report.language)}"
    begin = f"#show: report.with({named})\n"
    request = f'#pdf.attach("request.json", bytes({_raw(report.request)}), mime-type: "application/json")\n'
    return f"{style}\n{begin}{request}{_Typst().body(report)}\n"


def _raw(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _array(items: Iterable[str]) -> str:
    return f"({''.join(item + ',' for item in items)})"


def _texts(texts: Iterable[str]) -> str:
    return _array(map(for_typst, texts))


class _Typst(Writer):
    def section(self, title: str, inside: str) -> str:
        return f"#heading({for_typst(title)})\n{inside}"

    def banner(self, block: content.Banner) -> str:
        return f"#banner({for_typst(block.standing)}, {for_typst(block.word)}, {for_typst(block.text)})\n"

    def paragraph(self, block: content.Paragraph) -> str:
        return f"#par({for_typst(block.text)})\n"

    def bullets(self, block: content.Bullets) -> str:
        return f"#bullets({_texts(block.items)})\n"

    def table(self, block: content.Table) -> str:
        columns = _array(f"{width}fr" for width in block.widths) if block.widths else f"(1fr,) * {len(block.head)}"
        head, rows = _texts(block.head if any(block.head) else ()), _array(map(_texts, block.rows))
        numeric, marked = (_array(map(str, sorted(chosen))) for chosen in (block.numeric, block.marked))
        return f"#rows({columns}, {head}, {rows}, numeric: {numeric}, marked: {marked})\n"

    def facts(self, block: content.Facts) -> str:
        columns = (_array(f"({for_typst(n)}, {for_typst(v)})" for n, v in column) for column in _columns(block, 3))
        return f"#facts({_array(columns)})\n"

    def figure(self, block: content.Figure) -> str:
        return f"#drawn({_raw(block.svg)}, {for_typst(block.caption)})\n"

    def figures(self, block: content.Figures) -> str:
        return f"#plots({_array(f'({_raw(each.svg)}, {for_typst(each.caption)})' for each in block.figures)})\n"

    def part(self, block: content.Part) -> str:
        return f"#part({for_typst(block.text)})\n"

    def givens(self, block: content.Givens) -> str:
        items = (
            f"(${_MATH.symbol(item.symbol)} = {_MATH.number(item.number)}{_unit(item.unit)}$, {for_typst(item.words)})"
            for item in block.items
        )
        return f"#givens({_array(items)})\n"

    def formula(self, block: content.Formula) -> str:
        symbol, words = _MATH.symbol(block.symbol), for_typst(block.words)
        told = for_typst(f"{gettext('run')}: {block.told}") if block.told else "none"
        result = f"bold({_MATH.number(block.result)}){_unit(block.unit)}"
        numbers = f"{written(block.formula, _MATH, block.numbers)} = {result}"
        if block.again:
            return f"#again($display({symbol} = {numbers})$, {words}, {told})\n"
        formula = f"$display({symbol} = {written(block.formula, _MATH)})$"
        source = for_typst(block.source) if block.source else "none"
        return f"#step({formula}, $display(= {numbers})$, {words}, {source}, {told})\n"

    def rows(self, block: content.Rows) -> str:
        head = _array(f"(${_MATH.symbol(symbol)}$, {for_typst(unit)})" for symbol, unit in block.head)
        rows = (
            _array([for_typst(str(k)), *(f"${_MATH.number(value)}$" for value in row)])
            for k, row in enumerate(block.rows, block.first)
        )
        return f"#tabulated({head}, {_array(rows)})\n"


def _columns(block: content.Facts, count: int) -> list[list[tuple[str, str]]]:
    """The groups' lines in at most ``count`` balanced columns; a title is a line with an empty value."""
    parts = [[(title, ""), *items] if title else list(items) for title, items in block.groups]
    if len(parts) == 1:
        parts = [[pair] for pair in parts[0]]
    size, columns = sum(map(len, parts)), [[]]
    for part in parts:
        done = sum(map(len, columns))
        if columns[-1] and len(columns) < count and done + 0.5 * len(part) > size * len(columns) / count:
            columns.append([])
        columns[-1] += part
    return columns


def _unit(unit: str) -> str:
    return "" if unit in ("", "°") else f" thin {for_typst(unit)}"
