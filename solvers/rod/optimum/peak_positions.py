"""Positions of peaks in tables of samples, compiled (``solvers.rod.optimum.peaks``)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import utilisation_of
from solvers.numerics.arrays import Array, Index
from solvers.numerics.jit import kernel

Mask = NDArray[np.bool_]

SAMPLING_TOLERANCE = 0.02
"""Relative distance below the maximum within which a sample counts as equal to it."""


@kernel
def severities_along(table: Array, lines: Array, parabola: Array, by_stress: bool) -> Array:
    """Utilisation, or greatest magnitude of stress [Pa], of both fibres at every section, (2, sections), from stresses
    [Pa] (2, sections, angles)."""
    out = np.empty(table.shape[:2])
    for fibre in range(table.shape[0]):
        for j in range(table.shape[1]):
            high, low = table[fibre, j, 0], table[fibre, j, 0]
            for value in table[fibre, j]:
                high, low = max(high, value), min(low, value)
            out[fibre, j] = max(high, -low) if by_stress else utilisation_of(high, low, lines, parabola)
    return out


@kernel
def peaks_beside_clamp(values: Array, eta: Array) -> Array:
    """eta of the highest peak of each row away from the clamp, possibly at the head; 0.5 if there is none."""
    out, count, last = np.full(values.shape[0], 0.5), 0, values.shape[1] - 1
    for row in values:
        best = 0
        for j in range(1, last + 1):
            is_peak = row[j] >= row[j - 1] and (j == last or row[j] >= row[j + 1])
            if is_peak and (best == 0 or row[j] > row[best]):
                best = j
        if best > 0:
            out[count] = eta[best] + vertex_offset(row, best) * (eta[1] - eta[0])
            count += 1
    return out[: max(count, 1)]


@kernel
def peak_of_section(severity: Array, eta: Array, section: float) -> float:
    """eta of the peak of the worse fibre's severity on sections ``eta`` around one; that one if the peak is
    another's."""
    worse = 0 if severity[0].max() >= severity[1].max() else 1
    row = severity[worse]
    j = int(row.argmax())
    if j == 0 or (j == eta.size - 1 and eta[j] > 0.0):
        return section
    return eta[j] + vertex_offset(row, j) * (eta[1] - eta[0])


@kernel
def vertex_offset(values: Array, j: int) -> float:
    """Offset from sample j, in steps, of the maximum of the parabola through it and its neighbours, or at an end
    through the last three samples and within them; 0 if not concave."""
    middle = min(max(j, 1), values.size - 2)
    concavity = 2.0 * values[middle] - values[middle - 1] - values[middle + 1]
    if not concavity > 0.0:
        return 0.0
    vertex = middle + 0.5 * (values[middle + 1] - values[middle - 1]) / concavity
    return min(max(vertex, 0.0), values.size - 1.0) - j


@kernel
def near_extremes(table: Array, eta: Array, sections: Array) -> Mask:
    """The angles near which the stresses (2, sections, angles) at the clamp or at the sections nearest to some may have
    their maximum or minimum."""
    near = np.zeros(table.shape[2], np.bool_)
    for n in range(-1, sections.size):
        at = 0 if n < 0 else int(np.argmin(np.abs(eta - sections[n])))
        for fibre in range(table.shape[0]):
            row = table[fibre, at]
            high, low = row.max(), row.min()
            margin = SAMPLING_TOLERANCE * (high - low)
            for i in range(row.size):
                near[i] = near[i] or row[i] >= high - margin or row[i] <= low + margin
    return near


@kernel
def near_peaks(values: Array, fraction: float) -> Mask:
    """The angles of peaks that reach a fraction of their row's maximum, and of samples about as high as that."""
    near = np.zeros(values.shape[1], np.bool_)
    for row in values:
        top = row.max()
        for i in range(row.size):
            is_peak = row[i] >= row[i - 1] and row[i] >= row[(i + 1) % row.size] and row[i] >= fraction * top
            near[i] = near[i] or is_peak or row[i] >= (1.0 - SAMPLING_TOLERANCE) * top
    return near


@kernel
def refined(near: Mask, refinement: int) -> Index:
    """Numbers of the samples within a coarse step of the angles ``near``, on a grid ``refinement`` times as fine."""
    out, count = np.empty(near.size * refinement, np.intp), 0
    for i in range(near.size):
        if near[i] or near[(i + 1) % near.size]:
            for k in range(refinement):
                out[count] = i * refinement + k
                count += 1
    return out[:count]


@kernel
def peak_positions(values: Array, numbers: Index, samples: int, tolerance: float) -> tuple[Index, Array]:
    """Rows and positions, in steps of a grid of ``samples`` angles, of the peaks within a relative ``tolerance`` of
    their row's maximum, from the values at the samples of some ``numbers`` in ascending order.

    A sample next to a missing one is no peak.
    """
    positions, indices = [0.0 for _ in range(0)], [0 for _ in range(0)]
    for r in range(values.shape[0]):
        row, top = values[r], -np.inf
        for value in row:
            top = max(top, value) if value == value else top
        least = top - tolerance * abs(top)
        for i in range(row.size):
            if not row[i] >= least:
                continue
            before, after = i - 1, (i + 1) % row.size
            if (numbers[i] - numbers[before]) % samples != 1 or (numbers[after] - numbers[i]) % samples != 1:
                continue
            left, here, right = row[before], row[i], row[after]
            if here >= left and here >= right:
                concavity = 2.0 * here - left - right
                offset = 0.5 * (right - left) / concavity if concavity > 0.0 else 0.0
                positions.append(numbers[i] + offset)
                indices.append(r)
    return np.array(indices), np.array(positions)
