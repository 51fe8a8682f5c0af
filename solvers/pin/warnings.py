"""Warnings of a check: strength, wall, deflection, ovalization and hoop stress beyond their limits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.pin.limits import Limits
from solvers.pin.optimum.sought import Sought
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.scene import Scene

Array = NDArray[np.float64]


def where_over(x: Array, use: Array) -> Array | None:
    """First and last position [m] at which a utilisation at stations exceeds 1, linear in between; None: nowhere."""
    if not (use > 1.0 + 1e-9).any():
        return None
    over = np.flatnonzero(use > 1.0 + 1e-9)
    ends = []
    for inner, outer in ((over[0], over[0] - 1), (over[-1], over[-1] + 1)):
        place = float(x[inner])
        if 0 <= outer < x.size and math.isfinite(use[inner]):
            place += float((x[outer] - x[inner]) * (use[inner] - 1.0) / (use[inner] - use[outer]))
        ends.append(place)
    return np.array(ends)


def exceeded(scene: Scene, x: Array, use: float) -> str:
    """Describe where [m] and by how much the strength is exceeded."""
    by = f"by {100.0 * (use - 1.0):.2g} %" if math.isfinite(use) else "where there is no wall"
    return f"the strength is exceeded {_place(scene, x)}, {by}"


def shape_warnings(limits: Limits, least: float, deflection: float) -> list[str]:
    """Return warnings for a minimum wall [m] and a deflection [m] beyond their limits."""
    messages = []
    if least < limits.min_wall * (1.0 - 1e-9):
        messages.append(f"the wall is {least * 1e3:.4g} mm at its thinnest, not the {limits.min_wall * 1e3:.4g} asked")
    if limits.max_deflection is not None and deflection > limits.max_deflection * (1.0 + 1e-9):
        messages.append(f"the deflection of {deflection * 1e6:.4g} um exceeds its limit")
    return messages


def _place(scene: Scene, x: Array) -> str:
    """Describe the range of positions [m] in the whole part; those of a symmetric one lie in its first half."""
    length = scene.geometry.length
    if scene.symmetric and x.max() >= 0.5 * length * (1.0 - 1e-9):
        return _span(np.array([x.min(), length - x.min()]))
    return f"{_span(x)} (and mirrored)" if scene.symmetric else _span(x)


def _span(x: Array) -> str:
    """Describe the range of positions [m]."""
    first, last = f"{x.min() * 1e3:.4g}", f"{x.max() * 1e3:.4g}"
    return f"at {first} mm" if first == last else f"between {first} and {last} mm"


def ring_warnings(scene: Scene, sought: Sought, limits: Limits, x: Array, walls: Array, found: RingResult) -> list[str]:
    """Return warnings for ring failure, which the beam model does not cover; walls at positions x [m]."""
    messages: list[str] = []
    if scene.force == 0.0:
        return messages
    if limits.max_ovalization is not None and (
        found.ovalization_max is None or found.ovalization_max > limits.max_ovalization * (1.0 + 1e-9)
    ):
        messages.append("the ovalization exceeds its limit")
    allowable = scene.material.allowable_stress if limits.max_ring_stress is None else limits.max_ring_stress
    if found.stress_max is None or found.stress_max > allowable * (1.0 + 1e-9):
        thin, where = sought.over_ring_stress(scene, allowable, walls)
        if thin.any():
            place = _place(scene, x[thin])
            messages.append(f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where {where}, {place}")
    return messages
