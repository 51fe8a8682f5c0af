"""The hand calculation as report blocks, compared with the results of the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from app.designs.calculation import chain as chains
from app.designs.calculation.chain import DEGREE, Chain, NotANumber
from app.designs.kind import Kind, Mode
from app.designs.units import figures
from app.reports.content import Block, Formula, Givens, Paragraph, Part, Rows, Table
from app.words.effects import effect_rows
from app.words.fields import plain
from app.words.languages import gettext as _
from app.words.solver_texts import spoken

_AGREEMENT_TOLERANCE = 1e-4
"""Relative tolerance for agreement of hand calculation and run; six digits are carried."""


def is_calculated(run: Mapping[str, Any]) -> bool:
    """Whether the report of a run has a hand calculation."""
    return run["status"] == "succeeded" and run["mode"] != Mode.ACCURACY


def chain_of(kind: Kind, run: Mapping[str, Any]) -> Chain | None:
    """The hand calculation of a succeeded run, truncated at a step without a value; None for a study."""
    if not is_calculated(run):
        return None
    chain = Chain()
    try:
        kind.calculation(run, chain)
    except NotANumber:
        chain.remark("The next step has no value that the digits carried could tell: the rest is left to the run.")
    except ValidationError:
        chain.remark("The request is of an earlier version and cannot be read any more.")
    return chain


def blocks_of(chain: Chain) -> Iterator[Block]:
    """Blocks of all items of the chain, consecutive given quantities merged."""
    yield Paragraph(
        _(
            "In the order in which one would check it by hand. Every step shows its formula, then the numbers put in, "
            "then the result; it is calculated from the numbers as they are printed, so a pocket calculator finds the "
            "same digits. Where the same formula comes again, only its numbers are shown. Brackets name sources, "
            "listed below."
        )
    )
    sources = {text: f"[{k}]" for k, text in enumerate(chain.sources, 1)}
    given: list[chains.Given] = []
    for item in chain.items:
        if isinstance(item, chains.Given):
            source = f" ({_(item.source)})" if item.source else ""
            given.append(replace(item, words=spoken(item.words) + source))
            continue
        if given:
            yield Givens(tuple(given))
            given = []
        if isinstance(item, chains.Title):
            yield Part(spoken(item.text))
        elif isinstance(item, chains.Remark):
            yield Paragraph(spoken(item.text))
        elif isinstance(item, chains.Tabulated):
            yield from _tabulated(item)
        else:
            yield _formula(item, sources)
    if given:
        yield Givens(tuple(given))


def _formula(step: chains.Step, sources: Mapping[str, str]) -> Formula:
    again = step.again or not step.numbers
    return Formula(
        step.symbol, step.formula, step.numbers, step.result, step.unit, spoken(step.words),
        "" if again else sources.get(step.source, ""),
        "" if step.reported is None else _figure(step.reported), again,
    )  # fmt: skip


def _tabulated(item: chains.Tabulated) -> Iterator[Block]:
    """Each new formula evaluated for the first row, then the table of all rows."""
    numbers = item.numbers(0)
    for column in item.columns:
        if column.symbol in item.fresh:
            words = _("%(quantity)s; in row %(row)s") % {"quantity": spoken(column.words), "row": item.first}
            own = numbers[column.symbol]
            yield Formula(column.symbol, column.formula, numbers, own, column.unit, words)
    yield Rows(tuple((c.symbol, c.unit) for c in item.columns), item.rows, item.first)


def compared(kind: Kind, run: Mapping[str, Any], chain: Chain) -> Iterator[Block]:
    """Comparison with the run's values of the same quantities, and the reasons for deviations."""
    rows, apart = [], False
    for step in chain.steps:
        if step.reported is None:
            continue
        same = step.ratio is not None and abs(step.ratio - 1.0) < _AGREEMENT_TOLERANCE
        apart = apart or not same
        unit = step.unit if step.unit == DEGREE else f" {step.unit}"
        shown = "—" if step.ratio is None else _("the same") if same else f"{step.ratio:.5g}"
        result = str(step.result) if step.unit == DEGREE else f"{step.result}{unit}".rstrip()
        rows.append((spoken(step.words), result, f"{_figure(step.reported)}{unit}".rstrip(), shown))
    if rows:
        head = (_("quantity"), _("by hand"), _("the run"), _("run over hand"))
        yield Table(head, tuple(rows), frozenset({1, 2, 3}), (40, 22, 22, 16))
        yield Paragraph(_why_apart(kind, run, apart))


def _why_apart(kind: Kind, run: Mapping[str, Any], apart: bool) -> str:
    if not apart:
        return _("The run agrees with the calculation by hand to the digits carried (one part in 10 000).")
    active = [e for e in effect_rows(kind, run) if e["state"] == "active" and e["name"] not in kind.followed]
    if not active:
        return _(
            "What is apart comes from carrying six digits, from integrals that a person takes by a coarser rule, or "
            "from instants that were searched for more closely by the run."
        )
    told = "; ".join(f"{plain(e['name'])} ({e['adds']}): {e['may_change']}" for e in active)
    return (
        _(
            "The run has effects that cannot be followed by hand; the last column is the factor by which they, and the "
            "six digits carried, change a figure. They may change the results by: %(effects)s."
        )
        % {"effects": told}
    )  # fmt: skip


def _figure(value: float) -> str:
    return figures(value, 6).replace("-", "−")
