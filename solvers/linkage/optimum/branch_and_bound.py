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
_SAMPLES = 113
_CELLS = 84
_POINTS = 25
_PARTS = 6
_ROUNDS = 24
_MOST_CELLS = 160_000
_FEW, _LOOSE = 24, 1e-4
"""Cells of what lies beyond the range of designs, and the gap that is closed there where the best lies there."""
_BEYOND = 1e-8
_WORTH = 5e-3
"""What it must gain, relative, to leave the range of designs."""
_NARROWEST = 1e-11
_COARSE, _FINE = 1e-4, 1e-13
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

    Members beyond the range of designs are searched as well, up to where nothing changes any more, for what costs less
    than the best in any range. They lower the bound, and the best of them is a family's answer where the range holds
    none, or none that comes close to it.
    """
    if subproblem.fixed_end is not None:
        return [_only_member(subproblem, family) for family in families]
    found = [_within(subproblem, family, gap, math.inf, _CELLS) for family in families]
    for k, family in enumerate(families):
        for tail in family.tails:
            own = found[k]
            known = math.inf if own.q is None else min(proven.cost for proven in found)
            beyond = _within(subproblem, tail, gap - 1.1 * _BEYOND, known, _FEW)
            # Beyond the tail's own end nothing that counts changes by more than this.
            bound, cells = min(own.bound, beyond.bound * (1.0 - _BEYOND)), own.cells + beyond.cells
            within = own.q is not None and not beyond.cost < own.cost * (1.0 - _WORTH)
            found[k] = replace(own if within else beyond, bound=bound, cells=cells)
    return found


def _within(subproblem: Subproblem, family: Family, gap: float, known: float, parts: int) -> Proven:
    """The same within one family's range; where a cost is ``known``, only what costs less by more than the gap is
    sought, and the bound is no more than that."""
    low, high = _allowed_range(subproblem, family)
    if low > high:
        return Proven(None, math.nan, math.inf, math.inf, 0)
    best = None
    if not math.isfinite(known):
        samples = np.linspace(low, high, _SAMPLES * parts // _CELLS)
        best = _refined(subproblem, family, samples, _costs(subproblem, family, samples, _COARSE))
    edges = np.linspace(low, high, parts + 1)
    lows, highs, cells, bound = edges[:-1], edges[1:], 0, math.inf
    for turn in range(_ROUNDS):
        least = known if best is None else best[1]
        enough = least * (1.0 - (gap if best is None or math.isinf(known) else max(gap, _LOOSE)))
        ranges = RangeBounds(subproblem, family, lows, highs, enough)
        cells += lows.size
        bounds = _cost(ranges)
        alive = bounds < enough
        lows, highs, bounds = lows[alive], highs[alive], bounds[alive]
        if not lows.size:
            break
        if highs[0] - lows[0] < _NARROWEST or cells + _PARTS * lows.size > _MOST_CELLS:
            # What is this narrow and neither allowed nor excluded differs from what is excluded by rounding only.
            bound = min(bound, float(bounds.min())) if math.isfinite(least) else math.inf
            break
        if best is None or turn in (1, 2) or (turn > 0 and turn % 3 == 0):
            tried = 0.5 * (lows + highs)[np.argsort(bounds)[:_MOST_TRIALS]]
            better = _refined_near(subproblem, family, tried, float(highs[0] - lows[0]), least)
            best = better if better is not None else best
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


def _refined(subproblem: Subproblem, family: Family, samples: Array, costs: Array) -> tuple[float, float] | None:
    """Close in on the best of the samples: (q, cost), None where none is allowed."""
    top = int(np.argmin(costs))
    if not math.isfinite(costs[top]):
        return None
    last = samples.size - 1
    low, high, tolerance = samples[max(top - 1, 0)], samples[min(top + 1, last)], _COARSE
    q, cost = float(samples[top]), math.inf
    while high - low > 1e-13 * max(1.0, abs(high)):
        # The orientation's search need be no sharper than what the range can still gain.
        tolerance = max(_FINE, min(tolerance, 1e-2 * (high - low) ** 2))
        points = np.linspace(low, high, _POINTS)
        found = _costs(subproblem, family, points, tolerance)
        k = int(np.argmin(found))
        if found[k] <= cost * (1 + 2 * tolerance):
            q, cost = float(points[k]), float(found[k])
        else:
            k = int(np.argmin(np.abs(points - q)))
        narrower = points[max(k - 1, 0)], points[min(k + 1, _POINTS - 1)]
        if narrower[1] - narrower[0] >= high - low:
            break
        low, high = narrower
    return q, float(_costs(subproblem, family, np.array([q]), _FINE)[0])


def _refined_near(
    subproblem: Subproblem, family: Family, points: Array, width: float, known: float
) -> tuple[float, float] | None:
    """What closing in on the best of the points gives, where it is better than the known cost by more than rounding."""
    costs = _costs(subproblem, family, points, _COARSE)
    k = int(np.argmin(costs))
    if not costs[k] < known * (1.0 - 1e-9):
        return None
    bracket = np.array([points[k] - width, points[k], points[k] + width])
    bracket = np.clip(bracket, *_allowed_range(subproblem, family))
    found = _refined(subproblem, family, bracket, np.array([np.inf, costs[k], np.inf]))
    return found if found is not None and found[1] < known else None
