"""Section of docs/campaign.md on the designs of a kind."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence

from app.designs.registry import KINDS
from bench.campaign.designs import FEW_STEPS, QUICK, RIVALS, Design
from bench.campaign.page import judged_of, row, troubles
from bench.campaign.rivalry import STEPS
from bench.campaign.seeds import STRONG_EVERY, Part


def designs_section(slug: str, parts: Sequence[Part], day: str) -> str:
    """A kind's section; ``day`` is the date of its last run."""
    refused = sum(p.verdict is None and not p.trouble for p in parts)
    seconds = sum(p.seconds for p in parts)
    designs: list[tuple[int, Design]] = judged_of(parts)
    lines = [
        f"## {KINDS[slug].title}: designs",
        "",
        f"{day}: {len(parts):,} design problems, of which {refused} were refused; with their rivals they took "
        f"{seconds:,.0f} s together.",
        "",
    ]
    lines += ["| promise | held | seeds where it was not |", "|---|---|---|", *_promises(designs), ""]
    lines += [*_by_sort(designs), "", _strength(slug, designs), "", *troubles(parts)]
    return "\n".join(lines)


def _promises(designs: list[tuple[int, Design]]) -> Iterator[str]:
    found, none = [(s, d) for s, d in designs if not d.infeasible], [(s, d) for s, d in designs if d.infeasible]
    yield row("a design keeps its limits, checked anew", len(found), (s for s, d in found if not d.admissible))
    honest = "a design is as near to one a thousand times tighter as it estimates"
    yield row(honest, len(found), (s for s, d in found if not d.honest))
    rivals = sum(d.rivals for _, d in found)
    unbeaten = f"none of {rivals:,} rivals is better than the answer by more than it estimates"
    yield row(unbeaten, len(found), (s for s, d in found if not d.unbeaten))
    for proven, which in ((True, ""), (False, " that names what its proof leaves out")):
        own = [(s, d) for s, d in found if d.proven is proven]
        if own:
            promise = f"no rival, nor the tighter design, is better than a certificate's bound{which}"
            yield row(promise, len(own), (s for s, d in own if not d.bounded))
        own = [(s, d) for s, d in none if d.proven is proven]
        if own:
            promise = f"where there is said to be no design, by a certificate{which}, no rival keeps the limits"
            yield row(promise, len(own), (s for s, d in own if d.found))
    neighbours = sum(d.neighbours for _, d in designs)
    nest = f"{neighbours:,} neighbours nest: more room never makes an answer worse"
    yield row(nest, len(designs), (s for s, d in designs if not d.nested))


def _by_sort(designs: list[tuple[int, Design]]) -> Iterator[str]:
    """Table by sort: number of designs, and distances of the best competitors from answer and bound."""
    yield "| | designs | rivals each | best rival worse than the answer, median and least | beyond the bound, most |"
    yield "|---|---|---|---|---|"
    for sort in sorted({d.sort for _, d in designs}):
        own = [d for _, d in designs if d.sort == sort]
        closest = [d.closest for d in own if math.isfinite(d.closest)]
        near = f"{statistics.median(closest):.0e}, {min(closest):.0e}" if closest else "none kept the limits"
        rivals = statistics.mean(d.rivals for d in own)
        yield f"| {sort} | {len(own):,} | {rivals:,.0f} | {near} | {max(d.better for d in own):.0e} |"


def _strength(slug: str, designs: list[tuple[int, Design]]) -> str:
    closest = [d.closest for _, d in designs if math.isfinite(d.closest)]
    near = sum(abs(c) < 1e-6 for c in closest)
    steps = " and ".join(f"{step:g}" for step in STEPS)
    few = " and ".join(f"{step:g}" for step in FEW_STEPS)
    return (
        f"Rivals of one design in {STRONG_EVERY} are {RIVALS[slug]}; its neighbours at each limit looser and tighter "
        f"by {steps}; the answers where more is allowed. The others meet searches of the same sorts, but {QUICK}, at "
        f"most {QUICK.most} checks, and neighbours by {few}. In {near:,} of {len(closest):,} designs the best of them "
        "comes within 1e-6 of the answer (negative: better, as far as the answer's own error and gap allow)."
    )
