"""Warnings of a check: strength, wall, deflection, ovalization and hoop stress beyond their limits, and deformations
beyond the theory."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.result import PinCheck
from solvers.pin.scene import Limits, Scene
from solvers.pin.section.strength import SLACK
from solvers.verdict import per_cent

_SMALL = 0.1
"""Deflection over length, and ovalization over diameter, up to which the linear theory of beams and rings is used."""


def warnings_of(
    check: PinCheck,
    scene: Scene,
    limits: Limits,
    over: Callable[[], tuple[float, float] | None],
    x: Array,
    walls: Array,
) -> tuple[str, ...]:
    """Return one message per violated limit: its kind, location and amount.

    ``over`` finds the first and last position [m] at which the utilisation exceeds 1; ``walls`` at positions x [m].
    """
    messages, utilisation, ring = [], check.strength_utilisation, check.ring
    place = None if _within(utilisation, 1.0) else over()
    if place is not None:
        by = "where there is no wall" if utilisation is None else f"by {per_cent(utilisation - 1.0)} %"
        messages.append(f"the strength is exceeded {_place(scene, *place)}, {by}")
    if check.least_wall < limits.min_wall * (1.0 - SLACK):
        wall, least = check.least_wall * 1e3, limits.min_wall * 1e3
        messages.append(f"the wall is {wall:.4g} mm at its thinnest, not the {least:.4g} mm asked")
    if limits.max_deflection is not None and not _within(check.deflection, limits.max_deflection):
        deflection = math.inf if check.deflection is None else check.deflection * 1e6
        messages.append(f"the deflection of {deflection:.4g} µm exceeds its limit")
    growth = 0.0 if ring is None else ring.ovalization
    if (check.deflection or 0.0) > _SMALL * scene.geometry.length or growth > _SMALL * check.max_outer:
        messages.append("the deformation exceeds a tenth of length or diameter: beyond the small-deformation theory")
    if ring is None or scene.force == 0.0:
        return tuple(messages)
    # The beam model does not cover the ring.
    if limits.max_ovalization is not None and not _within(ring.ovalization_max, limits.max_ovalization):
        messages.append("the ovalization exceeds its limit")
    allowable = scene.material.allowable_stress if limits.max_ring_stress is None else limits.max_ring_stress
    if not _within(ring.stress_max, allowable):
        thin, where = design_variable_of(scene).over_ring_stress(scene, allowable, walls)
        if thin.any():
            place = _place(scene, *x[np.flatnonzero(thin)[[0, -1]]])
            messages.append(f"the ring's hoop stress exceeds {allowable * 1e-6:.4g} MPa where {where}, {place}")
    return tuple(messages)


def _within(value: float | None, limit: float) -> bool:
    """Return whether a result does not exceed a limit; None represents infinity."""
    return value is not None and value <= limit * (1.0 + SLACK)


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
