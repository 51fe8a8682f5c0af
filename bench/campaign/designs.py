"""Certificates of designs tested against competitors.

Every kind's random problem is designed at a random accuracy. The answer is rechecked: it must meet its limits and have
the reported objective. Competitors, random over everything allowed and close to the answer, or found by local searches
(each kind's ``RIVALS``), are put to the same check. A feasible competitor better than the answer by more than its
estimate, or than the certificate's bound, refutes the certificate; so does any feasible one if the design claims
infeasibility. The same problem solved a thousand times tighter must not be better than the bound, nor farther away than
the estimate.

Neighbours are the same problem with one limit slightly looser or tighter, or with more allowed (further types, steps,
arbitrary instead of stock thickness). Their answers must nest: a solution of the tighter problem competes in the looser
one, a solution of the looser one that meets the tighter limit competes there, and relaxation never makes an answer
worse.

Only the check is shared with the solver; the searches are independent of it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS
from bench.campaign import linkage_designs, pin_designs, rod_designs
from bench.campaign.rivalry import STEPS, Body, Field, Problem
from oracles.rivals.starts import Strength

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

QUICK = Strength(starts=4, evaluations=12, ways=("SLSQP", "Nelder-Mead", "linear programs"), most=160)
"""How hard local searches try where a share of the campaign is a test."""
FEW_STEPS = (1e-3,)
_ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
_TIGHTER = 1e-3
_TIGHTEST = 1e-10
_ROUNDING = 1e-8
"""What the check's own errors (asked to 1e-9) may add."""


@dataclass(frozen=True)
class Design:
    """One problem. Shares are relative to the objective.

    proven          whether the certificate itself names nothing that it does not cover
    sort            the form, or the objective
    rivals          how many were looked at
    found           whether one of them keeps the limits
    by              what found the best rival
    neighbours      how many there were
    apart           by what share neighbours miss to nest, beyond what they estimate of themselves
    missed          by what share the answer misses a limit, or its objective, when checked anew
    better          by what share the best rival, or the tighter design, is better than the bound
    error           of the answer, as it estimates
    estimated       of the answer's own error and gap, and the tighter design's
    own_estimate    of the answer's own error, with its gap where that is proven
    distance        from the tighter design
    closest         by what share the best rival is worse than the answer
    """

    requested: float
    infeasible: bool
    proven: bool
    sort: str
    rivals: int
    found: bool
    missed: float = 0.0
    better: float = 0.0
    error: float = 0.0
    estimated: float = 0.0
    own_estimate: float = 0.0
    distance: float = 0.0
    closest: float = math.inf
    by: str = ""
    neighbours: int = 0
    apart: float = 0.0

    @property
    def admissible(self) -> bool:
        return self.missed <= self.requested + _ROUNDING

    @property
    def bounded(self) -> bool:
        """No rival is better than the bound by more than the answer's own error."""
        return self.better <= self.error + _ROUNDING

    @property
    def nested(self) -> bool:
        """Neighbours with more room are not worse."""
        return self.apart <= _ROUNDING

    @property
    def unbeaten(self) -> bool:
        """No rival is better than the answer by more than it estimates."""
        return -self.closest <= self.own_estimate + _ROUNDING

    @property
    def honest(self) -> bool:
        return self.distance <= self.estimated + _ROUNDING


def judge_design(slug: str, seed: int, quick: bool = False) -> Design | None:
    """Judge the design problem of a seed; None where it is refused. ``quick``: by fewer rivals."""
    rng = np.random.default_rng([seed, 1])
    problem = DESIGNED[slug](rng)
    return judge_problem(slug, problem, float(rng.choice(_ACCURACIES)), rng, quick)


def judge_problem(
    slug: str, problem: Problem, accuracy: float, rng: np.random.Generator, quick: bool = False
) -> Design | None:
    """Judge a design problem solved to an accuracy; None where it is refused."""
    answer = _designed(slug, problem, accuracy)
    if answer.status not in ("succeeded", "infeasible"):
        return None
    field = Field(problem, lambda body: _checked(slug, body, answer), QUICK if quick else None)
    problem.rivals(rng, answer, field)
    neighbours = _neighbours(slug, problem, answer, accuracy, field, FEW_STEPS if quick else STEPS)
    proven, apart = _proven(answer), max((_apart(*pair) for pair in neighbours), default=0.0)
    about = {"sort": problem.sort, "rivals": field.tried, "by": field.by, "neighbours": len(neighbours), "apart": apart}
    if answer.status == "infeasible":
        return Design(accuracy, True, proven, found=math.isfinite(field.best), **about)
    own = problem.objective(answer.result)
    value, bound = own**problem.sign, _told(problem, answer).bound
    tight = _designed(slug, problem, max(_TIGHTER * accuracy, _TIGHTEST))
    if tight.status != "succeeded":
        return Design(accuracy, False, proven, found=math.isfinite(field.best), distance=math.inf, **about)
    least = problem.objective(tight.result) ** problem.sign
    return Design(
        requested=accuracy,
        infeasible=False,
        proven=proven,
        found=math.isfinite(field.best),
        missed=_missed(slug, problem, answer),
        better=max(bound / min(field.best, least) - 1.0, 0.0),
        error=answer.accuracy["estimated"],
        estimated=_doubt(answer) + _doubt(tight),
        own_estimate=_doubt(answer) if proven else answer.accuracy["estimated"],
        distance=abs(value / least - 1.0),
        closest=field.best / value - 1.0,
        **about,
    )


@dataclass(frozen=True)
class _Told:
    """Of an answer, as made small: its value and bound (inf where there is said to be none), its own error, its gap."""

    value: float
    bound: float
    error: float
    gap: float


def _told(problem: Problem, answer: Answer) -> _Told:
    if answer.status == "infeasible":
        return _Told(math.inf, math.inf, 0.0, 0.0)
    certificate = answer.result["certificate"]
    bound = certificate["bound"] ** problem.sign if certificate["bound"] else 0.0
    value = problem.objective(answer.result) ** problem.sign
    # Without a bound anything may be better: nothing is promised of neighbours.
    gap = math.inf if certificate["gap"] is None else certificate["gap"]
    return _Told(value, bound, answer.accuracy["estimated"], gap)


def _neighbours(
    slug: str, problem: Problem, answer: Answer, accuracy: float, field: Field, steps: Sequence[float]
) -> list[tuple[_Told, _Told]]:
    """(with more room, with less) of every neighbour and the answer; what keeps the answer's limits enters as a rival.

    All are designed with the answer's own effects.
    """
    pairs, own = [], _told(problem, answer)
    changed = list(problem.neighbours(steps)) + [("wider", 1.0, other) for other in problem.wider()]
    for name, looser, other in changed:
        found = _designed(slug, other, accuracy, _settled(answer))
        if found.status not in ("succeeded", "infeasible"):
            continue
        told = _told(other, found)
        pairs.append((told, own) if looser > 0.0 else (own, told))
        if found.status == "succeeded" and name != "wider" and (again := other.given(found)) is not None:
            field.check(again, f"neighbour, {name} {looser:+g}")
        elif found.status == "succeeded" and looser < 0.0:
            field.enter(told.value * (1.0 + told.error), f"neighbour, {name} {looser:+g}")
    return pairs


def _apart(more: _Told, less: _Told) -> float:
    """By what share the answer with more room is worse than that with less, or its bound above it, beyond doubt."""
    if math.isinf(less.value):
        return 0.0
    if math.isinf(more.value):
        return math.inf
    worse = more.value / less.value - 1.0 - more.gap
    return max(worse, more.bound / less.value - 1.0) - more.error - less.error


def _settled(answer: Answer) -> Body:
    """The very effects of a design's answer."""
    active = {e["name"] for e in answer.effects if e["state"] == "active"}
    return {"include": sorted(active), "exclude": sorted({e["name"] for e in answer.effects} - active)}


def _designed(slug: str, problem: Problem, accuracy: float, effects: Body | None = None) -> Answer:
    """The answer; with these effects, or those that the problem's own request asks for."""
    job = KINDS[slug].jobs[Mode.DESIGN]
    asked = {**problem.body, "accuracy": accuracy} | ({} if effects is None else {"effects": effects})
    return job.run(job.request.model_validate_json(json.dumps(asked)))


def _checked(slug: str, body: Body, answer: Answer) -> Body | None:
    """The checked result of a request with the very effects of a design's answer; None where it has none."""
    job = KINDS[slug].jobs[Mode.CHECK]
    found = job.run(
        job.request.model_validate_json(json.dumps({**body, "effects": _settled(answer), "accuracy": 1e-9}))
    )
    return found.result if found.status == "succeeded" else None


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
    return not {"beyond_the_proof", "effects_beyond_the_core"} & evidence.keys()


def _doubt(answer: Answer) -> float:
    return answer.accuracy["estimated"] + (answer.result["certificate"]["gap"] or 0.0)
