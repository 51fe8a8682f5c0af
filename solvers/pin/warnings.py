"""Warnings of a check: strength, wall, deflection, ovalization and hoop stress beyond their limits."""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.limits import Limits
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.ring.along_the_part import RingResult
from solvers.pin.scene import Scene
from solvers.verdict import per_cent

_SLACK = 1e-9
"""Relative excess up to which a violation is not reported."""


def where_over(x: Array, utilisations: Array, greatest: float) -> tuple[float, float] | None:
    """Return the first and last position [m] at which the larger of the utilisations (2, n), interpolated linearly
    between stations, exceeds 1; None: nowhere. Their maximum is ``greatest``."""
    if greatest <= 1.0 + _SLACK:
        return None
    utilisation, ends = utilisations.max(axis=0), []
    over = np.flatnonzero(utilisation > 1.0 + _SLACK)
    for inner, outer in ((over[0], over[0] - 1), (over[-1], over[-1] + 1)):
        place = float(x[inner])
        if 0 <= outer < x.size and math.isfinite(utilisation[inner]):
            place += float(
                (x[outer] - x[inner]) * (utilisation[inner] - 1.0) / (utilisation[inner] - utilisation[outer])
            )
        ends.append(place)
    return ends[0], ends[1]


def warnings_of(
    scene: Scene, limits: Limits, over: tuple[float, float] | None, utilisation: float, x: Array, walls: Array,
    least_wall: float, deflection: float, ring: RingResult | None,
) -> tuple[str, ...]:  # fmt: skip
    """Return one message per violated limit: its kind, location and amount.

    ``over``: first and last position [m] at which the ``utilisation`` exceeds 1, its maximum being given; ``walls`` at
    positions x [m], their minimum ``least_wall`` [m] and the ``deflection`` [m] as in the check; ``ring``: None if it
    is not judged.
    """
    messages, variable = [], design_variable_of(scene)
    if over is not None:
        by = f"by {per_cent(utilisation - 1.0)} %" if math.isfinite(utilisation) else "where there is no wall"
        messages.append(f"the strength is exceeded {_place(scene, *over)}, {by}")
    if least_wall < limits.min_wall * (1.0 - _SLACK):
        messages.append(
            f"the wall is {least_wall * 1e3:.4g} mm at its thinnest, not the {limits.min_wall * 1e3:.4g} mm asked"
        )
    if limits.max_deflection is not None and deflection > limits.max_deflection * (1.0 + _SLACK):
        messages.append(f"the deflection of {deflection * 1e6:.4g} µm exceeds its limit")
    if ring is None or scene.force == 0.0:
        return tuple(messages)
    # The beam model does not cover the ring.
    if limits.max_ovalization is not None and not _within(ring.ovalization_max, limits.max_ovalization):
        messages.append("the ovalization exceeds its limit")
    allowable = scene.material.allowable_stress if limits.max_ring_stress is None else limits.max_ring_stress
    if not _within(ring.stress_max, allowable):
        thin, where = variable.over_ring_stress(scene, allowable, walls)
        if thin.any():
            place = _place(scene, *x[np.flatnonzero(thin)[[0, -1]]])
            messages.append(f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where {where}, {place}")
    return tuple(messages)


def _within(value: float | None, limit: float) -> bool:
    """Return whether a result does not exceed a limit; None represents infinity."""
    return value is not None and value <= limit * (1.0 + _SLACK)


def _place(scene: Scene, first: float, last: float) -> str:
    """Describe a range of positions [m] in the whole part; those of a symmetric one lie in its first half."""
    length = scene.geometry.length
    if scene.symmetric and last >= 0.5 * length * (1.0 - 1e-9):
        return _span(first, length - first)
    return f"{_span(first, last)} (and mirrored)" if scene.symmetric else _span(first, last)


def _span(first: float, last: float) -> str:
    """Describe a range of positions [m]."""
    first_mm, last_mm = f"{first * 1e3:.4g}", f"{last * 1e3:.4g}"
    return f"at {first_mm} mm" if first_mm == last_mm else f"between {first_mm} and {last_mm} mm"
