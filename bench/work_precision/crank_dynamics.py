"""Mean torque, side force, crank-pin load and the work between the extremes of the speed, of one cylinder with all its
masses, on tables and indicator diagrams, in line or with a pin offset.

Beside the ladders of the library and of the service, which reads a request and tells all results, stand the usual ways
with scipy's PCHIP, its making included as it is in ours: numpy on equal angles with the trapezoidal rule
and the greatest samples, and scipy's quad, solve_ivp and minimize_scalar. The reference takes the work from the kinetic
energy and from Gauss's rule with twenty nodes on short pieces (of a diagram: from its antiderivative), and its maxima
from 72,000 angles and both sides of every dead centre, climbed with scipy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp, trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar

from bench.campaign.scenes import Scene, scenes
from bench.work_precision.curves import Method, Results
from solvers import crank
from solvers.effects import EffectSelection

TITLE = "Crank dynamics"
CASES = 200
JUDGED = ("mean_torque_nm", "work_fluctuation_j", "side_force_max_n", "crank_pin_load_max_n")
_ALL = {"include": ["reciprocating_inertia", "rod_inertia_couple", "pin_offset"], "exclude": ["engine"]}
_EFFECTS = EffectSelection(frozenset(_ALL["include"]), frozenset(_ALL["exclude"]))
_LADDER = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_GOALS = {"accuracy 0.001": 0.4e-3, "accuracy 1e-10": 1.5e-3}
_DENSE_ANGLES = 72_000
_BESIDE = 1e-12
_CANCELLED = 1e-2
"""Machines whose mean torque is less than this fraction of its mean magnitude are excluded: its relative error is not
meaningful."""

Array = np.ndarray


class CrankCase:
    """A random machine, as a request and as vectorised textbook formulas."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        machine = scene.request().scene()[0]
        m, c, masses = machine.mechanism, machine.cylinder, machine.masses
        self.r, self.length, self.e, self.omega = m.crank_radius, m.rod_length, m.offset, 2 * math.pi * m.speed
        self.area, self.clearance, self.back = c.area, c.clearance_volume, c.crankcase_pressure
        self.period, rod = math.pi * c.strokes, masses.rod
        share = rod.cg_from_pin / self.length
        self.to_and_fro = masses.piston + rod.mass * (1 - share)
        self.big_end = rod.mass * share
        self.defect = rod.mass * rod.cg_from_pin * (self.length - rod.cg_from_pin) - rod.inertia
        self.top = math.asin(self.e / (self.length + self.r))
        self.bottom = math.pi + math.asin(self.e / (self.length - self.r))
        pressure = machine.pressure
        self.machine, self.strokes = machine, getattr(pressure, "strokes", ())
        self.curves = self.joined()

    def joined(self) -> list[PchipInterpolator]:
        """Monotone cubics through the points, shared by all methods."""
        pressure = self.machine.pressure
        if self.strokes:
            return [PchipInterpolator(*_sorted(s.volume, s.pressure)) for s in self.strokes]
        angle, values = np.array(pressure.angle), np.array(pressure.pressure)
        turns = np.repeat([-self.period, 0.0, self.period], angle.size)
        return [PchipInterpolator(np.tile(angle, 3) + turns, np.tile(values, 3))]

    @property
    def dead_centres(self) -> Array:
        turns = 2 * math.pi * np.arange(round(self.period / math.pi) // 2)
        return np.sort(np.concatenate([self.top + turns, self.bottom + turns]))

    def sine(self, angle: Array) -> Array:
        return (self.r * np.sin(angle) - self.e) / self.length

    def volume(self, angle: Array) -> Array:
        high = math.sqrt((self.length + self.r) ** 2 - self.e**2)
        x = high - self.r * np.cos(angle) - self.length * np.sqrt(1 - self.sine(angle) ** 2)
        return self.clearance + self.area * x

    def stroke(self, angle: Array) -> Array:
        return np.clip((np.mod(angle, self.period) // math.pi).astype(int), 0, len(self.strokes) - 1)

    def pressure(self, angle: Array) -> Array:
        angle = np.mod(angle, self.period)
        if not self.strokes:
            return self.curves[0](angle)
        volume, along = self.volume(angle), self.stroke(angle)
        return np.select(
            [along == i for i in range(len(self.curves))],
            [c(np.clip(volume, c.x[0], c.x[-1])) for c in self.curves],
        )

    def columns(self, angle: Array) -> tuple[Array, Array, Array]:
        """Torque [N m], magnitude of the side force [N], crank-pin load [N]."""
        sine, cosine, tilt = np.sin(angle), np.cos(angle), self.sine(angle)
        bend = np.sqrt(1 - tilt**2)
        turn = self.r * cosine / (self.length * bend)
        again = (self.length * tilt * turn**2 - self.r * sine) / (self.length * bend)
        hastening = self.r * cosine + self.length * (bend * turn**2 + tilt * again)
        axial = (self.pressure(angle) - self.back) * self.area - self.to_and_fro * self.omega**2 * hastening
        side = axial * tilt / bend + self.defect * again * self.omega**2 / (self.length * bend)
        tangential, radial = axial * sine + side * cosine, axial * cosine - side * sine
        outward = self.big_end * self.r * self.omega**2
        return tangential * self.r, np.abs(side), np.hypot(tangential, radial - outward)

    def kinetic(self, angle: Array) -> Array:
        """Kinetic energy [J] of the moving masses, corrected for the excess inertia of the two-mass model."""
        bend = np.sqrt(1 - self.sine(angle) ** 2)
        turn = self.r * np.cos(angle) / (self.length * bend)
        speed = self.r * np.sin(angle) + self.length * self.sine(angle) * turn
        return 0.5 * self.omega**2 * (self.to_and_fro * speed**2 - self.defect * turn**2)


def _sorted(volume: tuple[float, ...], pressure: tuple[float, ...]) -> tuple[Array, Array]:
    order = np.argsort(volume)
    return np.array(volume)[order], np.array(pressure)[order]


class _Work:
    """Work of the torque since the start of the cycle, without integrating the torque."""

    def __init__(self, case: CrankCase) -> None:
        self.case = case
        corners = case.dead_centres if case.strokes else np.concatenate([case.curves[0].x, case.dead_centres])
        corners = corners[(corners > 0) & (corners < case.period)]
        self.bounds = np.unique(np.concatenate([corners, np.linspace(0, case.period, 64 * int(case.period / 3) + 1)]))
        self.rule = np.polynomial.legendre.leggauss(20)
        pieces = self._gas(self.bounds[:-1], self.bounds[1:])
        self.before = np.concatenate([[0.0], np.cumsum(pieces)])

    def _gas(self, low: Array, high: Array) -> Array:
        """Work of the gas between angles within one piece."""
        case, (at, weight) = self.case, self.rule
        if case.strokes:
            along, volumes = case.stroke(0.5 * (low + high)), (case.volume(low), case.volume(high))
            done = np.zeros_like(low)
            for i, curve in enumerate(case.curves):
                whole = curve.antiderivative()
                start, end = (np.clip(v, curve.x[0], curve.x[-1]) for v in volumes)
                done = np.where(along == i, whole(end) - whole(start), done)
            return done - case.back * (volumes[1] - volumes[0])
        angle = low[:, None] + 0.5 * (high - low)[:, None] * (1 + at)
        tilt = case.sine(angle)
        lever = case.r * (np.sin(angle) + np.cos(angle) * tilt / np.sqrt(1 - tilt**2))
        load = (case.pressure(angle) - case.back) * case.area
        return 0.5 * (high - low) * ((load * lever) @ weight)

    def __call__(self, angle: Array) -> Array:
        piece = np.clip(np.searchsorted(self.bounds, angle, side="right") - 1, 0, self.bounds.size - 2)
        gas = self.before[piece] + self._gas(self.bounds[piece], angle)
        return gas - (self.case.kinetic(angle) - self.case.kinetic(np.zeros(1)))


def _refined_maximum(function: Callable[[Array], Array], angle: Array) -> float:
    """The maximum sample, refined by scipy in its neighbourhood."""
    values = function(angle)
    best = int(np.argmax(values))
    bounds = angle[max(best - 1, 0)], angle[min(best + 1, angle.size - 1)]
    found = minimize_scalar(
        lambda a: -float(function(np.array([a]))[0]), bounds=bounds, method="bounded", options={"xatol": 1e-10}
    )
    return max(float(values[best]), -float(found.fun))


def reference(case: CrankCase) -> Results:
    """The reference values of the judged results."""
    beside = np.concatenate([case.dead_centres - _BESIDE, case.dead_centres + _BESIDE])
    even = np.linspace(0, case.period, _DENSE_ANGLES + 1)
    angle = np.unique(np.concatenate([even, beside[beside > 0], [case.period - _BESIDE]]))
    work = _Work(case)
    mean = float(work.before[-1]) / case.period
    swings = [_refined_maximum(lambda a, s=sign: s * (work(a) - mean * a), angle) for sign in (1.0, -1.0)]
    side, load = (_refined_maximum(lambda a, k=k: case.columns(a)[k], angle) for k in (1, 2))
    return dict(zip(JUDGED, (mean, sum(swings), side, load), strict=True))


def cases(count: int) -> list[CrankCase]:
    """Random machines, a quarter of them hard, without cancelling mean torque."""
    found: list[CrankCase] = []
    for scene in scenes("crank-dynamics", 10 * count, first_seed=50_000):
        case = CrankCase(scene)
        torque = case.columns(np.linspace(0, case.period, 1440, endpoint=False))[0]
        if abs(np.mean(torque)) > _CANCELLED * np.mean(np.abs(torque)):
            found.append(case)
        if len(found) == count:
            break
    return found


def _ours(accuracy: float, case: CrankCase) -> Results:
    found = crank.analyse(case.machine, _EFFECTS, accuracy=accuracy, series_angles=2).value
    worst = {w.name: w.force for w in found.worst}
    values = (
        found.torque_mean,
        found.speed_fluctuation.work_fluctuation,
        worst["side_force_max"],
        worst["crank_pin_load_max"],
    )
    return dict(zip(JUDGED, values, strict=True))


def _service(accuracy: float, case: CrankCase) -> Results:
    answer = case.scene.solve(effects=_ALL, accuracy=accuracy)
    return {name: answer.result[name] for name in JUDGED}


def _equal_angles(count: int, case: CrankCase) -> Results:
    case.curves = case.joined()
    angle = np.linspace(0, case.period, count + 1)
    torque, side, load = case.columns(angle)
    mean = trapezoid(torque, angle) / case.period
    work = cumulative_trapezoid(torque - mean, angle, initial=0)
    return dict(zip(JUDGED, (mean, float(np.ptp(work)), side.max(), load.max()), strict=True))


def _adaptive(tolerance: float, case: CrankCase) -> Results:
    def torque(angle: float) -> float:
        return float(case.columns(np.array([angle]))[0][0])

    inside = case.dead_centres[case.dead_centres > 0]
    corners = [0.0, *inside.tolist(), case.period]
    parts = [quad(torque, a, b, epsabs=0, epsrel=tolerance, limit=400)[0] for a, b in pairwise(corners)]
    mean = sum(parts) / case.period
    found = solve_ivp(
        lambda a, _: [torque(a) - mean],
        (0, case.period),
        [0.0],
        method="DOP853",
        rtol=tolerance,
        atol=tolerance * abs(mean),
        max_step=math.pi / 36,
        dense_output=True,
    )
    if not found.success:
        raise ArithmeticError(found.message)
    angle = np.linspace(0, case.period, 721)
    swings = [_refined_maximum(lambda a, s=sign: s * found.sol(a)[0], angle) for sign in (1.0, -1.0)]
    side, load = (_refined_maximum(lambda a, k=k: case.columns(a)[k], angle) for k in (1, 2))
    return dict(zip(JUDGED, (mean, sum(swings), side, load), strict=True))


def methods() -> Iterator[Method[CrankCase]]:
    """The accuracy ladders of library and service, then the peers."""
    yield Method("Crankwright", {f"accuracy {a:g}": partial(_ours, a) for a in _LADDER}, goals=_GOALS)
    yield Method("Crankwright, a request's answer", {f"accuracy {a:g}": partial(_service, a) for a in _LADDER})
    grids = {f"{n:,} angles": partial(_equal_angles, n) for n in (24, 72, 180, 720, 7_200, 72_000)}
    yield Method("numpy and scipy on equal angles", grids)
    solver = {f"tolerance {t:g}": partial(_adaptive, t) for t in (1e-3, 1e-6, 1e-9)}
    yield Method("scipy quad, solve_ivp, minimize_scalar", solver, cases=5)
