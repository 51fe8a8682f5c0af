"""Forms whose wall may change from station to station: free, drillable, with a limited slope; and the constant bore."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.pin.certificate import least_walls_bound, monotone_bound, pointwise_bound
from solvers.pin.flexibility import flexibility_values, product
from solvers.pin.form import Found
from solvers.pin.interior_point import sloped
from solvers.pin.peaks import risen
from solvers.pin.program import Program, assemble, bore_of, folded, refined, walls_of
from solvers.pin.section import wall_of
from solvers.pin.separable import Weighed, monotone_at, rising, weigh
from solvers.pin.slope import gentle, missed_by_slope
from solvers.pin.stations import Stations

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


@dataclass(frozen=True)
class Constant:
    """One bore all along."""

    name: str = "constant"

    def find(self, program: Program, gap: float) -> Found | None:
        weighed = weigh(segments(program, np.array([program.lower.max()]), [slice(None)]), None, False)
        if weighed is None:
            return None
        u = float(weighed.solidity[0])
        bound = least_walls_bound(program, np.full_like(program.lower, program.lower.max()))
        if weighed.multiplier != 0.0:
            # One unknown: a bore wider by 1e-12 breaks the deflection limit.
            bound = u * (1.0 - 1e-12)
        wall = wall_of(u) if weighed.multiplier != 0.0 else walls_of(program, program.lower).max()
        length, bore = program.scene.geometry.length, program.scene.geometry.outer_diameter * float(1.0 - wall)
        return Found(
            np.full_like(program.lower, u), u, min(bound, u), "one unknown", {"rounds": weighed.rounds},
            corners=((0.0, bore), (length, bore)),
            doubt=risen(program.stations, program.lower[None]) * (u if weighed.multiplier == 0.0 else 0.0),
        )  # fmt: skip


def lightest_constant(program: Program, accuracy: float) -> Found | None:
    """The lightest pin of one bore, on the program's panels and halves of those that may hold its weakest section
    between stations; None where even the solid pin is too weak or too soft."""
    found = None
    for _ in range(_PASSES):
        found = None if np.isnan(program.lower).any() else Constant().find(program, accuracy)
        between = None if found is None else found.doubt > 0.1 * accuracy * found.volume
        if between is None or not between.any():
            break
        stations = refined(program, between)
        program = assemble(program.scene, program.limits, program.criterion, program.physics, stations, program.law)
    return found


def segments(program: Program, low: Array, parts: list[slice]) -> Program:
    """The program in which every part of the stations has one u: its least values, shares and mean coefficients."""
    half = folded(program)
    share = np.array([half.share[part].sum() for part in parts])
    mean = [
        [float(half.share[p] @ c[p]) / w for p, w in zip(parts, share, strict=True)] for c in (half.bending, half.shear)
    ]
    edges = np.concatenate([[0.0], np.cumsum(share)])
    reduced = Lumped(edges[:-1], edges[1:], share)
    return replace(
        half, stations=reduced, lower=low, bending=np.array(mean[0]), shear=np.array(mean[1]), anchor=share.size
    )


@dataclass(frozen=True)
class Lumped(Stations):
    """Stations that stand for whole parts of the pin: only their shares mean anything."""

    weights: Array

    @property
    def share(self) -> Array:  # type: ignore[override]
        return self.weights
