"""A machine's cycle sampled once, and the crank angles and sections that govern a strip in it.

Stresses are tabulated on a coarse grid of angles and sections; from the greatest ones peaks are climbed on finer grids.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import severities
from solvers.rod.optimum.peak_model import ANGLE_STEP, SECTION_STEP, Array, Focus, side_and_pressure, stress_table

_SECTIONS = 41
_FINE = 21
_ZOOM = 17
_SECTION_SPAN = 0.04
_HUMP = 0.8
_SAMPLED, _TIED = 0.02, 1e-3
"""How far below the greatest a peak may lie that is another's equal: among samples, and when it has been climbed."""


class Matters(NamedTuple):
    """What is to be looked at beside utilisation and stability: greatest stress, greatest reactions, friction power."""

    stress: bool
    reactions: bool
    power: bool


class Cycle(Protocol):
    """What a focus has to know of a machine: its axial force [N] at any crank angles."""

    def axial_force(self, angle: Array) -> Array: ...


@dataclass(frozen=True)
class Machine:
    """A cycle sampled once, to be focused on any strip.

    ``whole`` has its force, stroke and |piston speed| [m/s] at as many angles as the mean of friction power takes.
    """

    cycle: Cycle
    crank_radius: float
    rod_length: float
    modulus: float
    guide: Array
    lines: Array
    parabola: Array
    angle: Array
    force: Array
    stroke: Array
    whole: tuple[Array, Array, Array]
    compression: float
    hardest: float

    def focus_at(self, b: float, h: float, l: float, matters: Matters) -> tuple[Focus, Array]:
        """The focus on a strip, on what of it matters, and the middle angle of each of its threes."""
        eta = np.linspace(0.0, 1.0, _SECTIONS)[::-1].copy()
        table = np.empty((2, eta.size, self.angle.size))
        stress_table(self.force, self.stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        high, low = table.max(axis=2), table.min(axis=2)
        severity = np.empty_like(high)
        severities(high, low, self.lines, self.parabola, severity)
        chosen = _apart(_inner_peaks(severity, eta))
        by_use = len(chosen)
        if matters.stress:
            chosen += _apart(_inner_peaks(np.maximum(high, -low), eta))
        columns = [0] + [int(np.argmin(np.abs(eta - section))) for section in chosen]
        peaks = table[:, columns].reshape(-1, self.angle.size)
        index = np.flatnonzero(_humps(peaks) | _humps(-peaks))
        middles = self._climb(index, b, h, l, np.array([1.0, *chosen]))
        stations = [1.0]
        for n, section in enumerate(chosen):
            place = self._zoom(section, middles, n >= by_use, b, h, l)
            middle = min(max(place, SECTION_STEP), 1.0 - SECTION_STEP)
            stations += [middle + SECTION_STEP, middle, middle - SECTION_STEP]
        triple = np.array([-ANGLE_STEP, 0.0, ANGLE_STEP])
        threes = (middles[:, None] + triple).ravel()
        peaks = (self.reaction_peaks(b, h, l)[:, None] + triple).ravel() if matters.reactions else np.empty(0)
        whole = self.whole if matters.power else (np.empty(0),) * 3
        focus = Focus(
            self.cycle.axial_force(threes), self.crank_radius * np.sin(threes), np.array(stations),
            self.cycle.axial_force(peaks), self.crank_radius * np.sin(peaks), *whole,
            self.lines, self.parabola, self.compression, self.guide, self.modulus, self.rod_length,
        )  # fmt: skip
        return focus, middles

    def _zoom(self, section: float, angles: Array, by_stress: bool, b: float, h: float, l: float) -> float:
        """Where near ``section`` the worse fibre's utilisation, or stress, peaks, seen at the governing angles."""
        eta = np.clip(section + _SECTION_SPAN * np.linspace(1.0, -1.0, _ZOOM), 0.0, 1.0)
        table = np.empty((2, eta.size, angles.size))
        force, stroke = self.cycle.axial_force(angles), self.crank_radius * np.sin(angles)
        stress_table(force, stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        severity = np.empty((2, eta.size))
        high, low = table.max(axis=2), table.min(axis=2)
        if by_stress:
            np.maximum(high, -low, out=severity)
        else:
            severities(high, low, self.lines, self.parabola, severity)
        row = severity[int(severity.max(axis=1).argmax())]
        j = int(row.argmax())
        if not 0 < j < eta.size - 1:
            return section
        bend = 2.0 * row[j] - row[j - 1] - row[j + 1]
        return float(eta[j] + (0.5 * (row[j + 1] - row[j - 1]) / bend if bend > 0 else 0.0) * (eta[1] - eta[0]))

    def reaction_peaks(self, b: float, h: float, l: float) -> Array:
        """The angles at which side force or contact pressure peak, of all peaks that may come to be the greatest."""
        span = 2.0 * np.pi / self.angle.size
        values = self._reactions(self.force, self.stroke, b, h, l)
        humps = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
        row, at = np.nonzero(humps & (values >= _HUMP * values.max(axis=1, keepdims=True)))
        offsets = span * np.linspace(-1.25, 1.25, _FINE)
        around = self.angle[at][:, None] + offsets
        force, stroke = self.cycle.axial_force(around.ravel()), self.crank_radius * np.sin(around.ravel())
        values = self._reactions(force, stroke, b, h, l).reshape(2, at.size, _FINE)[row, np.arange(at.size)]
        j = np.clip(values.argmax(axis=1), 1, _FINE - 2)
        left, here, right = (values[np.arange(j.size), j + shift] for shift in (-1, 0, 1))
        bend = 2.0 * here - left - right
        shift = np.clip(0.5 * (right - left) / np.where(bend > 0, bend, np.inf), -1.0, 1.0)
        return np.unique(np.round(self.angle[at] + offsets[j] + shift * (offsets[1] - offsets[0]), 6))

    def _reactions(self, force: Array, stroke: Array, b: float, h: float, l: float) -> Array:
        """Side force and contact pressure (in N) at each angle, shape (2, angles)."""
        out = np.empty((2, force.size))
        side_and_pressure(force, stroke, self.modulus, self.rod_length, self.guide, b, h, l, out)
        return out

    def _climb(self, index: NDArray[np.int64], b: float, h: float, l: float, eta: Array) -> Array:
        """The angles of the stresses' extremes at the sections, near those of the samples at ``index``."""
        span = 2.0 * np.pi / self.angle.size
        start = self.angle[index]
        around = start[:, None] + span * np.linspace(-1.25, 1.25, _FINE)
        force, stroke = self.cycle.axial_force(around.ravel()), self.crank_radius * np.sin(around.ravel())
        table = np.empty((2, eta.size, around.size))
        stress_table(force, stroke, self.modulus, self.rod_length, b, h, l, eta, table)
        table = table.reshape(2 * eta.size, index.size, _FINE)
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
