"""The section at which the severity of a smooth peak along the strip is greatest.

The error of a maximised peak value is quadratic in that of the section, but amplitude and mean vary linearly with the
section. The derivative of a polynomial through seven sections avoids this loss.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.cycle.section import MAXIMUM, MINIMUM, Field, RingingShape, extremes_at

_EPS = float(np.finfo(float).eps)
_STEPS = np.arange(-3.0, 4.0)
_POWERS = np.vander(_STEPS, 5, increasing=True)
_QUARTIC = np.ascontiguousarray(np.linalg.pinv(_POWERS))
"""The sections in units of their spacing, and the matrices from coefficients of a quartic to its values and back."""
_MAX_SPACING, _MIN_SPACING = 2e-3, 1e-6
"""Spacing of the sections over the strip's length."""
_NEWTON_STEPS = 20


class Severities(NamedTuple):
    """Severities of a sampled revolution, to a relative ``tolerance``: by ``lines`` and ``parabola`` of a diagram.
    ``work`` and ``extremes`` are the arrays that ``section.extremes_at`` fills."""

    field: Field
    ringing: RingingShape | None
    lines: Array
    parabola: Array
    tolerance: float
    work: Array
    extremes: Array


@kernel
def severity_at(s: Severities, layer: int, z: float, share: float) -> float:
    """The severity of a layer at a section, from extremes to a ``share`` of the tolerance, which ``extremes`` holds
    then."""
    extremes_at(s.field, s.ringing, z, layer, layer + 1, share * s.tolerance, s.work, s.extremes)
    return utilisation_of(s.extremes[layer, MAXIMUM], s.extremes[layer, MINIMUM], s.lines, s.parabola)


@kernel
def peak_section(s: Severities, layer: int, section: float) -> tuple[float, float]:
    """The section [m] of a smooth peak near one, and its uncertainty. If the polynomial misfits its own points the peak
    is a kink, and closer sections are tried."""
    length, values = s.field.strip.length, np.empty(_STEPS.size)
    width = min(_MAX_SPACING * length, section / 3.0, (length - section) / 3.0)
    while width > _MIN_SPACING * length:
        greatest_value = 0.0
        for k in range(values.size):
            values[k] = severity_at(s, layer, section + width * _STEPS[k], 1e-4)
            greatest_value = max(greatest_value, values[k])
        # Subtract the middle value, which would otherwise dominate the rounding errors of the fit.
        middle, misfit = values[3], 0.0
        for k in range(values.size):
            values[k] = (values[k] - middle) / greatest_value
        series = np.zeros(5)
        for m in range(5):
            for k in range(values.size):
                series[m] += _QUARTIC[m, k] * values[k]
        for k in range(values.size):
            total = -values[k]
            for m in range(5):
                total += _POWERS[k, m] * series[m]
            misfit += total * total
        misfit = math.sqrt(misfit)
        root, curvature = _stationary_point(series), abs(series[2])
        if abs(root) <= 3.0 and curvature > 0.0 and misfit <= 1e-4 * curvature:
            return section + width * root, width * (misfit + 4.0 * _EPS) / curvature
        width /= 4.0
    return section, max(width, 0.0)


@kernel
def _stationary_point(series: Array) -> float:
    """Stationary point of a polynomial of degree four, relative to the middle of seven points, by Newton's method;
    inf if none."""
    a, b, c, d = series[1], series[2], series[3], series[4]
    x = 0.0
    for _ in range(_NEWTON_STEPS):
        curvature = 2.0 * b + x * (6.0 * c + x * 12.0 * d)
        if curvature == 0.0:
            return np.inf
        step = (a + x * (2.0 * b + x * (3.0 * c + x * 4.0 * d))) / curvature
        x -= step
        if not abs(x) <= 3.0:
            return np.inf
        if abs(step) <= 4.0 * _EPS:
            break
    return x
