"""Builds the report of a run: verdict, drawing, inputs, calculation, effects, accuracy, proof, plots, reproduction.

Texts are in the language current at build time, as are those added by the writers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from app.designs.kind import Kind, Mode
from app.designs.pictures.chart import STYLE
from app.designs.registry import KINDS, plots_for
from app.designs.units import figures, power
from app.designs.verdict import accuracy_met
from app.reports.calculation import blocks_of, chain_of, compared
from app.reports.content import (
    Banner,
    Block,
    Bullets,
    Facts,
    Figure,
    Figures,
    Paragraph,
    Report,
    Section,
    Standing,
    Table,
)
from app.words.captions import captioned
from app.words.drawings import part_of
from app.words.effects import effect_rows
from app.words.fields import named, plain
from app.words.inputs import groups
from app.words.languages import gettext as _
from app.words.languages import language
from app.words.shaping import sentences
from app.words.solver_texts import spoken
from app.words.verdicts import margin, reached, required, standing, summary

_ANIMATION = re.compile(r"<animate [^>]*/>")
_LIGHT_STYLE = "<style>svg{color:#1d2430}</style>"
_MAX_PLOTS = 4


def report_of(run: Mapping[str, Any]) -> Report:
    """The report of a run with a result, given as its JSON."""
    kind = KINDS[run["kind"]]
    title = _(kind.title_of(run["spec"]))
    return Report(
        title=run["name"] or title,
        subtitle=f"{title} · {_first_upper(_(run['mode']))}",
        about=(
            (_("run"), run["id"]),
            (_("made"), f"{run['created_at'][:19].replace('T', ' ')} UTC"),
            (_("solver"), f"{run['solver']['name']} {run['solver']['version']}"),
        ),
        opening=tuple(_opening(kind, run)),
        sections=tuple(section for section in _sections(kind, run) if section.blocks),
        request=json.dumps(run["spec"], indent=1, ensure_ascii=False),
        language=language(),
    )


def _opening(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    verdict = run["verdict"]
    if verdict:
        how = Standing(standing(verdict, run["accuracy"]))
        yield Banner(how, _standing(how, verdict), summary(verdict, kind.slug, run["accuracy"]))
        yield _criteria(verdict)
        if verdict["cautions"]:
            yield Bullets(tuple(_sentence(spoken(text)) for text in verdict["cautions"]))
    elif run["status"] == "infeasible":
        none = _("No design meets all requirements.")
        yield Banner(Standing.FAILS, _("No such design"), none)
        yield _diagnosis(run["result"])
    else:
        yield Banner(Standing.PLAIN, _(kind.title_of(run["spec"])), _headline(run))
    if not verdict and run["result"].get("warnings"):
        yield Bullets(tuple(_sentence(spoken(text)) for text in run["result"]["warnings"]))
    if run["mode"] != Mode.ACCURACY and run["status"] == "succeeded":
        drawing, caption = part_of(kind, dict(run))
        if drawing:
            yield Figure(_light(drawing), caption)


def _standing(how: Standing, verdict: Mapping[str, Any]) -> str:
    if not verdict.get("certain", True):
        return _("In doubt")
    if how is Standing.FAILS:
        return _("Does not hold")
    return _("Holds, in doubt") if how is Standing.DOUBTFUL else _("Holds")


def _headline(run: Mapping[str, Any]) -> str:
    figure = run["figure"]
    if not figure or figure.get("value") is None:
        return _("An analysis has no verdict; its results follow.")
    words, unit = named(figure["name"])
    return f"{_first_upper(words)}: {_number(figure['value'])} {unit}".rstrip() + "."


def _criteria(verdict: Mapping[str, Any]) -> Table:
    rows = tuple(
        (_(c["label"]), reached(c), required(c), margin(c), _("holds") if c["holds"] else _("does not hold"))
        for c in verdict["criteria"]
    )
    failing = frozenset(k for k, item in enumerate(verdict["criteria"]) if not item["holds"])
    head = (_("criterion"), _("reached"), _("required"), _("margin"), "")
    return Table(head, rows, frozenset({1, 2, 3}), (30, 20, 24, 12, 14), failing)


def _diagnosis(result: Mapping[str, Any]) -> Table:
    rows = []
    for item in result["diagnosis"]:
        words, unit = named(item["requirement"])
        best = _("nothing") if item["attainable"] is None else f"{_number(item['attainable'])} {unit}".rstrip()
        rows.append((words, f"{_number(item['required'])} {unit}".rstrip(), best, spoken(item["advice"])))
    head = (_("requirement"), _("required"), _("attainable beside the others"), _("advice"))
    return Table(head, tuple(rows), frozenset({1, 2}), (20, 16, 16, 48))


def _sections(kind: Kind, run: Mapping[str, Any]) -> Iterator[Section]:
    yield Section(_("Inputs"), tuple(_inputs(run)))
    chain = chain_of(kind, run)
    if chain is not None and chain.items:
        yield Section(_("The calculation, step by step"), (*blocks_of(chain), *compared(kind, run, chain)))
    yield Section(_("Results"), tuple(_results(run)))
    shaped = sentences(run)
    yield Section(_("What limits the design"), (_shaped(shaped),) if shaped else ())
    yield Section(_("Effects"), tuple(_effects(kind, run)))
    yield Section(_("Accuracy"), tuple(_accuracy(run)))
    none = run["status"] == "infeasible"
    known = _("Proof that no design exists") if none else _("Proof of optimality")
    yield Section(known, tuple(_proof(run)))
    if run["status"] == "succeeded":
        yield Section(_("Pictures"), tuple(_pictures(kind, run)))
    if chain is not None and chain.sources:
        yield Section(_("Sources"), (Bullets(tuple(f"[{k}] {text}" for k, text in enumerate(chain.sources, 1))),))
    yield Section(_("To repeat this"), tuple(_repeating(run)))


def _inputs(run: Mapping[str, Any]) -> Iterator[Block]:
    found = groups(run)
    if found:
        yield Facts(tuple((_first_upper(g.title), tuple((i.words, i.text) for i in g.inputs)) for g in found))


_ELSEWHERE = {"fatigue_criterion", "objective", "value", "value_unit", "certificate", "transfer"}


def _results(run: Mapping[str, Any]) -> Iterator[Block]:
    rows = []
    for name, value in run["result"].items():
        if isinstance(value, bool) or name in _ELSEWHERE:
            continue
        if isinstance(value, (int, float)):
            words, unit = named(name)
            rows.append((words, f"{_number(value)} {unit}".rstrip()))
        elif isinstance(value, dict):
            words, unit = named(name)
            for inner, v in value.items():
                if isinstance(v, bool) or not isinstance(v, (int, float)):
                    continue
                own, its = named(inner)
                rows.append((f"{words}: {own}", f"{_number(v)} {its or unit}".rstrip()))
    if rows:
        yield Facts((("", tuple(rows)),))
    levels = run["result"].get("levels")
    if levels:
        yield _levels(levels)


def _levels(levels: list[Mapping[str, Any]]) -> Table:
    rows = tuple(
        (
            power(level["accuracy"]),
            _("failed") if level["error"] is None else f"{'≤ ' if level['at_most'] else ''}{power(level['error'], 1)}",
            "—" if level["time_median_s"] is None else f"{1e3 * level['time_median_s']:.3g} ms",
            str(level["runs"]),
        )
        for level in levels
    )
    head = (_("accuracy asked for"), _("greatest error"), _("time, median"), _("solves"))
    return Table(head, rows, frozenset({0, 1, 2, 3}))


def _shaped(shaped: list[dict[str, str]]) -> Bullets:
    return Bullets(tuple(f"{_first_upper(item['name'])}: {item['worth']}." for item in shaped))


def _effects(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    rows = tuple(
        (
            plain(e["name"]),
            _("computed") if e["state"] == "active" else _("left out"),
            e["may_change"],
            e["adds"],
            spoken(e["why"]),
        )
        for e in effect_rows(kind, run)
    )
    if rows:
        told = _(
            "Effects computed in addition to the basic model, and effects left out. Influences are relative to the "
            "main results."
        )
        tolerance = run["spec"].get("effect_tolerance")
        if tolerance is not None:
            told += " " + _("What was left out may change them by less than %(share)s %% together.") % {
                "share": f"{100 * tolerance:g}"
            }
        yield Paragraph(told)
        head = (_("effect"), "", _("may change the results by"), _("what it adds"), _("why"))
        yield Table(head, rows, frozenset(), (17, 11, 14, 27, 31))


def _accuracy(run: Mapping[str, Any]) -> Iterator[Block]:
    told = run["accuracy"]
    if told:
        asked = _("Asked for %(requested)s, estimated %(estimated)s:") % {
            "requested": figures(told["requested"], 2),
            "estimated": figures(told["estimated"], 2),
        }
        settings = ", ".join(f"{plain(name)} {_setting(value)}" for name, value in told["settings"].items())
        met = _("met") if accuracy_met(told) else _("not met")
        yield Paragraph(f"{asked} {met}" + (f" ({settings})." if settings else "."))


def _proof(run: Mapping[str, Any]) -> Iterator[Block]:
    certificate = run["result"].get("certificate")
    if not certificate or "method" not in certificate:
        return
    gap = certificate.get("gap")
    if gap is None:
        told = _("no gap is known")
    else:
        told = _("to the last digits") if gap < 1e-9 else _("gap %(share)s %%") % {"share": figures(100 * gap, 1)}
    rows = [(_("method"), f"{spoken(certificate['method'])}; {told}")]
    if certificate.get("bound") is not None:
        rows.append((_("bound"), _number(certificate["bound"])))
    words = {
        "proven": _("what is proven"),
        "physics": _("for which physics"),
        "form": _("among which forms"),
        "range": _("within which range"),
    }
    rows += [(say, spoken(str(certificate[name]))) for name, say in words.items() if certificate.get(name)]
    rows += [(_("only estimated"), spoken(text)) for text in certificate.get("estimated") or ()]
    yield Table(("", ""), tuple(rows), frozenset(), (20, 80))


def _pictures(kind: Kind, run: Mapping[str, Any]) -> Iterator[Block]:
    plots = plots_for(kind, run)
    chosen = [pair for pair in captioned(run["kind"], plots) if pair[0] != "effects"][:_MAX_PLOTS]
    figures = tuple(Figure(_light(plots[name](dict(run), _)), caption, wide=False) for name, caption in chosen)
    if figures:
        yield Figures(figures)


def _repeating(run: Mapping[str, Any]) -> Iterator[Block]:
    yield Paragraph(
        _("The request is attached to this file. Any Crankwright of the same version gives the same results for it.")
    )
    by = f"{run['solver']['name']} {run['solver']['version']}, {run['id']}, {run['created_at']}"
    rows = ((_("request"), f"POST /api/v1/{_path(run)}"), (_("its hash"), run["spec_hash"]), (_("answered by"), by))
    yield Table(("", ""), rows, frozenset(), (20, 80))


def _path(run: Mapping[str, Any]) -> str:
    folder = {"design": "designs", "check": "checks", "analysis": "analyses", "accuracy": "accuracy"}[run["mode"]]
    return f"{folder}/{run['kind']}"


def _light(svg: str) -> str:
    """A figure in the light theme without animations."""
    return _ANIMATION.sub("", svg.replace(STYLE, _LIGHT_STYLE))


def _setting(value: object) -> str:
    return plain(value) if isinstance(value, str) else _number(value)


def _number(value: object) -> str:
    return figures(value, 6).replace("-", "−") if isinstance(value, float) else str(value)


def _first_upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _sentence(text: str) -> str:
    text = _first_upper(text)
    return text if text.endswith((".", "!", "?")) else text + "."
