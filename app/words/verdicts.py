"""Presentation of verdicts: status class and the figures of the criteria."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.registry import KINDS
from app.designs.units import quantity
from app.designs.verdict import accuracy_met, summary_of
from app.words.languages import catalogue, language
from app.words.languages import gettext as _
from app.words.units import System, system, told, unit_shown

_ZERO_MARGIN = 5e-5
"""Relative margin displayed as zero."""
MOST_USED = 1.5
"""Upper end of the utilisation bar: 1.5 times the limit."""


def standing(verdict: dict[str, Any], accuracy: dict[str, Any] | None) -> str:
    """holds, doubtful or fails; doubtful if it is not certain, or holds but the requested accuracy was not met."""
    if not verdict.get("certain", True):
        return "doubtful"
    if not verdict["holds"]:
        return "fails"
    return "holds" if accuracy is None or accuracy_met(accuracy) else "doubtful"


def summary(verdict: Mapping[str, Any], kind: str, accuracy: Mapping[str, Any] | None) -> str:
    """The summary sentence of a stored verdict in the current language and units."""
    if language() == "en" and system() is System.METRIC:
        return verdict["summary"]
    shown = {**verdict, "criteria": [_measured(criterion) for criterion in verdict["criteria"]]}
    return summary_of(shown, KINDS[kind].denials if kind in KINDS else {}, accuracy, catalogue())


def _measured(criterion: dict[str, Any]) -> dict[str, Any]:
    """The criterion in the displayed units."""
    unit = criterion["unit"]
    figures = {n: None if (v := criterion[n]) is None else told(v, unit) for n in ("required", "reached")}
    return {**criterion, **figures, "unit": unit_shown(unit)}


def reached(criterion: dict[str, Any]) -> str:
    """The value reached, or the reason why there is none."""
    value = criterion["reached"]
    if criterion["sense"] == "yes":
        return _("yes") if value else _("no")
    if value is not None:
        return quantity(value, criterion["unit"], 4)
    if criterion["holds"]:
        return _("nothing acts")
    return _("not known") if criterion["margin"] is None else _("without bound")


def required(criterion: dict[str, Any]) -> str:
    """The limit of the criterion."""
    if criterion["sense"] == "yes":
        return _("yes")
    figure = quantity(criterion["required"], criterion["unit"], 4)
    if criterion["sense"] == "equal":
        return figure
    return (_("at least %(x)s") if criterion["sense"] == "at_least" else _("at most %(x)s")) % {"x": figure}


def margin(criterion: dict[str, Any]) -> str:
    """The relative margin in per cent, negative if violated; empty if undefined."""
    value = criterion["margin"]
    if value is None:
        return ""
    return "0 %" if criterion["holds"] and value < _ZERO_MARGIN else f"{100.0 * value:+.3g} %"


def used(criterion: dict[str, Any]) -> float:
    """Utilisation 1 / (1 + margin) [-], capped at ``MOST_USED``."""
    margin = criterion["margin"]
    return MOST_USED if margin <= 1.0 / MOST_USED - 1.0 else round(1.0 / (1.0 + margin), 4)
