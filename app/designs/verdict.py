"""Verdicts in the names and units of the API, and their wording.

The solvers judge; each kind's ``verdict.py`` names the criteria.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from gettext import NullTranslations
from typing import Any, Literal

from pydantic import Field

from app.designs.schema import Strict
from app.designs.units import figures, in_si, split_unit, with_unit
from solvers.outcome import Accuracy
from solvers.verdict import Criterion, Sense, Verdict

_NEGLIGIBLE_MARGIN = 5e-4


class CriterionResult(Strict):
    """A criterion: value and requirement."""

    name: str = Field(description="name of the request's field if asked is true, else of the result")
    label: str = Field(description="label of the criterion")
    sense: Literal["at_least", "at_most", "equal", "yes"] = Field(
        description="relation between reached and required; yes: a condition that is 1 if true and 0 if false"
    )
    required: float
    reached: float | None = Field(description="null: no load acts; if the criterion fails: unknown or unbounded")
    unit: str
    margin: float | None = Field(
        description="margin of safety: reached/required - 1 of a minimum, required/reached - 1 of a maximum; 0: "
        "fully used; negative: the criterion fails; null: no load acts, or unknown"
    )
    holds: bool = Field(description="whether the requirement is met, within the requested accuracy and at most 1e-3")
    asked: bool = Field(description="true: required by the request; false: required of every such part")


class VerdictResult(Strict):
    """The verdict: the part holds only if every criterion does."""

    holds: bool
    certain: bool = Field(
        default=True, description="false: the estimated error exceeds the distance of a figure from its limit"
    )
    error: float = Field(
        default=0.0, description="estimated relative error of the figures if the verdict depends on it, else 0"
    )
    summary: str = Field(description="one sentence with the governing figure")
    governed_by: str | None = Field(
        description="the criterion with the smallest margin; if certain is false, the one that makes it "
        "uncertain; null: no load acts"
    )
    criteria: list[CriterionResult]
    cautions: list[str] = Field(description="remarks beyond the criteria")


@dataclass(frozen=True, eq=False)
class Word:
    """A criterion in the API: its name, which says its unit, and display label. Compared by identity.

    ``no`` is the wording of a failed yes/no criterion, and of one that fails although its figure is what is required.
    """

    name: str
    label: str
    no: str = ""

    @cached_property
    def unit(self) -> str:
        """The unit as displayed."""
        return split_unit(self._field)[1]

    @cached_property
    def per(self) -> float:
        """The unit in SI."""
        return in_si(self._field)[1]

    @property
    def _field(self) -> str:
        """The name without the index of a range's end."""
        return self.name.partition(".")[0]


Words = Mapping[str, Word]


_AS_WRITTEN = NullTranslations()


def verdict_json(verdict: Verdict, words: Words, accuracy: Accuracy) -> dict[str, Any]:
    """A verdict as JSON; a missed accuracy is mentioned in its summary."""
    governing, holds, certain = verdict.governing, verdict.holds, verdict.certain
    result: dict[str, Any] = {
        "holds": holds,
        "certain": certain,
        "error": 0.0 if certain else verdict.error,
        "summary": "",
        "governed_by": None if governing is None else words[governing.name].name,
        "criteria": [_criterion(criterion, words[criterion.name]) for criterion in verdict.criteria],
        "cautions": list(verdict.cautions),
    }
    if holds and certain and governing is not None and accuracy.met:
        result["summary"] = _praise(governing, words[governing.name])
    else:
        reached = {"requested": accuracy.requested, "estimated": accuracy.estimated, "met": accuracy.met}
        result["summary"] = summary_of(result, {} if holds else denials(words), reached, _AS_WRITTEN)
    return result


@lru_cache(maxsize=1024)
def _praise(governing: Criterion, word: Word) -> str:
    """The summary where every criterion holds."""
    criterion = _criterion(governing, word)
    verdict = {"holds": True, "governed_by": criterion["name"], "criteria": [criterion]}
    return summary_of(verdict, {}, None, _AS_WRITTEN)


def labels(words: Words) -> dict[str, str]:
    """Labels of the criteria, by API name."""
    return {word.name: word.label for word in words.values()}


def denials(words: Words) -> dict[str, str]:
    """Wording of criteria that fail other than by their figure, by API name."""
    return {word.name: word.no for word in words.values() if word.no}


@lru_cache(maxsize=4096)
def _criterion(criterion: Criterion, word: Word) -> dict[str, Any]:
    """A criterion as JSON, not to be changed: items of a sweep share those which what varies has no influence on."""
    _, sense, required, reached, margin, holds, asked = criterion
    # Adding zero makes -0.0, which the cache cannot tell from 0.0, the latter.
    return {
        "name": word.name,
        "label": word.label,
        "sense": str(sense),
        "required": required / word.per + 0.0,
        "reached": reached / word.per + 0.0 if reached is not None and math.isfinite(reached) else None,
        "unit": word.unit,
        "margin": margin,
        "holds": holds,
        "asked": asked,
    }


def accuracy_met(accuracy: Mapping[str, Any]) -> bool:
    """Whether the accuracy of a stored run was met, by its figures: the earliest runs have no ``met``."""
    return bool(accuracy["estimated"] <= accuracy["requested"])


def summary_of(
    verdict: Mapping[str, Any], denials: Mapping[str, str], accuracy: Mapping[str, Any] | None, texts: NullTranslations
) -> str:
    """Summarise a verdict given as JSON in one sentence, in the language of ``texts``: the governing figure, and a
    missed accuracy.

    ``denials`` gives the wording ``Word.no`` of failed criteria; ``accuracy`` the requested and estimated accuracy.
    """
    name, criteria = verdict["governed_by"], verdict["criteria"]
    governing = next((criterion for criterion in criteria if criterion["name"] == name), None)
    if governing is None:
        said = texts.gettext("It holds: no load acts that it could fail under.")
    elif not verdict.get("certain", True) and accuracy is not None:
        said = texts.gettext(
            "It is not certain whether it holds: the %(label)s is %(compared)s, within the estimated error of "
            "%(error)s %%."
        ) % {
            "label": texts.gettext(governing["label"]),
            "compared": _compared(governing, texts),
            "error": figures(100.0 * verdict.get("error", accuracy["estimated"]), 2),
        }
    elif verdict["holds"]:
        said = texts.gettext("It holds. The %(label)s governs: %(compared)s, %(spare)s.") % {
            "label": texts.gettext(governing["label"]),
            "compared": _compared(governing, texts),
            "spare": _spare(governing["margin"], texts),
        }
    else:
        said = texts.gettext("It does not hold: %(failure)s.") % {"failure": _failure(governing, denials, texts)}
        others = sum(not criterion["holds"] for criterion in criteria) - 1
        if others:
            more = texts.ngettext(
                "%(others)s more of %(all)s criteria is not met.",
                "%(others)s more of %(all)s criteria are not met.",
                others,
            )
            said += " " + more % {"others": others, "all": len(criteria)}
    return said if accuracy is None or accuracy_met(accuracy) else f"{said} {_missed(accuracy, texts)}"


CriterionJson = Mapping[str, Any]
"""A criterion as its JSON object."""


def _failure(criterion: CriterionJson, denials: Mapping[str, str], texts: NullTranslations) -> str:
    denial = denials.get(criterion["name"], "")
    if criterion["sense"] == Sense.YES or (denial and criterion["reached"] == 0.0):
        return texts.gettext(denial)
    values = {"label": texts.gettext(criterion["label"])}
    if criterion["reached"] is not None:
        return texts.gettext("the %(label)s is %(compared)s") % {**values, "compared": _compared(criterion, texts)}
    values["wanted"] = _wanted(criterion, 4, texts)
    # An unbounded value has infinite margin; an unknown one has none.
    if criterion["margin"] is None:
        return texts.gettext("the %(label)s is not known, and %(wanted)s") % values
    return texts.gettext("the %(label)s grows without bound where %(wanted)s") % values


def _compared(criterion: CriterionJson, texts: NullTranslations) -> str:
    digits = 4
    if not criterion["holds"] and f"{criterion['reached']:.4g}" == f"{criterion['required']:.4g}":
        digits = 8
    figure = with_unit(figures(criterion["reached"], digits), criterion["unit"])
    return texts.gettext("%(figure)s where %(wanted)s") % {
        "figure": figure,
        "wanted": _wanted(criterion, digits, texts),
    }


def _wanted(criterion: CriterionJson, digits: int, texts: NullTranslations) -> str:
    return _requirement(criterion["sense"], criterion["required"], criterion["unit"], digits, texts)


@lru_cache(maxsize=256)
def _requirement(sense: str, required: float, unit: str, digits: int, texts: NullTranslations) -> str:
    """A requirement in words; the items of a batch mostly share theirs."""
    if sense == Sense.AT_LEAST:
        said = texts.gettext("at least %(figure)s is required")
    elif sense == Sense.AT_MOST:
        said = texts.gettext("at most %(figure)s is allowed")
    else:
        said = texts.gettext("%(figure)s is asked for")
    return said % {"figure": with_unit(figures(required, digits), unit)}


def _spare(margin: float | None, texts: NullTranslations) -> str:
    if margin is None or margin < _NEGLIGIBLE_MARGIN:
        return texts.gettext("with nothing to spare")
    share = f"{100.0 * margin:.2g}" if margin < 0.995 else f"{100.0 * margin:.0f}"
    return texts.gettext("with %(share)s %% to spare") % {"share": share}


def _missed(accuracy: CriterionJson, texts: NullTranslations) -> str:
    told = {name: figures(accuracy[name], 2) for name in ("requested", "estimated")}
    return texts.gettext("The accuracy asked for is not met: %(requested)s asked, %(estimated)s estimated.") % told
