"""Global optimum of a rod's design by outer approximation.

A relaxation (few angles, few sections) is solved by branch and bound and its best strip is refined on the full cycle.
The angles and sections that govern there are added to the relaxation. This is iterated until the lower bound of the
relaxation, which is also a bound of the problem itself, is within the gap of the incumbent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.fatigue.kernels import severities
from solvers.numerics.arrays import Array
from solvers.numerics.periodic import grid
from solvers.rod import rows
from solvers.rod.constraints import Limits
from solvers.rod.objectives import Objective
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.local_optimum import Polished, polish
from solvers.rod.optimum.peaks import Peaks, RequiredResults
from solvers.rod.optimum.proof.box_bounds import Relaxation
from solvers.rod.optimum.proof.branch_and_bound import prove
from solvers.rod.optimum.sizes import Sizes
from solvers.rod.optimum.sqp import TOLERANCE, required_results
from solvers.rod.scene import Dimensions

MAX_BOXES = 100_000
"""Maximum number of boxes of a design's proof."""
_FIRST_ANGLES = 8
_FIRST_SECTIONS = (1.0, 0.75, 0.5, 0.25)
_FIRST_GAP = 1.0
_ROUNDS = 16
_COARSE_MEAN_GAP, _COARSE_MEAN_STRIDE, _COARSE_MEAN_ERROR = 2e-4, 4, 5e-5
"""Gap above which the mean of friction power is taken over every fourth angle of the cycle, this stride, and a bound of
the relative error of that mean, which falls with the third power of the number of angles (``core.cycle``)."""
_MIN_GAP = 2e-10
"""Smallest gap in ln objective of a search, above the tolerance of local searches and rounding errors of bounds."""
_TOLERANCE_SHARE, _MAX_TOLERANCE = 1e-3, 1e-7
"""Tolerance of a local search in ln objective as a share of the gap, and its maximum."""
_NEAR_MAXIMUM, _TIE_TOLERANCE = 0.9, 1e-3


@dataclass
class SamplePoints:
    """Angles [rad] and sections (eta) of a relaxation; extended in each iteration."""

    angles: list[float]
    sections: list[float]

    def add(self, angles: Array, sections: Array) -> bool:
        """Add angles and sections; whether any of them is new."""
        count = len(self.angles) + len(self.sections)
        for known, new, distance in ((self.angles, angles, 1e-7), (self.sections, sections, 1e-6)):
            for value in map(float, new):
                if all(abs(value - other) > distance for other in known):
                    known.append(value)
        return len(self.angles) + len(self.sections) > count


@dataclass(frozen=True)
class Proof:
    """The best strip found, a lower bound of ln objective over all admissible strips, and the search statistics.

    ``best`` is None if none was found; the bound is then inf if infeasibility is proven.
    """

    best: Polished | None
    log_bound: float
    boxes: int
    rounds: int
    samples: SamplePoints


def search(
    cycle: CoreCycle, objective: Objective, limits: Limits, sizes: Sizes, gap: float, boxes: int,
    previous: Proof | None = None,
) -> Proof:  # fmt: skip
    """Global optimum with its bound: to ``gap`` (in ln objective), or as far as ``boxes`` boxes suffice.

    Continues from the result ``previous`` of a search to a larger gap, if given. Stepped widths with a free thickness
    are branched on: a range of widths is searched as if continuous, and split at the width of its best strip if the
    neighbouring available widths do not reach its bound.
    """
    samples = SamplePoints([*grid(_FIRST_ANGLES), cycle.peak_compression_angle], list(_FIRST_SECTIONS))
    incumbent = None
    if previous is not None:
        samples = SamplePoints([*previous.samples.angles], [*previous.samples.sections])
        incumbent = previous.best
    if sizes.step_b is None or sizes.stock_h is not None:
        return _search(cycle, objective, limits, sizes, gap, boxes, samples, incumbent)
    low, high = sizes.bounds.b
    first, last = math.ceil(low / sizes.step_b * (1 - 1e-12)), math.floor(high / sizes.step_b * (1 + 1e-12))
    ranges, bound, evaluated, rounds = [(first, last)], math.inf, 0, 0
    while ranges:
        first, last = ranges.pop()
        ends = min(max(first * sizes.step_b, low), high), min(max(last * sizes.step_b, low), high)
        part = Sizes(replace(sizes.bounds, b=ends), None, None, sizes.step_l)
        proof = _search(cycle, objective, limits, part, gap, max(boxes - evaluated, 200), samples, incumbent)
        evaluated, rounds = evaluated + proof.boxes, rounds + proof.rounds
        if proof.best is None or proof.best is incumbent:
            bound = min(bound, proof.log_bound)
            continue
        at = proof.best.dimensions
        below = min(max(math.floor(at.b / sizes.step_b * (1 + 1e-9)), first), last)
        above = min(max(math.ceil(at.b / sizes.step_b * (1 - 1e-9)), first), last)
        for width in {below, above}:
            neighbour = replace(at, b=width * sizes.step_b)
            found = polish(cycle, objective, limits, sizes.around(neighbour), neighbour, _tolerance(gap))
            if found is not None and (incumbent is None or found.log_cost < incumbent.log_cost):
                incumbent = found
        if below == above or evaluated >= boxes or (incumbent and incumbent.log_cost <= proof.log_bound + gap):
            bound = min(bound, proof.log_bound)
            continue
        ranges += sorted([(first, below), (above, last)], key=lambda one: one[1] - one[0], reverse=True)
    return Proof(incumbent, bound if incumbent is None else min(bound, incumbent.log_cost), evaluated, rounds, samples)


def _search(
    cycle: CoreCycle, objective: Objective, limits: Limits, sizes: Sizes, gap: float, boxes: int, samples: SamplePoints,
    incumbent: Polished | None,
) -> Proof:  # fmt: skip
    """``search`` over all widths within the bounds; returns ``incumbent`` if that is optimal within ``gap``."""
    slices, length = sizes.slices(), np.array(sizes.bounds.l)
    steps = np.array([sizes.step_b or 0.0, sizes.step_l or 0.0])
    required = required_results(objective, limits)
    # Half of the gap is reserved for the relaxation's own best strip, which may be slightly suboptimal.
    gap = max(0.45 * gap, _MIN_GAP)
    evaluated, bound = 0, -math.inf
    stride = _COARSE_MEAN_STRIDE if gap > _COARSE_MEAN_GAP else 1
    for iteration in range(_ROUNDS):
        p = _relaxation(cycle, objective, limits, samples, stride)
        known = math.inf if incumbent is None else incumbent.log_cost
        target = _FIRST_GAP if incumbent is None and iteration == 0 else gap
        nodes = max(boxes - evaluated, 200)
        lower, count, left, best = prove(p, slices, length, steps, known, target, nodes)
        evaluated += count
        bound = max(bound, lower)
        if math.isnan(best[1]):
            if left == 0 or incumbent is not None:
                break
            # Node limit reached before an admissible centre was found: no starting point.
            return Proof(None, bound, evaluated, iteration + 1, samples)
        if known - gap <= best[0] < math.inf:
            break
        candidate = Dimensions(math.exp(-best[1]) / best[3] ** 3, best[3], best[2])
        found = polish(cycle, objective, limits, sizes.around(candidate), candidate, _tolerance(gap))
        if found is not None and (incumbent is None or found.log_cost < incumbent.log_cost):
            incumbent = found
            if iteration == 0:
                samples = SamplePoints([0.0, cycle.peak_compression_angle], [1.0])
        if evaluated >= boxes:
            break
        better = found is not None and found is incumbent
        strip = found.dimensions if better else candidate
        peaks = found.peaks if better else cycle.peaks(strip, required)
        new = samples.add(*governing(cycle, strip, peaks, required))
        if not (new or better):
            break
    if incumbent is not None:
        bound = min(bound, incumbent.log_cost)
    return Proof(incumbent, bound, evaluated, iteration + 1, samples)


def _tolerance(gap: float) -> float:
    """Tolerance of local searches towards a gap."""
    return min(max(_TOLERANCE_SHARE * gap, TOLERANCE), _MAX_TOLERANCE)


def governing(cycle: CoreCycle, d: Dimensions, peaks: Peaks, required: RequiredResults) -> tuple[Array, Array]:
    """The angles and sections (eta) that govern a strip.

    Sections are those where a fibre's utilisation (or maximum stress, if required) is close to its maximum; angles are
    those where a stress there is close to an extreme, and the peaks of the reactions, if required.
    """
    eta, angles = peaks.stations(), peaks.angles
    table = cycle.strip(d).stresses(angles, eta)
    high, low = table.max(axis=2), table.min(axis=2)
    severity = np.empty_like(high)
    severities(high, low, *cycle.diagram, severity)
    indices: set[int] = set()
    sections: list[float] = []
    for values in (severity, np.maximum(high, -low)) if required.stress else (severity,):
        for fibre, j in np.argwhere(values > _NEAR_MAXIMUM * values.max()):
            # The clamp, or the peak of the stencil.
            sections.append(1.0 if j == 0 else peaks.sections[(j - 1) // 3])
            stress, margin = table[fibre, j], _TIE_TOLERANCE * (high[fibre, j] - low[fibre, j])
            indices.update(np.flatnonzero((stress >= high[fibre, j] - margin) | (stress <= low[fibre, j] + margin)))
    governed = angles[sorted(indices)]
    if required.reactions:
        governed = np.concatenate([governed, cycle.reaction_peaks(d)])
    return governed, np.array(sections)


def _relaxation(
    cycle: CoreCycle, objective: Objective, limits: Limits, samples: SamplePoints, stride: int = 1
) -> Relaxation:
    """The problem at the sampled angles and sections.

    The mean of friction power is taken over every ``stride``-th angle of the cycle and reduced by its error bound.
    """
    angles = np.array(samples.angles)
    force, lateral, speed = cycle.axial_force(angles), cycle.lateral_displacement(angles), np.zeros(angles.size)
    if required_results(objective, limits).power:
        # Power is a mean: it requires the whole cycle.
        mean_force, mean_lateral, mean_speed = (values[::stride] for values in cycle.mean_samples)
        force, lateral = np.append(force, mean_force), np.append(lateral, mean_lateral)
        share = (1.0 - (_COARSE_MEAN_ERROR if stride > 1 else 0.0)) / mean_speed.size
        speed = np.append(speed, share * mean_speed)
    log_limits = np.full(rows.FIRST_PART, math.inf)
    for row, limit in limits.items():
        log_limits[row] = limit
    weighted = [row for row, _ in objective.weights]
    return Relaxation(
        force, lateral, speed, angles.size, np.array(samples.sections), *cycle.diagram, log_limits,
        rows.THICKNESS if rows.THICKNESS in weighted else weighted[0], cycle.compression, cycle.guide, cycle.modulus,
        cycle.rod_length,
    )  # fmt: skip
