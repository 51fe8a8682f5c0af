"""What solvers say in English sentences, in the language spoken; those with figures by their patterns.

So a sentence that was stored years ago is still translated, and a solver knows nothing of languages.
"""

from __future__ import annotations

import re
from functools import cache

from app.words.languages import gettext

PATTERNS = (
    "the accuracy of {} is not met: the estimated error is {}",
    "the effect {} is left out, which may change the figures by up to {} %",
    "the effect {} is left out, which may change the figures by any amount",
    "needed by {}",
    "the scene does not give the {} that it needs",
    "the bounds of all that is left out add up to at most {}",
    "leaving it out could change the results by more than {} allows",
    "the strength is exceeded {}, by {} %",
    "the strength is exceeded {}, where there is no wall",
    "the strength is exceeded {}",
    "at {} mm",
    "between {} and {} mm",
    "between {} and {} mm (and mirrored)",
    "the wall is {} mm at its thinnest, not the {} asked",
    "the deflection of {} um exceeds its limit",
    "the ring's hoop stress exceeds {} MPa where the bore is wider than {} mm, {}",
    "the ring's hoop stress exceeds {} MPa where the outer diameter is less than {} mm, {}",
    "an outer diameter of at least {} mm would do",
    "an outer diameter of at least {} mm would do, or a longer pin",
    "the solid pin deflects more; an outer diameter of at least {} mm would do, or shorter bosses and gaps",
    "the solid section is too weak for {} < x < {} mm, by {} %; an outer diameter of at least {} mm would do",
    "with this motor the tool strikes at {} m/s, at {} blows a second",
    "the crank cannot turn: it is confined to ±{}° about the blow",
    "the rocker is {} times as fast in mid-cycle as at the blow",
    "the impact speed of {} m/s exceeds {} m/s, the strength of the parts",
    "the tool strikes at {} m/s, not at the {} m/s asked for",
    "the transmission angle in mid-cycle is {}°, outside the usual 40° to 140°",
    "the restitution may differ by {} from the one the mechanism is made for",
    "the lengths miss the closure of the {} by {} mm: the crank is blocked within ±{}° of the blow",
    "the lengths miss the closure of the {} by {} mm: the rocker turns back {}° short of its place",
    "the readings' sum differs from the rod's mass by {} %",
    "Section {}",
    "Ratios and closure: {}",
    "Stress and fatigue at the section that governs ({})",
    "The greatest stress of all ({} fibre)",
    "fatigue safety ({})",
    "{} over crank",
    "The ring is thin (d/D = {}, more than {}): an elastic ring's series joins in there, which is left to the run.",
    "a common error of +0.1 % in both periods moves the centre of mass by {} mm; weighing both ends is the robust "
    "alternative",
)
"""Sentences and their parts with their figures left out; a longer one before what it begins with."""

PLAIN = (
    "the strip buckles under the greatest compression of the cycle; stresses have no meaning there",
    "the strip buckles under what friction adds to its compression; stresses have no meaning there",
    "r/L exceeds 0.15: beyond what experiments confirm for the small-displacement theory",
    "V/l exceeds 0.15: the small-displacement theory may be wrong by more than 5 %",
    "the ovalization exceeds its limit",
    "the links close, but the rocker does not reverse at the blow: this motion cannot strike",
    "the longest link exceeds 100 cranks: a limit on the size would give a mechanism that can be built",
    "mass, both halves",
    "where the stress is greatest",
    "outer fibre, +h/2",
    "inner fibre, −h/2",
    "excluded by the request",
    "included by the request",
    "the request asks for all effects",
    "nothing bounds what leaving it out could change: buckling, resonance or a change of sign is near",
)
"""Sentences without figures of their own."""


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile("(.+?)".join(map(re.escape, pattern.split("{}"))))


def spoken(text: str) -> str:
    """A text made elsewhere, in the language spoken if the catalogue has it or its pattern; itself otherwise."""
    said = gettext(text)
    if said != text:
        return said
    for pattern in PATTERNS:
        found = _compiled(pattern).fullmatch(text)
        if found is not None and (said := gettext(pattern)) != pattern:
            return said.format(*map(_part, found.groups()))
    return text


_DOTTED = re.compile(r"[a-z_]+(?:\.[a-z_]+)+")


def _part(text: str) -> str:
    """What stands in a sentence: a figure, another sentence, or the dotted name of a field."""
    return gettext(text.rpartition(".")[2].replace("_", " ")) if _DOTTED.fullmatch(text) else spoken(text)
