"""The global optimum of a rod's design, and how it is known to be that.

A relaxation (few angles, few sections) is searched exhaustively by branch and bound; its best strip is polished on the
full cycle; the angles and sections that govern there join the relaxation; and so on until the relaxation holds nothing
better than the best strip by more than the gap asked for. Since a relaxation can only promise too much, its bound is a
bound of the problem itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from solvers.numerics.periodic import grid
from solvers.rod import rows
from solvers.rod.branch_and_bound import lagrangian, prove
from solvers.rod.focus import Array, Machine, severities, stress_table
from solvers.rod.polish import Limits, Polished, needs_reactions, polish
from solvers.rod.problem import Bounds, Objective
from solvers.rod.relaxation import Cuts, Relaxation, fill, workspace
from solvers.rod.scene import Dimensions

FIRST_ANGLES = 12
_FIRST_SECTIONS = (1.0, 0.75, 0.5, 0.25)
_FIRST_GAP = 0.1
_FIRST_BOXES = 2000
_ROUNDS = 12
_LEAST_GAP = 5e-9
_MOST_ANGLES = 48
_NEAR = 2e-3
_NEARLY = 0.9
_BALANCED = 1e-6


@dataclass(frozen=True)
class Sizes:
    """The bounds, and what may be had within them: thicknesses of a stock, steps of width and length [m]."""

    bounds: Bounds
    stock_h: tuple[float, ...] | None = None
    step_b: float | None = None
    step_l: float | None = None

    def slices(self) -> Array:
        """The boxes (b1, b2, h1, h2) that together hold every size; with a step of b but no stock, one per width."""
        (b1, b2), (h1, h2) = self.bounds.b, self.bounds.h
        if self.stock_h is not None:
            return np.array([[b1, b2, h, h] for h in sorted(set(self.stock_h)) if h1 <= h <= h2])
        if self.step_b is not None:
            first, last = math.ceil(b1 / self.step_b * (1 - 1e-12)), math.floor(b2 / self.step_b * (1 + 1e-12))
            return np.array([[n * self.step_b, n * self.step_b, h1, h2] for n in range(first, last + 1)])
        return np.array([[b1, b2, h1, h2]])

    def around(self, d: Dimensions) -> Bounds:
        """The bounds of what stays continuous when the sizes nearest to a strip are taken."""
        b, h, l = self.bounds.b, self.bounds.h, self.bounds.l
        if self.stock_h is not None:
            nearest = min((s for s in self.stock_h if h[0] <= s <= h[1]), key=lambda s: abs(s - d.h))
            h = (nearest, nearest)
        if self.step_b is not None:
            b = (_to_step(d.b, self.step_b, b),) * 2
        if self.step_l is not None:
            l = (_to_step(d.l, self.step_l, l),) * 2
        return Bounds(b, h, l)


def _to_step(value: float, step: float, within: tuple[float, float]) -> float:
    first, last = math.ceil(within[0] / step * (1 - 1e-12)), math.floor(within[1] / step * (1 + 1e-12))
    # n step may exceed a bound by one unit in the last place.
    return min(max(min(max(round(value / step), first), last) * step, within[0]), within[1])


@dataclass(frozen=True)
class Proof:
    """The best strip found, a lower bound of ln objective over everything admissible, and what it took.

    ``best`` is None where none was found; the bound is then inf if it is proven that there is none.
    """

    best: Polished | None
    log_bound: float
    boxes: int
    rounds: int
    angles: int


@dataclass
class _View:
    """The angles and sections that a relaxation looks at; grows from round to round."""

    angles: list[float]
    sections: list[float]
    pairs: set[int] = field(default_factory=set)

    def add(self, angles: Array, sections: Array) -> None:
        self.angles += [a for a in map(float, angles) if all(abs(a - b) > 1e-7 for b in self.angles)]
        self.sections += [s for s in map(float, sections) if all(abs(s - b) > 1e-6 for b in self.sections)]


def search(machine: Machine, objective: Objective, limits: Limits, sizes: Sizes, gap: float, boxes: int) -> Proof:
    """The global optimum with its bound: as close as ``gap`` (in ln objective) or as ``boxes`` boxes come."""
    view = _View([*grid(FIRST_ANGLES), machine.hardest], list(_FIRST_SECTIONS))
    slices, length = sizes.slices(), np.array(_length_range(machine, sizes))
    steps = np.array([sizes.step_b or 0.0, sizes.step_l or 0.0])
    incumbent: Polished | None = None
    # Half of the gap is left to the relaxation's own best strip, which may lie a little below the best of all.
    gap = max(0.45 * gap, _LEAST_GAP)
    looked, bound, tried = 0, -math.inf, set()
    for turn in range(_ROUNDS):
        p = _relaxation(machine, objective, limits, view)
        work, best = workspace(p), np.empty(5)
        cuts = _NO_CUTS if incumbent is None else _cuts(machine, p, objective, limits, incumbent, slices)
        known = math.inf if incumbent is None else _as_relaxed(incumbent.log_cost, objective, limits)
        wanted = _FIRST_GAP if incumbent is None and turn == 0 else gap
        room = _FIRST_BOXES if incumbent is None else max(boxes - looked, 200)
        lower, count, left = prove(p, slices, length, steps, cuts, known, wanted, room, work, 0.0, best)
        looked += count
        bound = max(bound, _from_relaxed(lower, objective, limits))
        if not math.isfinite(best[0]):
            if left == 0 or incumbent is not None:
                break
            # The boxes ran out before any centre was admissible: nothing to start from.
            return Proof(None, bound, looked, turn + 1, len(view.angles))
        if incumbent is not None and best[0] >= known - gap:
            break
        candidate = Dimensions(math.exp(-best[1]) / best[3] ** 3, best[3], best[2])
        key = tuple(round(math.log(v), 6) for v in (candidate.b, candidate.h, candidate.l))
        found = polish(machine, objective, limits, sizes.around(candidate), candidate)
        if found is not None and (incumbent is None or found.log_cost < incumbent.log_cost):
            incumbent = found
            if turn == 0 or len(view.angles) > _MOST_ANGLES:
                view = _View([0.0, machine.hardest], [1.0])
        if looked >= boxes or (key in tried and found is None):
            break
        tried.add(key)
        view.add(*governing(machine, incumbent.dimensions if incumbent is found and found else candidate))
    if incumbent is not None:
        bound = min(bound, incumbent.log_cost)
    return Proof(incumbent, bound, looked, turn + 1, len(view.angles))


def governing(machine: Machine, d: Dimensions) -> tuple[Array, Array]:
    """The angles and sections (eta) that govern a strip: where a fibre's cycle is nearly as bad as the worst."""
    focus, angles = machine.focus_at(d.b, d.h, d.l)
    eta = np.concatenate([focus.eta[:1], focus.eta[2::3]])
    table = np.empty((2, eta.size, angles.size))
    stress_table(focus.force[1::3], focus.stroke[1::3], machine.modulus, machine.rod_length, d.b, d.h, d.l, eta, table)
    high, low = table.max(axis=2), table.min(axis=2)
    severity = np.empty_like(high)
    severities(high, low, machine.lines, machine.parabola, severity)
    strength = np.maximum(high, -low)
    kept = (severity > _NEARLY * severity.max()) | (strength > _NEARLY * strength.max())
    wanted = np.unique(np.concatenate([table.argmax(axis=2)[kept], table.argmin(axis=2)[kept]]))
    return np.concatenate([angles[wanted], machine.reaction_peaks(d.b, d.h, d.l)]), eta[kept.any(axis=0)]


def _length_range(machine: Machine, sizes: Sizes) -> tuple[float, float]:
    return sizes.bounds.l[0], min(sizes.bounds.l[1], machine.rod_length)


def _as_relaxed(log_cost: float, objective: Objective, limits: Limits) -> float:
    """Relaxations measure stability by its limit."""
    return log_cost + dict(objective.weights).get(rows.STABILITY, 0.0) * math.log(limits.stability)


def _from_relaxed(value: float, objective: Objective, limits: Limits) -> float:
    return value - dict(objective.weights).get(rows.STABILITY, 0.0) * math.log(limits.stability)


def _relaxation(machine: Machine, objective: Objective, limits: Limits, view: _View) -> Relaxation:
    angles = np.array(view.angles)
    force, stroke, speed = (
        machine.cycle.axial_force(angles),
        machine.crank_radius * np.sin(angles),
        np.zeros(angles.size),
    )
    if dict(objective.weights).get(rows.POWER) or limits.power is not None:
        # Power is a mean: it needs the whole cycle.
        force, stroke = np.append(force, machine.force), np.append(stroke, machine.stroke)
        speed = np.append(speed, machine.speed / machine.speed.size)
    elif needs_reactions(objective, limits):
        force, stroke = np.append(force, machine.force[::4]), np.append(stroke, machine.stroke[::4])
        speed = np.zeros(force.size)
    weights = np.zeros(rows.COUNT)
    for row, weight in objective.weights:
        weights[row] = weight
    none = math.inf
    return Relaxation(
        force, stroke, speed, np.array(view.sections), machine.lines, machine.parabola,
        np.array([1.0 / limits.fatigue if limits.fatigue else 1e300, limits.stress or none, limits.pressure or none,
                  limits.power or none]),
        machine.compression * limits.stability, machine.guide, weights, machine.modulus, machine.rod_length,
    )  # fmt: skip


_NO_CUTS = Cuts(
    np.zeros((0, 2), np.int64), np.zeros(0, np.int64), np.zeros((0, 4)), np.zeros(0), np.zeros(0), np.zeros(0),
    np.zeros(2), np.zeros(3), 0,
)  # fmt: skip


def _cuts(
    machine: Machine, p: Relaxation, objective: Objective, limits: Limits, incumbent: Polished, slices: Array
) -> Cuts:
    """The functionals of stress that govern the incumbent, with the multipliers that make the Lagrangian stationary."""
    from scipy.optimize import nnls

    weights = p.weights
    if np.any(weights[[rows.SIDE, rows.PRESSURE, rows.POWER]] != 0.0):
        return _NO_CUTS
    d = incumbent.dimensions
    table = np.empty((2, p.eta.size, p.force.size))
    stress_table(p.force, p.stroke, p.modulus, p.rod_length, d.b, d.h, d.l, p.eta, table)
    fatigue = weights[rows.UTILISATION] != 0.0
    angles, section, factors, shared = [], [], [], []
    for fibre in range(2):
        for j in range(p.eta.size):
            i1, i2 = int(table[fibre, j].argmax()), int(table[fibre, j].argmin())
            high, low = table[fibre, j, i1], table[fibre, j, i2]
            for limit, share in ([(p.limits[0], False)] if p.limits[0] < 1e299 else []) + (
                [(math.exp(incumbent.log_cost), True)] if fatigue else []
            ):
                for pull, push in _lines(p, 0.5 * (high - low), 0.5 * (high + low)):
                    if abs(math.log(max((pull * high + push * low) / limit, 1e-300))) < _NEAR:
                        angles.append((i1, i2))
                        section.append(j)
                        factors.append((1.0 - 2.0 * fibre, pull, push, limit))
                        shared.append(share)
            if p.limits[1] < math.inf and abs(math.log(max(high, -low) / p.limits[1])) < _NEAR:
                angles.append((i1, i1) if high > -low else (i2, i2))
                section.append(j)
                factors.append((1.0 - 2.0 * fibre, 1.0 if high > -low else -1.0, 0.0, p.limits[1]))
                shared.append(False)
    n = len(section)
    if n == 0:
        return _NO_CUTS
    tau = 1.0 / (d.b * d.h**3)
    # The slice the incumbent lies in: the one whose fixed size, of b or of h, is its own.
    apart = np.abs(slices[:, 2] / d.h - 1.0) if slices[0, 2] == slices[0, 3] else np.abs(slices[:, 0] / d.b - 1.0)
    x, slice_ = math.log(tau), slices[int(np.argmin(apart))]
    work, gradient = workspace(p), np.empty(4)
    fill(p, np.full(3, tau), np.full(3, d.l), work)
    base = dict(
        angles=np.array(angles), section=np.array(section), factors=np.array(factors), share=np.zeros(n),
        ceiling=np.zeros(n), linear=np.zeros(3), floors=np.zeros(2), caps=np.zeros(3),
        thickness=0 if abs(math.log(d.h / slice_[2])) < _NEAR else 1,
    )  # fmt: skip

    def column(name: str, index: int) -> Array:
        one = {**base, name: np.eye(base[name].size)[index]}
        lagrangian(p, Cuts(**one), slice_, x, x, d.l, d.l, work, gradient)
        return np.array([gradient[0], gradient[2]])

    columns, names = [], []

    def offer(name: str, index: int, thickness: float, share: float) -> None:
        columns.append([*column(name, index), thickness, share])
        names.append((name, index))

    for k in range(n):
        if shared[k]:
            offer("share", k, 0.0, 1.0)
        else:
            offer("ceiling", k, 1.0, 0.0)
    if p.compression > 0.0:
        offer("linear", 2, 0.0, 0.0)
    for name, index, value in (
        ("floors", 0, d.h / slice_[2]), ("floors", 1, d.b / slice_[1]),
        ("caps", 0, d.h / slice_[3]), ("caps", 1, d.b / slice_[0]),
    ):  # fmt: skip
        if abs(math.log(value)) < _NEAR:
            offer(name, index, -1.0 if name == "floors" else 1.0, 0.0)
    for sign in (1.0, -1.0):
        # At a bound of l, and at fixed tau, the gradient may point outward.
        columns.append([0.0, sign, 0.0, 0.0])
        names.append(("length", 0))
    target = np.array([-weights[rows.TAU] - weights[rows.STABILITY],
                       -weights[rows.LENGTH] - weights[rows.STABILITY] * column("linear", 2)[1],
                       -weights[rows.THICKNESS], weights[rows.UTILISATION]])  # fmt: skip
    matrix = np.array(columns).T
    # Free slack in l costs a little, so that it is used only where a bound of l holds.
    matrix_used = matrix[:, :-2]
    found, residual = nnls(matrix_used, target)
    if residual > _BALANCED:
        found, residual = nnls(matrix, target)
        found = found[:-2]
    parts = {
        key: np.array(value, dtype=float) if isinstance(value, np.ndarray) else value for key, value in base.items()
    }
    parts["angles"], parts["section"] = base["angles"], base["section"]
    for (name, index), value in zip(names, found, strict=False):
        parts[name][index] += value
    parts["linear"][0] += weights[rows.TAU]
    parts["linear"][1] += weights[rows.LENGTH]
    parts["linear"][2] += weights[rows.STABILITY]
    return _balanced(Cuts(**parts), weights)


def _lines(p: Relaxation, amplitude: float, mean: float) -> list[tuple[float, float]]:
    """The lines alpha sigma_a + beta sigma_m that rule here, as factors of the highest and the lowest stress.

    A corner of several lines is the least of them, which no single one bounds from below: it gives none. A parabola is
    convex, so its tangent does.
    """
    out = []
    for corner in p.lines:
        distinct = {tuple(line) for line in corner}
        if len(distinct) == 1:
            alpha, beta = corner[0]
            out.append((0.5 * (alpha + beta), 0.5 * (beta - alpha)))
    if p.parabola[0] > 0.0:
        a, m = p.parabola[0] * amplitude, 2.0 * p.parabola[1] * max(mean, 0.0)
        root = math.hypot(a, m)
        if root > 0.0:
            alpha, beta = 0.5 * p.parabola[0] * (1.0 + a / root), p.parabola[1] * m / root
            out.append((0.5 * (alpha + beta), 0.5 * (beta - alpha)))
    return out


def _balanced(cuts: Cuts, weights: Array) -> Cuts:
    """Multipliers bound the objective only if they balance exactly in ln h and in the shares; none if they do not."""
    surplus = cuts.ceiling.sum() + cuts.caps.sum() - cuts.floors.sum() + weights[rows.THICKNESS]
    shares = cuts.share.sum() - weights[rows.UTILISATION]
    if abs(surplus) > 1e-3 or abs(shares) > 1e-3:
        return _NO_CUTS
    k = int(np.argmax(cuts.ceiling))
    if surplus < 0.0 or cuts.ceiling[k] >= surplus:
        cuts.ceiling[k] -= surplus
    elif cuts.caps.max() >= surplus:
        cuts.caps[int(np.argmax(cuts.caps))] -= surplus
    else:
        return _NO_CUTS
    if weights[rows.UTILISATION] != 0.0:
        cuts.share[:] *= weights[rows.UTILISATION] / cuts.share.sum()
    return cuts
