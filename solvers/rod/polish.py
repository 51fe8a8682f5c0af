"""From a good strip to the best one nearby: sequential quadratic programming in logarithms.

The worst of many sections is a kinked function; each group of sections that may govern (the clamp and the inside, for
both fibres) is a constraint of its own here, so that a kink becomes a corner where two smooth constraints meet.
Logarithms make lengths of millimetres and forces of newtons alike. Source: D. Kraft (1988), as scipy's SLSQP.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.rod import envelope
from solvers.rod.cycle import Array
from solvers.rod.landscape import STATIONS, Landscape
from solvers.rod.scene import Dimensions

_STEP = 1e-6
_TOLERANCE = 1e-11
_VIOLATION = 1e-8
_BUCKLED = 1e3


@dataclass(frozen=True)
class Polished:
    """A strip and the logarithm of its objective as made small (1/n for a safety)."""

    dimensions: Dimensions
    log_cost: float


def polish(landscape: Landscape, start: Dimensions) -> Polished | None:
    """The best strip near ``start`` that meets the landscape's limits, or None if none is reached."""
    from scipy.optimize import minimize

    bounds = landscape.problem.bounds
    longest = min(bounds.l[1], landscape.problem.scene.mechanism.rod_length)
    box = [tuple(map(math.log, r)) for r in (bounds.b, bounds.h, (bounds.l[0], longest))]
    fatigue = landscape.problem.objective.name == "fatigue_safety"
    x = np.log([start.b, start.h, start.l])
    x = np.clip(x, [low for low, _ in box], [high for _, high in box])
    if fatigue:
        x = np.append(x, float(np.max(_sections(landscape, x))))
        box.append((-60.0, 60.0))
    memory: dict[bytes, Array] = {}

    def terms(at: Array) -> Array:
        key = at[:3].tobytes()
        if key not in memory:
            memory[key] = _terms(landscape, at[:3])
        return memory[key]

    def cost(at: Array) -> float:
        return float(at[3]) if fatigue else float(terms(at)[0])

    def slacks(at: Array) -> Array:
        values = terms(at)[1:]
        return np.append(values, at[3] - _sections(landscape, at[:3])) if fatigue else values

    def gradient(at: Array) -> Array:
        if fatigue:
            return np.array([0.0, 0.0, 0.0, 1.0])
        return _derivative(lambda y: np.array([cost(y)]), at)[0]

    found = minimize(
        cost,
        x,
        jac=gradient,
        bounds=box,
        method="SLSQP",
        constraints={"type": "ineq", "fun": slacks, "jac": lambda at: _derivative(slacks, at)},
        options={"ftol": _TOLERANCE, "maxiter": 80},
    )
    at = np.clip(found.x, [low for low, _ in box], [high for _, high in box])
    if not np.all(np.isfinite(at)) or float(np.min(slacks(at))) < -_VIOLATION:
        return None
    b, h, l = (
        min(max(math.exp(v), r[0]), r[1])
        for v, r in zip(at, (bounds.b, bounds.h, (bounds.l[0], longest)), strict=False)
    )
    return Polished(Dimensions(b, h, l), cost(at))


def _derivative(function, at: Array) -> Array:
    """Central differences in logarithms: shape (values, variables)."""
    columns = []
    for i in range(at.size):
        step = np.zeros_like(at)
        step[i] = _STEP
        columns.append((function(at + step) - function(at - step)) / (2.0 * _STEP))
    return np.stack(columns, axis=-1)


def _sections(landscape: Landscape, x: Array) -> Array:
    """ln of the fatigue utilisation at the clamp and inside, both fibres: four values."""
    return np.log(np.maximum(_stress_groups(landscape, x)[0], 1e-300)).ravel()


def _stress_groups(landscape: Landscape, x: Array) -> tuple[Array, float]:
    """Utilisation by fibre for clamp and inside, shape (2, 2), and the greatest stress [Pa]."""
    b, h, l = np.exp(x)
    scene = landscape.problem.scene
    high, low = np.empty((2, STATIONS)), np.empty((2, STATIONS))
    stands = envelope.stress_envelope(
        landscape.force,
        landscape.stroke,
        scene.material.elastic_modulus,
        b,
        h,
        l,
        scene.mechanism.rod_length,
        high,
        low,
    )
    if not stands:
        return np.full((2, 2), _BUCKLED), _BUCKLED * scene.material.yield_strength
    utilisation = landscape.criterion.utilisation(0.5 * (high - low), 0.5 * (high + low))
    groups = np.stack([utilisation[:, 0], utilisation[:, 1:].max(axis=1)])
    return groups, float(max(high.max(), -low.min()))


def _terms(landscape: Landscape, x: Array) -> Array:
    """ln objective (made small) first, then the slacks of all limits as logarithms: positive where met."""
    b, h, l = map(float, np.exp(x))
    tau, problem = 1.0 / (b * h**3), landscape.problem
    l = min(l, problem.scene.mechanism.rod_length)
    groups, stress = _stress_groups(landscape, x)
    stability = landscape.stability(tau, l)
    side, pressure, power = landscape.reactions(tau, l)
    costs = {
        "mass": x.sum() + math.log(problem.scene.material.density),
        "fatigue_safety": 0.0,
        "stability_safety": -math.log(stability),
        "side_force": math.log(side),
        "contact_pressure": math.log(pressure),
        "friction_power": math.log(max(power, 1e-300)),
    }
    slacks = list(-np.log(np.maximum(groups, 1e-300) * landscape.fatigue_limit).ravel())
    slacks.append(math.log(min(stability, 1e300) / landscape.stability_limit))
    if landscape.yield_limit is not None:
        slacks.append(math.log(problem.scene.material.yield_strength / (stress * landscape.yield_limit)))
    if landscape.pressure_limit is not None:
        slacks.append(math.log(landscape.pressure_limit / pressure))
    if landscape.power_limit is not None:
        slacks.append(math.log(landscape.power_limit / max(power, 1e-300)))
    return np.array([costs[problem.objective.name], *slacks])
