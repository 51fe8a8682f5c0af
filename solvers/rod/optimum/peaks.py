"""Where a strip's results peak: the sections, and the crank angles at which their stresses and the reactions do.

Stresses are tabulated on a coarse grid of angles and sections; next to the greatest ones peaks are looked for on a
finer grid, which tells apart those 0.02 rad from each other. What is asked for is one strip at any angles and sections
(``Response``), whatever physics it has.
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
"""Apart from each other [rad, of l] are the three samples through which a peak is followed by a parabola."""

ANGLES = 96
"""Where peaks are first looked for."""

_TRIPLE = np.array([-1.0, 0.0, 1.0])
_SECTIONS = 41
_FINER = 8
_ZOOM = 17
_SECTION_SPAN = 0.04
_HUMP = 0.8
_SAMPLED, _TIED = 0.02, 1e-3
"""How far below the greatest a peak may lie that is another's equal: among samples, and when it has been climbed."""
_ZOOMS, _CLOSER = 5, np.linspace(-1.0, 1.0, 9)
"""Steps to a peak beside a corner, where no parabola leads to it; the places looked at in each, of which the next
step's are a quarter as far apart."""
_NO_CORNERS = np.empty(0)


class Wanted(NamedTuple):
    """What is looked at beside utilisation and stability: greatest stress, greatest reactions, friction power."""

    stress: bool
    reactions: bool
    power: bool


class Response(Protocol):
    """One strip at any crank angles [rad]; ``eta`` are sections by their distance from the head over l."""

    def stresses(self, angle: Array, eta: Array) -> Array:
        """Both fibres' stresses [Pa], shape (2, sections, angles)."""

    def reactions(self, angle: Array) -> Array:
        """|T| and |T| + 6 |M0 + T e|/Lp [N], shape (2, angles)."""


class Peaks(NamedTuple):
    """``angles`` of the stresses' extremes, ``sections`` (eta) of inner peaks along the strip - the clamp is always
    looked at -, angles of the peaks of side force or contact pressure in ``reactions``, and those of the compression,
    where it depends on the strip, in ``pushed``."""

    angles: Array
    sections: Array
    reactions: Array
    pushed: Array = np.empty(0)

    def threes(self, apart: float | Array = ANGLE_STEP) -> Array:
        """The angles with a neighbour on each side, three by three."""
        return _threes(self.angles, apart)

    def reaction_threes(self, apart: float | Array = ANGLE_STEP) -> Array:
        return _threes(self.reactions, apart)

    def pushed_threes(self, apart: float = ANGLE_STEP) -> Array:
        return _threes(self.pushed, apart)

    def stations(self) -> Array:
        """eta of the clamp, then of the inner sections with a neighbour on each side."""
        middle = np.clip(self.sections, SECTION_STEP, 1.0 - SECTION_STEP)
        inner = middle[:, None] + np.array([SECTION_STEP, 0.0, -SECTION_STEP])
        return np.concatenate([[1.0], inner.ravel()])

    def joined(self, earlier: Peaks) -> Peaks:
        """With those of other peaks that are not next to one of these."""
        apart = ANGLE_STEP, SECTION_STEP, ANGLE_STEP, ANGLE_STEP
        return Peaks(*(_with_others(own, other, a) for own, other, a in zip(self, earlier, apart, strict=True)))

    def on_one_side(self, jumps: Array, apart: float) -> Peaks:
        """With peaks on either side of a jump in place of those whose threes it would part."""
        angles, reactions, pushed = (_on_one_side(x, jumps, apart) for x in (self.angles, self.reactions, self.pushed))
        return self._replace(angles=angles, reactions=reactions, pushed=pushed)


def _on_one_side(angles: Array, jumps: Array, apart: float) -> Array:
    if not (angles.size and jumps.size):
        return angles
    away = np.mod(angles[:, None] - jumps + np.pi, 2.0 * np.pi) - np.pi
    met = np.any(np.abs(away) < apart, axis=0)
    sides = jumps[met, None] + (apart + JUMP) * np.array([-1.0, 1.0])
    return np.unique(np.concatenate([angles[np.all(np.abs(away) >= apart, axis=1)], sides.ravel()]))


def _threes(angles: Array, apart: float | Array) -> Array:
    return (angles[:, None] + np.reshape(apart, (-1, 1)) * _TRIPLE).ravel()


def _with_others(own: Array, other: Array, apart: float) -> Array:
    if not (own.size and other.size):
        return np.append(own, other)
    return np.append(own, other[np.abs(other[:, None] - own).min(axis=1) > apart])


def peaks_of(strip: Response, diagram: Diagram, wanted: Wanted, corners: Array = _NO_CORNERS) -> Peaks:
    """Every peak of a strip that governs it, or nearly does; as exactly beside ``corners`` [rad], where derivatives by
    the angle jump."""
    eta, angle = np.linspace(0.0, 1.0, _SECTIONS)[::-1].copy(), periodic.grid(ANGLES)
    table = strip.stresses(angle, eta)
    high, low = table.max(axis=2), table.min(axis=2)
    severity = np.empty_like(high)
    severities(high, low, *diagram, severity)
    chosen = _apart(_inner_peaks(severity, eta))
    by_use = len(chosen)
    if wanted.stress:
        chosen += _apart(_inner_peaks(np.maximum(high, -low), eta))
    columns = [0] + [int(np.argmin(np.abs(eta - section))) for section in chosen]
    rows = table[:, columns].reshape(-1, angle.size)
    angles = _climb(strip, _near_the_top(rows) | _near_the_top(-rows), np.array([1.0, *chosen]), corners)
    sections = _apart([_zoom(strip, section, angles, diagram, n >= by_use) for n, section in enumerate(chosen)])
    reactions = reaction_peaks(strip, corners) if wanted.reactions else np.empty(0)
    return Peaks(angles, np.array(sections), reactions)


def compression_peaks(force: Callable[[Array], Array]) -> Array:
    """The angles at which an axial force is least, of all dips that may come to be the deepest."""
    return _refined_peaks(lambda angle: -force(angle)[None])


def reaction_peaks(strip: Response, corners: Array = _NO_CORNERS) -> Array:
    """The angles at which side force or contact pressure peak, of all peaks that may come to be the greatest."""
    return _refined_peaks(strip.reactions, corners)


def _refined_peaks(rows: Callable[[Array], Array], corners: Array = _NO_CORNERS) -> Array:
    """The angles of the peaks of any of several functions, given as rows, that are not far below its greatest."""
    values = rows(periodic.grid(ANGLES))
    most = values.max(axis=1, keepdims=True)
    humps = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1)) & (values >= _HUMP * most)
    angle, values = _closely(rows, np.any(humps | (values >= (1.0 - _SAMPLED) * most), axis=0))
    return _tops(rows, angle, values, 1.0 - _HUMP, corners)


def _climb(strip: Response, near: NDArray[np.bool_], eta: Array, corners: Array) -> Array:
    """The angles of the stresses' extremes at the sections, next to angles of the coarse grid that are ``near``."""
    rows = lambda angle: strip.stresses(angle, eta).reshape(2 * eta.size, -1)  # noqa: E731
    angle, values = _closely(rows, near)
    greatest = _tops(rows, angle, values, _TIED, corners)
    return np.unique(np.append(greatest, _tops(lambda angle: -rows(angle), angle, -values, _TIED, corners)))


def _closely(rows: Callable[[Array], Array], near: NDArray[np.bool_]) -> tuple[Array, Array]:
    """A finer grid of angles, and rows of values there; nan more than a coarse step away from the angles ``near``."""
    angle, seen = periodic.grid(ANGLES * _FINER), np.repeat(near | np.roll(near, -1), _FINER)
    found = rows(angle[seen])
    values = np.full((found.shape[0], angle.size), np.nan)
    values[:, seen] = found
    return angle, values


def _tops(rows: Callable[[Array], Array], angle: Array, values: Array, below: float, corners: Array) -> Array:
    """The angles of the peaks of rows of values that lie below their row's greatest by no greater share."""
    row, places = _top_places(values, below)
    places *= angle[1]
    beside = from_corners(places, corners) < 2.0 * angle[1]
    if beside.any():
        places[beside] = _climbed(rows, row[beside], places[beside], angle[1])
    return np.unique(np.round(places, 5))


def from_corners(angles: Array, corners: Array) -> Array:
    """How far angles are from the nearest corner [rad], in the turn's round; inf without corners."""
    away = np.mod(angles[:, None] - corners + np.pi, 2.0 * np.pi) - np.pi
    return np.min(np.abs(away), axis=1, initial=np.inf)


def _climbed(rows: Callable[[Array], Array], row: NDArray[np.intp], places: Array, step: float) -> Array:
    """Where, within a step of ``places``, one row each has its greatest value."""
    each = np.arange(places.size)
    for _ in range(_ZOOMS):
        looked = places[:, None] + step * _CLOSER
        values = rows(looked.ravel()).reshape(-1, *looked.shape)[row, each]
        places, step = looked[each, values.argmax(axis=1)], 0.25 * step
    return places


@kernel
def _top_places(values: Array, below: float) -> tuple[NDArray[np.intp], Array]:
    """``_tops`` in steps of the grid, and their rows; beside a missing value (nan) is no peak."""
    found, of = [0.0 for _ in range(0)], [0 for _ in range(0)]
    for r in range(values.shape[0]):
        row, level = values[r], -np.inf
        for value in row:
            level = max(level, value) if value == value else level
        for i in range(row.size):
            left, here, right = row[i - 1], row[i], row[(i + 1) % row.size]
            if here >= left and here >= right and here >= level - below * abs(level):
                bend = 2.0 * here - left - right
                found.append(i + (0.5 * (right - left) / bend if bend > 0.0 else 0.0))
                of.append(r)
    return np.array(of), np.array(found)


def _zoom(strip: Response, section: float, angles: Array, diagram: Diagram, by_stress: bool) -> float:
    """Where near ``section`` the worse fibre's utilisation, or stress, peaks, seen at the governing angles."""
    eta = np.clip(section + _SECTION_SPAN * np.linspace(1.0, -1.0, _ZOOM), 0.0, 1.0)
    table = strip.stresses(angles, eta)
    severity, high, low = np.empty((2, eta.size)), table.max(axis=2), table.min(axis=2)
    if by_stress:
        np.maximum(high, -low, out=severity)
    else:
        severities(high, low, *diagram, severity)
    row = severity[int(severity.max(axis=1).argmax())]
    j = int(row.argmax())
    if not 0 < j < eta.size - 1:
        return section
    bend = 2.0 * row[j] - row[j - 1] - row[j + 1]
    return float(eta[j] + (0.5 * (row[j + 1] - row[j - 1]) / bend if bend > 0 else 0.0) * (eta[1] - eta[0]))


def _near_the_top(values: Array) -> NDArray[np.bool_]:
    """The angles at which any row of values may be at its greatest once it is looked at closely."""
    level = values.max(axis=1, keepdims=True)
    return np.any(values >= level - _SAMPLED * (level - values.min(axis=1, keepdims=True)), axis=0)


def _apart(sections: list[float]) -> list[float]:
    """Those of the sections that are not next to an earlier one."""
    out: list[float] = []
    for section in sections:
        if all(abs(section - other) > SECTION_STEP for other in out):
            out.append(section)
    return out


def _inner_peaks(values: Array, eta: Array) -> list[float]:
    """Where, away from the clamp, either fibre's value along the strip has its greatest peak."""
    out = []
    for row in values:
        inner = (row[1:-1] >= row[:-2]) & (row[1:-1] >= row[2:])
        at = np.flatnonzero(inner) + 1
        if at.size == 0:
            continue
        j = int(at[np.argmax(row[at])])
        bend = 2.0 * row[j] - row[j - 1] - row[j + 1]
        shift = 0.5 * (row[j + 1] - row[j - 1]) / bend if bend > 0 else 0.0
        out.append(float(eta[j] + shift * (eta[1] - eta[0])))
    return out or [0.5]
