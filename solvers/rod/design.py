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
from solvers.rod.problem import OBJECTIVES, Objective, RodProblem
from solvers.rod.scene import Dimensions

_TAU_SAMPLES = 28
_LENGTH_SAMPLES = 18
_CORRECTIONS = 4
_PERTURBATION = 1e-3
_ACTIVE = 1e-4
_STARTS = 2


@dataclass(frozen=True)
class RodDesign:
    """The strip found, its check on the full model, and the constraints that shape it."""

    check: RodCheck
    objective: str
    active: tuple[ActiveConstraint, ...]


@dataclass(frozen=True)
class _Point:
    cost: float
    tau: float
    length: float
    h: float


def design(
    problem: RodProblem,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
) -> Outcome[RodDesign]:
    """The best strip for a problem, or the diagnosis why there is none.

    The landscape over (tau, l) is scanned exhaustively, its best hollows are descended by bracketing (Brent's method
    in both variables, which kinks do not mislead), and where the scene calls for effects beyond the landscape the
    requirements are shifted by what the full model says until it agrees. The answer satisfies every requirement on
    the full model.
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
    active = _active(landscape, point, result, accuracy)
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
) -> tuple[_Point, RodCheck, Landscape] | None:
    """Solve on the landscape, look at the full model, shift the limits by the difference, and again."""
    best: tuple[_Point, RodCheck, Landscape] | None = None
    point: _Point | None = None
    for _ in range(_CORRECTIONS):
        point = _solve(landscape, accuracy) if point is None else _local(landscape, point, accuracy)
        if point is None or not math.isfinite(point.cost):
            return best
        result = evaluate(landscape.dimensions(point.tau, point.length, point.h))
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


def _shifted(landscape: Landscape, point: _Point, result: RodCheck) -> Landscape:
    """The landscape with its limits moved by the ratio of its own values to the full model's, to the safe side."""
    r, s = landscape.problem.requirements, result.stresses
    safe = 1.0 + 1e-9
    utilisation, stress = landscape.stresses(point.tau, point.length, point.h)
    _, pressure, power = landscape.reactions(point.tau, point.length)
    stability = landscape.stability(point.tau, point.length)
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


def _solve(landscape: Landscape, accuracy: float) -> _Point | None:
    """Scan (tau, l), descend from the best hollows, keep the best."""
    objective, bounds = landscape.problem.objective, landscape.problem.bounds
    rod_length = landscape.problem.scene.mechanism.rod_length
    lengths = np.linspace(bounds.l[0], min(bounds.l[1], rod_length), _LENGTH_SAMPLES)
    if lengths[-1] <= lengths[0] * (1 + 1e-12):
        lengths = lengths[:1]
    points: list[tuple[float, float, float]] = []
    for length in lengths:
        low, high = _tau_range(landscape, float(length))
        if high < low:
            continue
        for tau in np.geomspace(low, high, _TAU_SAMPLES) if high > low * (1 + 1e-12) else [low]:
            cost, _ = _cost(landscape, objective, float(tau), float(length))
            if math.isfinite(cost):
                points.append((cost, float(tau), float(length)))
    if not points:
        return None
    points.sort()
    step = (lengths[-1] - lengths[0]) / max(lengths.size - 1, 1)
    best = None
    tried: list[tuple[float, float, float]] = []
    for start in points:
        near = any(abs(start[2] - t[2]) <= 1.5 * step and abs(math.log(start[1] / t[1])) < 0.7 for t in tried)
        if near:
            continue
        tried.append(start)
        candidate = _descend(landscape, objective, start, float(step), accuracy)
        if best is None or candidate.cost < best.cost:
            best = candidate
        if len(tried) == _STARTS:
            break
    return best


def _tau_range(landscape: Landscape, length: float) -> tuple[float, float]:
    bounds = landscape.problem.bounds
    low = 1.0 / (bounds.b[1] * bounds.h[1] ** 3)
    high = 1.0 / (bounds.b[0] * bounds.h[0] ** 3)
    return low, min(high, landscape.greatest_tau(length))


def _descend(
    landscape: Landscape, objective: Objective, start: tuple[float, float, float], step: float, accuracy: float
) -> _Point:
    """Brent's method in l over Brent's method in ln tau, within the cell of the scan around the start."""
    from scipy.optimize import minimize_scalar

    bounds = landscape.problem.bounds
    tolerance = max(0.1 * accuracy, 1e-9)
    best = _Point(start[0], start[1], start[2], _cost(landscape, objective, start[1], start[2])[1])

    def over_tau(length: float) -> float:
        nonlocal best
        low, high = _tau_range(landscape, length)
        if high < low:
            return math.inf
        spacing = max(math.log(high / low) / (_TAU_SAMPLES - 1), 1e-12)
        middle = min(max(best.tau, low), high)
        candidates = [middle, low, high]
        span = (max(math.log(low), math.log(middle) - 2 * spacing), min(math.log(high), math.log(middle) + 2 * spacing))

        def cost(log_tau: float) -> float:
            value, h = _cost(landscape, objective, math.exp(log_tau), length)
            nonlocal best
            if value < best.cost:
                best = _Point(value, math.exp(log_tau), length, h)
            return value if math.isfinite(value) else 1e300

        values = [cost(math.log(tau)) for tau in candidates]
        if span[1] > span[0]:
            found = minimize_scalar(cost, bounds=span, method="bounded", options={"xatol": tolerance, "maxiter": 22})
            values.append(float(found.fun))
        return min(values)

    low = max(bounds.l[0], start[2] - step)
    high = min(bounds.l[1], landscape.problem.scene.mechanism.rod_length, start[2] + step)
    over_tau(low)
    over_tau(high)
    if high > low:
        for width in (1.0, 0.1):
            around = best.length
            span = (max(low, around - width * (high - low)), min(high, around + width * (high - low)))
            options = {"xatol": tolerance * high, "maxiter": 22}
            minimize_scalar(over_tau, bounds=span, method="bounded", options=options)
    return best


def _active(landscape: Landscape, point: _Point, result: RodCheck, accuracy: float) -> tuple[ActiveConstraint, ...]:
    """The constraints that hold with equality, each with d ln objective/d ln bound from a second solution."""
    out = []
    reference = _local(landscape, point, accuracy)
    for name, value, moved in _constraints(landscape, point):
        if abs(value) > _ACTIVE:
            continue
        relaxed = _local(moved, point, accuracy)
        change = (relaxed.cost - reference.cost) / reference.cost * landscape.problem.objective.sign
        direction = -1.0 if name.startswith("min_") or name.endswith("_lower") else 1.0
        if abs(change) > 1e-7:
            out.append(ActiveConstraint(name, change / (direction * _PERTURBATION)))
    return tuple(out)


def _local(landscape: Landscape, point: _Point, accuracy: float) -> _Point:
    """The optimum near a known one."""
    bounds = landscape.problem.bounds
    step = max((bounds.l[1] - bounds.l[0]) / (_LENGTH_SAMPLES - 1) * 0.2, 0.0)
    length = min(max(point.length, bounds.l[0]), bounds.l[1])
    low, high = _tau_range(landscape, length)
    tau = min(max(point.tau, low), max(low, high))
    cost, _ = _cost(landscape, landscape.problem.objective, tau, length)
    return _descend(landscape, landscape.problem.objective, (cost, tau, length), step, min(accuracy, 1e-7))


def _constraints(landscape: Landscape, point: _Point) -> list[tuple[str, float, Landscape]]:
    """Every constraint: its name, its relative slack at the point, and the landscape with it relaxed a little."""
    p, ease = landscape.problem, 1.0 - _PERTURBATION
    d = landscape.dimensions(point.tau, point.length, point.h)
    utilisation, stress = landscape.stresses(point.tau, point.length, point.h)
    stability = landscape.stability(point.tau, point.length)
    out = [
        ("min_fatigue_safety", 1.0 / utilisation / landscape.fatigue_limit - 1.0,
         replace(landscape, fatigue_limit=landscape.fatigue_limit * ease)),
        ("min_stability_safety", stability / landscape.stability_limit - 1.0,
         replace(landscape, stability_limit=landscape.stability_limit * ease)),
    ]  # fmt: skip
    if landscape.yield_limit is not None:
        slack = p.scene.material.yield_strength / stress / landscape.yield_limit - 1.0
        out.append(("min_yield_safety", slack, replace(landscape, yield_limit=landscape.yield_limit * ease)))
    _, pressure, power = landscape.reactions(point.tau, point.length)
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
    "min_fatigue_safety": ("fatigue_safety", "fatigue_limit", 1e-9),
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
        best = _solve(replace(landscape, problem=wanted, **{limit: dropped}), 1e-4)
        alone = best is None
        if alone:
            nothing = replace(
                landscape, problem=wanted, fatigue_limit=1e-9, stability_limit=1.0, yield_limit=None,
                pressure_limit=None, power_limit=None,
            )  # fmt: skip
            best = _solve(nothing, 1e-4)
        attainable = None
        if best is not None:
            attainable = 1.0 / best.cost if OBJECTIVES[objective].sign < 0 else best.cost
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
