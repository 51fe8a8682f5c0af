"""The verdict in words: what of a part holds, what governs, in the names and units of the contract.

A wing of ``solvers`` judges; a kind's own ``verdict.py`` names the criteria.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import Field

from app.designs.schema import Strict
from solvers.outcome import Accuracy
from solvers.verdict import Criterion, Sense, Verdict

_NOTHING_TO_SPARE = 5e-4


class CriterionResult(Strict):
    """One figure and what is required of it."""

    name: str = Field(description="of the request's field where asked is true, else of the result")
    label: str = Field(description="the same in words")
    sense: Literal["at_least", "at_most", "equal", "yes"] = Field(
        description="how reached must stand to required; yes: 1 for yes, 0 for no"
    )
    required: float
    reached: float | None = Field(
        description="null: nothing acts, or where it does not hold, nothing is known or it has no bound"
    )
    unit: str
    margin: float | None = Field(
        description="how many times more it could bear, less 1: reached/required - 1 of a least value, "
        "required/reached - 1 of a greatest one; 0: all of it is used; negative where it does not hold; null where "
        "nothing acts or nothing is known"
    )
    holds: bool = Field(description="within the accuracy asked for, at most 1e-3, of what is required")
    asked: bool = Field(description="whether the request asks for it, or every such part must keep it")


class VerdictResult(Strict):
    """Whether the part holds: true only if every criterion does."""

    holds: bool
    summary: str = Field(description="one sentence with the figure that governs")
    governed_by: str | None = Field(description="the criterion that fails most, or has least to spare; null: none acts")
    criteria: list[CriterionResult]
    cautions: list[str] = Field(description="what to know beside the criteria")


@dataclass(frozen=True)
class Word:
    """A criterion at the edge: its name in the contract, a label for people, unit, and that unit in SI.

    ``no`` is what is said where a yes is a no, or nothing is there of what there must be some.
    """

    name: str
    label: str
    unit: str = ""
    per: float = 1.0
    no: str = ""

    def shown(self, value: float) -> float:
        """A SI value in the unit of the contract."""
        return value / self.per


Words = Mapping[str, Word]


def verdict_json(verdict: Verdict, words: Words, accuracy: Accuracy) -> dict[str, Any]:
    """A verdict as the contract shows it; an accuracy that is missed is said in its line."""
    governing = verdict.governing
    return {
        "holds": verdict.holds,
        "summary": _summary(verdict, words) + _missed(verdict, accuracy),
        "governed_by": None if governing is None else words[governing.name].name,
        "criteria": [_criterion(criterion, words[criterion.name]) for criterion in verdict.criteria],
        "cautions": list(verdict.cautions),
    }


def _criterion(criterion: Criterion, word: Word) -> dict[str, Any]:
    reached = criterion.reached
    return {
        "name": word.name,
        "label": word.label,
        "sense": str(criterion.sense),
        "required": word.shown(criterion.required),
        "reached": word.shown(reached) if reached is not None and math.isfinite(reached) else None,
        "unit": word.unit,
        "margin": criterion.margin,
        "holds": criterion.holds,
        "asked": criterion.asked,
    }


def _summary(verdict: Verdict, words: Words) -> str:
    governing = verdict.governing
    if governing is None:
        return "It holds: nothing acts that it could fail under."
    word = words[governing.name]
    if verdict.holds:
        return f"It holds. The {word.label} governs: {_compared(governing, word)}, {_spare(governing.margin)}."
    others = sum(not criterion.holds for criterion in verdict.criteria) - 1
    more = (
        f" {others} more of {len(verdict.criteria)} criteria {'is' if others == 1 else 'are'} not met."
        if others
        else ""
    )
    return f"It does not hold: {_failure(governing, word)}.{more}"


def _failure(criterion: Criterion, word: Word) -> str:
    if criterion.sense is Sense.YES or (word.no and criterion.reached == 0.0):
        return word.no
    if criterion.reached is None:
        return f"the {word.label} cannot be told, and {_wanted(criterion, word, '.4g')}"
    if math.isinf(criterion.reached):
        return f"the {word.label} grows without bound where {_wanted(criterion, word, '.4g')}"
    return f"the {word.label} is {_compared(criterion, word)}"


def _compared(criterion: Criterion, word: Word) -> str:
    digits = ".4g"
    if not criterion.holds and f"{criterion.reached:.4g}" == f"{criterion.required:.4g}":
        digits = ".8g"
    return f"{_figure(word, criterion.reached, digits)} where {_wanted(criterion, word, digits)}"


def _wanted(criterion: Criterion, word: Word, digits: str) -> str:
    figure = _figure(word, criterion.required, digits)
    if criterion.sense is Sense.AT_LEAST:
        return f"at least {figure} is required"
    return f"at most {figure} is allowed" if criterion.sense is Sense.AT_MOST else f"{figure} is asked for"


def _figure(word: Word, value: float, digits: str) -> str:
    return f"{word.shown(value):{digits}} {word.unit}".rstrip()


def _spare(margin: float | None) -> str:
    if margin is None or margin < _NOTHING_TO_SPARE:
        return "with nothing to spare"
    return f"with {100.0 * margin:.2g} % to spare" if margin < 1.0 else f"with {100.0 * margin:.0f} % to spare"


def _missed(verdict: Verdict, accuracy: Accuracy) -> str:
    if accuracy.met:
        return ""
    said = f" The accuracy asked for is not met: {accuracy.requested:.0e} asked, {accuracy.estimated:.0e} estimated"
    governing = verdict.governing
    if verdict.holds and governing is not None and (governing.margin or 0.0) <= accuracy.estimated:
        return f"{said}, more than there is to spare."
    return f"{said}."
