"""Section of docs/campaign.md on realistic rod designs and their rivals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from app.designs.registry import KINDS
from bench.campaign.page import judged_of, row, troubles
from bench.campaign.rod_contests import Contested
from bench.campaign.seeds import Part
from oracles.rivals.rod import FINELY, JUDGED, ROUGHLY, SCOUTS, SEEKERS

TITLE = f"{KINDS['flexible-rod'].title}: realistic designs"
_ROUNDING = 1e-7
"""What limits may be missed by, checked anew to 1e-7."""
_SHOWN = 20


def contests_section(slug: str, parts: Sequence[Part], day: str) -> str:
    """The section; ``day`` is the date of its last run."""
    judged: list[tuple[int, Contested]] = judged_of(parts)
    found = [(s, c) for s, c in judged if not c.infeasible]
    ring = [(s, c) for s, c in found if c.rings]
    lines = [
        f"## {TITLE}",
        "",
        f"{day}: {len(parts):,} problems of `python -m bench.rod_problems`{_seeds(parts)}, with every setting at its "
        f"default. Rivals are searches on the check ({SCOUTS}) and over sizes in steps next to the answer's, of which "
        f"an accuracy of {ROUGHLY:g} is asked; the best strips they see, and the answer, are starts of linear programs "
        f"and steps along ridges to {FINELY:g}. What beats an answer there is searched once more, and judged, by "
        f"checks to {JUDGED:g}. Where there is said to be no strip, {SEEKERS.starts} starts look for any.",
        "",
        "| promise | held | seeds where it was not |",
        "|---|---|---|",
        row("a design keeps its limits, checked anew", len(found), (s for s, c in found if _missed(c))),
        row(
            f"none of {sum(c.contest.evaluations for _, c in found):,} strips is better by more than the answer "
            "estimates",
            len(found),
            (s for s, c in found if c.contest.won),
        ),
        row("the same where the strip rings", len(ring), (s for s, c in ring if c.contest.won)),
        row("the accuracy asked for is met", len(found), (s for s, c in found if not c.met)),
    ]
    none = [(s, c) for s, c in judged if c.infeasible]
    if none:
        promise = "where there is said to be no design, no rival keeps the limits"
        lines.append(row(promise, len(none), (s for s, c in none if c.contest.won)))
    lines += ["", *_beaten(found), *troubles(parts)]
    return "\n".join(lines)


def _seeds(parts: Sequence[Part]) -> str:
    """The range of their seeds."""
    return f", seeds {min(p.seed for p in parts):,} to {max(p.seed for p in parts):,}" if parts else ""


def _missed(c: Contested) -> bool:
    return c.contest.missed > max(c.contest.estimated, _ROUNDING)


def _beaten(found: list[tuple[int, Contested]]) -> Iterator[str]:
    """The answers that were beaten, the worst first."""
    won = sorted(((s, c) for s, c in found if c.contest.won), key=lambda one: -one[1].contest.gain)
    gains = [c.contest.gain for _, c in found if math.isfinite(c.contest.gain)]
    counts = ", ".join(f"{sum(gain > least for gain in gains)} by more than {least:g}" for least in (1e-6, 1e-5, 1e-4))
    yield f"Of {len(gains):,} answers with a rival within the limits, rivals better {counts}."
    yield ""
    if won:
        yield "| seed | objective | rings | sizes in steps | estimated | rival better by | found by |"
        yield "|---|---|---|---|---|---|---|"
    for seed, c in won[:_SHOWN]:
        told = "yes" if c.rings else "no", "yes" if c.stepped else "no"
        r = c.contest
        yield f"| {seed} | {c.objective} | {' | '.join(told)} | {r.estimated:.2g} | {r.gain:.2g} | {r.found_by} |"
    if won:
        yield ""
