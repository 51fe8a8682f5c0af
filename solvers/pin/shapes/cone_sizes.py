"""The greatest size of a cone's shape, and how much a box of shapes can hold at most.

A shape (``tapers``) is fixed by which way it tapers, by r, its narrowest bore over its greatest, and by c, the share of
the half that the cone takes; its size is the greatest that strength, wall, deflection and slope allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.discretised import least_walls_at
from solvers.pin.optimum.program import Program
from solvers.pin.optimum.slope_limit import bore_of
from solvers.pin.section.flexibility import bending, phi
from solvers.pin.shapes.break_points.bar import kinks
from solvers.pin.shapes.cone_bounds import Rule, deflection_slopes, second_order, station_slopes
from solvers.pin.shapes.tapers import NARROWING, Box, Taper, lost_range, narrowest, widest
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES, interpolation

Array = NDArray[np.float64]
SMALL = 0.02
"""Boxes no wider than this are bounded to second order as well."""
_CELLS, _STRAIGHT, _SHORTEST = 512, 1e-8, 1e-10
"""For the corner of a widening cone the bore that strength allows is looked at in so many cells of the half at least,
cut until it is as straight as this in each, or they are as short."""
_ROOT = 1e-14
"""A size under a deflection limit is known from below, to this."""


@kernel
def _greatest_size(
    r: float, lost: Array, bore: Array, share: Array, bend: Array, shear: Array,
    a: float, b: float, limit: float, most: float,
) -> float:  # fmt: skip
    """The greatest size of a shape 1 - (1 - r) lost, over the outer diameter, up to ``most``."""
    size = most
    n = lost.size
    for i in range(n):
        shape = 1.0 - (1.0 - r) * lost[i]
        if bore[i] < size * shape:
            size = bore[i] / shape
    if limit == np.inf:
        return size
    # Regula falsi in limit/deflection - 1, which ends at -1 where nothing is left, with every fourth step a bisection.
    low, high, at_low, at_high, last = 0.0, size, 1.0, -1.0, 0
    for step in range(120):
        if step == 0:
            at = high
        elif step % 4 == 0:
            at = 0.5 * (low + high)
        else:
            least = 5e-16 * high
            at = min(max(low + (high - low) * at_low / (at_low - at_high), low + least), high - least)
        total = 0.0
        for i in range(n):
            if bend[i] == 0.0 and shear[i] == 0.0:
                continue
            d = at * (1.0 - (1.0 - r) * lost[i])
            u = (1.0 - d) * (1.0 + d)
            if u <= 0.0:
                total = np.inf
                break
            total += share[i] * (bend[i] * bending(u)[0] + shear[i] * phi(u, a, b))
        value = limit / total - 1.0 if total > 0.0 else np.inf
        if value >= 0.0:
            if step == 0:
                return size
            low, at_low = at, value
            if last == 1:
                at_high *= 0.5
            last = 1
        else:
            high, at_high = at, value
            if last == -1:
                at_low *= 0.5
            last = -1
        if high - low <= 1.2e-15 * high:
            break
    return low


@dataclass(frozen=True)
class _Nodes:
    """Places over the half's length, the widest bore that strength allows there over the outer diameter, and weights
    and coefficients of the deflection, (n,) each."""

    places: Array
    bore: Array
    share: Array
    bending: Array
    shear: Array

    @cached_property
    def bent(self) -> NDArray[np.bool_]:
        """The places that count in the deflection."""
        return (self.bending != 0.0) | (self.shear != 0.0)

    def split(self, x: Array, panel: int, ends: tuple[float, ...]) -> _Nodes:
        """The same with a panel, whose nodes are x, split at those of these places that lie in it: its old nodes stay
        for the strength, its parts count in the deflection."""
        begin, wide = x[0], x[-1] - x[0]
        cuts = np.array([0.0, *sorted((end - begin) / wide for end in set(ends) if x[0] < end < x[-1]), 1.0])
        within = (cuts[:-1, None] + np.diff(cuts)[:, None] * 0.5 * (1.0 + NODE_PLACES)).ravel()
        through, own = interpolation(2.0 * within - 1.0), slice(panel * NODES, (panel + 1) * NODES)
        bending, shear = self.bending.copy(), self.shear.copy()
        bending[own] = shear[own] = 0.0
        return _Nodes(
            np.concatenate([self.places, begin + wide * within]),
            np.concatenate([self.bore, np.full(within.size, math.inf)]),
            np.concatenate([self.share, np.outer(np.diff(cuts), self.share[own]).ravel()]),
            np.concatenate([bending, np.maximum(through @ self.bending[own], 0.0)]),
            np.concatenate([shear, np.maximum(through @ self.shear[own], 0.0)]),
        )


@dataclass(frozen=True)
class Cones:
    """The sizes of shapes of one taper on a program's stations."""

    program: Program
    taper: Taper = NARROWING

    @cached_property
    def _places(self) -> Array:
        return self.program.stations.x / (0.5 * self.program.scene.geometry.length)

    @cached_property
    def _bore(self) -> Array:
        """The widest bore that strength allows, over the outer diameter."""
        return bore_of(self.program, self.program.lower) / self.program.scene.geometry.outer_diameter

    @cached_property
    def _whole_panels(self) -> _Nodes:
        p = self.program
        return _Nodes(self._places, self._bore, p.share, p.bending, p.shear)

    @cached_property
    def _split(self) -> dict[tuple[float, ...], _Nodes]:
        return {}

    def nodes(self, *ends: float) -> _Nodes:
        """The stations, with panels split at these places, where a cone may end.

        A quadrature rule across that kink would be off by 1e-4 of the deflection, and a search would find the shapes
        for which that is in their favour. Moments and shear forces are polynomials in a panel: its own nodes give them
        at those of its parts.
        """
        if ends not in self._split:
            found = self._whole_panels
            for panel in sorted({self._panel_of(end) for end in ends} - {None}):
                found = found.split(self._places.reshape(-1, NODES)[panel], panel, ends)
            self._split[ends] = found
        return self._split[ends]

    def _panel_of(self, place: float) -> int | None:
        """The panel that counts in the deflection and has this place inside."""
        x = self._places.reshape(-1, NODES)
        panel = int(np.searchsorted(x[:, 0], place)) - 1
        inside = panel >= 0 and x[panel, 0] < place < x[panel, -1]
        return panel if inside and self._whole_panels.bent[panel * NODES : (panel + 1) * NODES].any() else None

    def shape(self, r: float, c: float) -> Array:
        """The bore at the stations over its greatest."""
        return 1.0 - (1.0 - r) * self.taper.lost(self._places, c)

    def size(self, shape: tuple[float, float], slope_at: tuple[float, float], corner: float) -> float:
        """Greatest size of a shape (r, c), ``corner`` at most; the slope limit, which loosens with r and c, at its own
        pair."""
        p, g, (r, c) = self.program, self.program.scene.geometry, shape
        limit = math.inf if p.limit is None else p.limit
        at = self.nodes(c)
        size = _greatest_size(
            r, self.taper.lost(at.places, c), at.bore, at.share, at.bending, at.shear, p.law.a, p.law.b, limit, corner
        )  # fmt: skip
        slope, (steep_r, steep_c) = p.limits.max_slope, slope_at
        if slope is not None and steep_r < 1.0:
            size = min(size, slope * steep_c * 0.5 * g.length / (g.outer_diameter * (1.0 - steep_r)))
        return size

    def corner(self, c0: float, c1: float) -> float:
        """The widest bore that strength allows where the cone of a widening shape ends, c in [c0, c1], or more: of all
        shapes only these are widest between stations."""
        if self.taper.turn > 0 or c0 >= 1.0:
            return 1.0
        if c0 == c1:
            return float(self._bore_at(np.array([c0]))[0])
        cells = self._cells(c0, c1)
        return float(np.max(np.maximum(self._edge_bore[cells], self._edge_bore[cells + 1]) + self._above[cells]))

    def _bore_at(self, places: Array) -> Array:
        p, half = self.program, 0.5 * self.program.scene.geometry.length
        return 1.0 - least_walls_at(p.scene, p.criterion, p.floor, half * places)

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """Edges of cells from 0 to 1, that bore there, and how far it may lie above a straight line between them, a
        kink in the cell included."""
        scene = self.program.scene
        edges = np.union1d(
            np.linspace(0.0, 1.0, _CELLS + 1), kinks(scene.cases, scene.geometry.length, scene.reference)
        )
        edges = edges[np.concatenate([[True], np.diff(edges) > _SHORTEST])]
        while True:
            bore, wide = self._bore_at(edges), np.diff(edges)
            bend = np.abs(np.diff(np.diff(bore) / wide))
            above = 0.5 * wide * np.maximum(np.append(bend, bend[-1]), np.insert(bend, 0, bend[0]))
            cut = (above > _STRAIGHT) & (wide > 2.0 * _SHORTEST)
            if not cut.any():
                return edges, bore, above
            edges = np.sort(np.concatenate([edges, 0.5 * (edges[:-1] + edges[1:])[cut]]))

    @property
    def _edge_bore(self) -> Array:
        return self._edges[1]

    @property
    def _above(self) -> Array:
        return self._edges[2]

    def _cells(self, c0: float, c1: float) -> NDArray[np.int64]:
        edges = self._edges[0]
        first, last = (int(k) for k in np.searchsorted(edges, (c0, c1), side="right"))
        return np.arange(max(first - 1, 0), max(min(last, edges.size - 1), first))

    def held(self, r: float, c: float) -> float:
        """Greatest size of a shape."""
        return self.size((r, c), (r, c), self.corner(c, c))

    def gain(self, r: float, c: float) -> float:
        """Volume of the greatest bore of this shape."""
        return self.held(r, c) ** 2 * self.taper.hollow(r, c)

    def most(self, box: Box) -> float:
        """No shape of the box holds more."""
        r0, r1, c0, c1 = box
        size = self.size(widest(self.taper, box), (r1, c1), self.corner(c0, c1))
        first = size**2 * self.taper.hollow(*narrowest(self.taper, box))
        # Far from small the range of slopes says nothing.
        if max(r1 - r0, c1 - c0) > SMALL:
            return first
        return min(first, second_order(self.taper, box, self._rules(box)))

    def _rules(self, box: Box) -> list[Rule]:
        """The rules that hold the shapes of a box: stations that are the weakest somewhere, deflection, slope."""
        p, g, taper = self.program, self.program.scene.geometry, self.taper
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
            at = self.nodes(c0, c1)
            slopes = deflection_slopes(
                r0, r1, float(taper.turn), least, most * (1.0 + _ROOT), *lost_range(taper, at.places, c0, c1),
                at.share, at.bending, at.shear, p.law.a, p.law.b,
            )  # fmt: skip
            rules.append(Rule(math.log(middle) + _ROOT, slopes))
        if p.limits.max_slope is not None and r1 < 1.0:
            allowed = p.limits.max_slope * 0.5 * g.length / g.outer_diameter
            slopes = (1.0 / (1.0 - r0), 1.0 / (1.0 - r1), 1.0 / c1, 1.0 / c0)
            rules.append(Rule(math.log(allowed * c / (1.0 - r)), slopes))
        return rules

    def _corner_rule(self, c0: float, c1: float) -> list[Rule]:
        """That of the place where a widening cone ends."""
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
        """The greatest size that the deflection allows, be it beyond the outer diameter where no load bends."""
        p, at = self.program, self.nodes(c)
        lost = self.taper.lost(at.places, c)
        widest_bent = float(np.max(1.0 - (1.0 - r) * lost[at.bent], initial=0.0))
        if p.limit is None or widest_bent <= 0.0:
            return math.inf
        return _greatest_size(
            r, lost, np.full(lost.size, math.inf), at.share, at.bending, at.shear, p.law.a, p.law.b, p.limit,
            1.0 / widest_bent,
        )  # fmt: skip
