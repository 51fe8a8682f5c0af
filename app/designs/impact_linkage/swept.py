"""Outline of the area swept by the links: a level line of the distance to them over the cycle.

The links at many crank angles are line segments; with eyes of radius r they cover the points whose distance d to the
nearest segment is at most r. Consecutive positions overlap, so a single closed curve bounds them. It is traced by a
predictor step along d = r and Newton corrections, which are exact for a distance: p + (r - d) n, with n the direction
from the nearest point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS, _MAX_STEPS = 400, 20_000
"""Steps across the extent of the area; maximum steps in total."""
_MIN_RADIUS = 0.02
"""Minimum tracing distance from the links, relative to the extent."""
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


def outline(segments: Array, radius: float) -> Array:
    """Points, shape (m, 2), of the counterclockwise outline at distance ``radius`` around ``segments``, shape (n, 2,
    2).

    Accurate to 1e-4 of the radius; around thin bars concave corners are cut off, so that the outline still contains all
    links. Raises RuntimeError if the curve does not close.
    """
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    square = np.maximum(np.sum(way * way, axis=1), np.finfo(float).tiny)

    def from_nearest(place: Array) -> tuple[float, Array]:
        off = place - start
        off = off - np.clip(np.sum(off * way, axis=1) / square, 0.0, 1.0)[:, None] * way
        squares = np.sum(off * off, axis=1)
        nearest = int(np.argmin(squares))
        distance = float(np.sqrt(squares[nearest]))
        return distance, off[nearest] / distance

    ends = segments.reshape(-1, 2)
    extent = float(np.max(np.ptp(ends, axis=0) + 2.0 * radius))
    # Thin bars leave notches between positions: the curve is traced farther out and then offset inward.
    spare = max(_MIN_RADIUS * extent - radius, 0.0)
    step, radius = extent / _STEPS, radius + spare
    place = first = ends[np.argmin(ends[:, 0])] - np.array([radius, 0.0])
    normal = np.array([-1.0, 0.0])
    walked = [place - spare * normal]
    for count in range(_MAX_STEPS):
        place = place + step * np.array([-normal[1], normal[0]])
        for _ in range(_CORRECTIONS):
            distance, normal = from_nearest(place)
            if abs(distance - radius) <= _CLOSE * radius:
                break
            place = place + (radius - distance) * normal
        if count > 2 and np.hypot(*(place - first)) < step:
            return np.array(walked)
        walked.append(place - spare * normal)
    raise RuntimeError("the outline of the swept area does not close")
