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
from solvers.rod.optimum.full_strip import FullStrip
from solvers.rod.optimum.peak_model import buckled_rows, log, peak, reaction_rows
from solvers.rod.optimum.peaks import Peaks
from solvers.rod.optimum.smooth_parts import Index, Parts, part_values
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
        out, d = np.zeros(self.layout.size), strip.dimensions
        out[rows.TAU], out[rows.LENGTH], out[rows.THICKNESS] = -math.log(d.b * d.h**3), math.log(d.l), math.log(d.h)
        pushed = highest(-strip.cycle.axial_force(self._pushed))
        for row, critical in zip((rows.STABILITY, rows.SIDEWAYS), strip.critical, strict=True):
            out[row] = math.log(pushed / critical) if pushed > 0.0 else rows.NEVER_COMPRESSED
        if out[rows.STABILITY] < 0.0:
            self._read_loads(strip, out)
        if out[rows.STABILITY] >= 0.0 or not np.isfinite(out).all():
            buckled_rows(out)
        return out

    def _read_loads(self, strip: FullStrip, out: Array) -> None:
        """The other rows of a strip that does not buckle."""
        parts, piston = self.parts, self.scene.piston
        reactions = strip.reactions(self._reactions) if self._reactions.size else np.empty((2, 0))
        read_loads(
            strip.stresses(self._angles, self._stations), parts.order, parts.starts, parts.utilisations, parts.stresses,
            *self.diagram, reactions, pressure_per_load(piston.diameter, piston.skirt_length), out,
        )  # fmt: skip
        if self.power:
            out[rows.POWER] = log(strip.friction_power())

    @cached_property
    def _angles(self) -> Array:
        return self.peaks.threes(self.apart)

    @cached_property
    def _stations(self) -> Array:
        return self.peaks.stations()

    @cached_property
    def _pushed(self) -> Array:
        return self.peaks.pushed_threes(self.apart)

    @cached_property
    def _reactions(self) -> Array:
        return self.peaks.reaction_threes(self.apart)


@kernel
def highest(values: Array) -> float:
    """The height of the highest of parabolas through samples, three by three."""
    out = -np.inf
    for i in range(0, values.size, 3):
        out = max(out, peak(values[i], values[i + 1], values[i + 2]))
    return out


@kernel
def read_loads(
    stress: Array, order: Index, starts: Index, utilisations: Index, stresses: Index, lines: Array, parabola: Array,
    reactions: Array, per_force: float, out: Array,
) -> None:  # fmt: skip
    """The rows of utilisation, stress, side force and pressure with their parts, from samples at the peaks: stresses
    [Pa] (2, sections, 3 angles), reactions (2, 3 angles) [N], of the second of which ``per_force`` [1/m^2] makes a
    pressure."""
    used, strained = part_values(stress, order, starts, utilisations, stresses, lines, parabola)
    out[UTILISATION], out[STRESS] = log(used.max()), log(strained.max())
    for n in range(used.size):
        out[FIRST_PART + n] = log(used[n])
    for n in range(strained.size):
        out[FIRST_PART + used.size + n] = log(strained[n])
    reaction_rows(reactions, per_force, FIRST_PART + used.size + strained.size, out)
