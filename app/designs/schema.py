"""What the requests of every kind share: strict models, the effects field, and the way back from a solver's refusal.

Request fields bear the solver's names with a unit behind them (``crank_radius`` → ``crank_radius_mm``), so one rule
turns the path of a refused quantity into the JSON pointer of the field that the user wrote.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Outcome, Status

MILLI, MEGA, GIGA = 1e-3, 1e6, 1e9
_LARGEST_INFLUENCE = 1e9

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]


class Strict(BaseModel):
    """Numbers are numbers, unknown fields are refused, nothing changes after validation."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, hide_input_in_errors=True)


class EffectChoice(Strict):
    """Effects that the user settles; all others follow their bounds."""

    include: list[str] = Field(default=[], max_length=32)
    exclude: list[str] = Field(default=[], max_length=32)


class SolverRequest(Strict):
    """What every check and every design may say."""

    name: str = Field(
        default="", max_length=200, pattern=r"^[^\x00]*$", description="a name for people; it changes no result"
    )
    effects: Literal["auto", "all"] | EffectChoice = Field(
        default="auto", description="auto, all, or a choice with include and exclude"
    )
    effect_tolerance: float = Field(
        default=1e-2, gt=0, le=1, description="what all effects left out may change together, relative"
    )
    accuracy: float = Field(default=1e-6, ge=1e-12, le=1e-1, description="wanted relative numerical accuracy")

    def contradictions(self) -> list[dict[str, str]]:
        """What single fields cannot see: one problem entry for every pair of values that cannot both hold."""
        return []

    def selection(self) -> EffectSelection:
        if isinstance(self.effects, EffectChoice):
            return EffectSelection(frozenset(self.effects.include), frozenset(self.effects.exclude))
        return {"auto": AUTO, "all": ALL}[self.effects]


def scaled(value: float | None, unit: float) -> float | None:
    """A SI value in the unit at the edge; None stays None."""
    return None if value is None else value / unit


def envelope(outcome: Outcome, result: dict[str, Any] | None) -> dict[str, Any]:
    """The parts of an answer that every kind has, as plain JSON values."""
    if outcome.status is Status.INFEASIBLE:
        result = {
            **(result or {}),
            "diagnosis": [
                {
                    "requirement": s.requirement,
                    "required": s.required,
                    "attainable": s.attainable,
                    "advice": s.advice,
                }
                for s in outcome.diagnosis
            ],
        }
    return {
        "status": str(outcome.status),
        "result": result,
        "effects": [
            {
                "name": e.name,
                "state": str(e.state),
                "influence": float(min(e.influence, _LARGEST_INFLUENCE)),
                "why": e.why,
            }
            for e in outcome.effects
        ],
        "accuracy": {
            "requested": outcome.accuracy.requested,
            "estimated": float(outcome.accuracy.estimated),
            "settings": dict(outcome.accuracy.settings),
        },
        "timing": {name: float(seconds) for name, seconds in outcome.timing.items()},
    }


def pointer(request: BaseModel, refusal: InvalidInput) -> str:
    """The JSON pointer of the field behind a solver's path, as far as the request knows it."""
    parts: list[str] = []
    here: Any = request
    for step in refusal.field.split("."):
        name = step
        if isinstance(here, BaseModel):
            names = type(here).model_fields
            name = next((n for n in names if n == step or n.startswith(step + "_")), step)
            here = getattr(here, name, None)
        elif isinstance(here, (list, tuple)) and step.isdigit():
            here = here[int(step)] if int(step) < len(here) else None
        parts.append(name)
    return "/" + "/".join(parts)


def entry(pointer: str, detail: str, allowed: str) -> dict[str, str]:
    """One bad field of problem details."""
    return {"pointer": pointer, "detail": detail, "allowed": allowed}


def refusal_problem(request: BaseModel, refusal: InvalidInput) -> dict[str, Any]:
    """Problem details for an input that only the solver could see through."""
    return {
        "type": "about:blank",
        "title": "The request is not valid",
        "status": 422,
        "detail": refusal.reason,
        "errors": [entry(pointer(request, refusal), refusal.reason, refusal.allowed)],
    }


def finite(value: Any) -> bool:
    """Whether a JSON value holds finite numbers only."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, dict):
        return all(finite(v) for v in value.values())
    if isinstance(value, (list, tuple)):
        return all(finite(v) for v in value)
    return True
