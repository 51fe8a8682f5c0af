"""Finding the strip: the global optimum over width, thickness and free length."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.outcome import Accuracy, ActiveConstraint, EffectState, Outcome, Shortfall, Status
from solvers.rod.check import RodCheck, check
from solvers.rod.cycle import BeamColumn, Composition
from solvers.rod.effects import ReciprocatingInertia
from solvers.rod.effects_over_box import choose_over_box
from solvers.rod.landscape import Landscape
from solvers.rod.polish import Polished, polish
from solvers.rod.problem import OBJECTIVES, Objective, RodProblem
from solvers.rod.scene import Dimensions

_TAU_SAMPLES = 28
_LENGTH_SAMPLES = 18
_CORRECTIONS = 4
_PERTURBATION = 1e-3
_ACTIVE = 1e-4
_STARTS = 4
_NO_LIMIT = 1e-9


@dataclass(frozen=True)
class RodDesign:
    """The strip found, its check on the full model, and the constraints that shape it."""

    check: RodCheck
    objective: str
    active: tuple[ActiveConstraint, ...]


def design(
    problem: RodProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
) -> Outcome[RodDesign]:
    """The best strip for a problem, or the diagnosis why there is none.

    The landscape over (tau, l) is scanned, its best hollows are polished by scipy's SLSQP in logarithms, with every
    section that may govern as a constraint of its own so that kinks are corners, and where the scene calls for effects
    beyond the landscape the requirements are shifted by what the full model says until it agrees. The answer satisfies
    every requirement on the full model.
    """
    started = time.perf_counter()
    criterion = criterion or serensen(problem.scene.material)
    bounds = problem.bounds
    choice = choose_over_box(
        problem.scene,
        Dimensions(bounds.b[0], bounds.h[0], bounds.l[0]),
        Dimensions(bounds.b[1], bounds.h[1], min(bounds.l[1], problem.scene.mechanism.rod_length)),
        effects,
        effect_tolerance,
        problem.requirements.demands() + problem.objective.demands(),
        problem.requirements.min_stability_safety,
    )
    settled = EffectSelection(
        frozenset(e.name for e in choice.manifest if e.state is EffectState.ACTIVE),
        frozenset(e.name for e in choice.manifest if e.state is EffectState.SKIPPED),
    )

    def evaluate(dimensions: Dimensions) -> RodCheck:
        outcome = check(problem.scene, dimensions, settled, effect_tolerance, min(accuracy, 1e-6), criterion)
        return outcome.value

    terms = (ReciprocatingInertia(),) if choice.has("reciprocating_inertia") else ()
    landscape = _landscape(problem, criterion, Composition(force_terms=terms, beam=BeamColumn()))
    found = _solve_on_full_model(landscape, evaluate, accuracy)
    timing = {"solve_s": time.perf_counter() - started}
    if found is None:
        return Outcome(
            Status.INFEASIBLE,
            None,
            choice.manifest,
            Accuracy(accuracy, accuracy, {}),
            diagnosis=_diagnose(landscape),
            timing=timing,
        )
    point, result, landscape = found
    active = _active(landscape, point)
    return Outcome(
        Status.SUCCEEDED,
        RodDesign(result, problem.objective.name, active),
        choice.manifest,
        Accuracy(accuracy, accuracy, {"tau_samples": _TAU_SAMPLES, "length_samples": _LENGTH_SAMPLES}),
        timing={"solve_s": time.perf_counter() - started},
    )


def _landscape(problem: RodProblem, criterion: FatigueCriterion, composition: Composition) -> Landscape:
    r = problem.requirements
    return Landscape(
        problem,
        criterion,
        composition,
        r.min_fatigue_safety,
        r.min_stability_safety,
        r.min_yield_safety,
        r.max_contact_pressure,
        r.max_friction_power,
    )


def _solve_on_full_model(
    landscape: Landscape, evaluate: Callable[[Dimensions], RodCheck], accuracy: float
) -> tuple[Polished, RodCheck, Landscape] | None:
    """Solve on the landscape, look at the full model, shift the limits by the difference, and again."""
    best: tuple[Polished, RodCheck, Landscape] | None = None
    point: Polished | None = None
    for _ in range(_CORRECTIONS):
        point = _solve(landscape) if point is None else polish(landscape, point.dimensions)
        if point is None:
            return best
        result = evaluate(point.dimensions)
        if result.stresses is None:
            landscape, point = replace(landscape, stability_limit=landscape.stability_limit * 1.1), None
            continue
        shifted = _shifted(landscape, point, result)
        if _meets(result, landscape.problem):
            best = (point, result, landscape)
            if _same_limits(shifted, landscape, accuracy):
                break
        landscape = shifted
    return best


def _meets(result: RodCheck, problem: RodProblem) -> bool:
    r, s = problem.requirements, result.stresses
    fatigue, stability = s.fatigue_safety or math.inf, result.stability_safety or math.inf
    return (
        fatigue >= r.min_fatigue_safety
        and stability >= r.min_stability_safety
        and (r.min_yield_safety is None or (s.yield_safety or math.inf) >= r.min_yield_safety)
        and (r.max_contact_pressure is None or s.contact_pressure_max <= r.max_contact_pressure)
        and (r.max_friction_power is None or s.friction_power <= r.max_friction_power)
    )


def _shifted(landscape: Landscape, point: Polished, result: RodCheck) -> Landscape:
    """The landscape with its limits moved by the ratio of its own values to the full model's, to the safe side."""
    r, s = landscape.problem.requirements, result.stresses
    safe = 1.0 + 1e-9
    d = point.dimensions
    tau = 1.0 / (d.b * d.h**3)
    utilisation, stress = landscape.stresses(tau, d.l, d.h)
    _, pressure, power = landscape.reactions(tau, d.l)
    stability = landscape.stability(tau, d.l)
    strength = landscape.problem.scene.material.yield_strength

    def shift(required: float | None, own: float, full: float | None) -> float | None:
        return None if required is None else required * (own / full if full else 1.0)

    return replace(
        landscape,
        fatigue_limit=safe * shift(r.min_fatigue_safety, 1.0 / utilisation, s.fatigue_safety),
        stability_limit=safe * shift(r.min_stability_safety, stability, result.stability_safety),
        yield_limit=shift(r.min_yield_safety, safe * strength / stress, s.yield_safety),
        pressure_limit=shift(r.max_contact_pressure, pressure / safe, s.contact_pressure_max),
        power_limit=shift(r.max_friction_power, power / safe, s.friction_power),
    )


def _same_limits(a: Landscape, b: Landscape, accuracy: float) -> bool:
    names = ("fatigue_limit", "stability_limit", "yield_limit", "pressure_limit", "power_limit")
    pairs = [(getattr(a, n), getattr(b, n)) for n in names if getattr(a, n) is not None]
    return all(abs(x - y) <= accuracy * abs(y) for x, y in pairs)


def _cost(landscape: Landscape, objective: Objective, tau: float, length: float) -> tuple[float, float]:
    """The objective (to be made small) and the thickness that serves it; inf where nothing is admissible."""
    span = landscape.admissible(tau, length)
    if span is None:
        return math.inf, math.nan
    h = span[0] if objective.thickness < 0 else span[1]
    if objective.name == "mass":
        return landscape.problem.scene.material.density * length / (tau * h * h), h
    if objective.name == "fatigue_safety":
        return landscape.stresses(tau, length, h)[0], h
    if objective.name == "stability_safety":
        return 1.0 / landscape.stability(tau, length), h
    side, pressure, power = landscape.reactions(tau, length)
    return {"side_force": side, "contact_pressure": pressure, "friction_power": power}[objective.name], h


def _solve(landscape: Landscape) -> Polished | None:
    """Scan (tau, l), polish from the best of what is admissible; where nothing is, climb toward it first."""
    starts, least_bad = _scan(landscape)
    if not starts and least_bad is not None:
        # The admissible set may be a crescent thinner than the scan's mesh: make the strip as safe as it can be first.
        safest = replace(landscape, problem=replace(landscape.problem, objective=OBJECTIVES["fatigue_safety"]))
        climbed = polish(replace(safest, fatigue_limit=_NO_LIMIT, yield_limit=None), least_bad)
        starts = [climbed.dimensions] if climbed is not None else []
    found = [polished for start in starts if (polished := polish(landscape, start)) is not None]
    return min(found, key=lambda point: point.log_cost, default=None)


def _scan(landscape: Landscape) -> tuple[list[Dimensions], Dimensions | None]:
    """The best admissible strips of a mesh over (tau, l), far enough apart, and the least inadmissible one."""
    objective, bounds = landscape.problem.objective, landscape.problem.bounds
    longest = min(bounds.l[1], landscape.problem.scene.mechanism.rod_length)
    lengths = np.linspace(bounds.l[0], longest, _LENGTH_SAMPLES) if longest > bounds.l[0] else [longest]
    points: list[tuple[float, float, float, float]] = []
    least_bad, least_excess = None, math.inf
    for length in map(float, lengths):
        low, high = _tau_range(landscape, length)
        for tau in map(float, np.geomspace(low, high, _TAU_SAMPLES) if high >= low else []):
            cost, h = _cost(landscape, objective, tau, length)
            if math.isfinite(cost):
                points.append((cost, tau, length, h))
            elif not points:
                thinnest, thickest = landscape.thickness_range(tau)
                if thinnest <= thickest and (excess := landscape.excess(tau, length, thinnest)) < least_excess:
                    least_bad, least_excess = landscape.dimensions(tau, length, thinnest), excess
    points.sort()
    chosen: list[tuple[float, float, float, float]] = []
    for point in points:
        if all(abs(math.log(point[1] / c[1])) + abs(math.log(point[2] / c[2])) > 0.3 for c in chosen):
            chosen.append(point)
        if len(chosen) == _STARTS:
            break
    return [landscape.dimensions(tau, length, h) for _, tau, length, h in chosen], least_bad


def _tau_range(landscape: Landscape, length: float) -> tuple[float, float]:
    bounds = landscape.problem.bounds
    low = 1.0 / (bounds.b[1] * bounds.h[1] ** 3)
    high = 1.0 / (bounds.b[0] * bounds.h[0] ** 3)
    return low, min(high, landscape.greatest_tau(length))


def _active(landscape: Landscape, point: Polished) -> tuple[ActiveConstraint, ...]:
    """The constraints that hold with equality, each with d ln objective/d ln bound from a second solution."""
    out = []
    for name, slack, moved in _constraints(landscape, point.dimensions):
        if abs(slack) > _ACTIVE:
            continue
        relaxed = polish(moved, point.dimensions)
        if relaxed is None:
            continue
        gain = (relaxed.log_cost - point.log_cost) * landscape.problem.objective.sign
        step = (
            math.log1p(-_PERTURBATION)
            if name.startswith("min_") or name.endswith("_lower")
            else -math.log1p(-_PERTURBATION)
        )
        if abs(gain) > 1e-7:
            out.append(ActiveConstraint(name, gain / step))
    return tuple(out)


def _constraints(landscape: Landscape, d: Dimensions) -> list[tuple[str, float, Landscape]]:
    """Every constraint: its name, its relative slack at the point, and the landscape with it relaxed a little."""
    p, ease = landscape.problem, 1.0 - _PERTURBATION
    tau = 1.0 / (d.b * d.h**3)
    utilisation, stress = landscape.stresses(tau, d.l, d.h)
    stability = landscape.stability(tau, d.l)
    out = [
        ("min_fatigue_safety", 1.0 / utilisation / landscape.fatigue_limit - 1.0,
         replace(landscape, fatigue_limit=landscape.fatigue_limit * ease)),
        ("min_stability_safety", stability / landscape.stability_limit - 1.0,
         replace(landscape, stability_limit=landscape.stability_limit * ease)),
    ]  # fmt: skip
    if landscape.yield_limit is not None:
        slack = p.scene.material.yield_strength / stress / landscape.yield_limit - 1.0
        out.append(("min_yield_safety", slack, replace(landscape, yield_limit=landscape.yield_limit * ease)))
    _, pressure, power = landscape.reactions(tau, d.l)
    if landscape.pressure_limit is not None:
        moved = replace(landscape, pressure_limit=landscape.pressure_limit / ease)
        out.append(("max_contact_pressure", pressure / landscape.pressure_limit - 1.0, moved))
    if landscape.power_limit is not None:
        moved = replace(landscape, power_limit=landscape.power_limit / ease)
        out.append(("max_friction_power", power / landscape.power_limit - 1.0, moved))
    for name in ("b", "h", "l"):
        low, high = getattr(p.bounds, name)
        value = getattr(d, name)
        for side, bound, moved in (("lower", low, (low * ease, high)), ("upper", high, (low, high / ease))):
            changed = replace(p, bounds=replace(p.bounds, **{name: moved}))
            out.append((f"{name}_{side}", value / bound - 1.0, replace(landscape, problem=changed)))
    return out


_MEASURES = {
    "min_fatigue_safety": ("fatigue_safety", "fatigue_limit", _NO_LIMIT),
    "min_stability_safety": ("stability_safety", "stability_limit", 1.0),
    "max_contact_pressure": ("contact_pressure", "pressure_limit", None),
    "max_friction_power": ("friction_power", "power_limit", None),
}
"""Per requirement: the objective that serves it, the limit to drop, and what dropping means."""

_ADVICE = {
    "min_fatigue_safety": "allow a longer or wider strip, a smaller crank radius, or a stronger material",
    "min_stability_safety": "allow a thicker or wider strip, a smaller piston, or lower pressure",
    "max_contact_pressure": "allow a longer strip or a longer skirt",
    "max_friction_power": "allow a longer strip or a lower friction coefficient",
}


def _diagnose(landscape: Landscape) -> tuple[Shortfall, ...]:
    """For every requirement, the best value to be had while all others hold, or alone where they cannot hold."""
    out = []
    for name, (objective, limit, dropped) in _MEASURES.items():
        required = getattr(landscape.problem.requirements, name)
        if required is None:
            continue
        wanted = replace(landscape.problem, objective=OBJECTIVES[objective])
        best = _solve(replace(landscape, problem=wanted, **{limit: dropped}))
        alone = best is None
        if alone:
            nothing = replace(
                landscape, problem=wanted, fatigue_limit=_NO_LIMIT, stability_limit=1.0, yield_limit=None,
                pressure_limit=None, power_limit=None,
            )  # fmt: skip
            best = _solve(nothing)
        attainable = None
        if best is not None:
            attainable = math.exp(OBJECTIVES[objective].sign * best.log_cost)
            reached = attainable >= required if name.startswith("min_") else attainable <= required
            if alone and reached:
                continue
        where = "even with no other requirement" if alone else "while the other requirements hold"
        out.append(Shortfall(name, required, attainable, f"best to be had {where}; {_ADVICE[name]}"))
    return tuple(out)


def require_known(name: str) -> Objective:
    """The objective of this name, or InvalidInput."""
    if name not in OBJECTIVES:
        raise InvalidInput("objective", f"there is no objective {name!r}", ", ".join(OBJECTIVES))
    return OBJECTIVES[name]
