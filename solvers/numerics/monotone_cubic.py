"""Monotone cubic interpolation: no overshoot, continuously differentiable.

Interior slopes are weighted harmonic means of the neighbouring chords' slopes; end slopes are three-point formulas
limited so as to preserve the shape of the data. Source: F. N. Fritsch and J. Butland, A method for constructing local
monotone piecewise cubic interpolants, 1984.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def monotone_cubics(x: Array, y: Array) -> Array:
    """Cubic coefficients between increasing ``x`` (n >= 2), highest power of the distance from the left end first;
    shape (n - 1, 4)."""
    n = x.size
    slope, out = np.empty(n), np.empty((n - 1, 4))
    if n == 2:
        slope[0] = slope[1] = (y[1] - y[0]) / (x[1] - x[0])
    else:
        for i in range(1, n - 1):
            width_before, width_after = x[i] - x[i - 1], x[i + 1] - x[i]
            chord_before, chord_after = (y[i] - y[i - 1]) / width_before, (y[i + 1] - y[i]) / width_after
            slope[i] = 0.0
            if chord_before * chord_after > 0.0:
                weight_before, weight_after = 2.0 * width_after + width_before, width_after + 2.0 * width_before
                slope[i] = (weight_before + weight_after) / (weight_before / chord_before + weight_after / chord_after)
        slope[0] = _end_slope(x[1] - x[0], x[2] - x[1], y[1] - y[0], y[2] - y[1])
        slope[n - 1] = _end_slope(x[n - 1] - x[n - 2], x[n - 2] - x[n - 3], y[n - 1] - y[n - 2], y[n - 2] - y[n - 3])
    for i in range(n - 1):
        width = x[i + 1] - x[i]
        chord = (y[i + 1] - y[i]) / width
        curvature = (slope[i] + slope[i + 1] - 2.0 * chord) / width
        out[i, 0], out[i, 1] = curvature / width, (chord - slope[i]) / width - curvature
        out[i, 2], out[i, 3] = slope[i], y[i]
    return out


@kernel
def _end_slope(near: float, far: float, near_rise: float, far_rise: float) -> float:
    """Slope at the end of an interval of width ``near``, next to one of width ``far``."""
    near_chord, far_chord = near_rise / near, far_rise / far
    slope = ((2.0 * near + far) * near_chord - near * far_chord) / (near + far)
    if slope * near_chord <= 0.0:
        return 0.0
    if near_chord * far_chord <= 0.0 and abs(slope) > 3.0 * abs(near_chord):
        return 3.0 * near_chord
    return slope
