"""Forms whose wall may change from station to station: free, drillable, with a limited slope; and the constant bore."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.conic import sloped
from solvers.pin.optimum.discretised import Program, bore_of
from solvers.pin.optimum.dual_bound import least_walls_bound, monotone_bound, pointwise_bound
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.lagrangian import Weighed, monotone_at, rising, weigh
from solvers.pin.optimum.slope_limit import gentle, missed_by_slope
from solvers.pin.section.flexibility import flexibility_values, product
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]
_PASSES = 40
_TIGHT, _AROUND, _TRIES, _GOLDEN = 1e-7, 0.2, 14, 0.5 * (math.sqrt(5.0) - 1.0)
"""Below which gap no better multiplier is looked for; where and how often otherwise."""


def missed_by_order(stations: Stations, lower: Array, anchor: int) -> Array:
    """What values that must not fall toward the middle miss between stations, per panel."""
    first = np.arange(lower.size) < anchor
    most = float(lower.max()) + 1.0
    missed = stations.overlooked(np.where(first, lower, most))
    if anchor < lower.size:
        missed = missed + stations.overlooked(np.where(first, most, lower), forward=False)
    return missed


def _missed(program: Program, drillable: bool) -> Array:
    """What the running extremes of a drillable or a gentle bore miss between stations, as volume."""
    missed, low = np.zeros(program.stations.left.size), program.lower
    if drillable:
        missed, low = missed_by_order(program.stations, low, program.anchor), rising(low, program.anchor)
    if program.limits.max_slope is not None:
        # u = 1 - (d/D)^2 changes by at most 2/D of what the bore changes.
        scale = 2.0 / program.scene.geometry.outer_diameter
        missed = missed + scale * missed_by_slope(program.stations, -bore_of(program, low), program.limits.max_slope)
    return missed


def _doubt(program: Program, weighed: Weighed, drillable: bool) -> Array:
    """Quadrature's doubt of the volume, that of the deflection included at its price."""
    doubt = program.stations.doubt(weighed.solidity) + _missed(program, drillable)
    if program.limit is not None and 0.0 < weighed.multiplier < math.inf:
        bend, shear = flexibility_values(weighed.solidity, program.law)
        density = product(program.bending, bend) + product(program.shear, shear)
        doubt = doubt + weighed.multiplier / program.limit * program.stations.doubt(density)
    return doubt


def _best_monotone_bound(program: Program, low: Array, multiplier: float, u: Array) -> float:
    """``monotone_bound`` at the answer's multiplier; where a jump to the solid section has kept that from being the
    best one, at others around it (golden section: the bound is concave in the multiplier)."""
    bound = monotone_bound(program, low, multiplier, u)
    if math.isinf(multiplier) or bound >= program.volume(u) * (1.0 - _TIGHT):
        return bound

    def at(factor: float) -> float:
        price = factor * multiplier
        return monotone_bound(program, low, price, monotone_at(program, low, price, u))

    left, right = 1.0 - _AROUND, 1.0 + _AROUND
    ahead, behind = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
    one, other = at(ahead), at(behind)
    for _ in range(_TRIES):
        bound = max(bound, one, other)
        if one > other:
            right, behind, other = behind, ahead, one
            ahead = right - _GOLDEN * (right - left)
            one = at(ahead)
        else:
            left, ahead, one = ahead, behind, other
            behind = left + _GOLDEN * (right - left)
            other = at(behind)
    return max(bound, one, other)


@dataclass(frozen=True)
class Free:
    """Any bore; ``drillable`` keeps it from widening toward the middle."""

    drillable: bool = False

    @property
    def name(self) -> str:
        return "drillable" if self.drillable else "free"

    def find(self, program: Program, gap: float) -> Found | None:
        low = rising(program.lower, program.anchor) if self.drillable else program.lower
        low = gentle(program, low)
        soft = program.limit is not None and program.deflection(low) > program.limit
        if soft and program.limits.max_slope is not None:
            return sloped(program, low, self.drillable, gap)
        weighed = weigh(program, low, self.drillable)
        if weighed is None:
            return None
        volume = program.volume(weighed.solidity)
        if weighed.multiplier == 0.0:
            bound, method = least_walls_bound(program, low), "every station's wall is the least that holds"
        else:
            lower_bound = _best_monotone_bound if self.drillable else pointwise_bound
            bound = lower_bound(program, low, weighed.multiplier, weighed.solidity)
            method = "Lagrangian dual, tangents at the answer"
        evidence = {
            "multiplier": weighed.multiplier if math.isfinite(weighed.multiplier) else "unbounded: only the solid span",
            "rounds": weighed.rounds,
        }
        return Found(
            weighed.solidity,
            volume,
            min(bound, volume),
            method,
            evidence,
            doubt=_doubt(program, weighed, self.drillable),
        )


FREE = Free()
