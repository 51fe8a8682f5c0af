"""Locations of the peaks of a strip's results: sections and crank angles of extreme stresses and guide reactions.

Stresses are tabulated on a coarse grid of angles and sections. Near the largest values, peaks are located on a finer
grid, which resolves peaks 0.02 rad apart. The search depends only on stresses and reactions at arbitrary angles and
sections (``Response``), not on the physics behind them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from solvers.fatigue.kernels import Diagram
from solvers.numerics import periodic
from solvers.numerics.arrays import Array, Index
from solvers.rod.optimum.peak_positions import (
    Mask,
    near_extremes,
    near_peaks,
    peak_of_section,
    peak_positions,
    peaks_beside_clamp,
    refined,
    severities_along,
)
from solvers.rod.scene import JUMP

ANGLE_STEP = 0.01
SECTION_STEP = 0.006
"""Spacing [rad, fraction of l] of the three samples (a stencil) whose parabola represents a peak."""

ANGLES = 96
"""Number of angles of the coarse grid."""

_STENCIL = np.array([-1.0, 0.0, 1.0])
_GRID, _ETA = periodic.grid(ANGLES), np.linspace(0.0, 1.0, 41)[::-1].copy()
"""The coarse grid: angles, and sections from the clamp to the head."""
_REFINEMENT = 8
_FINE_GRID = periodic.grid(ANGLES * _REFINEMENT)
_SECTION_SPAN, _SECTION_FRACTIONS = 0.04, np.linspace(0.0, 1.0, 17)
"""Span in eta to both sides of an approximate peak, and the sections in it, as fractions."""
_CANDIDATE_FRACTION = 0.8
_TIE_TOLERANCE = 1e-3
"""Relative distance below the maximum within which a located peak counts as equal to it."""
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
    distance = periodic.distances(angles, jumps)
    crossed = np.any(distance < spacing, axis=0)
    sides = jumps[crossed, None] + (spacing + JUMP) * np.array([-1.0, 1.0])
    return np.unique(np.concatenate([angles[np.all(distance >= spacing, axis=1)], sides.ravel()]))


def stencils(angles: Array, spacing: float | Array) -> Array:
    """Three angles per peak: its own and a neighbour on each side."""
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
    table, candidates = strip.stresses(_GRID, _ETA), []
    for by_stress in (False, True) if required.stress else (False,):
        severity = severities_along(table, *diagram, by_stress)
        candidates += [(section, by_stress) for section in _distinct(peaks_beside_clamp(severity, _ETA).tolist())]
    eta = np.array([section for section, _ in candidates])
    angles = _stress_extremes(strip, near_extremes(table, _ETA, eta), np.append(1.0, eta), corners)
    sections = [_refined_section(strip, section, angles, diagram, by_stress) for section, by_stress in candidates]
    reactions = reaction_peaks(strip, corners) if required.reactions else np.empty(0)
    return Peaks(angles, np.array(_distinct(sections)), reactions)


def compression_peaks(force: Callable[[Array], Array]) -> Array:
    """Angles of the minima of an axial force that may become the lowest for neighbouring strips."""
    return _refined_peaks(lambda angle: -force(angle)[None])


def reaction_peaks(strip: Response, corners: Array = _NO_CORNERS) -> Array:
    """Angles of the peaks of side force or contact pressure that may become the highest for neighbouring strips."""
    return _refined_peaks(strip.reactions, corners)


def _refined_peaks(rows: Callable[[Array], Array], corners: Array = _NO_CORNERS) -> Array:
    """Angles of the peaks of several functions, given as rows, that reach a fraction of their function's maximum."""
    near = near_peaks(rows(_GRID), _CANDIDATE_FRACTION)
    return _peaks_near_maximum(rows, near, 1.0 - _CANDIDATE_FRACTION, corners)


def _stress_extremes(strip: Response, near: Mask, eta: Array, corners: Array) -> Array:
    """Angles of the extremes of stress at sections ``eta``; ``near`` marks the coarse grid's angles close to one."""

    def rows(angle: Array) -> Array:
        stresses = strip.stresses(angle, eta).reshape(2 * eta.size, -1)
        return np.concatenate([stresses, -stresses])

    return _peaks_near_maximum(rows, near, _TIE_TOLERANCE, corners)


def _peaks_near_maximum(rows: Callable[[Array], Array], near: Mask, tolerance: float, corners: Array) -> Array:
    """Angles of the peaks within a relative ``tolerance`` of their row's maximum, located on a refined grid near the
    coarse grid's angles marked ``near``."""
    numbers, step = refined(near, _REFINEMENT), _FINE_GRID[1]
    row, peaks = peak_positions(rows(_FINE_GRID[numbers]), numbers, _FINE_GRID.size, tolerance)
    peaks *= step
    at_corner = distance_to_corners(peaks, corners) < 2.0 * step
    if at_corner.any():
        peaks[at_corner] = _grid_search(rows, row[at_corner], peaks[at_corner], step)
    return np.unique(np.round(peaks, 5))


def distance_to_corners(angles: Array, corners: Array) -> Array:
    """Distance of angles from the nearest corner [rad], modulo a revolution; inf without corners."""
    if not corners.size:
        return np.full(angles.size, np.inf)
    ordered = np.sort(np.mod(corners, periodic.TURN))
    after = np.searchsorted(ordered, np.mod(angles, periodic.TURN)) % ordered.size
    return np.min([periodic.distance(angles, ordered[after - 1]), periodic.distance(angles, ordered[after])], axis=0)


def _grid_search(rows: Callable[[Array], Array], row: Index, peaks: Array, step: float) -> Array:
    """Position of the maximum of one row each within ``step`` of the approximate ``peaks``, by nested grids."""
    each = np.arange(peaks.size)
    for _ in range(_GRID_REFINEMENTS):
        grid = peaks[:, None] + step * _LOCAL_GRID
        values = rows(grid.ravel()).reshape(-1, *grid.shape)[row, each]
        peaks, step = grid[each, values.argmax(axis=1)], 0.25 * step
    return peaks


def _refined_section(strip: Response, section: float, angles: Array, diagram: Diagram, by_stress: bool) -> float:
    """eta near ``section`` at which the worse fibre's utilisation or stress peaks, from its extremes at ``angles``."""
    high, low = min(section + _SECTION_SPAN, 1.0), max(section - _SECTION_SPAN, 0.0)
    eta = high + (low - high) * _SECTION_FRACTIONS
    severity = severities_along(strip.stresses(angles, eta), *diagram, by_stress)
    return peak_of_section(severity, eta, section)


def _distinct(sections: list[float]) -> list[float]:
    """The sections farther than a step from every earlier one."""
    out: list[float] = []
    for section in sections:
        if all(abs(section - other) > SECTION_STEP for other in out):
            out.append(section)
    return out
