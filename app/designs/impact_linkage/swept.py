"""Outline of the area swept by the links: a level line of the distance to them over the cycle.

The links at many crank angles are line segments; with eyes of radius r they cover the points whose distance d to the
nearest segment is at most r. Consecutive positions overlap, so a single closed curve bounds them. It is traced by a
predictor step along d = r and Newton corrections, which are exact for a distance: p + (r - d) n, with n the direction
from the nearest point.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS, _MAX_STEPS = 300, 20_000
"""Steps across the extent of the area; maximum steps in total."""
_MIN_RADIUS = 0.02
"""Minimum tracing distance from the links, relative to the extent."""
_REFRESH_STEPS = 10
"""Steps after which the segments near the current position are selected again."""
_CORRECTIONS, _CLOSE = 8, 1e-4
"""Maximum Newton corrections (concave corners need several); tolerance relative to r."""


def segments_of(pins: Array, joints: Array, base: float) -> Array:
    """Line segments of the four links at n positions.

    ``pins`` and ``joints``: crank pins and rocker joints, shape (2, n). The crank's pivot is (0, 0), the rocker's
    (base, 0). Returns start and end points, shape (3 n + 1, 2, 2).
    """
    pivot, far = np.zeros_like(pins), np.stack([np.full(pins.shape[1], base), np.zeros(pins.shape[1])])
    bars = np.stack([np.stack(pair) for pair in ((pivot, pins), (pins, joints), (far, joints))])
    moving = np.moveaxis(bars, -1, 1).reshape(-1, 2, 2)
    return np.concatenate([moving, [[[0.0, 0.0], [base, 0.0]]]])


def outline(segments: Array, radius: float) -> Array | None:
    """Points, shape (m, 2), of the counterclockwise outline at distance ``radius`` around ``segments``, shape (n, 2,
    2); None if the curve does not close.

    Accurate to 1e-4 of the radius; around thin bars concave corners are cut off, so that the outline still contains all
    links.
    """
    ends = segments.reshape(-1, 2)
    extent = float(np.max(np.ptp(ends, axis=0) + 2.0 * radius))
    # Thin bars leave notches between positions: the curve is traced farther out and then offset inward.
    spare = max(_MIN_RADIUS * extent - radius, 0.0)
    step, radius = extent / _STEPS, radius + spare
    near = _Near(segments, _REFRESH_STEPS * step)
    place = first = ends[np.argmin(ends[:, 0])] - np.array([radius, 0.0])
    normal = np.array([-1.0, 0.0])
    walked = [place - spare * normal]
    for count in range(_MAX_STEPS):
        place = place + step * np.array([-normal[1], normal[0]])
        for _ in range(_CORRECTIONS):
            distance, normal = near.nearest(place)
            if abs(distance - radius) <= _CLOSE * radius:
                break
            place = place + (radius - distance) * normal
        if count > 2 and math.hypot(*(place - first)) < step:
            return np.array(walked)
        walked.append(place - spare * normal)
    return None


class _Near:
    """The segments that can be nearest to the tracing point within the next steps; all segments are examined again once
    it has moved farther.

    After a displacement of at most ``reach``, a segment that was farther away than the nearest by more than twice that
    cannot be the nearest (triangle inequality).
    """

    def __init__(self, segments: Array, reach: float) -> None:
        way = segments[:, 1] - segments[:, 0]
        square = np.maximum(np.einsum("ij,ij->i", way, way), np.finfo(float).tiny)
        self._all = self._few = (segments[:, 0], way, way / square[:, None])
        self._reach, self._chosen_at = reach, np.full(2, np.inf)

    def nearest(self, place: Array) -> tuple[float, Array]:
        """Distance to the nearest segment, and the unit direction away from it."""
        if not math.hypot(*(place - self._chosen_at)) <= self._reach:
            distances = np.sqrt(_off(place, *self._all)[1])
            there = distances <= distances.min() + 2.0 * self._reach
            self._few, self._chosen_at = tuple(part[there] for part in self._all), place
        off, squares = _off(place, *self._few)
        least = int(squares.argmin())
        distance = math.sqrt(squares[least])
        return distance, off[least] / distance


def _off(place: Array, start: Array, way: Array, unit: Array) -> tuple[Array, Array]:
    """From the nearest point of every segment to a place, (n, 2), and the squares of their lengths; ``unit`` is each
    segment's vector divided by its squared length."""
    off = place - start
    share = np.einsum("ij,ij->i", off, unit)
    off -= np.minimum(np.maximum(share, 0.0), 1.0)[:, None] * way
    return off, np.einsum("ij,ij->i", off, off)
