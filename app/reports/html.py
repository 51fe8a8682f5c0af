"""A report as one HTML file: formulas as MathML, pictures inside, nothing asked of anybody."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from functools import singledispatch
from importlib.resources import files

from app.designs.calculation.chain import Chain, Given, Remark, Step, Tabulated, Title
from app.designs.calculation.expression import written
from app.designs.calculation.notations import MathML
from app.designs.calculation.printed import Printed
from app.reports.content import Banner, Block, Bullets, Calculation, Facts, Figure, Figures, Paragraph, Report, Table
from app.reports.text import for_html

_MATH = MathML()
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


def html(report: Report) -> str:
    """The whole page."""
    style = (files("app.reports") / "style.css").read_text("utf-8")
    about = "".join(f"<div><dt>{for_html(name)}</dt><dd>{for_html(value)}</dd></div>" for name, value in report.about)
    body = "".join(_block(block) for block in report.opening)
    for section in report.sections:
        body += f"<section><h2>{for_html(section.title)}</h2>{''.join(_block(b) for b in section.blocks)}</section>"
    title = for_html(report.title)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}"><meta name="color-scheme" content="light">'
        f"<title>{title}</title><style>{style}</style></head><body><main>"
        f'<header><p class="kind">Crankwright <span>{for_html(report.subtitle)}</span></p>'
        f"<h1><bdi>{title}</bdi></h1></header>{body}"
        f"<details><summary>The request as JSON</summary><pre>{_json(report.request)}</pre></details>"
        f'<footer><dl class="about">{about}</dl></footer></main></body></html>\n'
    )


def _json(text: str) -> str:
    return "\n".join(for_html(line) for line in text.split("\n"))


@singledispatch
def _block(block: Block) -> str:
    raise TypeError(type(block))


@_block.register
def _(block: Banner) -> str:
    told = f"<strong>{for_html(block.word)}</strong><p>{for_html(block.text)}</p>"
    return f'<div class="banner {block.standing}" role="note">{told}</div>'


@_block.register
def _(block: Paragraph) -> str:
    return f"<p>{for_html(block.text)}</p>"


@_block.register
def _(block: Bullets) -> str:
    return f"<ul>{''.join(f'<li>{for_html(text)}</li>' for text in block.items)}</ul>"


@_block.register
def _(block: Table) -> str:
    def cell(k: int, text: str) -> str:
        kind = ' class="number"' if k in block.numeric else ""
        return f'<th scope="row">{for_html(text)}</th>' if k == 0 else f"<td{kind}>{for_html(text)}</td>"

    head = "".join(
        f'<th scope="col"{" class=number" if k in block.numeric else ""}>{for_html(text)}</th>'
        for k, text in enumerate(block.head)
    )
    rows = "".join(
        f"<tr{' class=marked' if y in block.marked else ''}>{''.join(cell(k, text) for k, text in enumerate(row))}</tr>"
        for y, row in enumerate(block.rows)
    )
    top = f"<thead><tr>{head}</tr></thead>" if any(block.head) else ""
    return f'<div class="scroll"><table>{top}<tbody>{rows}</tbody></table></div>'


@_block.register
def _(block: Facts) -> str:
    def group(title: str, items: tuple[tuple[str, str], ...]) -> str:
        lines = "".join(f"<div><dt>{for_html(name)}</dt><dd>{for_html(value)}</dd></div>" for name, value in items)
        return f"<section>{f'<h3>{for_html(title)}</h3>' if title else ''}<dl>{lines}</dl></section>"

    many = "" if len(block.groups) > 1 else " single"
    return f'<div class="facts{many}">{"".join(group(*each) for each in block.groups)}</div>'


@_block.register
def _(block: Figure) -> str:
    # As an image of its own, so that no style of one picture reaches another or the page.
    coded = base64.b64encode(block.svg.encode()).decode()
    image = f'<img src="data:image/svg+xml;base64,{coded}" alt="{for_html(block.caption)}">'
    kind = ' class="wide"' if block.wide else ""
    return f"<figure{kind}>{image}<figcaption>{for_html(block.caption)}</figcaption></figure>"


@_block.register
def _(block: Figures) -> str:
    return f'<div class="figures">{"".join(_block(figure) for figure in block.figures)}</div>'


@_block.register
def _(block: Calculation) -> str:
    return f'<div class="calculation">{"".join(_items(block.chain))}</div>'


def _items(chain: Chain) -> Iterator[str]:
    number = {text: k for k, text in enumerate(chain.sources, 1)}
    given: list[str] = []
    for item in chain.items:
        if isinstance(item, Given):
            given.append(_given(item))
            continue
        if given:
            yield f'<ul class="given">{"".join(given)}</ul>'
            given = []
        if isinstance(item, Title):
            yield f"<h3>{for_html(item.text)}</h3>"
        elif isinstance(item, Remark):
            yield f"<p>{for_html(item.text)}</p>"
        elif isinstance(item, Tabulated):
            yield from _tabulated(item)
        else:
            yield _step(item, number)
    if given:
        yield f'<ul class="given">{"".join(given)}</ul>'


def _math(inner: str, kind: str = "") -> str:
    return f'<math displaystyle="true"{f" class={kind}" if kind else ""}><mrow>{inner}</mrow></math>'


def _equals(left: str, right: str) -> str:
    return f"{left}<mo>=</mo>{right}"


def _value(number: Printed, unit: str) -> str:
    digits = f'<mrow class="result">{_MATH.number(number)}</mrow>'
    return digits if unit in ("", "°") else f'{digits}<mspace width="0.2em"></mspace><mtext>{for_html(unit)}</mtext>'


def _given(item: Given) -> str:
    words = for_html(item.words + (f" ({item.source})" if item.source else ""))
    math = _math(_equals(_MATH.symbol(item.symbol), _value(item.number, item.unit)))
    return f"<li>{math} <span>{words}</span></li>"


def _step(step: Step, number: Mapping[str, int]) -> str:
    source = f" [{number[step.source]}]" if step.source else ""
    told = "" if step.told is None else f' <span class="told">run: {step.told:.6g}</span>'.replace("-", "−")
    symbol = _MATH.symbol(step.symbol)
    put_in = _equals(written(step.formula, _MATH, step.numbers), _value(step.result, step.unit))
    if step.again or not step.numbers:
        lines = _math(_equals(symbol, put_in), "numbers")
    else:
        formula = _math(_equals(symbol, written(step.formula, _MATH)))
        lines = formula + _math(f"<mo>=</mo>{put_in}", "numbers")
    return f'<div class="step"><span>{for_html(step.words + source)}</span><div>{lines}{told}</div></div>'


def _tabulated(item: Tabulated) -> Iterator[str]:
    """Each new formula with the numbers of the first row, then all rows."""
    numbers = item.numbers(0)
    for column in item.columns:
        if column.symbol in item.fresh:
            formula = _math(_equals(_MATH.symbol(column.symbol), written(column.formula, _MATH)))
            result = _value(numbers[column.symbol], column.unit)
            put_in = _math(f"<mo>=</mo>{_equals(written(column.formula, _MATH, numbers), result)}", "numbers")
            words = for_html(f"{column.words}; in row {item.first}")
            yield f'<div class="step"><span>{words}</span><div>{formula}{put_in}</div></div>'
    head = "".join(
        f'<th scope="col" class="number">{_math(_MATH.symbol(c.symbol))}<br><small>{for_html(c.unit)}</small></th>'
        for c in item.columns
    )
    rows = "".join(
        f'<tr><th scope="row">{k}</th>'
        + "".join(f'<td class="number">{_math(_MATH.number(value))}</td>' for value in row)
        + "</tr>"
        for k, row in enumerate(item.rows, item.first)
    )
    top = f"<thead><tr><td></td>{head}</tr></thead>"
    yield f'<div class="scroll"><table class="rows">{top}<tbody>{rows}</tbody></table></div>'
