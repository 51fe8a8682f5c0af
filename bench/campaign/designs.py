"""Designs: does a certificate ever lie?

Every kind's random problem is designed at an accuracy drawn for it. Then the answer is put to the kind's check, where
it must keep its limits and have the objective that the design tells. Rivals, drawn at random over all that is allowed
and close around the answer, or found by local searches (each kind's ``RIVALS``), are put to the same check: one that
keeps the limits and is better than the answer by more than its estimate, or than the certificate's bound, shows a lie,
and so does one that keeps them where the design says that there is none. Last, the same problem designed a thousand
times tighter must not be better than the bound, nor further away than the estimate.

The check is the physics that both share; the search has nothing of the solver's.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS
from bench.campaign import linkage_designs, pin_designs, rod_designs
from bench.campaign.rivalry import Body, Problem

DESIGNED: Mapping[str, Callable[[np.random.Generator], Problem]] = {
    "flexible-rod": rod_designs.problem,
    "impact-linkage": linkage_designs.problem,
    "pin-profile": pin_designs.problem,
}
"""For every kind that designs, how a random problem is made; pins and bushings are one kind."""
RIVALS: Mapping[str, str] = {
    "flexible-rod": rod_designs.RIVALS,
    "impact-linkage": linkage_designs.RIVALS,
    "pin-profile": pin_designs.RIVALS,
}
"""How strong the rivals of a kind's designs are."""

_ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
_TIGHTER = 1e-3
_TIGHTEST = 1e-10
_ROUNDING = 1e-8
"""What the check's own errors (asked to 1e-9) may add."""


@dataclass(frozen=True)
class Design:
    """One problem. Shares are relative to the objective.

    proven          whether the certificate itself names nothing that it does not cover
    found           whether a rival keeps the limits
    missed          by what share the answer misses a limit, or its objective, when checked anew
    better          by what share the best rival, or the tighter design, is better than the bound
    estimated       of the answer's own error and gap, and the tighter design's
    own_estimate    of the answer's own error, with its gap where that is proven
    distance        from the tighter design
    closest         by what share the best rival is worse than the answer
    """

    requested: float
    infeasible: bool
    proven: bool
    rivals: int
    found: bool
    missed: float = 0.0
    better: float = 0.0
    estimated: float = 0.0
    own_estimate: float = 0.0
    distance: float = 0.0
    closest: float = math.inf

    @property
    def admissible(self) -> bool:
        return self.missed <= self.requested + _ROUNDING

    @property
    def bounded(self) -> bool:
        """The bound itself is as exact as the accuracy asked for."""
        return self.better <= self.requested + _ROUNDING

    @property
    def unbeaten(self) -> bool:
        """No rival is better than the answer by more than it estimates."""
        return -self.closest <= self.own_estimate + _ROUNDING

    @property
    def honest(self) -> bool:
        return self.distance <= self.estimated + _ROUNDING


def judge_design(slug: str, seed: int) -> Design | None:
    """Judge the design problem of a seed; None where it is refused."""
    rng = np.random.default_rng([seed, 1])
    problem, accuracy = DESIGNED[slug](rng), float(rng.choice(_ACCURACIES))
    answer = _designed(slug, problem, accuracy)
    if answer.status not in ("succeeded", "infeasible"):
        return None
    tried, best = _best_rival(slug, problem, answer, rng)
    proven = _proven(answer)
    if answer.status == "infeasible":
        return Design(accuracy, True, proven, tried, math.isfinite(best))
    own = problem.objective(answer.result)
    value, bound = own**problem.sign, answer.result["certificate"]["bound"] ** problem.sign
    tight = _designed(slug, problem, max(_TIGHTER * accuracy, _TIGHTEST))
    if tight.status != "succeeded":
        return Design(accuracy, False, proven, tried, math.isfinite(best), distance=math.inf)
    least = problem.objective(tight.result) ** problem.sign
    return Design(
        requested=accuracy,
        infeasible=False,
        proven=proven,
        rivals=tried,
        found=math.isfinite(best),
        missed=_missed(slug, problem, answer),
        better=max(bound / min(best, least) - 1.0, 0.0),
        estimated=_doubt(answer) + _doubt(tight),
        own_estimate=_doubt(answer) if proven else answer.accuracy["estimated"],
        distance=abs(value / least - 1.0),
        closest=best / value - 1.0,
    )


def _designed(slug: str, problem: Problem, accuracy: float) -> Answer:
    job = KINDS[slug].jobs[Mode.DESIGN]
    return job.run(job.request.model_validate_json(json.dumps({**problem.body, "accuracy": accuracy})))


def _checked(slug: str, body: Body, answer: Answer) -> Body | None:
    """The checked result of a request with the very effects of a design's answer; None where it has none."""
    job = KINDS[slug].jobs[Mode.CHECK]
    active = {e["name"] for e in answer.effects if e["state"] == "active"}
    settled = {"include": sorted(active), "exclude": sorted({e["name"] for e in answer.effects} - active)}
    found = job.run(job.request.model_validate_json(json.dumps({**body, "effects": settled, "accuracy": 1e-9})))
    return found.result if found.status == "succeeded" else None


def _best_rival(slug: str, problem: Problem, answer: Answer, rng: np.random.Generator) -> tuple[int, float]:
    """How many rivals had an answer, and the best objective, as made small, of those that keep the limits."""
    tried, best = 0, math.inf

    def check(body: Body) -> Body | None:
        nonlocal tried, best
        result = _checked(slug, body, answer)
        tried += 1
        if result is not None and problem.broken(result) <= 0.0 and (value := problem.objective(result)) is not None:
            best = min(best, value**problem.sign)
        return result

    problem.rivals(rng, answer, check)
    return tried, best


def _missed(slug: str, problem: Problem, answer: Answer) -> float:
    """By what share the answer misses a limit by its own word, or, checked anew, a limit or its objective."""
    missed, again = problem.broken(answer.result), problem.given(answer)
    if again is None:
        return missed
    result = _checked(slug, again, answer)
    if result is None:
        return math.inf
    apart = abs(problem.objective(result) / problem.objective(answer.result) - 1.0)
    return max(missed, problem.broken(result), apart)


def _proven(answer: Answer) -> bool:
    """Whether the certificate names nothing that its proof leaves out: effects, or shear's tangent."""
    evidence = (answer.result.get("certificate") or {}).get("evidence", {})
    constrained = evidence.get("deflection_as_constrained_um")
    if constrained is not None and abs(answer.result["deflection_um"] / constrained - 1.0) > _ROUNDING:
        return False
    return "beyond_the_proof" not in evidence


def _doubt(answer: Answer) -> float:
    return answer.accuracy["estimated"] + answer.result["certificate"]["gap"]
