"""A report as a self-contained HTML file, with formulas as MathML and embedded figures."""

from __future__ import annotations

import base64
from importlib.resources import files

from app.designs.calculation.expression import written
from app.designs.calculation.notations import MathML
from app.designs.calculation.printed import Printed
from app.reports import content
from app.reports.text import for_html
from app.reports.writer import Writer
from app.words.languages import gettext

_MATH = MathML()
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


def html(report: content.Report) -> str:
    """The complete HTML document."""
    style = (files("app.reports") / "style.css").read_text("utf-8")
    title = for_html(report.title)
    return (
        f'<!doctype html><html lang="{report.language}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}"><meta name="color-scheme" content="light">'
        f"<title>{title}</title><style>{style}</style></head><body><main>"
        f'<header><p class="kind">Crankwright <span>{for_html(report.subtitle)}</span></p>'
        f"<h1><bdi>{title}</bdi></h1></header>{_Html().body(report)}"
        f"<details><summary>{gettext('The request as JSON')}</summary><pre>{_json(report.request)}</pre></details>"
        f'<footer><dl class="about">{_pairs(report.about)}</dl></footer></main></body></html>\n'
    )


def _json(text: str) -> str:
    return "\n".join(for_html(line) for line in text.split("\n"))


def _pairs(items: tuple[tuple[str, str], ...]) -> str:
    return "".join(f"<div><dt>{for_html(name)}</dt><dd>{for_html(value)}</dd></div>" for name, value in items)


class _Html(Writer):
    def section(self, title: str, inside: str) -> str:
        return f"<section><h2>{for_html(title)}</h2>{inside}</section>"

    def banner(self, block: content.Banner) -> str:
        told = f"<strong>{for_html(block.word)}</strong><p>{for_html(block.text)}</p>"
        return f'<div class="banner {block.standing}" role="note">{told}</div>'

    def paragraph(self, block: content.Paragraph) -> str:
        return f"<p>{for_html(block.text)}</p>"

    def bullets(self, block: content.Bullets) -> str:
        return f"<ul>{''.join(f'<li>{for_html(text)}</li>' for text in block.items)}</ul>"

    def table(self, block: content.Table) -> str:
        def cell(k: int, text: str) -> str:
            kind = ' class="number"' if k in block.numeric else ""
            return f'<th scope="row">{for_html(text)}</th>' if k == 0 else f"<td{kind}>{for_html(text)}</td>"

        head = "".join(
            f'<th scope="col"{" class=number" if k in block.numeric else ""}>{for_html(text)}</th>'
            for k, text in enumerate(block.head)
        )
        rows = "".join(
            f"<tr{' class=marked' if y in block.marked else ''}>"
            f"{''.join(cell(k, text) for k, text in enumerate(row))}</tr>"
            for y, row in enumerate(block.rows)
        )
        top = f"<thead><tr>{head}</tr></thead>" if any(block.head) else ""
        return f'<div class="scroll"><table>{top}<tbody>{rows}</tbody></table></div>'

    def facts(self, block: content.Facts) -> str:
        many = "" if len(block.groups) > 1 else " single"
        groups = (
            f"<section>{f'<h3>{for_html(title)}</h3>' if title else ''}<dl>{_pairs(items)}</dl></section>"
            for title, items in block.groups
        )
        return f'<div class="facts{many}">{"".join(groups)}</div>'

    def figure(self, block: content.Figure) -> str:
        # As an image, so that the styles of a figure cannot leak into others or the page.
        coded = base64.b64encode(block.svg.encode()).decode()
        image = f'<img src="data:image/svg+xml;base64,{coded}" alt="{for_html(block.caption)}">'
        kind = ' class="wide"' if block.wide else ""
        return f"<figure{kind}>{image}<figcaption>{for_html(block.caption)}</figcaption></figure>"

    def figures(self, block: content.Figures) -> str:
        return f'<div class="figures">{self.blocks(block.figures)}</div>'

    def part(self, block: content.Part) -> str:
        return f'<h3 class="part">{for_html(block.text)}</h3>'

    def givens(self, block: content.Givens) -> str:
        items = (
            f"<li>{_math(_equals(_MATH.symbol(item.symbol), _value(item.number, item.unit)))} "
            f"<span>{for_html(item.words)}</span></li>"
            for item in block.items
        )
        return f'<ul class="given">{"".join(items)}</ul>'

    def formula(self, block: content.Formula) -> str:
        symbol = _MATH.symbol(block.symbol)
        put_in = _equals(written(block.formula, _MATH, block.numbers), _value(block.result, block.unit))
        if block.again:
            lines = _math(_equals(symbol, put_in), "numbers")
        else:
            formula = _math(_equals(symbol, written(block.formula, _MATH)))
            lines = formula + _math(f"<mo>=</mo>{put_in}", "numbers")
        told = f' <span class="told">{gettext("run")}: {for_html(block.told)}</span>' if block.told else ""
        words = for_html(f"{block.words} {block.source}".rstrip())
        return f'<div class="step"><span>{words}</span><div>{lines}{told}</div></div>'

    def rows(self, block: content.Rows) -> str:
        head = "".join(
            f'<th scope="col" class="number">{_math(_MATH.symbol(symbol))}<br><small>{for_html(unit)}</small></th>'
            for symbol, unit in block.head
        )
        rows = "".join(
            f'<tr><th scope="row">{k}</th>'
            + "".join(f'<td class="number">{_math(_MATH.number(value))}</td>' for value in row)
            + "</tr>"
            for k, row in enumerate(block.rows, block.first)
        )
        top = f"<thead><tr><td></td>{head}</tr></thead>"
        return f'<div class="scroll"><table class="rows">{top}<tbody>{rows}</tbody></table></div>'


def _math(inner: str, kind: str = "") -> str:
    return f'<math displaystyle="true"{f" class={kind}" if kind else ""}><mrow>{inner}</mrow></math>'


def _equals(left: str, right: str) -> str:
    return f"{left}<mo>=</mo>{right}"


def _value(number: Printed, unit: str) -> str:
    digits = f'<mrow class="result">{_MATH.number(number)}</mrow>'
    return digits if unit in ("", "°") else f'{digits}<mspace width="0.2em"></mspace><mtext>{for_html(unit)}</mtext>'
