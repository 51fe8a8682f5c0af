"""Bores of straight lines: a double cone, and a cone from each end that runs into a cylinder in the middle.

A shape (``tapers``) is fixed by which way it tapers, by r, its narrowest bore over its greatest, and by c, the share of
the half that the cone takes; its size is the greatest that strength, wall, deflection and slope allow. Where the shape
is wider everywhere its greatest size falls and its volume per size grows: on a box of (r, c) the size at one corner and
the shape at the opposite one bound the bore's volume, and branch and bound closes in on the best cone of either way.
Small boxes are bounded to second order as well (``cone_bounds``).
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.discretised import assemble, least_walls_at
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.program import Program, folded, refined, unfolded
from solvers.pin.optimum.slope_limit import bore_of
from solvers.pin.section.flexibility import bending, phi
from solvers.pin.section.variables import solidity_of
from solvers.pin.shapes.break_points.bar import kinks
from solvers.pin.shapes.cone_bounds import Rule, deflection_slopes, second_order, station_slopes
from solvers.pin.shapes.tapers import NARROWING, WIDENING, Box, Taper, lost_range, narrowest, widest
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES, interpolation

Array = NDArray[np.float64]
Shape = tuple[float, float, float]
"""Volume of the greatest bore of a shape, its r and c."""
_BOXES = {False: 20_000, True: 8_000}
"""How many boxes are looked at without and with a deflection limit, which costs a root for each."""
_SMALL = 0.02
"""Boxes no wider than this are bounded to second order as well."""
_SLENDER = 64.0
"""Boxes this much longer than wide are cut across."""
_CELLS, _STRAIGHT, _SHORTEST = 512, 1e-8, 1e-10
"""For the corner of a widening cone the bore that strength allows is looked at in so many cells of the half at least,
cut until it is as straight as this in each, or they are as short."""
_GAP = 8e-8
"""How close bound and best come, relative, whatever the accuracy asked of the mass itself."""
_ROOT = 1e-14
"""A size under a deflection limit is known from below, to this."""
_LOOKS = 12
"""How often the best shape is sought anew on stations that lie closer where the last one touched the walls."""
_ZOOMS, _NEAR, _NARROWEST = 16, 1e-4, 1e-4
"""Halvings of the panels that come this near, relative, to touching; shorter shares of the length are not halved."""


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
class _Cones:
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
        if max(r1 - r0, c1 - c0) > _SMALL:
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
        least, middle = self._stiff(*narrowest(taper, box)), self._stiff(r, c)
        most = self._stiff(*widest(taper, box))
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

    def _stiff(self, r: float, c: float) -> float:
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


def _best(
    cones: _Cones, c_range: tuple[float, float], gap: float, boxes: int, start: Shape, known: float
) -> tuple[Shape, float, int]:
    """(the best shape, an bound of every bore's volume, boxes looked at) by branch and bound, the widest promise first.

    ``start`` is a shape to begin with. Ends as soon as nothing beats ``known``, the volume of another bore.
    """
    whole = (0.0, 1.0, *c_range)
    found = start
    queue = [(-cones.most(whole), whole)]
    looked = 0
    while queue and looked < boxes:
        best = max(found[0], known)
        if -queue[0][0] - best <= gap * (1.0 - best):
            break
        _, (r0, r1, c0, c1) = heapq.heappop(queue)
        looked += 1
        middle = (0.5 * (r0 + r1), 0.5 * (c0 + c1))
        across = (r0, middle[0], c0, c1), (middle[0], r1, c0, c1)
        along = (r0, r1, c0, middle[1]), (r0, r1, middle[1], c1)
        wide, long = r1 - r0, c1 - c0
        if max(wide, long) <= _SMALL and wide < _SLENDER * long and long < _SLENDER * wide:
            # Near a ridge or on a short cone one side counts most: the better cut is told by trying both.
            halves = min(_halves(cones, across), _halves(cones, along), key=lambda pair: -sum(lost for lost, _ in pair))
        else:
            halves = _halves(cones, across if wide >= long else along)
        for lost, box in halves:
            if -lost > max(found[0], known):
                heapq.heappush(queue, (lost, box))
        gain = cones.gain(*middle)
        if gain > found[0]:
            found = _climb(cones, (gain, *middle), c_range)
    bound = max(-queue[0][0] if queue else 0.0, found[0], known)
    return found, bound, looked


def _halves(cones: _Cones, boxes: tuple[Box, Box]) -> list[tuple[float, Box]]:
    """Boxes with what they can hold at most, its sign turned; the one that promises most first."""
    return sorted((-cones.most(box), box) for box in boxes)


def _sampled(cones: _Cones, c_range: tuple[float, float]) -> Shape:
    """The best of some shapes, closed in on."""
    shapes = ((r, c) for r in np.linspace(0, 1, 21).tolist() for c in np.unique(np.linspace(*c_range, 9)).tolist())
    return _climb(cones, max((cones.gain(r, c), r, c) for r, c in shapes), c_range)


def _climb(cones: _Cones, start: Shape, c_range: tuple[float, float]) -> Shape:
    """Pattern search from a shape: sixteen directions, steps that double on success and halve otherwise."""
    gain, r, c = start
    step = 0.05
    moves = [(math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(16)]
    if c_range[0] == c_range[1]:
        moves = [(1.0, 0.0), (-1.0, 0.0)]
    while step > 1e-13:
        for dr, dc in moves:
            r1 = min(max(r + step * dr, 0.0), 1.0)
            c1 = min(max(c + step * dc, c_range[0]), c_range[1])
            trial = cones.gain(r1, c1)
            if trial > gain:
                gain, r, c = trial, r1, c1
                step *= 2.0
                break
        else:
            step *= 0.5
    return gain, r, c


@dataclass(frozen=True)
class Cone:
    """A double cone, or with ``cylinder`` a cone at each end and a cylinder between; narrowest in the middle or at the
    ends, whichever is lighter."""

    cylinder: bool = False

    @property
    def name(self) -> str:
        return "cone_cylinder" if self.cylinder else "double_cone"

    def find(self, program: Program, gap: float) -> Found | None:
        g, solid = program.scene.geometry, np.ones_like(program.lower)
        if program.limit is not None and program.deflection(solid) > program.limit * (1.0 + 1e-12):
            return None
        looked_at = program
        c_range, wanted = (1e-3, 1.0) if self.cylinder else (1.0, 1.0), _GAP
        boxes = 0
        allowed, bounds = _BOXES[program.limit is not None], {NARROWING: math.inf, WIDENING: math.inf}
        for _ in range(_LOOKS):
            ways = {taper: _Cones(folded(looked_at), taper) for taper in bounds}
            found = {taper: _sampled(cones, c_range) for taper, cones in ways.items()}
            for taper in sorted(found, key=found.get, reverse=True):
                best = max(found.values())[0]
                # A bound on fewer stations holds as well.
                if bounds[taper] - best > wanted * (1.0 - best):
                    found[taper], bounds[taper], looked = _best(
                        ways[taper], c_range, wanted, allowed, found[taper], best
                    )  # fmt: skip
                    boxes += looked
            taper = max(found, key=found.get)
            _, r, c = found[taper]
            # Stations say nothing of what lies between them, nor rules of the corner that a cone ends in.
            looked_at, size = _closer(looked_at, taper, r, c), ways[taper].held(r, c)
            held = min(size, _Cones(folded(looked_at), taper).held(r, c))
            if size - held <= 0.1 * wanted * size:
                break
            bounds[taper] = math.inf
        most = max(bounds.values())
        size = held
        gain = size * size * taper.hollow(r, c)

        def bored(half: Program) -> Array:
            return solidity_of(1.0 - size * _Cones(half, taper).shape(r, c))

        end, middle = (size * g.outer_diameter * share for share in taper.diameters(r))
        evidence: dict[str, float | int | str] = {"boxes": boxes, "cone_share": c}
        evidence["narrowing" if taper == NARROWING else "widening"] = r
        if program.limit is not None:
            half = folded(looked_at)
            evidence["deflection_as_constrained_um"] = 1e6 * half.deflection(bored(half))
        solidity, cone = bored(folded(program)), c * 0.5 * g.length
        corners = [(0.0, end), (cone, middle)] + ([(g.length - cone, middle)] if c < 1.0 else []) + [(g.length, end)]
        return Found(
            unfolded(program, solidity), float(1.0 - gain), float(min(1.0 - most, 1.0 - gain)),
            "branch and bound over the cone's shape, narrowing and widening", evidence, corners=tuple(corners),
        )  # fmt: skip


def _closer(program: Program, taper: Taper, r: float, c: float) -> Program:
    """The program with a panel's end where the cone ends, and ever shorter panels where it touches the walls."""
    g = program.scene.geometry
    place = c * 0.5 * g.length
    stations = program.stations.cut((place,) if program.scene.symmetric else (place, g.length - place))
    for _ in range(_ZOOMS):
        finer = assemble(program.scene, program.limits, program.criterion, program.physics, stations, program.law)
        t = np.minimum(stations.x, g.length - stations.x) / (0.5 * g.length)
        with np.errstate(divide="ignore"):
            room = bore_of(finer, finer.lower) / (1.0 - (1.0 - r) * taper.lost(t, c))
        panels = room.reshape(-1, NODES).min(axis=1)
        touched = (panels <= panels.min() * (1.0 + _NEAR)) & (stations.right - stations.left > _NARROWEST * g.length)
        if not touched.any():
            break
        stations = refined(finer, touched)
    return finer
