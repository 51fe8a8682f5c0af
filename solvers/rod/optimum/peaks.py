"""Locations of the peaks of a strip's results: sections and crank angles of extreme stresses and guide reactions.

Stresses are tabulated on a coarse grid of angles and sections. Near the largest values, peaks are located on a finer
grid, which resolves peaks 0.02 rad apart. The search depends only on stresses and reactions at arbitrary angles and
sections (``Response``), not on the physics behind them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram, severities
from solvers.numerics import periodic
from solvers.numerics.jit import kernel
from solvers.rod.scene import JUMP

Array = NDArray[np.float64]

ANGLE_STEP = 0.01
SECTION_STEP = 0.006
"""Spacing [rad, fraction of l] of the three samples (a stencil) whose parabola represents a peak."""

ANGLES = 96
"""Number of angles of the coarse grid."""

_STENCIL = np.array([-1.0, 0.0, 1.0])
_SECTIONS = 41
_REFINEMENT = 8
_REFINED_SECTIONS = 17
_SECTION_SPAN = 0.04
_CANDIDATE_FRACTION = 0.8
_SAMPLING_TOLERANCE, _TIE_TOLERANCE = 0.02, 1e-3
"""Relative distance below the maximum within which a peak counts as equal to it: of samples, and of located peaks."""
_GRID_REFINEMENTS, _LOCAL_GRID = 5, np.linspace(-1.0, 1.0, 9)
"""Number of local grids by which a peak near a corner, where a parabola is no approximation, is located, and their
points; each grid is four times as fine as the one before."""
_NO_CORNERS = np.empty(0)


class RequiredResults(NamedTuple):
    """The results required besides utilisation and stability: maximum stress, maximum reactions, friction power."""

    stress: bool
    reactions: bool
    power: bool


class Response(Protocol):
    """The response of one strip at arbitrary crank angles [rad]; ``eta`` is the distance of a section from the head
    over l."""

    def stresses(self, angle: Array, eta: Array) -> Array:
        """Stresses of both fibres [Pa], shape (2, sections, angles)."""

    def reactions(self, angle: Array) -> Array:
        """|T| and |T| + 6 |M0 + T e|/Lp [N], shape (2, angles)."""


class Peaks(NamedTuple):
    """Locations of a strip's peaks; the clamp section is always included.

    angles        crank angles of the extremes of stress [rad]
    sections      eta of the peaks along the strip
    reactions     crank angles of the peaks of side force or contact pressure [rad]
    compressions  crank angles of the peaks of compression [rad], where it depends on the strip
    """

    angles: Array
    sections: Array
    reactions: Array
    compressions: Array = np.empty(0)

    def stencils(self, spacing: float | Array = ANGLE_STEP) -> Array:
        """Three angles per extreme of stress: the peak and a neighbour on each side."""
        return _stencils(self.angles, spacing)

    def reaction_stencils(self, spacing: float | Array = ANGLE_STEP) -> Array:
        """Three angles per peak of the reactions."""
        return _stencils(self.reactions, spacing)

    def compression_stencils(self, spacing: float = ANGLE_STEP) -> Array:
        """Three angles per peak of compression."""
        return _stencils(self.compressions, spacing)

    def stations(self) -> Array:
        """eta of the clamp, then of each other section and a neighbour on each side."""
        middle = np.clip(self.sections, SECTION_STEP, 1.0 - SECTION_STEP)
        inner = middle[:, None] + np.array([SECTION_STEP, 0.0, -SECTION_STEP])
        return np.concatenate([[1.0], inner.ravel()])

    def merged_with(self, earlier: Peaks) -> Peaks:
        """These peaks and those ``earlier`` ones that are farther than a step from all of them."""
        steps = ANGLE_STEP, SECTION_STEP, ANGLE_STEP, ANGLE_STEP
        return Peaks(*(_with_distinct(own, other, step) for own, other, step in zip(self, earlier, steps, strict=True)))

    def split_at_jumps(self, jumps: Array, spacing: float) -> Peaks:
        """Peaks whose stencils contain a jump of the load replaced by one peak on either side of it."""
        sides = [_split_at_jumps(angles, jumps, spacing) for angles in (self.angles, self.reactions, self.compressions)]
        return self._replace(angles=sides[0], reactions=sides[1], compressions=sides[2])


def _split_at_jumps(angles: Array, jumps: Array, spacing: float) -> Array:
    if not (angles.size and jumps.size):
        return angles
    distance = np.abs(np.mod(angles[:, None] - jumps + np.pi, 2.0 * np.pi) - np.pi)
    crossed = np.any(distance < spacing, axis=0)
    sides = jumps[crossed, None] + (spacing + JUMP) * np.array([-1.0, 1.0])
    return np.unique(np.concatenate([angles[np.all(distance >= spacing, axis=1)], sides.ravel()]))


def _stencils(angles: Array, spacing: float | Array) -> Array:
    return (angles[:, None] + np.reshape(spacing, (-1, 1)) * _STENCIL).ravel()


def _with_distinct(own: Array, other: Array, step: float) -> Array:
    if not (own.size and other.size):
        return np.append(own, other)
    return np.append(own, other[np.abs(other[:, None] - own).min(axis=1) > step])


def find_peaks(strip: Response, diagram: Diagram, required: RequiredResults, corners: Array = _NO_CORNERS) -> Peaks:
    """All peaks of a strip that govern its results or nearly do.

    At ``corners`` [rad], the crank angles where derivatives of the load jump, peaks are located as accurately as
    elsewhere.
    """
    eta, angle = np.linspace(0.0, 1.0, _SECTIONS)[::-1].copy(), periodic.grid(ANGLES)
    table = strip.stresses(angle, eta)
    high, low = table.max(axis=2), table.min(axis=2)
    severity = np.empty_like(high)
    severities(high, low, *diagram, severity)
    candidates = _distinct(_peaks_beside_clamp(severity, eta))
    by_utilisation = len(candidates)
    if required.stress:
        candidates += _distinct(_peaks_beside_clamp(np.maximum(high, -low), eta))
    columns = [0] + [int(np.argmin(np.abs(eta - section))) for section in candidates]
    rows = table[:, columns].reshape(-1, angle.size)
    near = _may_hold_maximum(rows) | _may_hold_maximum(-rows)
    angles = _stress_extremes(strip, near, np.array([1.0, *candidates]), corners)
    sections = _distinct(
        [_refined_section(strip, section, angles, diagram, n >= by_utilisation) for n, section in enumerate(candidates)]
    )
    reactions = reaction_peaks(strip, corners) if required.reactions else np.empty(0)
    return Peaks(angles, np.array(sections), reactions)


def compression_peaks(force: Callable[[Array], Array]) -> Array:
    """Angles of the minima of an axial force that may become the lowest for neighbouring strips."""
    return _refined_peaks(lambda angle: -force(angle)[None])


def reaction_peaks(strip: Response, corners: Array = _NO_CORNERS) -> Array:
    """Angles of the peaks of side force or contact pressure that may become the highest for neighbouring strips."""
    return _refined_peaks(strip.reactions, corners)


def _refined_peaks(rows: Callable[[Array], Array], corners: Array = _NO_CORNERS) -> Array:
    """Angles of the peaks of several functions, given as rows, that reach a fraction of their function's maximum."""
    values = rows(periodic.grid(ANGLES))
    top = values.max(axis=1, keepdims=True)
    peaks = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    peaks &= values >= _CANDIDATE_FRACTION * top
    angle, values = _refined_samples(rows, np.any(peaks | (values >= (1.0 - _SAMPLING_TOLERANCE) * top), axis=0))
    return _peaks_near_maximum(rows, angle, values, 1.0 - _CANDIDATE_FRACTION, corners)


def _stress_extremes(strip: Response, near: NDArray[np.bool_], eta: Array, corners: Array) -> Array:
    """Angles of the extremes of stress at sections ``eta``; ``near`` marks the coarse grid's angles close to one."""
    rows = lambda angle: strip.stresses(angle, eta).reshape(2 * eta.size, -1)  # noqa: E731
    angle, values = _refined_samples(rows, near)
    highest = _peaks_near_maximum(rows, angle, values, _TIE_TOLERANCE, corners)
    lowest = _peaks_near_maximum(lambda angle: -rows(angle), angle, -values, _TIE_TOLERANCE, corners)
    return np.unique(np.append(highest, lowest))


def _refined_samples(rows: Callable[[Array], Array], near: NDArray[np.bool_]) -> tuple[Array, Array]:
    """A refined grid of angles and the rows' values; nan more than a coarse step away from the angles ``near``."""
    angle, evaluated = periodic.grid(ANGLES * _REFINEMENT), np.repeat(near | np.roll(near, -1), _REFINEMENT)
    samples = rows(angle[evaluated])
    values = np.full((samples.shape[0], angle.size), np.nan)
    values[:, evaluated] = samples
    return angle, values


def _peaks_near_maximum(
    rows: Callable[[Array], Array], angle: Array, values: Array, tolerance: float, corners: Array
) -> Array:
    """Angles of the peaks within a relative ``tolerance`` of their row's maximum."""
    row, peaks = _peak_positions(values, tolerance)
    peaks *= angle[1]
    at_corner = distance_to_corners(peaks, corners) < 2.0 * angle[1]
    if at_corner.any():
        peaks[at_corner] = _grid_search(rows, row[at_corner], peaks[at_corner], angle[1])
    return np.unique(np.round(peaks, 5))


def distance_to_corners(angles: Array, corners: Array) -> Array:
    """Distance of angles from the nearest corner [rad], modulo a revolution; inf without corners."""
    difference = np.mod(angles[:, None] - corners + np.pi, 2.0 * np.pi) - np.pi
    return np.min(np.abs(difference), axis=1, initial=np.inf)


def _grid_search(rows: Callable[[Array], Array], row: NDArray[np.intp], peaks: Array, step: float) -> Array:
    """Position of the maximum of one row each within ``step`` of the approximate ``peaks``, by nested grids."""
    each = np.arange(peaks.size)
    for _ in range(_GRID_REFINEMENTS):
        grid = peaks[:, None] + step * _LOCAL_GRID
        values = rows(grid.ravel()).reshape(-1, *grid.shape)[row, each]
        peaks, step = grid[each, values.argmax(axis=1)], 0.25 * step
    return peaks


@kernel
def _peak_positions(values: Array, tolerance: float) -> tuple[NDArray[np.intp], Array]:
    """Rows and positions, in steps of the grid, of the peaks within a relative ``tolerance`` of their row's maximum.

    A sample next to a missing value (nan) is no peak.
    """
    positions, indices = [0.0 for _ in range(0)], [0 for _ in range(0)]
    for r in range(values.shape[0]):
        row, top = values[r], -np.inf
        for value in row:
            top = max(top, value) if value == value else top
        for i in range(row.size):
            left, here, right = row[i - 1], row[i], row[(i + 1) % row.size]
            if here >= left and here >= right and here >= top - tolerance * abs(top):
                concavity = 2.0 * here - left - right
                positions.append(i + (0.5 * (right - left) / concavity if concavity > 0.0 else 0.0))
                indices.append(r)
    return np.array(indices), np.array(positions)


def _refined_section(strip: Response, section: float, angles: Array, diagram: Diagram, by_stress: bool) -> float:
    """eta near ``section`` at which the worse fibre's utilisation or stress peaks, from its extremes at ``angles``."""
    eta = np.unique(np.clip(section + _SECTION_SPAN * np.linspace(-1.0, 1.0, _REFINED_SECTIONS), 0.0, 1.0))[::-1].copy()
    table = strip.stresses(angles, eta)
    severity, high, low = np.empty((2, eta.size)), table.max(axis=2), table.min(axis=2)
    if by_stress:
        np.maximum(high, -low, out=severity)
    else:
        severities(high, low, *diagram, severity)
    row = severity[int(severity.max(axis=1).argmax())]
    j = int(row.argmax())
    if j == 0 or (j == eta.size - 1 and eta[j] > 0.0):
        # The peak of another section.
        return section
    return float(eta[j] + _vertex_offset(row, j) * (eta[1] - eta[0]))


def _may_hold_maximum(values: Array) -> NDArray[np.bool_]:
    """The angles of the coarse grid near which any row of values may have its maximum."""
    top = values.max(axis=1, keepdims=True)
    return np.any(values >= top - _SAMPLING_TOLERANCE * (top - values.min(axis=1, keepdims=True)), axis=0)


def _distinct(sections: list[float]) -> list[float]:
    """The sections farther than a step from every earlier one."""
    out: list[float] = []
    for section in sections:
        if all(abs(section - other) > SECTION_STEP for other in out):
            out.append(section)
    return out


def _peaks_beside_clamp(values: Array, eta: Array) -> list[float]:
    """eta of the highest peak of each row away from the clamp, possibly at the head; [0.5] if there is none."""
    out = []
    for row in values:
        at = np.flatnonzero((row[1:] >= row[:-1]) & (row[1:] >= np.append(row[2:], -np.inf))) + 1
        if at.size == 0:
            continue
        j = int(at[np.argmax(row[at])])
        out.append(float(eta[j] + _vertex_offset(row, j) * (eta[1] - eta[0])))
    return out or [0.5]


def _vertex_offset(values: Array, j: int) -> float:
    """Offset from sample j, in steps, of the maximum of the parabola through it and its neighbours, or at an end
    through the last three samples and within them; 0 if not concave."""
    middle = min(max(j, 1), values.size - 2)
    concavity = 2.0 * values[middle] - values[middle - 1] - values[middle + 1]
    if concavity <= 0.0:
        return 0.0
    vertex = middle + 0.5 * (values[middle + 1] - values[middle - 1]) / concavity
    return min(max(vertex, 0.0), values.size - 1.0) - j
