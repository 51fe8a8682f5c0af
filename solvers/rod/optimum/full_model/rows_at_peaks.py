"""All rows of a strip, evaluated at given peaks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.fatigue.kernels import Diagram
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod import rows
from solvers.rod.cycle.bent_strip import BentStrip, fibre_stresses
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE
from solvers.rod.optimum.full_model.smooth_parts import Parts, part_values
from solvers.rod.optimum.full_model.strip import FullStrip
from solvers.rod.optimum.peaks import Peaks, stencils
from solvers.rod.optimum.rows_at_samples import finite_log, peak_height, reaction_rows, set_buckled_rows
from solvers.rod.piston.skirt import contact_load, couple_of, pressure_per_load
from solvers.rod.scene import Scene


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
    def layout(self) -> rows.Layout:
        parts = self.parts
        return rows.Layout(parts.utilisations.shape[1], parts.stresses.shape[1], self.peaks.reactions.size)

    def __call__(self, strip: FullStrip) -> Array:
        """All rows of a strip, shape (rows,); those of the loads are invalid for a strip that buckles."""
        return self._rows(strip, strip.cycle.states(self._angles))

    def corrections(self, strip: FullStrip) -> Array:
        """Contribution of its corrections to the rows of a strip, (rows,); zero if it buckles."""
        states, uncorrected = strip.cycle.states(self._angles), FullStrip(strip.cycle.without_corrections())
        return self._rows(strip, states) - self._rows(uncorrected, states)

    def _rows(self, strip: FullStrip, states: Array) -> Array:
        """All rows of a strip from its states at the angles of the stencils."""
        out, piston, d = np.zeros(self.layout.size), self.scene.piston, strip.dimensions
        stations, critical = self._stations * d.l, strip.critical
        compression = max_peak_height(-states[FORCE, 3 * (self.peaks.angles.size + self.peaks.reactions.size) :])
        # A strip that buckles has no corrections.
        cycle = strip.cycle if compression < critical[0] else strip.cycle.without_corrections()
        shape = cycle.bent_strip(states)
        set_rows(
            shape, stations, shape.curvature_correction(stations), d.b, d.h, compression, *critical, self.parts,
            self.diagram, self.peaks.reactions.size, pressure_per_load(piston.diameter, piston.skirt_length), out,
        )  # fmt: skip
        if self.power and out[rows.POWER] != rows.BUCKLED:
            out[rows.POWER] = finite_log(strip.friction_power())
        return out

    @cached_property
    def _angles(self) -> Array:
        """Angles of the stencils of stresses, of reactions, and of the maximum compression [rad]."""
        p = self.peaks
        return stencils(np.concatenate([p.angles, p.reactions, p.compressions]), self.spacing)

    @cached_property
    def _stations(self) -> Array:
        """The sections' distances from the clamp, relative to the strip's length."""
        return 1.0 - self.peaks.stations()


@kernel
def max_peak_height(values: Array) -> float:
    """Maximum height of the parabolas through consecutive triples of samples."""
    out = -np.inf
    for i in range(0, values.size, 3):
        out = max(out, peak_height(values[i], values[i + 1], values[i + 2]))
    return out


@kernel
def set_rows(
    shape: BentStrip, stations: Array, correction: Array, b: float, h: float, compression: float, in_plane: float,
    out_of_plane: float, parts: Parts, diagram: Diagram, peaks: int, pressure_per_force: float, out: Array,
) -> None:  # fmt: skip
    """Set all rows but that of friction power, from the strip with its ``correction`` to V'' [1/m] at the stations, and
    the maximum compression and the critical forces in and out of the crank's plane [N]. The three-point stencils of its
    states are those of stresses, as in ``Parts``, then those of ``peaks`` peaks of the reactions [N], the second of
    which times ``pressure_per_force`` [1/m^2] is a pressure."""
    strip, states = shape.strip, shape.states
    out[rows.TAU], out[rows.LENGTH], out[rows.THICKNESS] = -math.log(b * h**3), math.log(strip.length), math.log(h)
    out[rows.STABILITY] = math.log(compression / in_plane) if compression > 0.0 else rows.NEVER_COMPRESSED
    out[rows.SIDEWAYS] = math.log(compression / out_of_plane) if compression > 0.0 else rows.NEVER_COMPRESSED
    if not out[rows.STABILITY] < 0.0:
        set_buckled_rows(out)
        return
    stress = fibre_stresses(strip, states, stations, correction, shape.inclined)
    utilisation_parts, stress_parts = part_values(stress, parts, diagram)
    out[rows.UTILISATION], out[rows.STRESS] = finite_log(utilisation_parts.max()), finite_log(stress_parts.max())
    for n in range(utilisation_parts.size):
        out[rows.FIRST_PART + n] = finite_log(utilisation_parts[n])
    for n in range(stress_parts.size):
        out[rows.FIRST_PART + utilisation_parts.size + n] = finite_log(stress_parts[n])
    reactions = np.empty((2, 3 * peaks))
    for i in range(3 * peaks):
        at = 3 * parts.order.size + i
        side = states[SIDE, at] + shape.side_correction[at]
        moment = states[MOMENT, at] + shape.moment_correction[at]
        reactions[0, i] = abs(side)
        reactions[1, i] = contact_load(abs(side), abs(couple_of(side, moment, strip.lever, strip.offset)))
    reaction_rows(reactions, pressure_per_force, rows.FIRST_PART + utilisation_parts.size + stress_parts.size, out)
    if not np.isfinite(out).all():
        set_buckled_rows(out)
