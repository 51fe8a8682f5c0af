"""The maximum size of a cone's shape, and an upper bound of the bore volume over a box of shapes.

A shape (``tapers``) is defined by its direction of taper, by r, the ratio of its narrowest to its widest bore, and
by c, the fraction of the half that the cone occupies; its size is the greatest that strength, wall, deflection and
slope allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.discretised import least_walls_at
from solvers.pin.optimum.program import Program
from solvers.pin.optimum.slope_limit import bore_of
from solvers.pin.shapes.cone_bounds import Rule, deflection_slopes, second_order, station_slopes
from solvers.pin.shapes.cone_climb import climb, greatest_size, split
from solvers.pin.shapes.tapers import NARROWING, Box, Taper, lost_range, narrowest, widest
from solvers.pin.stations.lobatto_panels import NODES
from solvers.pin.stations.opening import kinks

Array = NDArray[np.float64]
Shape = tuple[float, float, float]
"""Maximum bore volume of a shape, its r and c."""
SMALL = 0.02
"""Box width up to which the second-order bound is used as well."""
_MIN_CELLS, _MIN_CELL_WIDTH = 64, 1e-10
"""Initial cells of the half for the allowed bore at a widening cone's corner, and their minimum width; cells are
split until the bore is linear in each to the tolerance of the bound."""
_SIZE_TOLERANCE = 1e-14
"""Relative error of a size under a deflection limit, which is a lower estimate."""
Nodes = tuple[Array, Array, Array, Array]
"""Positions relative to the half's length, with quadrature weights and deflection coefficients."""


@dataclass(frozen=True)
class Cones:
    """Sizes of shapes of one taper on a program's stations.

    ``straight`` is the relative tolerance of a bound for deviations between sampled positions.
    """

    program: Program
    taper: Taper = NARROWING
    straight: float = 1e-8

    @cached_property
    def _places(self) -> Array:
        return self.program.stations.x / (0.5 * self.program.scene.geometry.length)

    @cached_property
    def _bore(self) -> Array:
        """The widest bore that strength allows, relative to the outer diameter."""
        return bore_of(self.program, self.program.lower) / self.program.scene.geometry.outer_diameter

    @property
    def _limit(self) -> float:
        return math.inf if self.program.limit is None else self.program.limit

    @property
    def _steep(self) -> float:
        """Coefficient of the slope limit: the size is at most this times c/(1 - r)."""
        slope, g = self.program.limits.max_slope, self.program.scene.geometry
        return math.inf if slope is None else slope * 0.5 * g.length / g.outer_diameter

    def nodes(self, *ends: float) -> Nodes:
        """Return the stations, with panels split at the cone ends (see ``cone_climb.split``)."""
        p = self.program
        work = np.empty((4, self._places.size + 2 * NODES * len(ends)))
        count = split(np.array(sorted(ends)), self._places, p.share, p.bending, p.shear, *work)
        return tuple(row[:count] for row in work)

    def shape(self, r: float, c: float) -> Array:
        """Return the bore at the stations relative to its maximum."""
        return 1.0 - (1.0 - r) * self.taper.lost(self._places, c)

    def size(self, shape: tuple[float, float], slope_at: tuple[float, float], corner: float) -> float:
        """Return the maximum size of a shape (r, c), at most ``corner``.

        The slope limit, which relaxes with r and c, is evaluated at its own pair ``slope_at``.
        """
        (r, c), (steep_r, steep_c) = shape, slope_at
        size = self._greatest(r, c, self._bore, corner)
        return size if steep_r == 1.0 else min(size, self._steep * steep_c / (1.0 - steep_r))

    def _greatest(self, r: float, c: float, bore: Array, most: float) -> float:
        p = self.program
        at = self.nodes(c) if p.limit is not None else (self._places, p.share, p.bending, p.shear)
        return greatest_size(
            self.taper.turn, r, c, self._places, bore, *at, p.law.a, p.law.b, self._limit, most
        )  # fmt: skip

    def closed_in(self, rs: Array, cs: Array, c_range: tuple[float, float], least_step: float) -> Shape:
        """Return the best shape of a grid, refined by pattern search with steps down to ``least_step``."""
        p, none = self.program, np.empty(0)
        at_corner = self.taper.turn < 0 and c_range[0] < c_range[1]
        edges, bore = self._edges[:2] if at_corner else (none, none)
        _, r, c = climb(
            self.taper.turn, rs, cs, *c_range, least_step, edges, bore, self._steep, self._places, self._bore, p.share,
            p.bending, p.shear, p.law.a, p.law.b, self._limit,
        )  # fmt: skip
        return self.gain(r, c), r, c

    def corner(self, c0: float, c1: float) -> float:
        """Return an upper bound of the allowed bore at the corner of a widening cone, c in [c0, c1].

        Only these shapes are widest between stations.
        """
        if self.taper.turn > 0 or c0 >= 1.0:
            return 1.0
        if c0 == c1:
            return float(self._bore_at(np.array([c0]))[0])
        cells = self._cells(c0, c1)
        _, bore, above = self._edges
        return float(np.max(np.maximum(bore[cells], bore[cells + 1]) + above[cells]))

    def _bore_at(self, places: Array) -> Array:
        p, half = self.program, 0.5 * self.program.scene.geometry.length
        return 1.0 - least_walls_at(p.scene, p.criterion, p.floor, half * places)

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """Cell edges from 0 to 1, the allowed bore there, and its maximum excess over linear interpolation in each
        cell, including a kink in the cell."""
        scene = self.program.scene
        edges = np.union1d(np.linspace(0.0, 1.0, _MIN_CELLS + 1), kinks(scene))
        edges = edges[np.concatenate([[True], np.diff(edges) > _MIN_CELL_WIDTH])]
        while True:
            bore, wide = self._bore_at(edges), np.diff(edges)
            bend = np.abs(np.diff(np.diff(bore) / wide))
            above = 0.5 * wide * np.maximum(np.append(bend, bend[-1]), np.insert(bend, 0, bend[0]))
            cut = (above > self.straight) & (wide > 2.0 * _MIN_CELL_WIDTH)
            if not cut.any():
                return edges, bore, above
            edges = np.sort(np.concatenate([edges, 0.5 * (edges[:-1] + edges[1:])[cut]]))

    def _cells(self, c0: float, c1: float) -> NDArray[np.int64]:
        edges = self._edges[0]
        first, last = (int(k) for k in np.searchsorted(edges, (c0, c1), side="right"))
        return np.arange(max(first - 1, 0), max(min(last, edges.size - 1), first))

    def held(self, r: float, c: float) -> float:
        """Return the maximum size of a shape."""
        return self.size((r, c), (r, c), self.corner(c, c))

    def gain(self, r: float, c: float) -> float:
        """Return the maximum bore volume of a shape."""
        return self.held(r, c) ** 2 * self.taper.hollow(r, c)

    def most(self, box: Box) -> float:
        """Return an upper bound of the bore volume over the box."""
        r0, r1, c0, c1 = box
        size = self.size(widest(self.taper, box), (r1, c1), self.corner(c0, c1))
        first = size**2 * self.taper.hollow(*narrowest(self.taper, box))
        # On large boxes the slope ranges are too wide to be useful.
        if max(r1 - r0, c1 - c0) > SMALL:
            return first
        return min(first, second_order(self.taper, box, self._rules(box)))

    def _rules(self, box: Box) -> list[Rule]:
        """Return the rules that limit a box's shapes: stations critical for some shape, deflection, slope."""
        p, taper = self.program, self.taper
        r0, r1, c0, c1 = box
        r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
        t, bore, middle_shape = self._places, self._bore, self.shape(r, c)
        weakest: set[int] = set()
        with np.errstate(divide="ignore"):
            for shape in (middle_shape, self.shape(r0, c1), self.shape(r1, c0)):
                weakest.add(int(np.argmin(bore / shape)))
        rules = [Rule(0.0, (0.0, 0.0, 0.0, 0.0)), *self._corner_rule(c0, c1)]
        for i in weakest:
            if bore[i] > 0.0 and middle_shape[i] > 0.0:
                rules.append(Rule(math.log(bore[i] / middle_shape[i]), station_slopes(taper, box, float(t[i]))))
        least, middle = self.stiff(*narrowest(taper, box)), self.stiff(r, c)
        most = self.stiff(*widest(taper, box))
        if least > 0.0 and math.isfinite(most):
            places, *weighed = self.nodes(c0, c1)
            slopes = deflection_slopes(
                r0, r1, float(taper.turn), least, most * (1.0 + _SIZE_TOLERANCE), *lost_range(taper, places, c0, c1),
                *weighed, p.law.a, p.law.b,
            )  # fmt: skip
            rules.append(Rule(math.log(middle) + _SIZE_TOLERANCE, slopes))
        if p.limits.max_slope is not None and r1 < 1.0:
            slopes = (1.0 / (1.0 - r0), 1.0 / (1.0 - r1), 1.0 / c1, 1.0 / c0)
            rules.append(Rule(math.log(self._steep * c / (1.0 - r)), slopes))
        return rules

    def _corner_rule(self, c0: float, c1: float) -> list[Rule]:
        """Return the rule of the corner where a widening cone ends."""
        if self.taper.turn > 0 or c0 >= 1.0:
            return []
        edges, values, above = self._edges
        cells = self._cells(c0, c1)
        bore = values[cells[0] : cells[-1] + 2]
        least, most = float(bore.min()), float(bore.max())
        if least <= 0.0:
            return []
        slopes = np.diff(bore) / np.diff(edges[cells[0] : cells[-1] + 2])
        low, high = float(slopes.min()), float(slopes.max())
        low, high = low / (most if low > 0.0 else least), high / (least if high > 0.0 else most)
        at = float(np.interp(0.5 * (c0 + c1), edges, values))
        return [Rule(math.log(at) + float(above[cells].max()) / least, (0.0, 0.0, low, high))]

    def stiff(self, r: float, c: float) -> float:
        """Return the maximum size under the deflection limit, possibly above the outer diameter in unloaded
        sections."""
        p = self.program
        bent = self._places[(p.bending != 0.0) | (p.shear != 0.0)]
        widest_bent = float(np.max(1.0 - (1.0 - r) * self.taper.lost(bent, c), initial=0.0))
        if p.limit is None or widest_bent <= 0.0:
            return math.inf
        return self._greatest(r, c, np.full_like(self._bore, math.inf), 1.0 / widest_bent)
