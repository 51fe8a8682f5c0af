"""The free bore's mass, with and without a deflection limit in bending: the same least walls, the same beam.

A case is two designs, and its time and its goals are those of both. Beside the service's ladder, which places its own
stations, stand its two tiers on midpoints of equal panels, one multiplier and the cone program with its bound, and what
a user would write on the same midpoints: Newton's method with numpy at all stations at once and brentq for the
multiplier, scipy's brentq at every station and for the multiplier, the program in cvxpy with Clarabel, and scipy's
SLSQP on a few stations. The reference is the textbook's equations at Gauss points of panels between the places where
loads begin, halved toward wherever the limit begins to govern, every root and every station's minimum by bisection. The
limit itself is measured on 2,000 midpoints: it is the same number for all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import cvxpy as cp
import numpy as np
from scipy.optimize import brentq, minimize

from bench.pin import Midpoints
from bench.work_precision.curves import Method, Results
from solvers import pin
from solvers.pin.effects import Physics
from solvers.pin.optimum.conic import slope_limited_optimum
from solvers.pin.optimum.lagrangian import minimum_volume
from solvers.pin.optimum.program import Program, assemble

TITLE = "The free bore of a piston pin"
CASES = 200
_LADDER = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
_GOALS = {"accuracy 0.001": 2 * 0.4e-3, "accuracy 1e-08": 2 * 2e-3}
"""Of the two designs of a case."""
_BENDING = pin.EffectSelection(exclude=frozenset({"shear_deflection"}))
_PANELS, _POINTS, _CUTS = 16, 16, 16
"""Reference quadrature: panels per load segment, points per panel, bisections towards a corner."""
_BISECTIONS = 64
_NEWTON_STEPS, _NEWTON_TOLERANCE = 60, 1e-7
_MIN_LOG_PRICE = -60.0
"""Logarithm of the multiplier below which the limit counts as inactive."""


@dataclass(frozen=True)
class PinCase:
    """A random pin; ``stiffness`` places the deflection limit between the solid (0) and the free bore (1)."""

    scene: pin.Scene
    stiffness: float

    def model(self, count: int) -> Model:
        return Model(self.scene, *_panels(self.scene.geometry, count))

    @cached_property
    def limit(self) -> float:
        model = self.model(2_000)
        solid, free = model.deflection(np.ones_like(model.x)), model.deflection(model.least_u)
        return solid + self.stiffness * (free - solid)


def _panels(g: pin.Geometry, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints and widths of about ``count`` panels of the half, equal between load boundaries."""
    half = 0.5 * g.length
    edges = sorted({0.0, g.boss_length, g.boss_length + g.gap, half})
    x, h = [], []
    for lo, hi in pairwise(edges):
        n = max(round(count * (hi - lo) / half), 2)
        x.append(lo + (np.arange(n) + 0.5) * (hi - lo) / n)
        h.append(np.full(n, (hi - lo) / n))
    return np.concatenate(x), np.concatenate(h)


class Model:
    """Textbook model on panel midpoints of one half: forces, minimum walls, bending deflection, mass."""

    def __init__(self, scene: pin.Scene, x: np.ndarray, h: np.ndarray) -> None:
        g, m, p = scene.geometry, scene.material, scene.force
        a, t = g.boss_length, x - g.boss_length - g.gap
        self.x, self.weight = x, h / h.sum()
        shear = np.where(x < a, p * x**2 / (2 * a * a), np.where(t < 0, p / 2, p / 2 - p * t / g.small_end_length))
        spread = np.where(t > 0, p * t**2 / (2 * g.small_end_length), 0.0)
        moment = np.where(x < a, p * x**3 / (6 * a * a), p * a / 6 + p / 2 * (x - a) - spread)
        d, sigma = g.outer_diameter, m.allowable_stress
        self.m, self.q = 32 * moment / (math.pi * sigma * d**3), 32 * np.abs(shear) / (3 * math.pi * sigma * d**2)
        arm = np.where(x > a, 0.5 * (x - a), 0.0)
        self.bend = 2 * h * moment * arm / (m.elastic_modulus * math.pi * d**4 / 64)
        self.solid_mass = m.density * math.pi * d * d / 4 * g.length

    @cached_property
    def least_u(self) -> np.ndarray:
        """Minimum solidity of every station, by simultaneous bisection in w = 1 - beta."""
        low, high = np.zeros_like(self.x), np.ones_like(self.x)
        for _ in range(_BISECTIONS):
            w = 0.5 * (low + high)
            b = 1 - w
            holds = w * (2 - w) * (1 + b * b) >= np.hypot(self.m, self.q * (1 + b + b * b))
            low, high = np.where(holds, low, w), np.where(holds, w, high)
        return high * (2 - high)

    def deflection(self, u: np.ndarray) -> float:
        pulls = self.bend > 0
        return float(np.sum(self.bend[pulls] / (u[pulls] * (2 - u[pulls]))))

    def mass(self, u: np.ndarray) -> float:
        return self.solid_mass * float(self.weight @ u)

    def stiff(self, least: np.ndarray, limit: float) -> np.ndarray:
        """Lightest u within the deflection limit: root of the multiplier around bisection for every station."""
        pulls = self.bend > 0
        floor, weight, bend = least[pulls], self.weight[pulls], self.bend[pulls] / limit

        def best(price: float) -> np.ndarray:
            low, high = floor.copy(), np.ones_like(floor)
            for _ in range(_BISECTIONS):
                u = 0.5 * (low + high)
                falls = weight + price * bend * 0.5 * ((2 - u) ** -2 - u**-2) < 0
                low, high = np.where(falls, u, low), np.where(falls, high, u)
            return high

        def at(log_price: float) -> np.ndarray:
            out = least.copy()
            out[pulls] = best(math.exp(log_price))
            return out

        low, high = -1.0, 1.0
        while self.deflection(at(high)) > limit:
            low, high = high, high + 2.0
        while self.deflection(at(low)) < limit and low > _MIN_LOG_PRICE:
            low, high = low - 2.0, low
        if low <= _MIN_LOG_PRICE:
            return least
        return at(float(brentq(lambda p: math.log(self.deflection(at(p)) / limit), low, high, xtol=1e-14)))


def cases(count: int) -> list[PinCase]:
    """Random pins of any size; a quarter hard: close to the capacity of the solid pin, thin, or without gap."""
    found = []
    for seed in range(count):
        rng = np.random.default_rng(70_000 + seed)
        hard = seed % 4 == 0
        outer = 10 ** rng.uniform(-3.0, -0.7)
        boss, small = outer * 10 ** rng.uniform(-0.3, 0.4, 2)
        g = pin.Geometry(outer, boss, small, 0.0 if hard else outer * rng.uniform(0.01, 0.2))
        m = pin.PinMaterial(10 ** rng.uniform(7.7, 9.0), 10 ** rng.uniform(10.5, 11.4), 0.3, 7850.0)
        probe = Model(pin.Scene(g, 1.0, m), *_panels(g, 2_000))
        most = 1.0 / float(np.hypot(probe.m, probe.q).max())
        share = rng.choice([0.999, 1e-3]) if hard else rng.uniform(0.05, 0.9)
        found.append(PinCase(pin.Scene(g, most * share, m), rng.uniform(0.05, 0.8)))
    return found


def _results(model: Model, free: np.ndarray, stiff: np.ndarray) -> Results:
    return {"free": model.mass(free), "stiff": model.mass(stiff)}


def reference(case: PinCase) -> Results:
    """Both masses by Gauss quadrature; panels in which the limit becomes active are repeatedly bisected."""
    g = case.scene.geometry
    places = sorted({0.0, g.boss_length, g.boss_length + g.gap, 0.5 * g.length})
    edges = np.unique(np.concatenate([np.linspace(a, b, _PANELS + 1) for a, b in pairwise(places)]))
    at, weight = np.polynomial.legendre.leggauss(_POINTS)
    for _ in range(_CUTS):
        half = 0.5 * np.diff(edges)[:, None]
        model = Model(case.scene, (edges[:-1, None] + half * (1 + at)).ravel(), (half * weight).ravel())
        stiff = model.stiff(model.least_u, case.limit)
        governs = (stiff > model.least_u * (1.0 + 1e-12)).reshape(-1, _POINTS)
        # The transition may lie between the last point of a panel and the first of the next.
        turns = governs.any(axis=1) & ~governs.all(axis=1)
        turns[1:] |= governs[1:, 0] != governs[:-1, -1]
        if not turns.any():
            break
        edges = np.sort(np.concatenate([edges, 0.5 * (edges[:-1] + edges[1:])[turns]]))
    return _results(model, model.least_u, stiff)


def _ours(accuracy: float, case: PinCase) -> Results:
    masses = {}
    # A new scene, since its loads are computed once.
    g = case.scene.geometry
    geometry = pin.Geometry(g.outer_diameter, g.boss_length, g.small_end_length, g.gap)
    scene = pin.Scene(geometry, case.scene.force, case.scene.material)
    for name, limits in (("free", pin.Limits()), ("stiff", pin.Limits(max_deflection=case.limit))):
        value = pin.design(pin.PinProblem(scene, limits), _BENDING, accuracy=accuracy).value
        if value is None:
            raise ArithmeticError(name)
        masses[name] = value.check.mass
    return masses


def _by_multiplier(program: Program) -> np.ndarray:
    return minimum_volume(program, program.lower, False).solidity


def _by_cones(program: Program) -> np.ndarray:
    return slope_limited_optimum(program, program.lower, False, 1e-8).solidity


def _on_midpoints(tier: Callable[[Program], np.ndarray], count: int, case: PinCase) -> Results:
    """A tier of the solver on the peers' stations."""
    x, h = _panels(case.scene.geometry, count)
    stations = Midpoints(np.append(x - 0.5 * h, x[-1] + 0.5 * h[-1]))
    limits = pin.Limits(max_deflection=case.limit)
    program = assemble(case.scene, limits, pin.CRITERIA["tresca_paper"], Physics(shear_deflection=False), stations)
    masses = [program.mass_unit * program.volume(u) for u in (program.lower, tier(program))]
    return dict(zip(("free", "stiff"), masses, strict=True))


def _by_newton(count: int, case: PinCase) -> Results:
    """Newton's method at all stations at once; for the multiplier, brentq in logarithms around it."""
    model = case.model(count)
    m, q, wall = model.m, model.q, np.zeros_like(model.m)
    for _ in range(_NEWTON_STEPS):
        beta = 1 - wall
        area = 1 + beta * (1 + beta)
        demand = np.hypot(m, q * area)
        step = (demand - wall * (2 - wall) * (1 + beta * beta)) / (4 * beta**3 + q * q * area * (1 + 2 * beta) / demand)
        wall = wall + step
        if np.abs(step).max() < _NEWTON_TOLERANCE:
            break
    free = wall * (2 - wall)
    pulls = model.bend > 0
    floor, weight, bend = free[pulls], model.weight[pulls], model.bend[pulls] / case.limit

    def best(log_price: float) -> np.ndarray:
        target = weight / (math.exp(log_price) * bend)
        u = 1 / np.sqrt(1 + 2 * target)
        for _ in range(4):
            solid = 2 - u
            u = u + (0.5 * (u**-2 - solid**-2) - target) / (u**-3 + solid**-3)
        return np.maximum(floor, u)

    def excess(log_price: float) -> float:
        u = best(log_price)
        return math.log(float(np.sum(bend / (u * (2 - u)))))

    # Exact for thin walls without lower bounds.
    low = high = 2 * math.log(float(np.sqrt(0.5 * weight * bend).sum()))
    while excess(high) > 0:
        low, high = high, high + 1.0
    while low > _MIN_LOG_PRICE and excess(low) < 0:
        low, high = low - 1.0, low
    out = free.copy()
    if low > _MIN_LOG_PRICE:
        out[pulls] = best(brentq(excess, low, high, xtol=_NEWTON_TOLERANCE))
    return _results(model, free, out)


def _by_brentq(count: int, case: PinCase) -> Results:
    """brentq for every wall; with the limit, brentq for the multiplier around brentq at every station."""
    model = case.model(count)

    def least(m: float, q: float) -> float:
        beta = brentq(lambda b: 1 - b**4 - math.sqrt(m * m + (q * (1 + b + b * b)) ** 2), 0.0, 1.0, xtol=1e-14)
        return 1 - beta * beta

    free = np.array([least(m, q) for m, q in zip(model.m, model.q, strict=True)])
    return _results(model, free, model.stiff(free, case.limit))


def _by_cvxpy(count: int, case: PinCase) -> Results:
    model = case.model(count)
    least, pulls = model.least_u, np.flatnonzero(model.bend > 0)
    u = cp.Variable(least.size)
    bent = cp.multiply(0.5 * model.bend[pulls] / case.limit, cp.inv_pos(u[pulls]) + cp.inv_pos(2 - u[pulls]))
    problem = cp.Problem(cp.Minimize(model.weight @ u), [u >= least, u <= 1, cp.sum(bent) <= 1])
    try:
        problem.solve(solver=cp.CLARABEL)
    except cp.SolverError as failure:
        raise ArithmeticError(str(failure)) from failure
    if u.value is None:
        raise ArithmeticError(problem.status)
    return _results(model, least, u.value)


def _by_slsqp(count: int, case: PinCase) -> Results:
    model = case.model(count)
    least = model.least_u
    room = {"type": "ineq", "fun": lambda u: 1.0 - model.deflection(u) / case.limit}
    bounds = [(max(lo, 1e-9), 1.0) for lo in least]
    found = minimize(
        lambda u: float(model.weight @ u), np.ones_like(least), jac=lambda u: model.weight, bounds=bounds,
        constraints=[room], method="SLSQP", options={"maxiter": 300, "ftol": 1e-12},
    )  # fmt: skip
    if not found.success:
        raise ArithmeticError(found.message)
    return _results(model, least, found.x)


def methods() -> Iterator[Method[PinCase]]:
    """The service's accuracy ladder, then the peers."""
    yield Method("Crankwright", {f"accuracy {a:g}": partial(_ours, a) for a in _LADDER}, goals=_GOALS)
    for name, tier, most in (("one multiplier", _by_multiplier, 200), ("cone program", _by_cones, 20)):
        settings = {f"{n} stations": partial(_on_midpoints, tier, n) for n in (50, 200, 1000)}
        yield Method(f"Crankwright, {name} on midpoints", settings, most)
    yield Method("Newton, numpy", {f"{n} stations": partial(_by_newton, n) for n in (10, 20, 50, 200, 1000)})
    yield Method("brentq at every station", {f"{n} stations": partial(_by_brentq, n) for n in (50, 200, 1000)}, 50)
    yield Method("cvxpy + Clarabel", {f"{n} stations": partial(_by_cvxpy, n) for n in (50, 200, 1000)}, 20)
    yield Method("scipy SLSQP", {f"{n} stations": partial(_by_slsqp, n) for n in (10, 30)}, 20)
