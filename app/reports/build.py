"""From a run to its report: verdict, drawing, inputs, calculation, effects, accuracy, proof, plots, repetition."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from app.designs.calculation.chain import DEGREE, Chain, NotANumber
from app.designs.kind import Kind, Mode
from app.designs.pictures.chart import STYLE
from app.designs.registry import KINDS, plots_for
from app.designs.units import split_unit
from app.reports.content import (
    Banner,
    Block,
    Bullets,
    Calculation,
    Facts,
    Figure,
    Figures,
    Paragraph,
    Report,
    Section,
    Standing,
    Table,
)
from app.web.captions import captioned
from app.web.effects import effect_rows
from app.web.inputs import groups
from app.web.part import made_part, part_of
from app.web.shaping import sentences
from app.web.verdicts import margin, reached, required, standing

_MODES = {"design": "Design", "check": "Check", "analysis": "Analysis", "accuracy": "Study of accuracy"}
_WORDS = {Standing.HOLDS: "Holds", Standing.DOUBTFUL: "Holds, in doubt", Standing.FAILS: "Does not hold"}
_MOTION = re.compile(r"<animate [^>]*/>")
_LIGHT = "<style>svg{color:#1d2430}</style>"
_MOST_PLOTS = 4
_CLOSE = 1e-4
"""Up to this a figure by hand and the run's are the same: six digits were carried."""


def report_of(run: Mapping[str, Any]) -> Report:
    """The report of a run with a result, as its JSON tells it."""
    kind = KINDS[run["kind"]]
    return Report(
        title=run["name"] or kind.title,
        subtitle=f"{kind.title} · {_MODES[run['mode']]}",
        about=(
            ("run", run["id"]),
            ("made", f"{run['created_at'][:19].replace('T', ' ')} UTC"),
            ("solver", f"{run['solver']['name']} {run['solver']['version']}"),
        ),
        opening=tuple(_opening(kind, run)),
        sections=tuple(section for section in _sections(kind, run) if section.blocks),
        request=json.dumps(run["spec"], indent=1, ensure_ascii=False),
    )


def _opening(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    verdict = run["verdict"]
    if verdict:
        how = Standing(standing(verdict, run["accuracy"]))
        yield Banner(how, _WORDS[how], verdict["summary"])
        yield _criteria(verdict)
        if verdict["cautions"]:
            yield Bullets(tuple(_sentence(text) for text in verdict["cautions"]))
    elif run["status"] == "infeasible":
        yield Banner(Standing.FAILS, "No such design", "There is none: not all that is required can be had.")
        yield _diagnosis(run["result"])
    else:
        yield Banner(Standing.PLAIN, kind.title, _headline(run))
        if run["result"].get("warnings"):
            yield Bullets(tuple(_sentence(text) for text in run["result"]["warnings"]))
    if run["mode"] != Mode.ACCURACY and run["status"] == "succeeded":
        made = made_part(kind, dict(run))
        drawing, caption = made or part_of(kind, dict(run))
        if drawing:
            yield Figure(_light(drawing), caption)


def _headline(run: Mapping[str, Any]) -> str:
    figure = run["figure"]
    if not figure or figure.get("value") is None:
        return "An analysis has no verdict; its results follow."
    words, unit = split_unit(figure["name"])
    return f"{_sentence(words).rstrip('.')}: {_number(figure['value'])} {unit}".rstrip() + "."


def _criteria(verdict: Mapping[str, Any]) -> Table:
    rows = tuple(
        (item["label"], reached(item), required(item), margin(item), "holds" if item["holds"] else "does not hold")
        for item in verdict["criteria"]
    )
    failing = frozenset(k for k, item in enumerate(verdict["criteria"]) if not item["holds"])
    head = ("criterion", "reached", "required", "to spare", "")
    return Table(head, rows, frozenset({1, 2, 3}), (30, 20, 24, 12, 14), failing)


def _diagnosis(result: Mapping[str, Any]) -> Table:
    rows = []
    for item in result["diagnosis"]:
        words, unit = split_unit(item["requirement"])
        best = "nothing" if item["attainable"] is None else f"{_number(item['attainable'])} {unit}".rstrip()
        rows.append((words, f"{_number(item['required'])} {unit}".rstrip(), best, item["advice"]))
    return Table(("requirement", "required", "attainable", "advice"), tuple(rows), frozenset({1, 2}), (20, 16, 16, 48))


def _sections(kind: Kind, run: Mapping[str, Any]) -> Iterator[Section]:
    yield Section("What was asked", tuple(_inputs(run)))
    chain = chain_of(kind, run)
    if chain is not None and chain.items:
        yield Section("The calculation, step by step", tuple(_calculation(kind, run, chain)))
    yield Section("Results", tuple(_results(run)))
    shaped = sentences(run)
    yield Section("What shaped it", (_shaped(shaped),) if shaped else ())
    yield Section("Effects", tuple(_effects(kind, run)))
    yield Section("Accuracy", tuple(_accuracy(run)))
    none = run["status"] == "infeasible"
    yield Section(
        "How it is known that there is none" if none else "How it is known to be the best", tuple(_proof(run))
    )
    if run["status"] == "succeeded":
        yield Section("Pictures", tuple(_pictures(kind, run)))
    if chain is not None and chain.sources:
        yield Section("Sources", (Bullets(tuple(f"[{k}] {text}" for k, text in enumerate(chain.sources, 1))),))
    yield Section("To repeat this", tuple(_repeating(run)))


def chain_of(kind: Kind, run: Mapping[str, Any]) -> Chain | None:
    """The calculation by hand of a run that found or was given something; it ends where a step has no value."""
    if run["status"] != "succeeded" or run["mode"] == Mode.ACCURACY:
        return None
    chain = Chain()
    try:
        kind.calculation(run, chain)
    except NotANumber:
        chain.remark("The next step has no value that the digits carried could tell: the rest is left to the run.")
    except ValidationError:
        chain.remark("The request is of an earlier version and cannot be read any more.")
    return chain


def _calculation(kind: Kind, run: Mapping[str, Any], chain: Chain) -> Iterator[Block]:
    yield Paragraph(
        "In the order in which one would check it by hand. Every step shows its formula, then the numbers put in, then "
        "the result; it is calculated from the numbers as they are printed, so a pocket calculator finds the same "
        "digits. Where the same formula comes again, only its numbers are shown. Brackets name sources, listed below."
    )
    yield Calculation(chain)
    compared = [step for step in chain.steps if step.told is not None]
    if not compared:
        return
    rows, apart = [], False
    for step in compared:
        ratio = step.ratio
        off = None if ratio is None else ratio - 1.0
        same = off is not None and abs(off) < _CLOSE
        apart = apart or not same
        unit = "" if step.unit == DEGREE else f" {step.unit}"
        told = f"{_number(step.told)}{step.unit if step.unit == DEGREE else unit}".rstrip()
        shown = "—" if off is None else "the same" if same else f"{ratio:.5g}"
        rows.append((step.words, f"{step.result}{unit}".rstrip(), told, shown))
    yield Table(
        ("quantity", "by hand", "the run", "run over hand"), tuple(rows), frozenset({1, 2, 3}), (40, 22, 22, 16)
    )
    yield Paragraph(_why_apart(kind, run, apart))


def _why_apart(kind: Kind, run: Mapping[str, Any], apart: bool) -> str:
    active = [e for e in effect_rows(kind, run) if e["state"] == "active" and e["name"] not in kind.followed]
    if not apart:
        return "The run agrees with the calculation by hand to the digits carried (one part in 10 000)."
    if not active:
        return (
            "What is apart comes from carrying six digits, from integrals that a person takes by a coarser rule, or "
            "from instants that were searched for more closely by the run."
        )
    told = "; ".join(f"{_plain(e['name'])} ({e['adds']}): {e['may_change']}" for e in active)
    return (
        "The run has effects that cannot be followed by hand; the last column is the factor by which they, and the six "
        f"digits carried, change a figure. They may change the results by: {told}."
    )


def _inputs(run: Mapping[str, Any]) -> Iterator[Block]:
    found = groups(run)
    if found:
        yield Facts(tuple((_sentence(g.title).rstrip("."), tuple((i.words, i.text) for i in g.inputs)) for g in found))


_ELSEWHERE = {"fatigue_criterion", "objective", "value", "value_unit", "certificate", "transfer"}


def _results(run: Mapping[str, Any]) -> Iterator[Block]:
    rows = []
    for name, value in run["result"].items():
        if isinstance(value, bool) or name in _ELSEWHERE:
            continue
        if isinstance(value, (int, float)):
            words, unit = split_unit(name)
            rows.append((words, f"{_number(value)} {unit}".rstrip()))
        elif isinstance(value, dict):
            words, unit = split_unit(name)
            for inner, v in value.items():
                if isinstance(v, bool) or not isinstance(v, (int, float)):
                    continue
                own, its = split_unit(inner)
                rows.append((f"{words}: {own}", f"{_number(v)} {its or unit}".rstrip()))
    if rows:
        yield Facts((("", tuple(rows)),))
    levels = run["result"].get("levels")
    if levels:
        yield _levels(levels)


def _levels(levels: list[Mapping[str, Any]]) -> Table:
    rows = tuple(
        (
            f"{level['accuracy']:g}",
            "failed" if level["error"] is None else f"{'≤ ' if level['at_most'] else ''}{level['error']:.1e}",
            "—" if level["time_median_s"] is None else f"{1e3 * level['time_median_s']:.3g} ms",
            str(level["runs"]),
        )
        for level in levels
    )
    return Table(("accuracy asked for", "greatest error", "median time", "runs"), rows, frozenset({0, 1, 2, 3}))


def _shaped(shaped: list[dict[str, str]]) -> Bullets:
    return Bullets(tuple(f"{_sentence(item['name']).rstrip('.')}: {item['worth']}." for item in shaped))


def _effects(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    rows = tuple(
        (_plain(e["name"]), "computed" if e["state"] == "active" else "left out", e["may_change"], e["adds"], e["why"])
        for e in effect_rows(kind, run)
    )
    if rows:
        tolerance = run["spec"].get("effect_tolerance")
        told = (
            "" if tolerance is None else f", as long as all of them together may change less than {100 * tolerance:g} %"
        )
        yield Paragraph(
            f"What was computed beside the core of the physics, and what was left out{told}. The bounds are relative "
            "to the main results."
        )
        yield Table(("effect", "", "may change", "what it adds", "why"), rows, frozenset(), (17, 11, 14, 27, 31))


def _accuracy(run: Mapping[str, Any]) -> Iterator[Block]:
    told = run["accuracy"]
    if told:
        met = "met" if told["met"] else "NOT met"
        settings = ", ".join(f"{_plain(name)} {_number(value)}" for name, value in told["settings"].items())
        yield Paragraph(
            f"Asked for {told['requested']:.0e}, estimated {told['estimated']:.1g}: {met}"
            + (f" ({settings})." if settings else ".")
        )


def _proof(run: Mapping[str, Any]) -> Iterator[Block]:
    certificate = run["result"].get("certificate")
    if not certificate or "method" not in certificate:
        return
    gap = certificate.get("gap")
    told = "no gap is known" if gap is None else "to the last digits" if gap < 1e-9 else f"gap {100 * gap:.1g} %"
    rows = [("shown by", f"{certificate['method']}; {told}")]
    if certificate.get("bound") is not None:
        rows.append(("bound", _number(certificate["bound"])))
    names = ("proven", "physics", "form", "range")
    words = ("what is proven", "for which physics", "among which forms", "within which range")
    rows += [(say, str(certificate[name])) for name, say in zip(names, words, strict=True) if certificate.get(name)]
    rows += [("only estimated", text) for text in certificate.get("estimated") or ()]
    yield Table(("", ""), tuple(rows), frozenset(), (20, 80))


def _pictures(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    plots = plots_for(kind, run)
    chosen = [pair for pair in captioned(run["kind"], plots) if pair[0] != "effects"][:_MOST_PLOTS]
    figures = tuple(Figure(_light(plots[name](dict(run))), caption, wide=False) for name, caption in chosen)
    if figures:
        yield Figures(figures)


def _repeating(run: Mapping[str, Any]) -> Iterator[Block]:
    yield Paragraph(
        "The request travels with this file. Sent to any Crankwright of the same version it gives the same figures."
    )
    yield Table(
        ("", ""),
        (
            ("request", f"POST /api/v1/{_path(run)}"),
            ("its hash", run["spec_hash"]),
            (
                "answered by",
                f"{run['solver']['name']} {run['solver']['version']}, run {run['id']}, {run['created_at']}",
            ),
        ),
        frozenset(),
        (20, 80),
    )


def _path(run: Mapping[str, Any]) -> str:
    folder = {"design": "designs", "check": "checks", "analysis": "analyses", "accuracy": "accuracy"}[run["mode"]]
    return f"{folder}/{run['kind']}"


def _light(svg: str) -> str:
    """A picture for white paper, at rest."""
    return _MOTION.sub("", svg.replace(STYLE, _LIGHT))


def _number(value: object) -> str:
    return f"{value:.6g}".replace("-", "−") if isinstance(value, float) else str(value)


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else text + "."
