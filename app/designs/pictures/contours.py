"""Superlevel sets and zero contours of a function on a grid, linear within the cells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_DIGITS = 9
Points = tuple[list[float], list[float]]
"""x and y of a polygon or polyline"""


def inside(x: Array, y: Array, values: Array) -> Iterator[Points]:
    """Polygons, one per cell, of the region where ``values`` at points (x, y) is nonnegative. All three have the shape
    of the grid, which may be curvilinear."""
    for corners in _cells(x, y, values):
        found = []
        for (px, py, pv), (qx, qy, qv) in zip(corners, corners[1:] + corners[:1], strict=True):
            if pv >= 0.0:
                found.append((px, py))
            if (pv >= 0.0) != (qv >= 0.0):
                t = pv / (pv - qv)
                found.append((px + t * (qx - px), py + t * (qy - py)))
        if found:
            yield [point[0] for point in found], [point[1] for point in found]


def level_lines(x: Array, y: Array, values: Array) -> list[Points]:
    """Zero contours of ``values``, joined into polylines; cells with NaN are skipped."""
    pieces = []
    for corners in _cells(x, y, values):
        found = []
        for (px, py, pv), (qx, qy, qv) in zip(corners, corners[1:] + corners[:1], strict=True):
            if (pv >= 0.0) != (qv >= 0.0):
                t = pv / (pv - qv)
                # rounded so that neighbouring cells yield the same point
                found.append((round(px + t * (qx - px), _DIGITS), round(py + t * (qy - py), _DIGITS)))
        both = [(found[n], found[n + 1]) for n in range(0, len(found) - 1, 2)]
        pieces += [(begin, end) for begin, end in both if begin != end]
    return [([p[0] for p in line], [p[1] for p in line]) for line in _joined(pieces)]


def _cells(x: Array, y: Array, values: Array) -> Iterator[list[tuple[float, float, float]]]:
    """Corners of each cell without NaN."""
    for i in range(values.shape[0] - 1):
        for j in range(values.shape[1] - 1):
            around = ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j))
            corners = [(float(x[a, b]), float(y[a, b]), float(values[a, b])) for a, b in around]
            if not any(np.isnan(corner[2]) for corner in corners):
                yield corners


def _joined(pieces: list[tuple[tuple[float, float], ...]]) -> list[list[tuple[float, float]]]:
    """Join segments with common end points."""
    left, lines = list(pieces), []
    while left:
        line = list(left.pop())
        grown = True
        while grown:
            grown = False
            for n, (a, b) in enumerate(left):
                for end, other in ((a, b), (b, a)):
                    if line[-1] == end:
                        line.append(other)
                    elif line[0] == end:
                        line.insert(0, other)
                    else:
                        continue
                    left.pop(n)
                    grown = True
                    break
                if grown:
                    break
        lines.append(line)
    return lines
