"""All rows of strips, read at given peaks: of several strips side by side, as most of the time goes into each call."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue.kernels import Diagram
from solvers.rod import rows
from solvers.rod.optimum.full_strip import FullStrip
from solvers.rod.optimum.peak_model import buckled_rows
from solvers.rod.optimum.peaks import Peaks
from solvers.rod.optimum.smooth_parts import Parts, vertex
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.rows import Layout
from solvers.rod.scene import Scene

Array = NDArray[np.float64]

_LEAST = 1e-300


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

    def __call__(self, strips: Sequence[FullStrip]) -> Array:
        """Shape (strips, rows)."""
        out = np.zeros((len(strips), self.layout.size))
        for k, strip in enumerate(strips):
            d = strip.dimensions
            out[k, rows.TAU], out[k, rows.LENGTH] = -math.log(d.b * d.h**3), math.log(d.l)
            out[k, rows.THICKNESS] = math.log(d.h)
        out[:, [rows.STABILITY, rows.SIDEWAYS]] = self._stability(strips)
        standing = np.flatnonzero(out[:, rows.STABILITY] < 0.0)
        if standing.size:
            out[standing] += self._loads([strips[k] for k in standing])
        for k, own in enumerate(out):
            if own[rows.STABILITY] >= 0.0 or not np.isfinite(own).all():
                buckled_rows(out[k])
        return out

    def _stability(self, strips: Sequence[FullStrip]) -> Array:
        """ln of compression over critical force, in the crank's plane and out of it, (strips, 2)."""
        force = np.stack([strip.cycle.axial_force(self._pushed) for strip in strips]).reshape(len(strips), -1, 3)
        pushed = np.max(vertex(*np.moveaxis(-force, 2, 0)), axis=1)[:, None]
        critical = np.array([strip.critical for strip in strips])
        return np.where(pushed > 0.0, np.log(np.maximum(pushed, _LEAST) / critical), rows.NEVER_COMPRESSED)

    def _loads(self, strips: Sequence[FullStrip]) -> Array:
        """The other rows of strips that do not buckle, (strips, rows)."""
        out = np.zeros((len(strips), self.layout.size))
        stresses = np.stack([strip.stresses(self._angles, self._stations) for strip in strips])
        used, strained = self.parts.values(stresses, self.diagram)
        self._put(out, rows.UTILISATION, used)
        self._put(out, rows.STRESS, strained)
        if self.peaks.reactions.size:
            reactions = np.stack([strip.reactions(self._reactions) for strip in strips])
            side, contact = vertex(*np.moveaxis(reactions.reshape(len(strips), 2, -1, 3), 3, 0)).swapaxes(0, 1)
            piston = self.scene.piston
            self._put(out, rows.SIDE, side)
            self._put(out, rows.PRESSURE, contact * pressure_per_load(piston.diameter, piston.skirt_length))
        if self.power:
            out[:, rows.POWER] = [math.log(max(strip.friction_power(), _LEAST)) for strip in strips]
        return out

    def _put(self, out: Array, row: int, parts: Array) -> None:
        """A row and its parts, (strips, parts)."""
        logs = np.log(np.maximum(parts, _LEAST))
        out[:, self.layout.parts(row)], out[:, row] = logs, logs.max(axis=1)

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
