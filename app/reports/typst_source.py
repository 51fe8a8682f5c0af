"""A report as a typst document. Whatever a user wrote is a string in it, never markup."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import singledispatch
from importlib.resources import files

from app.designs.calculation.chain import Chain, Given, Remark, Step, Tabulated, Title
from app.designs.calculation.expression import written
from app.designs.calculation.notations import Typst
from app.reports.content import Banner, Block, Bullets, Calculation, Facts, Figure, Figures, Paragraph, Report, Table
from app.reports.text import for_typst

_MATH = Typst()


def typst_source(report: Report) -> str:
    """The whole document; style.typ says how its parts look."""
    style = (files("app.reports") / "style.typ").read_text("utf-8")
    about = "".join(f"({for_typst(name)}, {for_typst(value)})," for name, value in report.about)
    begin = f"#show: report.with({for_typst(report.title)}, {for_typst(report.subtitle)}, ({about}))\n"
    request = f'#pdf.attach("request.json", bytes({_json(report.request)}), mime-type: "application/json")\n'
    body = "\n".join(_block(block) for block in report.opening)
    for section in report.sections:
        body += f"\n#heading({for_typst(section.title)})\n" + "\n".join(_block(block) for block in section.blocks)
    return f"{style}\n{begin}{request}{body}\n"


def _json(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


@singledispatch
def _block(block: Block) -> str:
    raise TypeError(type(block))


@_block.register
def _(block: Banner) -> str:
    return f"#banner({for_typst(block.standing)}, {for_typst(block.word)}, {for_typst(block.text)})"


@_block.register
def _(block: Paragraph) -> str:
    return f"#par({for_typst(block.text)})"


@_block.register
def _(block: Bullets) -> str:
    return f"#bullets(({''.join(for_typst(text) + ',' for text in block.items)}))"


@_block.register
def _(block: Table) -> str:
    widths = "".join(f"{width}fr," for width in block.widths) or f"(1fr,) * {len(block.head)}"
    rows = "".join(f"({''.join(for_typst(cell) + ',' for cell in row)})," for row in block.rows)
    head = "".join(for_typst(cell) + "," for cell in block.head) if any(block.head) else ""
    numeric, marked = ("".join(f"{k}," for k in sorted(chosen)) for chosen in (block.numeric, block.marked))
    columns = f"({widths})" if block.widths else widths
    return f"#rows({columns}, ({head}), ({rows}), numeric: ({numeric}), marked: ({marked}))"


@_block.register
def _(block: Facts) -> str:
    def line(name: str, value: str) -> str:
        return f"({for_typst(name)}, {for_typst(value)}),"

    columns = "".join(f"({''.join(line(*pair) for pair in column)})," for column in _columns(block, 3))
    return f"#facts(({columns}))"


def _columns(block: Facts, count: int) -> list[list[tuple[str, str]]]:
    """The groups' lines, a title first with an empty value, in so many columns of about one length."""
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


@_block.register
def _(block: Figure) -> str:
    return f"#drawn({_svg(block.svg)}, {for_typst(block.caption)})"


@_block.register
def _(block: Figures) -> str:
    return f"#plots(({''.join(f'({_svg(f.svg)}, {for_typst(f.caption)}),' for f in block.figures)}))"


@_block.register
def _(block: Calculation) -> str:
    return "\n".join(_items(block.chain))


def _svg(svg: str) -> str:
    return '"' + svg.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _items(chain: Chain) -> Iterator[str]:
    number = {text: k for k, text in enumerate(chain.sources, 1)}
    given: list[str] = []
    for item in chain.items:
        if isinstance(item, Given):
            given.append(_given(item))
            continue
        if given:
            yield f"#givens(({''.join(given)}))"
            given = []
        if isinstance(item, Title):
            yield f"#part({for_typst(item.text)})"
        elif isinstance(item, Remark):
            yield f"#par({for_typst(item.text)})"
        elif isinstance(item, Tabulated):
            yield from _tabulated(item)
        else:
            yield _step(item, number)
    if given:
        yield f"#givens(({''.join(given)}))"


def _given(item: Given) -> str:
    value = f"${_MATH.symbol(item.symbol)} = {_MATH.number(item.number)}{_unit(item.unit)}$"
    return f"({value}, {for_typst(item.words + (f' ({item.source})' if item.source else ''))}),"


def _step(step: Step, number: Mapping[str, int]) -> str:
    symbol, unit = _MATH.symbol(step.symbol), _unit(step.unit)
    numbers = f"{written(step.formula, _MATH, step.numbers)} = bold({_MATH.number(step.result)}){unit}"
    told = "none" if step.told is None else for_typst(f"{step.told:.6g}".replace("-", "−"))
    if step.again or not step.numbers:
        return f"#again($display({symbol} = {numbers})$, {for_typst(step.words)}, {told})"
    formula = f"$display({symbol} = {written(step.formula, _MATH)})$"
    source = _source(step.source, number)
    return f"#step({formula}, $display(= {numbers})$, {for_typst(step.words)}, {source}, {told})"


def _tabulated(item: Tabulated) -> Iterator[str]:
    """Each new formula with the numbers of the first row, then all rows."""
    numbers = item.numbers(0)
    for column in item.columns:
        if column.symbol not in item.fresh:
            continue
        symbol, result = _MATH.symbol(column.symbol), _MATH.number(numbers[column.symbol])
        formula = f"$display({symbol} = {written(column.formula, _MATH)})$"
        put_in = f"$display(= {written(column.formula, _MATH, numbers)} = bold({result}){_unit(column.unit)})$"
        yield f"#step({formula}, {put_in}, {for_typst(f'{column.words}; in row {item.first}')}, none, none)"
    head = "".join(f"(${_MATH.symbol(c.symbol)}$, {for_typst(c.unit)})," for c in item.columns)
    rows = "".join(
        f"({for_typst(str(k))}, {''.join(f'${_MATH.number(value)}$,' for value in row)}),"
        for k, row in enumerate(item.rows, item.first)
    )
    yield f"#tabulated(({head}), ({rows}))"


def _unit(unit: str) -> str:
    return "" if unit in ("", "°") else f" thin {for_typst(unit)}"


def _source(source: str, number: Mapping[str, int]) -> str:
    return for_typst(f"[{number[source]}]") if source else "none"
