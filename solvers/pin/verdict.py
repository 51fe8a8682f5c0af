"""Verdict on a pin or a bushing: design limits, wall, allowable stress in bending and shear, ring stress."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from solvers.numerics.arrays import Array
from solvers.outcome import Accuracy, EffectReport
from solvers.pin.result import PinCheck
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.scene import Limits, PinMaterial, Scene
from solvers.verdict import Criterion, Sense, Verdict, at_least, at_most, doubt, left_out, slack_of, unknown


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
    slack = slack_of(accuracy)
    unjudged = () if check.ring else ("the ring's hoop stress is not judged: the effect ovalization is left out",)
    with_deflection = () if limits.max_deflection is None else ("shear_deflection",)
    slope = None
    if limits.max_slope is not None:
        along = check.along
        slope = max(steepest(along.x, along.bore), steepest(along.x, along.outer))
    return Verdict(
        (
            *_of_stresses(check.equivalent_stress_max, check.shear_stress_max, scene.material, slack),
            _of_wall(check.least_wall, limits, slack),
            *_of_ring(check.ring, scene.force, scene.material, limits, slack),
            *_of_shape(check.deflection, slope, limits, slack),
        ),
        (*check.warnings, *unjudged, *left_out(effects, with_deflection)),
        doubt(accuracy, designed),
    )


def _of_stresses(
    equivalent: float | None, shear: float | None, material: PinMaterial, slack: float
) -> tuple[Criterion, ...]:
    """Compare the maximum stresses [Pa] with their allowable values; None: there is no wall."""
    found = [at_most("equivalent_stress", material.allowable_stress, _bounded(equivalent), slack, asked=False)]
    if material.allowable_shear is not None:
        found.append(at_most("shear_stress", material.allowable_shear, _bounded(shear), slack, asked=False))
    return tuple(found)


def _of_ring(
    ring: RingResult | None, force: float, material: PinMaterial, limits: Limits, slack: float
) -> tuple[Criterion, ...]:
    """Judge hoop stress and ovalization at the thinnest wall."""
    asked = limits.max_ring_stress is not None
    required = limits.max_ring_stress if asked else material.allowable_stress
    name, found = "max_ring_stress" if asked else "ring_stress", []
    if ring is not None:
        found.append(at_most(name, required, _bounded(ring.stress_max) if force > 0.0 else 0.0, slack, asked))
    elif asked:
        found.append(unknown(name, Sense.AT_MOST, required))
    if limits.max_ovalization is not None and ring is not None:
        grown = _bounded(ring.ovalization_max) if force > 0.0 else 0.0
        found.append(at_most("max_ovalization", limits.max_ovalization, grown, slack))
    elif limits.max_ovalization is not None:
        found.append(unknown("max_ovalization", Sense.AT_MOST, limits.max_ovalization))
    return tuple(found)


def _of_wall(wall: float, limits: Limits, slack: float) -> Criterion:
    """Judge the minimum wall; without a limit it must still be positive."""
    asked = limits.min_wall > 0.0
    if wall > 0.0:
        return at_least("min_wall", limits.min_wall, wall, slack, asked)
    return Criterion("min_wall", Sense.AT_LEAST, limits.min_wall, 0.0, -1.0, False, asked)


def _of_shape(deflection: float | None, slope: float | None, limits: Limits, slack: float) -> tuple[Criterion, ...]:
    """Judge deflection [m] (None: a loaded section has no wall) and slope against their limits."""
    found = []
    if limits.max_deflection is not None:
        found.append(at_most("max_deflection", limits.max_deflection, _bounded(deflection), slack))
    if limits.max_slope is not None:
        found.append(at_most("max_slope", limits.max_slope, slope, slack))
    return tuple(found)


def steepest(x: Array, diameter: Array) -> float:
    """Return the maximum slope of a diameter between positions; inf at a step."""
    run, rise = np.diff(x), np.abs(np.diff(diameter))
    # Between nearly coincident positions the difference is rounding, not slope.
    apart = run > 1e-9 * x[-1]
    if np.any(rise[~apart] > 1e-7 * diameter.max()):
        return math.inf
    return float(np.max(rise[apart] / run[apart], initial=0.0))


def _bounded(value: float | None) -> float:
    return math.inf if value is None else value
