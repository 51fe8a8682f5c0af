"""The best member of one family, with the proof that there is no better one.

The free ratio is sampled, the best sample is closed in on (corners of the cost included: no derivative is used), and
branch and bound over the whole range of the free ratio proves that nothing beats it by more than the gap: a range is
dropped when its bounds (``range_bounds``) say that no member in it is allowed, or that none costs less.

A design keeps off the ends of the family, the parallelogram and links without end; the proof does not. It looks at
both tails up to where every figure has settled to 1e-8 of itself, except those that grow without end, as sizes do, and
then cost. (Costs that fall with them for ever are refused beforehand: ``unbounded``.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.member_quantities import MemberQuantities
from solvers.linkage.optimum.range_bounds import RangeBounds
from solvers.linkage.problem import Quantities, Subproblem

Array = NDArray[np.float64]
_SAMPLES = 57
_CELLS = 24
_POINTS = 25
_PARTS = 6
_ROUNDS = 24
_MOST_CELLS = 160_000
_FEW, _LOOSE = 8, 1e-4
"""Cells of what lies beyond the range of designs, and the gap that is closed there where the best lies there."""
_BEYOND = 1e-8
_WORTH = 5e-3
"""What it must gain, relative, to leave the range of designs."""
_NARROWEST = 1e-11
_OTHERS = 1e-3
"""Gap to which at least the best of a type is proven that is not the best of all."""
_COARSE, _FINE = 1e-4, 1e-13
_MOST_ROUNDS, _SHARE = 40, 1e-5
"""A best place is closed in on until it moves, or its cost falls in two rounds, by this share of the gap."""
_ASIDE, _SLOW = 0.02, 0.2
_MOST_TRIALS = 24


@dataclass(frozen=True)
class Proven:
    """The best member: q, V [m], cost, a proven lower bound of the cost (inf: nothing is allowed) and what it took.

    ``q`` is None where no member is allowed. The bound holds for members beyond the range of designs as well.
    """

    q: float | None
    scale: float
    cost: float
    bound: float
    cells: int

    @property
    def gap(self) -> float:
        """How far the cost may be above the least one, relative."""
        return max(1.0 - self.bound / self.cost, 0.0) if self.q is not None else 0.0


def search(subproblem: Subproblem, family: Family, gap: float) -> Proven:
    """The best member of one family and a lower bound of every member's cost."""
    return search_all(subproblem, [family], gap)[0]


def search_all(subproblem: Subproblem, families: Sequence[Family], gap: float) -> list[Proven]:
    """The best member of every family, and bounds of which the least holds for the members of all.

    The best of all is proven to the ``gap``, the best of every other family to no less than ``_OTHERS``. Members beyond
    the range of designs are searched as well, up to where nothing changes any more, for what costs less than the best
    in any range. They lower the bound, and the best of them is a family's answer where the range holds none, or none
    that comes close to it.
    """
    if subproblem.fixed_end is not None:
        return [_only_member(subproblem, family) for family in families]
    ranges = [_allowed_range(subproblem, family) for family in families]
    bests = [_best_of_samples(subproblem, *each, gap) for each in zip(families, ranges, strict=True)]
    least, found = min((cost for _, cost in filter(None, bests)), default=math.inf), []
    for family, limits, best in zip(families, ranges, bests, strict=True):
        found.append(_proven(subproblem, family, limits, best, least, math.inf, gap))
        least = min(least, found[-1].cost)
    for k, family in enumerate(families):
        for tail in family.tails:
            own, limits = found[k], _allowed_range(subproblem, tail)
            known, best = min(proven.cost for proven in found), None
            if own.q is None:
                known, best = math.inf, _best_of_samples(subproblem, tail, limits, gap, _FEW)
            beyond = _proven(subproblem, tail, limits, best, known, known, gap - 1.1 * _BEYOND, _FEW)
            # Beyond the tail's own end nothing that counts changes by more than this.
            bound, cells = min(own.bound, beyond.bound * (1.0 - _BEYOND)), own.cells + beyond.cells
            within = own.q is not None and not beyond.cost < own.cost * (1.0 - _WORTH)
            found[k] = replace(own if within else beyond, bound=bound, cells=cells)
    return found


def _best_of_samples(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], gap: float, parts: int = _CELLS
) -> tuple[float, float] | None:
    """(q, cost) that closing in on the best of even samples gives, None where none is allowed."""
    if limits[0] > limits[1]:
        return None
    samples = np.linspace(*limits, _SAMPLES * parts // _CELLS)
    costs = _costs(subproblem, family, samples, _COARSE)
    top = int(np.argmin(costs))
    if not math.isfinite(costs[top]):
        return None
    return _refined(subproblem, family, samples[max(top - 1, 0) : top + 2], gap)


def _proven(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], best: tuple[float, float] | None,
    known: float, sought: float, gap: float, parts: int = _CELLS,
) -> Proven:  # fmt: skip
    """The best within limits of q, and a bound, from the best known in them and the cost ``known`` in all families.

    Where there is no best so far, only what costs less than ``sought`` by more than the gap is looked for, and the
    bound is no more than that.
    """
    low, high = limits
    if low > high:
        return Proven(None, math.nan, math.inf, math.inf, 0)
    edges = np.linspace(low, high, parts + 1)
    lows, highs, cells, bound, places = edges[:-1], edges[1:], 0, math.inf, {}
    for turn in range(_ROUNDS):
        least = sought if best is None else best[1]
        if best is None or not math.isfinite(sought):
            enough = max(min(known, least) * (1.0 - gap), least * (1.0 - max(gap, _OTHERS)))
        else:
            enough = least * (1.0 - max(gap, _LOOSE))
        ranges = RangeBounds(subproblem, family, lows, highs, enough, places)
        cells += lows.size
        bounds = _cost(ranges)
        alive = bounds < enough
        lows, highs, bounds, places = lows[alive], highs[alive], bounds[alive], ranges.parts(alive, _PARTS)
        if not lows.size:
            break
        if highs[0] - lows[0] < _NARROWEST or cells + _PARTS * lows.size > _MOST_CELLS:
            # What is this narrow and neither allowed nor excluded differs from what is excluded by rounding only.
            bound = min(bound, float(bounds.min())) if math.isfinite(least) else math.inf
            break
        if best is None or turn in (1, 2) or (turn > 0 and turn % 3 == 0):
            tried = 0.5 * (lows + highs)[np.argsort(bounds)[:_MOST_TRIALS]]
            width = float(highs[0] - lows[0])
            best = _refined_near(subproblem, family, limits, tried, width, least, gap) or best
        # Cut into equal parts: a few large rounds cost less than many small ones.
        edges = lows[:, None] + (highs - lows)[:, None] * np.linspace(0.0, 1.0, _PARTS + 1)
        edges[:, -1] = highs
        lows, highs = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    bound = min(bound, enough)
    if best is None:
        return Proven(None, math.nan, math.inf, bound, cells)
    return Proven(best[0], _scale(subproblem, family, best[0]), best[1], bound, cells)


def _only_member(subproblem: Subproblem, family: Family) -> Proven:
    """With speed, frequency and tool radius given there is one member at most."""
    q = family.margin_where(lambda members: members.end, subproblem.fixed_end)
    if q is None:
        return Proven(None, math.nan, math.inf, math.inf, 0)
    cost = float(_costs(subproblem, family, np.array([q]), _FINE)[0])
    if not math.isfinite(cost):
        return Proven(None, math.nan, math.inf, math.inf, 1)
    return Proven(q, _scale(subproblem, family, q), cost, cost, 1)


def _allowed_range(subproblem: Subproblem, family: Family) -> tuple[float, float]:
    """The range of q within the limits that are monotone in it: nu(pi) falls with q, and so does the crank per V."""
    low, high = family.range
    ends = family.members(np.array([low, high]))
    if subproblem.limits.transmission_angle is not None:
        least, greatest = subproblem.limits.transmission_angle
        if ends.transmission[1] > greatest or ends.transmission[0] < least:
            return math.inf, -math.inf
        low = _or(family.margin_of_transmission(greatest), low)
        high = _or(family.margin_of_transmission(least), high)
    if subproblem.fixed_scale is not None and subproblem.limits.min_link > 0:
        crank = subproblem.limits.min_link / subproblem.fixed_scale
        if ends.lengths[0, 0] < crank:
            return math.inf, -math.inf
        high = min(_or(family.margin_of_crank(crank), high), high)
    return low, high


def _or(found: float | None, otherwise: float) -> float:
    return otherwise if found is None else found


def _scale(subproblem: Subproblem, family: Family, q: float) -> float:
    low, high = MemberQuantities(subproblem, family, np.array([q]), _FINE).scale
    return float(high[0] if subproblem.objective.grows else low[0])


def _cost(quantities: Quantities) -> Array:
    low, high = quantities.scale
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.where(low <= high, quantities.subproblem.objective.cost(quantities), np.inf)


def _costs(subproblem: Subproblem, family: Family, q: Array, tolerance: float) -> Array:
    return _cost(MemberQuantities(subproblem, family, q, tolerance))


def _refined(subproblem: Subproblem, family: Family, bracket: Array, gap: float) -> tuple[float, float] | None:
    """Close in on the least cost within a bracket of rising places: (q, cost), None where none is allowed.

    Where all costs about the best place are known, the vertex of the parabola through them is tried and where lines
    through two places on either side meet, as at a corner of the cost. Where a limit cuts the range off, and where that
    has not helped, even places are.
    """
    q, costs, idle, even = bracket, _costs(subproblem, family, bracket, _FINE), 0, False
    for _ in range(_MOST_ROUNDS):
        k = int(np.argmin(costs))
        low, high, least = q[max(k - 1, 0)], q[min(k + 1, q.size - 1)], costs[k]
        if idle == 2 or high - low <= _SHARE * gap * max(1.0, abs(high)):
            break
        near = slice(max(k - 2, 0), k + 3)
        even = even or not np.all(np.isfinite(costs[near]))
        points = np.linspace(low, high, _POINTS)[1:-1] if even else _trials(q[near], costs[near], min(k, 2))
        q, places = np.unique(np.concatenate([q[near], points]), return_index=True)
        costs = np.concatenate([costs[near], _costs(subproblem, family, points, _FINE)])[places]
        idle = idle + 1 if not even and least - costs.min() <= _SHARE * gap * abs(least) else 0
        k = int(np.argmin(costs))
        even = q[min(k + 1, q.size - 1)] - q[max(k - 1, 0)] > _SLOW * (high - low)
    k = int(np.argmin(costs))
    return (float(q[k]), float(costs[k])) if math.isfinite(costs[k]) else None


def _trials(q: Array, costs: Array, k: int) -> Array:
    """Where a function may have its least value, by up to two places to either side of the best so far, the k-th."""
    low, here, high = q[max(k - 1, 0)], q[k], q[min(k + 1, q.size - 1)]
    width = high - low
    tried = [here]
    if low < here < high:
        left, right = (here - low) * (costs[k + 1] - costs[k]), (high - here) * (costs[k - 1] - costs[k])
        if left + right > 0.0:
            tried[0] = here + 0.5 * ((high - here) * right - (here - low) * left) / (left + right)
        for left, right in ((k - 2, k), (k - 1, k + 1)):
            # Lines through (left, left + 1) and (right, right + 1); the best place is on either of them.
            if left >= 0 and right + 1 < q.size:
                falling = (costs[left + 1] - costs[left]) / (q[left + 1] - q[left])
                rising = (costs[right + 1] - costs[right]) / (q[right + 1] - q[right])
                if rising > falling:
                    tried.append(
                        q[left] + (costs[right] - costs[left] - rising * (q[right] - q[left])) / (falling - rising)
                    )
    tried += [tried[0] - _ASIDE * width, tried[0] + _ASIDE * width, 0.5 * (low + here), 0.5 * (here + high)]
    return np.setdiff1d(np.clip(tried, low, high), q)


def _refined_near(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], points: Array, width: float, known: float,
    gap: float,
) -> tuple[float, float] | None:  # fmt: skip
    """What closing in on the best of the points gives, where it is better than the known cost by more than rounding."""
    costs = _costs(subproblem, family, points, _COARSE)
    k = int(np.argmin(costs))
    if not costs[k] < known * (1.0 - 1e-9):
        return None
    bracket = np.unique(np.clip([points[k] - width, points[k], points[k] + width], *limits))
    found = _refined(subproblem, family, bracket, gap)
    return found if found is not None and found[1] < known else None
