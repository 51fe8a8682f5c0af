"""Global optimum of a rod's design by outer approximation.

A relaxation (few angles, few sections) is solved by branch and bound; its best strip is refined on the full cycle; the
angles and sections that govern there are added to the relaxation; this is iterated until the relaxation's lower bound
is within the gap of the incumbent. The bound of a relaxation is a bound of the problem itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.fatigue.kernels import severities
from solvers.numerics.periodic import grid
from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.optimum import Polished, polish
from solvers.rod.optimum.peaks import Peaks, RequiredResults
from solvers.rod.optimum.proof.box_bounds import Array, Relaxation
from solvers.rod.optimum.proof.branch_and_bound import prove
from solvers.rod.optimum.sqp import required_results
from solvers.rod.problem import Bounds, Objective
from solvers.rod.scene import Dimensions

_FIRST_ANGLES = 8
_FIRST_SECTIONS = (1.0, 0.75, 0.5, 0.25)
_FIRST_GAP = 1.0
_ROUNDS = 16
_LOOSE, _FEWER, _FEWER_ERROR = 2e-4, 4, 5e-5
"""Gaps from which on the mean of friction power is taken over every fourth angle of the cycle, and what it may be wrong
by then, relative: the error falls with the third power of their number (``core.cycle``)."""
_MIN_GAP = 5e-9
_NEARLY, _TIED = 0.9, 1e-3


@dataclass(frozen=True)
class Sizes:
    """The bounds and the available sizes within them: stock thicknesses, steps of width and length [m]."""

    bounds: Bounds
    stock_h: tuple[float, ...] | None = None
    step_b: float | None = None
    step_l: float | None = None

    @property
    def discrete(self) -> bool:
        """Whether any size is discrete."""
        return len(self.free) < 3

    @property
    def free(self) -> tuple[int, ...]:
        """The indices of those of b, h, l that may be chosen at will."""
        steps = self.step_b, self.stock_h, self.step_l
        return tuple(k for k, step in enumerate(steps) if step is None)

    def slices(self) -> Array:
        """The boxes (b1, b2, h1, h2) that together contain all sizes; one per stock thickness."""
        (b1, b2), (h1, h2) = self.bounds.b, self.bounds.h
        if self.stock_h is not None:
            return np.array([[b1, b2, h, h] for h in sorted(set(self.stock_h)) if h1 <= h <= h2])
        return np.array([[b1, b2, h1, h2]])

    def stock_near(self, h: float, steps: int) -> list[float]:
        """The thickness nearest to ``h`` in stock with those up to so many steps from it; ``h`` where there is none."""
        if self.stock_h is None:
            return [h]
        low, high = self.bounds.h
        stock = sorted({s for s in self.stock_h if low <= s <= high})
        at = min(range(len(stock)), key=lambda n: abs(stock[n] - h))
        return stock[max(at - steps, 0) : at + steps + 1]

    def around(self, d: Dimensions) -> Bounds:
        """The bounds of the continuous dimensions, with the sizes nearest to a strip fixed."""
        b, h, l = self.bounds.b, self.bounds.h, self.bounds.l
        if self.stock_h is not None:
            h = (*self.stock_near(d.h, 0),) * 2
        if self.step_b is not None:
            b = (_to_step(d.b, self.step_b, b),) * 2
        if self.step_l is not None:
            l = (_to_step(d.l, self.step_l, l),) * 2
        return Bounds(b, h, l)


def _to_step(value: float, step: float, within: tuple[float, float]) -> float:
    first, last = math.ceil(within[0] / step * (1 - 1e-12)), math.floor(within[1] / step * (1 + 1e-12))
    # A multiple of the step may exceed a bound by one unit in the last place.
    return min(max(min(max(round(value / step), first), last) * step, within[0]), within[1])


@dataclass
class View:
    """The angles and sections of a relaxation; extended in each iteration."""

    angles: list[float]
    sections: list[float]

    def add(self, angles: Array, sections: Array) -> bool:
        """Whether there are new ones among them."""
        before = len(self.angles) + len(self.sections)
        for known, new, apart in ((self.angles, angles, 1e-7), (self.sections, sections, 1e-6)):
            for value in map(float, new):
                if all(abs(value - other) > apart for other in known):
                    known.append(value)
        return len(self.angles) + len(self.sections) > before


@dataclass(frozen=True)
class Proof:
    """The best strip found, a lower bound of ln objective over all admissible strips, and the search statistics.

    ``best`` is None if none was found; the bound is then inf if infeasibility is proven.
    """

    best: Polished | None
    log_bound: float
    boxes: int
    rounds: int
    view: View


def search(
    cycle: CoreCycle, objective: Objective, limits: Limits, sizes: Sizes, gap: float, boxes: int,
    before: Proof | None = None,
) -> Proof:  # fmt: skip
    """Global optimum with its bound: to ``gap`` (in ln objective), or as far as ``boxes`` boxes suffice.

    It goes on from what a search to a greater gap has found ``before``.
    Stepped widths with a free thickness are branched on: a range of widths is searched as if continuous, and split at
    the width of its best strip if the neighbouring available widths do not reach its bound.
    """
    view, incumbent = View([*grid(_FIRST_ANGLES), cycle.peak_compression_angle], list(_FIRST_SECTIONS)), None
    if before is not None:
        view, incumbent = View([*before.view.angles], [*before.view.sections]), before.best
    if sizes.step_b is None or sizes.stock_h is not None:
        return _search(cycle, objective, limits, sizes, gap, boxes, view, incumbent)
    low, high = sizes.bounds.b
    first, last = math.ceil(low / sizes.step_b * (1 - 1e-12)), math.floor(high / sizes.step_b * (1 + 1e-12))
    ranges, bound, looked, rounds = [(first, last)], math.inf, 0, 0
    while ranges:
        first, last = ranges.pop()
        ends = min(max(first * sizes.step_b, low), high), min(max(last * sizes.step_b, low), high)
        part = Sizes(replace(sizes.bounds, b=ends), None, None, sizes.step_l)
        proof = _search(cycle, objective, limits, part, gap, max(boxes - looked, 200), view, incumbent)
        looked, rounds = looked + proof.boxes, rounds + proof.rounds
        if proof.best is None or proof.best is incumbent:
            bound = min(bound, proof.log_bound)
            continue
        at = proof.best.dimensions
        below = min(max(math.floor(at.b / sizes.step_b * (1 + 1e-9)), first), last)
        above = min(max(math.ceil(at.b / sizes.step_b * (1 - 1e-9)), first), last)
        for width in {below, above}:
            beside = replace(at, b=width * sizes.step_b)
            found = polish(cycle, objective, limits, sizes.around(beside), beside)
            if found is not None and (incumbent is None or found.log_cost < incumbent.log_cost):
                incumbent = found
        if below == above or looked >= boxes or (incumbent and incumbent.log_cost <= proof.log_bound + gap):
            bound = min(bound, proof.log_bound)
            continue
        ranges += sorted([(first, below), (above, last)], key=lambda one: one[1] - one[0], reverse=True)
    return Proof(incumbent, bound if incumbent is None else min(bound, incumbent.log_cost), looked, rounds, view)


def _search(
    cycle: CoreCycle, objective: Objective, limits: Limits, sizes: Sizes, gap: float, boxes: int, view: View,
    incumbent: Polished | None,
) -> Proof:  # fmt: skip
    """``search`` over all widths within the bounds; ``incumbent`` if it is optimal within ``gap``."""
    slices, length = sizes.slices(), np.array([sizes.bounds.l[0], min(sizes.bounds.l[1], cycle.rod_length)])
    steps = np.array([sizes.step_b or 0.0, sizes.step_l or 0.0])
    looked_at = required_results(objective, limits)
    # Half of the gap is left for the relaxation's own best strip, which may be slightly suboptimal.
    gap = max(0.45 * gap, _MIN_GAP)
    looked, bound = 0, -math.inf
    for turn in range(_ROUNDS):
        p = _relaxation(cycle, objective, limits, view, _FEWER if gap > _LOOSE and not sizes.discrete else 1)
        known = math.inf if incumbent is None else incumbent.log_cost
        wanted = _FIRST_GAP if incumbent is None and turn == 0 else gap
        room = max(boxes - looked, 200)
        lower, count, left, best = prove(p, slices, length, steps, known, wanted, room)
        looked += count
        bound = max(bound, lower)
        if math.isnan(best[1]):
            if left == 0 or incumbent is not None:
                break
            # Node limit reached before an admissible centre was found: no starting point.
            return Proof(None, bound, looked, turn + 1, view)
        if known - gap <= best[0] < math.inf:
            break
        candidate = Dimensions(math.exp(-best[1]) / best[3] ** 3, best[3], best[2])
        found = polish(cycle, objective, limits, sizes.around(candidate), candidate)
        if found is not None and (incumbent is None or found.log_cost < incumbent.log_cost):
            incumbent = found
            if turn == 0:
                view = View([0.0, cycle.peak_compression_angle], [1.0])
        if looked >= boxes:
            break
        better = found is not None and found is incumbent
        strip = found.dimensions if better else candidate
        seen = found.peaks if better else cycle.peaks(strip, looked_at)
        new = view.add(*governing(cycle, strip, seen, looked_at))
        if not (new or better):
            break
    if incumbent is not None:
        bound = min(bound, incumbent.log_cost)
    return Proof(incumbent, bound, looked, turn + 1, view)


def governing(cycle: CoreCycle, d: Dimensions, peaks: Peaks, looked_at: RequiredResults) -> tuple[Array, Array]:
    """The angles and sections (eta) that govern a strip: where a fibre's cycle is nearly as severe as the worst.

    If the maximum stress is relevant besides the utilisation, at the sections of both; if reactions are, including the
    angles of maximum side force and contact pressure. So are angles at which a stress misses its extremum by little.
    """
    eta, angles = peaks.stations(), peaks.angles
    table = cycle.strip(d).stresses(angles, eta)
    high, low = table.max(axis=2), table.min(axis=2)
    severity = np.empty_like(high)
    severities(high, low, *cycle.diagram, severity)
    wanted: set[int] = set()
    sections: list[float] = []
    for values in (severity, np.maximum(high, -low)) if looked_at.stress else (severity,):
        for fibre, j in np.argwhere(values > _NEARLY * values.max()):
            # The clamp, or the middle one of three sections around a peak.
            if j == 0 or j % 3 == 2:
                sections.append(eta[j])
            stress, room = table[fibre, j], _TIED * (high[fibre, j] - low[fibre, j])
            wanted.update(np.flatnonzero((stress >= high[fibre, j] - room) | (stress <= low[fibre, j] + room)))
    governed = angles[sorted(wanted)]
    if looked_at.reactions:
        governed = np.concatenate([governed, cycle.reaction_peaks(d)])
    return governed, np.array(sections)


def _relaxation(cycle: CoreCycle, objective: Objective, limits: Limits, view: View, fewer: int = 1) -> Relaxation:
    """The problem at the view's angles and sections; the mean of friction power over every ``fewer``-th angle of the
    cycle, less what that may be wrong by."""
    angles = np.array(view.angles)
    force, stroke, speed = cycle.axial_force(angles), cycle.lateral_stroke(angles), np.zeros(angles.size)
    if required_results(objective, limits).power:
        # Power is a mean: it requires the whole cycle.
        whole_force, whole_stroke, whole_speed = (values[::fewer] for values in cycle.mean_samples)
        force, stroke = np.append(force, whole_force), np.append(stroke, whole_stroke)
        share = (1.0 - (_FEWER_ERROR if fewer > 1 else 0.0)) / whole_speed.size
        speed = np.append(speed, share * whole_speed)
    most = np.full(rows.FIRST_PART, math.inf)
    for row, limit in limits.items():
        most[row] = limit
    weighed = [row for row, _ in objective.weights]
    return Relaxation(
        force, stroke, speed, angles.size, np.array(view.sections), *cycle.diagram, most,
        rows.THICKNESS if rows.THICKNESS in weighed else weighed[0], cycle.compression, cycle.guide, cycle.modulus,
        cycle.rod_length,
    )  # fmt: skip
