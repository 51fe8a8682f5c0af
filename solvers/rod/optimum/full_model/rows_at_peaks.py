"""All rows of a strip, evaluated at given peaks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram
from solvers.numerics.jit import kernel
from solvers.rod import rows
from solvers.rod.cycle.bent_strip import fibre_stresses
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip
from solvers.rod.optimum.core.peak_model import finite_log, peak_height, reaction_rows, set_buckled_rows
from solvers.rod.optimum.full_model.smooth_parts import Index, Parts, part_values
from solvers.rod.optimum.full_model.strip import FullStrip
from solvers.rod.optimum.peaks import Peaks
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.rows import FIRST_PART, STRESS, UTILISATION, Layout
from solvers.rod.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RowsAtPeaks:
    """The rows (``solvers.rod.rows``) of strips of a scene at ``peaks``; each peak is represented by a parabola through
    three angles of the given ``spacing`` [rad]. Friction power is evaluated if ``power`` is set."""

    scene: Scene
    diagram: Diagram
    peaks: Peaks
    parts: Parts
    spacing: float
    power: bool

    @cached_property
    def layout(self) -> Layout:
        parts = self.parts
        return Layout(parts.utilisations.shape[1], parts.stresses.shape[1], self.peaks.reactions.size)

    def __call__(self, strip: FullStrip) -> Array:
        """All rows of a strip, shape (rows,)."""
        states = strip.cycle.states(self._angles)
        out = self._stability_rows(strip, states)
        self._set_load_rows(strip, states, out)
        return out

    def corrections(self, strip: FullStrip) -> Array:
        """Contribution of its corrections to the rows of a strip, (rows,); zero if it buckles."""
        states = strip.cycle.states(self._angles)
        uncorrected = self._stability_rows(strip, states)
        out = uncorrected.copy()
        self._set_load_rows(FullStrip(strip.cycle.without_corrections()), states, uncorrected)
        self._set_load_rows(strip, states, out)
        return out - uncorrected

    def _stability_rows(self, strip: FullStrip, states: Array) -> Array:
        """The rows, with those of dimensions and stability set."""
        out, d = np.zeros(self.layout.size), strip.dimensions
        out[rows.TAU], out[rows.LENGTH], out[rows.THICKNESS] = -math.log(d.b * d.h**3), math.log(d.l), math.log(d.h)
        in_plane, out_of_plane = strip.critical
        compression = max_peak_height(-states[FORCE, 3 * (self.peaks.angles.size + self.peaks.reactions.size) :])
        out[rows.STABILITY] = math.log(compression / in_plane) if compression > 0.0 else rows.NEVER_COMPRESSED
        out[rows.SIDEWAYS] = math.log(compression / out_of_plane) if compression > 0.0 else rows.NEVER_COMPRESSED
        return out

    def _set_load_rows(self, strip: FullStrip, states: Array, out: Array) -> None:
        """Set the other rows; they are invalid for a strip that buckles."""
        if out[rows.STABILITY] < 0.0:
            parts, piston, d, shape = self.parts, self.scene.piston, strip.dimensions, strip.cycle.bent_strip(states)
            stations, modulus = (1.0 - self._stations) * d.l, self.scene.material.elastic_modulus
            set_load_rows(
                shape.strip, states, stations, shape.curvature_correction(stations), shape.side_correction,
                shape.moment_correction, shape.inclined, 1.0 / (d.b * d.h), 0.5 * modulus * d.h, parts.order,
                parts.starts, parts.utilisations, parts.stresses, *self.diagram, self.peaks.reactions.size,
                pressure_per_load(piston.diameter, piston.skirt_length), out,
            )  # fmt: skip
            if self.power:
                out[rows.POWER] = finite_log(strip.friction_power())
        if out[rows.STABILITY] >= 0.0 or not np.isfinite(out).all():
            set_buckled_rows(out)

    @cached_property
    def _angles(self) -> Array:
        """Angles of the stencils of stresses, of reactions, and of the maximum compression [rad]."""
        p = self.peaks
        return np.concatenate(
            [p.stencils(self.spacing), p.reaction_stencils(self.spacing), p.compression_stencils(self.spacing)]
        )

    @cached_property
    def _stations(self) -> Array:
        return self.peaks.stations()


@kernel
def max_peak_height(values: Array) -> float:
    """Maximum height of the parabolas through consecutive triples of samples."""
    out = -np.inf
    for i in range(0, values.size, 3):
        out = max(out, peak_height(values[i], values[i + 1], values[i + 2]))
    return out


@kernel
def set_load_rows(
    strip: Strip, states: Array, stations: Array, curvature_correction: Array, side_correction: Array,
    moment_correction: Array, inclined: bool, axial_factor: float, bending_factor: float, order: Index, starts: Index,
    utilisations: Index, stresses: Index, lines: Array, parabola: Array, peaks: int, pressure_per_force: float,
    out: Array,
) -> None:  # fmt: skip
    """Set the rows of utilisation, stress, side force and pressure with their parts, from states and corrections as in
    ``BentStrip``. The three-point stencils of the states are those of stresses, as in ``Parts``, then those of
    ``peaks`` peaks of the reactions [N], the second of which times ``pressure_per_force`` [1/m^2] is a pressure."""
    stress = fibre_stresses(strip, states, stations, curvature_correction, axial_factor, bending_factor, inclined)
    utilisation_parts, stress_parts = part_values(stress, order, starts, utilisations, stresses, lines, parabola)
    out[UTILISATION], out[STRESS] = finite_log(utilisation_parts.max()), finite_log(stress_parts.max())
    for n in range(utilisation_parts.size):
        out[FIRST_PART + n] = finite_log(utilisation_parts[n])
    for n in range(stress_parts.size):
        out[FIRST_PART + utilisation_parts.size + n] = finite_log(stress_parts[n])
    reactions = np.empty((2, 3 * peaks))
    for i in range(3 * peaks):
        at = 3 * order.size + i
        side, moment = states[SIDE, at] + side_correction[at], states[MOMENT, at] + moment_correction[at]
        reactions[0, i] = abs(side)
        reactions[1, i] = abs(side) + strip.lever * abs(moment + side * strip.offset)
    reaction_rows(reactions, pressure_per_force, FIRST_PART + utilisation_parts.size + stress_parts.size, out)
