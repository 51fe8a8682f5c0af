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
"""Generator of random problems per designing kind; pins and bushings are one kind."""
RIVALS: Mapping[str, str] = {
    "flexible-rod": rod_designs.RIVALS,
    "impact-linkage": linkage_designs.RIVALS,
    "pin-profile": pin_designs.RIVALS,
}
"""Description of the competitors per kind."""

QUICK = Strength(starts=4, evaluations=12, ways=("SLSQP", "Nelder-Mead", "linear programs"), most=160)
"""Effort of local searches in the reduced campaign and in tests."""
FEW_STEPS = (1e-3,)
_ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
_TIGHTER = 1e-3
_TIGHTEST = 1e-10
_ROUNDING = 1e-8
"""Allowance for the errors of the check, which is solved to 1e-9."""


@dataclass(frozen=True)
class Design:
    """Verdict on one design problem. All differences are relative to the objective.

    proven          whether the certificate excludes nothing from its proof
    sort            the form, or the objective
    rivals          number of competitors evaluated
    found           whether a competitor is feasible
    by              search that found the best competitor
    neighbours      number of neighbouring problems
    apart           violation of nesting by neighbours, beyond their estimates
    missed          violation of a limit, or deviation of the objective, when rechecked
    better          excess of the best competitor, or the tighter design, over the bound
    error           estimated error of the answer
    estimated       sum of estimated errors and gaps of the answer and the tighter design
    own_estimate    estimated error of the answer, with its gap if proven
    distance        distance from the tighter design
    closest         distance of the best competitor from the answer (negative: better)
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
        """No competitor beats the bound by more than the answer's estimated error."""
        return self.better <= self.error + _ROUNDING

    @property
    def nested(self) -> bool:
        """Relaxed neighbours are not worse."""
        return self.apart <= _ROUNDING

    @property
    def unbeaten(self) -> bool:
        """No competitor beats the answer by more than its estimate."""
        return -self.closest <= self.own_estimate + _ROUNDING

    @property
    def honest(self) -> bool:
        return self.distance <= self.estimated + _ROUNDING


def judge_design(slug: str, seed: int, quick: bool = False) -> Design | None:
    """Judge the design problem of a seed; None if it is refused. ``quick``: fewer competitors."""
    rng = np.random.default_rng([seed, 1])
    problem = DESIGNED[slug](rng)
    return judge_problem(slug, problem, float(rng.choice(_ACCURACIES)), rng, quick)


def judge_problem(
    slug: str, problem: Problem, accuracy: float, rng: np.random.Generator, quick: bool = False
) -> Design | None:
    """Judge a design problem solved to an accuracy; None if it is refused."""
    answer = _designed(slug, problem, accuracy)
    if answer.status not in ("succeeded", "infeasible"):
        return None
    field = Field(problem, lambda body: _checked(slug, body, answer), QUICK if quick else None)
    problem.rivals(rng, answer, field)
    neighbours = _neighbours(slug, problem, answer, accuracy, field, FEW_STEPS if quick else STEPS)
    proven, apart = _proven(answer), max((_nesting_violation(*pair) for pair in neighbours), default=0.0)
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
        missed=_violation(slug, problem, answer),
        better=max(bound / min(field.best, least) - 1.0, 0.0),
        error=answer.accuracy["estimated"],
        estimated=_uncertainty(answer) + _uncertainty(tight),
        own_estimate=_uncertainty(answer) if proven else answer.accuracy["estimated"],
        distance=abs(value / least - 1.0),
        closest=field.best / value - 1.0,
        **about,
    )


@dataclass(frozen=True)
class _Summary:
    """Value and lower bound of an answer as minimised (inf if infeasible), its estimated error and gap."""

    value: float
    bound: float
    error: float
    gap: float


def _told(problem: Problem, answer: Answer) -> _Summary:
    if answer.status == "infeasible":
        return _Summary(math.inf, math.inf, 0.0, 0.0)
    certificate = answer.result["certificate"]
    bound = certificate["bound"] ** problem.sign if certificate["bound"] else 0.0
    value = problem.objective(answer.result) ** problem.sign
    # Without a bound nothing is claimed about neighbours.
    gap = math.inf if certificate["gap"] is None else certificate["gap"]
    return _Summary(value, bound, answer.accuracy["estimated"], gap)


def _neighbours(
    slug: str, problem: Problem, answer: Answer, accuracy: float, field: Field, steps: Sequence[float]
) -> list[tuple[_Summary, _Summary]]:
    """Pairs (relaxed, tightened) of every neighbour and the answer; neighbours' designs compete with the answer.

    All are designed with the answer's effects.
    """
    pairs, own = [], _told(problem, answer)
    changed = list(problem.neighbours(steps)) + [("wider", 1.0, other) for other in problem.wider()]
    for name, looser, other in changed:
        found = _designed(slug, other, accuracy, _effects_of(answer))
        if found.status not in ("succeeded", "infeasible"):
            continue
        told = _told(other, found)
        pairs.append((told, own) if looser > 0.0 else (own, told))
        if found.status == "succeeded" and name != "wider" and (again := other.given(found)) is not None:
            field.check(again, f"neighbour, {name} {looser:+g}")
        elif found.status == "succeeded" and looser < 0.0:
            field.enter(told.value * (1.0 + told.error), f"neighbour, {name} {looser:+g}")
    return pairs


def _nesting_violation(more: _Summary, less: _Summary) -> float:
    """Relative violation of nesting: the relaxed answer, or its bound, is worse than the tightened one."""
    if math.isinf(less.value):
        return 0.0
    if math.isinf(more.value):
        return math.inf
    worse = more.value / less.value - 1.0 - more.gap
    return max(worse, more.bound / less.value - 1.0) - more.error - less.error


def _effects_of(answer: Answer) -> Body:
    """Effect selection that reproduces the answer's effects."""
    active = {e["name"] for e in answer.effects if e["state"] == "active"}
    return {"include": sorted(active), "exclude": sorted({e["name"] for e in answer.effects} - active)}


def _designed(slug: str, problem: Problem, accuracy: float, effects: Body | None = None) -> Answer:
    """Solve the problem, with the given effects or those of its request."""
    job = KINDS[slug].jobs[Mode.DESIGN]
    asked = {**problem.body, "accuracy": accuracy} | ({} if effects is None else {"effects": effects})
    return job.run(job.request.model_validate_json(json.dumps(asked)))


def _checked(slug: str, body: Body, answer: Answer) -> Body | None:
    """Check a request with the effects of the answer; None if there is no result."""
    job = KINDS[slug].jobs[Mode.CHECK]
    found = job.run(
        job.request.model_validate_json(json.dumps({**body, "effects": _effects_of(answer), "accuracy": 1e-9}))
    )
    return found.result if found.status == "succeeded" else None


def _violation(slug: str, problem: Problem, answer: Answer) -> float:
    """Relative violation of a limit as reported, or, rechecked, of a limit or the objective."""
    missed, again = problem.broken(answer.result), problem.given(answer)
    if again is None:
        return missed
    result = _checked(slug, again, answer)
    if result is None:
        return math.inf
    apart = abs(problem.objective(result) / problem.objective(answer.result) - 1.0)
    return max(missed, problem.broken(result), apart)


def _proven(answer: Answer) -> bool:
    """Whether the proof covers everything: no effects beyond it."""
    evidence = (answer.result.get("certificate") or {}).get("evidence", {})
    return not {"beyond_the_proof", "effects_beyond_the_core"} & evidence.keys()


def _uncertainty(answer: Answer) -> float:
    return answer.accuracy["estimated"] + (answer.result["certificate"]["gap"] or 0.0)
