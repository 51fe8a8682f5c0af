"""Where a strip's results peak: the sections, and the crank angles at which their stresses and the reactions do.

Stresses are tabulated on a coarse grid of angles and sections; from the greatest ones peaks are climbed on finer grids.
What is asked for is one strip at any angles and sections (``Response``), whatever physics it has.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram, severities
from solvers.numerics import periodic

Array = NDArray[np.float64]

ANGLE_STEP = 0.01
SECTION_STEP = 0.006
"""Apart from each other [rad, of l] are the three samples through which a peak is followed by a parabola."""

ANGLES = 96
"""Where peaks are first looked for."""

_TRIPLE = np.array([-1.0, 0.0, 1.0])
_SECTIONS = 41
_FINE = 21
_ZOOM = 17
_SECTION_SPAN = 0.04
_HUMP = 0.8
_SAMPLED, _TIED = 0.02, 1e-3
"""How far below the greatest a peak may lie that is another's equal: among samples, and when it has been climbed."""


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

    def threes(self, apart: float = ANGLE_STEP) -> Array:
        """The angles with a neighbour on each side, three by three."""
        return _threes(self.angles, apart)

    def reaction_threes(self, apart: float = ANGLE_STEP) -> Array:
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


def _threes(angles: Array, apart: float) -> Array:
    return (angles[:, None] + apart * _TRIPLE).ravel()


def _with_others(own: Array, other: Array, apart: float) -> Array:
    if not (own.size and other.size):
        return np.append(own, other)
    return np.append(own, other[np.abs(other[:, None] - own).min(axis=1) > apart])


def peaks_of(strip: Response, diagram: Diagram, wanted: Wanted) -> Peaks:
    """Every peak of a strip that governs it, or nearly does."""
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
    start = angle[np.flatnonzero(_humps(rows) | _humps(-rows))]
    angles = _climb(strip, start, np.array([1.0, *chosen]))
    sections = _apart([_zoom(strip, section, angles, diagram, n >= by_use) for n, section in enumerate(chosen)])
    reactions = reaction_peaks(strip) if wanted.reactions else np.empty(0)
    return Peaks(angles, np.array(sections), reactions)


def compression_peaks(force: Callable[[Array], Array]) -> Array:
    """The angles at which an axial force is least, of all dips that may come to be the deepest."""
    return _refined_peaks(lambda angle: -force(angle)[None])


def reaction_peaks(strip: Response) -> Array:
    """The angles at which side force or contact pressure peak, of all peaks that may come to be the greatest."""
    return _refined_peaks(strip.reactions)


def _refined_peaks(rows: Callable[[Array], Array]) -> Array:
    """The angles of the peaks of any of several functions, given as rows, that are not far below its greatest."""
    angle = periodic.grid(ANGLES)
    span = 2.0 * np.pi / ANGLES
    values = rows(angle)
    humps = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    row, at = np.nonzero(humps & (values >= _HUMP * values.max(axis=1, keepdims=True)))
    offsets = span * np.linspace(-1.25, 1.25, _FINE)
    around = angle[at][:, None] + offsets
    values = rows(around.ravel()).reshape(-1, at.size, _FINE)[row, np.arange(at.size)]
    j = np.clip(values.argmax(axis=1), 1, _FINE - 2)
    left, here, right = (values[np.arange(j.size), j + shift] for shift in (-1, 0, 1))
    bend = 2.0 * here - left - right
    shift = np.clip(0.5 * (right - left) / np.where(bend > 0, bend, np.inf), -1.0, 1.0)
    return np.unique(np.round(angle[at] + offsets[j] + shift * (offsets[1] - offsets[0]), 6))


def _climb(strip: Response, start: Array, eta: Array) -> Array:
    """The angles of the stresses' extremes at the sections, near those given."""
    span = 2.0 * np.pi / ANGLES
    around = start[:, None] + span * np.linspace(-1.25, 1.25, _FINE)
    table = strip.stresses(around.ravel(), eta).reshape(2 * eta.size, start.size, _FINE)
    step = 2.5 * span / (_FINE - 1)
    found = set()
    for values in (table, -table):
        # A window that has the peak at its very end only says on which side it lies.
        tops = values[:, :, 1:-1].max(axis=2)
        level = tops.max(axis=1, keepdims=True)
        for row, which in np.argwhere(tops >= level - _TIED * np.abs(level)):
            here = values[row, which]
            at = 1 + int(here[1:-1].argmax())
            if not here[at - 1] <= here[at] >= here[at + 1] and tops[row, which] < level[row, 0]:
                continue
            bend = 2.0 * here[at] - here[at - 1] - here[at + 1]
            shift = 0.5 * (here[at + 1] - here[at - 1]) / bend if bend > 0 else 0.0
            found.add(round(float(around[which, at] + step * min(max(shift, -1.0), 1.0)), 5))
    return np.array(sorted(found))


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


def _humps(values: Array) -> NDArray[np.bool_]:
    """The angles at which any row of values has a peak that may be its greatest once it is looked at closely."""
    level = values.max(axis=1, keepdims=True)
    near = values >= level - _SAMPLED * (level - values.min(axis=1, keepdims=True))
    return np.any(near & (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1)), axis=0)


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
