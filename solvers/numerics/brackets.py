"""One-dimensional maximisation by brackets that shrink around parabolas.

A bracket holds points a <= c <= b with f(c) the largest known value. An iteration evaluates five points
(``trial_points``): the parabola's vertex with a near neighbour on either side, and the midpoints of both halves. The
best point and its neighbours form the next bracket (``shrink_bracket``), which is at most half as wide and, for smooth
functions, twenty-five times narrower.

The remaining gain is bounded by concavity: no extended chord between known points lies below the function. At
an end of the range (a = c or c = b) the chord through the two nearest interior points is used. If the second
differences of the parabolas through the five nearest points agree, the function is smooth there, and the gain predicted
by the middle one is a much sharper estimate; if not, as at a kink, the chord bound is used.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_NEIGHBOUR_DISTANCE = 0.02
_MAX_CURVATURE_RATIO = 2.0
"""Maximum ratio of neighbouring parabolas' curvatures for a function to count as smooth."""
_GAIN_SAFETY = 8.0
"""Safety factor on the gain predicted by a parabola."""
_SLOPE_SAFETY = 2.0
"""Safety factor on the cubic correction of the slope."""
MAX_ITERATIONS = 60
_EPS = np.finfo(float).eps


@kernel
def trial_points(place: Array, value: Array, out: Array) -> None:
    """The five trial points of a bracket, given its points and values of shape (3,)."""
    a, c, b = place
    fa, fc, fb = value
    left, right = (c - a) * (fc - fb), (b - c) * (fc - fa)
    vertex = c
    if left + right > 0.0:
        vertex = c + 0.5 * ((b - c) * right - (c - a) * left) / (left + right)
    vertex = min(max(vertex, a), b)
    offset = _NEIGHBOUR_DISTANCE * (b - a)
    out[0], out[1], out[2] = max(vertex - offset, a), vertex, min(vertex + offset, b)
    out[3], out[4] = 0.5 * (a + c), 0.5 * (c + b)


@kernel
def shrink_bracket(place: Array, value: Array, points: Array, heights: Array) -> float:
    """Replace a bracket by the best point and its nearest distinct neighbours; returns a bound of how much the maximum
    exceeds the best value."""
    x = (place[0], place[1], place[2], points[0], points[1], points[2], points[3], points[4])
    f = (value[0], value[1], value[2], heights[0], heights[1], heights[2], heights[3], heights[4])
    best = 0
    for m in range(1, 8):
        if f[m] > f[best]:
            best = m
    c, fc = x[best], f[best]
    # The two nearest points on either side: the neighbour, and the next one, for the chord at an end of the range.
    a, fa, a2, fa2 = -np.inf, 0.0, -np.inf, 0.0
    b, fb, b2, fb2 = np.inf, 0.0, np.inf, 0.0
    for m in range(8):
        if x[m] < c:
            if x[m] > a:
                a2, fa2, a, fa = a, fa, x[m], f[m]
            elif a > x[m] > a2:
                a2, fa2 = x[m], f[m]
        elif x[m] > c:
            if x[m] < b:
                b2, fb2, b, fb = b, fb, x[m], f[m]
            elif b < x[m] < b2:
                b2, fb2 = x[m], f[m]
    first, last = a == -np.inf, b == np.inf
    gain_bound = 0.0
    if first and last:
        a, fa, b, fb = c, fc, c, fc
    elif first:
        gain_bound = np.inf if b2 == np.inf else fb + (fb - fb2) * (b - c) / (b2 - b) - fc
        a, fa = c, fc
    elif last:
        gain_bound = np.inf if a2 == -np.inf else fa + (fa - fa2) * (c - a) / (a - a2) - fc
        b, fb = c, fc
    else:
        gain_bound = max((fc - fa) * (b - c) / (c - a), (fc - fb) * (c - a) / (b - c))
        if a2 != -np.inf and b2 != np.inf:
            curvature = _divided_difference(a, fa, c, fc, b, fb)
            before, after = _divided_difference(a2, fa2, a, fa, c, fc), _divided_difference(c, fc, b, fb, b2, fb2)
            if (
                curvature < 0.0
                and curvature * _MAX_CURVATURE_RATIO <= min(before, after)
                and max(before, after) * _MAX_CURVATURE_RATIO <= curvature
            ):
                # the parabola's slope at c, a weighted mean of the chords' slopes
                slope = abs((fc - fa) / (c - a) * (b - c) + (fb - fc) / (b - c) * (c - a)) / (b - a)
                # the change of curvature measures its error, also for a slope that cancels
                change = max(abs(curvature - before) / (b - a2), abs(after - curvature) / (b2 - a))
                slope += _SLOPE_SAFETY * change * (c - a) * (b - c)
                gain_bound = min(gain_bound, _GAIN_SAFETY * slope * slope / (-4.0 * curvature))
    place[0], place[1], place[2] = a, c, b
    value[0], value[1], value[2] = fa, fc, fb
    return max(gain_bound, 0.0)


@kernel
def _divided_difference(a: float, fa: float, c: float, fc: float, b: float, fb: float) -> float:
    """Second divided difference: half the second derivative of the parabola through three points."""
    return ((fb - fc) / (b - c) - (fc - fa) / (c - a)) / (b - a)
