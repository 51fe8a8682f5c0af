"""All rows of a strip, read at given peaks."""

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
    """The rows (``solvers.rod.rows``) of strips of a scene at ``peaks``, each followed by a parabola through angles
    ``apart`` [rad] from each other; friction power if it is wanted."""

    scene: Scene
    diagram: Diagram
    peaks: Peaks
    parts: Parts
    apart: float
    power: bool

    @cached_property
    def layout(self) -> Layout:
        parts = self.parts
        return Layout(parts.utilisations.shape[1], parts.stresses.shape[1], self.peaks.reactions.size)

    def __call__(self, strip: FullStrip) -> Array:
        """Shape (rows,)."""
        states = strip.cycle.states(self._angles)
        out = self._stability(strip, states)
        self._read_loads(strip, states, out)
        return out

    def added(self, strip: FullStrip) -> Array:
        """What its corrections add to the rows of a strip, (rows,); nothing where it buckles."""
        states = strip.cycle.states(self._angles)
        plain = self._stability(strip, states)
        out = plain.copy()
        self._read_loads(FullStrip(strip.cycle.without_corrections()), states, plain)
        self._read_loads(strip, states, out)
        return out - plain

    def _stability(self, strip: FullStrip, states: Array) -> Array:
        """The rows, so far those of sizes and of stability."""
        out, d = np.zeros(self.layout.size), strip.dimensions
        out[rows.TAU], out[rows.LENGTH], out[rows.THICKNESS] = -math.log(d.b * d.h**3), math.log(d.l), math.log(d.h)
        inside, outside = strip.critical
        pushed = highest(-states[FORCE, 3 * (self.peaks.angles.size + self.peaks.reactions.size) :])
        out[rows.STABILITY] = math.log(pushed / inside) if pushed > 0.0 else rows.NEVER_COMPRESSED
        out[rows.SIDEWAYS] = math.log(pushed / outside) if pushed > 0.0 else rows.NEVER_COMPRESSED
        return out

    def _read_loads(self, strip: FullStrip, states: Array, out: Array) -> None:
        """The other rows; of a strip that buckles they mean nothing."""
        if out[rows.STABILITY] < 0.0:
            parts, piston, d, shape = self.parts, self.scene.piston, strip.dimensions, strip.cycle.bent_strip(states)
            stations, modulus = (1.0 - self._stations) * d.l, self.scene.material.elastic_modulus
            read_loads(
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
        """Those of stresses, of reactions, and of the greatest compression."""
        p = self.peaks
        return np.concatenate(
            [p.stencils(self.apart), p.reaction_stencils(self.apart), p.compression_stencils(self.apart)]
        )

    @cached_property
    def _stations(self) -> Array:
        return self.peaks.stations()


@kernel
def highest(values: Array) -> float:
    """The height of the highest of parabolas through samples, three by three."""
    out = -np.inf
    for i in range(0, values.size, 3):
        out = max(out, peak_height(values[i], values[i + 1], values[i + 2]))
    return out


@kernel
def read_loads(
    strip: Strip, states: Array, stations: Array, more_bent: Array, more_side: Array, more_moment: Array,
    inclined: bool, direct: float, bending: float, order: Index, starts: Index, utilisations: Index, stresses: Index,
    lines: Array, parabola: Array, peaks: int, per_force: float, out: Array,
) -> None:  # fmt: skip
    """The rows of utilisation, stress, side force and pressure with their parts, from states and corrections as in
    ``BentStrip``: those of stresses, as in ``Parts``, and then of so many ``peaks`` of reactions [N], of the second of
    which ``per_force`` [1/m^2] makes a pressure, all at angles in three-point stencils."""
    stress = fibre_stresses(strip, states, stations, more_bent, direct, bending, inclined)
    used, strained = part_values(stress, order, starts, utilisations, stresses, lines, parabola)
    out[UTILISATION], out[STRESS] = finite_log(used.max()), finite_log(strained.max())
    for n in range(used.size):
        out[FIRST_PART + n] = finite_log(used[n])
    for n in range(strained.size):
        out[FIRST_PART + used.size + n] = finite_log(strained[n])
    reactions = np.empty((2, 3 * peaks))
    for i in range(3 * peaks):
        at = 3 * order.size + i
        side, moment = states[SIDE, at] + more_side[at], states[MOMENT, at] + more_moment[at]
        reactions[0, i] = abs(side)
        reactions[1, i] = abs(side) + strip.lever * abs(moment + side * strip.offset)
    reaction_rows(reactions, per_force, FIRST_PART + used.size + strained.size, out)
