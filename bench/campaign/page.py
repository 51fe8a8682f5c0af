"""docs/campaign.md: one section per kind, each with the date and number of scenes of its run."""

from __future__ import annotations

import re
import statistics
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from app.designs.registry import KINDS
from bench.campaign.choices import TOLERANCES
from bench.campaign.honesty import JUDGED_INDEPENDENTLY
from bench.campaign.scenes import DRAWN
from bench.campaign.seeds import (
    CHOICE,
    COMBINATIONS,
    COMBINED_EVERY,
    ESTIMATE,
    NEEDLESS_EVERY,
    Part,
)

PAGE = Path(__file__).parents[2] / "docs" / "campaign.md"
_SHOWN = 10

_HEAD = f"""# The campaign

Written by `make campaign`. Scenes are random, each made again by its seed; a quarter of them is hard. Every scene is
solved at an accuracy drawn for it and judged by a solution to 1e-12, one in {JUDGED_INDEPENDENTLY} by independent
means as well; with all effects and with those that `auto` keeps at six tolerances; and one in {COMBINED_EVERY} with
every combination of effects. A scene that takes too long is counted and named.

Designs have seeds of their own: random forms, objectives and limits. Every answer is checked anew, designed once more a
thousand times tighter, and meets rivals that want to win: local searches on the check, its neighbours at limits a
little looser and tighter, and the answers of problems that allow more. What a certificate may say is told in
[decision 12](decisions/0012-certificates.md).

A campaign that is interrupted goes on where it stopped, as long as the sources that its verdicts depend on stay the
same.
"""
_TAIL = """## Crank masses

Not part of the campaign: their formulas are closed, nothing in them is a choice of accuracy or of effects. The tests
hold them to independent computations, their uncertainties included.
"""


def section(slug: str, parts: Sequence[Part], day: str) -> str:
    """A kind's section; ``day`` is the date of its last run."""
    of = {name: [p for p in parts if p.name == name] for name in (ESTIMATE, CHOICE, COMBINATIONS)}
    lines = [f"## {KINDS[slug].title}", "", _extent(of[ESTIMATE], day, sum(p.seconds for p in parts)), ""]
    lines += ["| promise | held | seeds where it was not |", "|---|---|---|", *_promises(of), ""]
    lines += [_shares(slug, of), ""]
    lines += _in_doubt(of)
    lines += troubles(parts)
    return "\n".join(lines)


def _extent(parts: Sequence[Part], day: str, seconds: float) -> str:
    unanswered = sum(p.verdict is None and not p.trouble for p in parts)
    return f"{day}: {len(parts):,} scenes, of which {unanswered} have no answer; they took {seconds:,.0f} s together."


def _promises(of: dict[str, list[Part]]) -> Iterator[str]:
    estimates = judged_of(of[ESTIMATE])
    honest = [(seed, j.honest) for seed, j in estimates if j.honesty_judged]
    yield row("the true error is at most the estimate", len(honest), (seed for seed, held in honest if not held))
    met = [(seed, j.met) for seed, j in estimates if j.meeting_judged]
    yield row("the accuracy asked for is met", len(met), (seed for seed, held in met if not held))
    missed = [(seed, j.told) for seed, j in estimates if j.meeting_judged and not j.met]
    if missed:
        yield row("where it is not, the answer says so", len(missed), (seed for seed, told in missed if not told))
    verdicts = [(seed, v) for seed, found in judged_of(of[CHOICE]) for v in found if v.judged]
    false = (seed for seed, v in verdicts if not v.kept_promise)
    yield row("`auto` stays within its tolerance of all effects", len(verdicts), false)
    combined = judged_of(of[COMBINATIONS])
    broken = (seed for seed, c in combined for _ in c.broken)
    run = sum(c.run for _, c in combined)
    yield row("every combination of effects has a finite answer, or a reason", run, broken)


def judged_of(parts: Iterable[Part]) -> list[tuple[int, object]]:
    return [(p.seed, p.verdict) for p in parts if p.verdict is not None]


def row(promise: str, total: int, seeds: Iterable[int]) -> str:
    broken = list(seeds)
    return f"| {promise} | {total - len(broken):,} of {total:,} | {shown(broken) or 'none'} |"


def shown(seeds: Iterable[int]) -> str:
    """The first seeds, without duplicates."""
    names = sorted(set(seeds))
    return ", ".join(map(str, names[:_SHOWN])) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def _shares(slug: str, of: dict[str, list[Part]]) -> str:
    said = []
    estimates = [j for _, j in judged_of(of[ESTIMATE])]
    if estimates:
        said.append(
            f"The estimate is {statistics.median(j.ratio for j in estimates):.3g} times the error in the median."
        )
    verdicts = [v for _, found in judged_of(of[CHOICE]) for v in found]
    skipped, kept = sum(v.skipped for v in verdicts), sum(v.kept for v in verdicts)
    asked = [v for v in verdicts if v.needless is not None]
    needless, of_kept = sum(len(v.needless) for v in asked), sum(v.kept for v in asked)
    if of_kept:
        every = NEEDLESS_EVERY.get(slug, 1)
        where = f" (in every {every}th scene)" if every > 1 else ""
        said.append(
            f"Over the tolerances from {TOLERANCES[0]:g} to {TOLERANCES[-1]:g}, `auto` leaves out "
            f"{skipped / (skipped + kept):.0%} of the effects; {needless / of_kept:.1%} of those it keeps could have "
            f"been left out as well{where}."
        )
    return " ".join(said)


def _in_doubt(of: dict[str, list[Part]]) -> Iterator[str]:
    """Inconclusive verdicts."""
    estimates, choices = judged_of(of[ESTIMATE]), judged_of(of[CHOICE])
    doubted = "but not above that and what the reference says it may be off"
    yield from _unjudged(
        f"{ESTIMATE}: {{}} of the estimates, the error being above the estimate, {doubted}",
        [seed for seed, j in estimates if not j.honesty_judged],
    )
    yield from _unjudged(
        f"{ESTIMATE}: in {{}} of the scenes whether the accuracy is met, the error being above it, {doubted}",
        [seed for seed, j in estimates if not j.meeting_judged],
    )
    yield from _unjudged(
        f"{CHOICE}: {{}} of the choices of `auto`, whose difference from all effects is above the tolerance, but not "
        "above what the two solutions, not as exact as was asked, say they may be off",
        [seed for seed, found in choices for v in found if not v.judged],
    )


def _unjudged(what: str, seeds: list[int]) -> Iterator[str]:
    if seeds:
        yield f"Could not be judged, {what.format(len(seeds))} (seeds {shown(seeds)})."
        yield ""


def troubles(parts: Sequence[Part]) -> Iterator[str]:
    bad = sorted((p.trouble, p.name, p.seed) for p in parts if p.trouble)
    for trouble, name in sorted({(t, n) for t, n, _ in bad}):
        seeds = [seed for t, n, seed in bad if (t, n) == (trouble, name)]
        yield f"Not judged, {name}: {trouble} ({len(seeds)}: {', '.join(map(str, seeds[:_SHOWN]))})."
        yield ""


def written(page: str, text: str) -> str:
    """Replace the section with the text's title; the others are unchanged."""
    known = {title: body for title, body in re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)}
    sections = {name: f"## {name}\n{body}" for name, body in known.items()} | {text[3 : text.index("\n")]: text}
    titles = [f"{KINDS[s].title}{part}" for s in DRAWN for part in ("", ": designs", ": realistic designs")]
    kinds = [sections[title].rstrip() + "\n" for title in titles if title in sections]
    return "\n".join([_HEAD, *kinds, _TAIL])
