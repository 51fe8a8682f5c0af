"""Verdict on a pin or a bushing: design limits, wall, allowable stress in bending and shear, ring stress."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from solvers.numerics.arrays import Array
from solvers.outcome import Accuracy, EffectReport
from solvers.pin.result import PinCheck
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.scene import Limits, Scene
from solvers.verdict import Criterion, Sense, Verdict, at_least, at_most, doubt, left_out, slack_of, unknown

_ROUNDING = 4.0 * float(np.finfo(float).eps)
"""Rounding error of a difference of diameters or positions, relative to the greatest."""


def judge(
    check: PinCheck,
    scene: Scene,
    accuracy: Accuracy,
    limits: Limits,
    effects: Iterable[EffectReport] = (),
    designed: bool = False,
) -> Verdict:
    """Return the verdict on a pin or a bushing; ``designed`` if it was designed for these limits.

    Without ``max_ring_stress`` the ring's hoop stress is compared with the allowable stress. If the ovalization effect
    is inactive, the ring is not judged and a caution states this.
    """
    slack, material = slack_of(accuracy), scene.material
    unjudged = () if check.ring else ("the ring's hoop stress is not judged: the effect ovalization is left out",)
    with_deflection = () if limits.max_deflection is None else ("shear_deflection",)
    found = [_at_most("equivalent_stress", material.allowable_stress, check.equivalent_stress_max, slack, asked=False)]
    if material.allowable_shear is not None:
        found.append(_at_most("shear_stress", material.allowable_shear, check.shear_stress_max, slack, asked=False))
    wall = at_least("min_wall", limits.min_wall, check.least_wall, slack, limits.min_wall > 0.0)
    # Without a limit the wall must still be positive.
    found.append(wall if check.least_wall > 0.0 else wall._replace(reached=0.0, margin=-1.0, holds=False))
    found += _of_ring(check.ring, scene, limits, slack)
    if limits.max_deflection is not None:
        found.append(_at_most("max_deflection", limits.max_deflection, check.deflection, slack))
    if limits.max_slope is not None:
        along = check.along
        slope = steepest(along.x, along.bore, along.outer)
        found.append(at_most("max_slope", limits.max_slope, slope, slack))
    cautions = *check.warnings, *unjudged, *left_out(effects, with_deflection)
    return Verdict(tuple(found), cautions, doubt(accuracy, designed))


def _of_ring(ring: RingResult | None, scene: Scene, limits: Limits, slack: float) -> list[Criterion]:
    """Judge hoop stress and ovalization at the thinnest wall; a limit on what is not judged does not hold."""
    asked = limits.max_ring_stress is not None
    allowable = limits.max_ring_stress if asked else scene.material.allowable_stress
    if ring is None:
        limited = ("max_ring_stress", limits.max_ring_stress), ("max_ovalization", limits.max_ovalization)
        return [unknown(name, Sense.AT_MOST, limit) for name, limit in limited if limit is not None]
    loaded = scene.force > 0.0
    name, stress = "max_ring_stress" if asked else "ring_stress", ring.stress_max if loaded else 0.0
    found = [_at_most(name, allowable, stress, slack, asked)]
    if limits.max_ovalization is not None:
        grown = ring.ovalization_max if loaded else 0.0
        found.append(_at_most("max_ovalization", limits.max_ovalization, grown, slack))
    return found


def _at_most(name: str, required: float, reached: float | None, slack: float, asked: bool = True) -> Criterion:
    """As ``at_most``; None: infinite, since a loaded section has no wall."""
    return at_most(name, required, math.inf if reached is None else reached, slack, asked)


def steepest(x: Array, bore: Array, outer: Array) -> float:
    """Return the maximum slope of a diameter between positions, less what rounding adds; inf at a step."""
    run, rise, largest = np.diff(x), np.abs(np.diff([bore, outer])).max(axis=0), outer.max()
    # Between nearly coincident positions the difference is rounding, not slope.
    apart = run > 1e-9 * x[-1]
    if np.any(rise[~apart] > 1e-7 * largest):
        return math.inf
    certain = np.maximum(rise[apart] - _ROUNDING * largest, 0.0) / (run[apart] + _ROUNDING * x[-1])
    return float(np.max(certain, initial=0.0))
