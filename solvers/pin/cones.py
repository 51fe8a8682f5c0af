"""Bores of straight lines: a double cone, and a cone from each end that runs into a cylinder in the middle.

A shape is fixed by r = d_middle/d_end and by c, the share of the half that the cone takes; its size is the greatest
that strength, wall, deflection and slope allow. Where r or c grow the shape is wider everywhere, so its greatest size
falls and its volume per size grows: on a box of (r, c) the size at the least corner and the shape at the greatest
corner bound the bore's volume, and branch and bound closes in on the best cone. Under a deflection limit small boxes
are bounded to second order as well (``cone_bounds``).
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.cone_bounds import Box, Rule, deflection_slopes, hollow, second_order, station_slopes
from solvers.pin.flexibility import bending, phi
from solvers.pin.form import Found
from solvers.pin.program import Program, assemble, bore_of, folded, refined, unfolded
from solvers.pin.section import solidity_of
from solvers.pin.stations import NODES

Array = NDArray[np.float64]
_BOXES = {False: 20_000, True: 8_000}
"""How many boxes are looked at without and with a deflection limit, which costs a root for each."""
_SMALL = 0.02
"""Boxes no wider than this are bounded to second order as well."""
_SLENDER = 64.0
"""Boxes this much longer than wide are cut across."""
_ROOT = 1e-14
"""A size under a deflection limit is known from below, to this."""
_LOOKS = 12
"""How often the best shape is sought anew on stations that lie closer where the last one touched the walls."""
_ZOOMS, _NEAR, _NARROWEST = 16, 1e-4, 1e-4
"""Halvings of the panels that come this near, relative, to touching; shorter shares of the length are not halved."""


@kernel
def _greatest_size(
    r: float, c: float, t: Array, bore: Array, share: Array, bend: Array, shear: Array,
    a: float, b: float, limit: float, most: float,
) -> float:  # fmt: skip
    """The greatest end bore of (r, c), over the outer diameter, up to ``most``; stations t = x/(L/2) in [0, 1]."""
    size = most
    n = t.size
    for i in range(n):
        shape = 1.0 - (1.0 - r) * min(t[i] / c, 1.0)
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
            d = at * (1.0 - (1.0 - r) * min(t[i] / c, 1.0))
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
class _Cones:
    """The sizes of shapes on a program's stations."""

    program: Program

    @cached_property
    def _places(self) -> Array:
        return self.program.stations.x / (0.5 * self.program.scene.geometry.length)

    @cached_property
    def _bore(self) -> Array:
        """The widest bore that strength allows, over the outer diameter."""
        return bore_of(self.program, self.program.lower) / self.program.scene.geometry.outer_diameter

    @cached_property
    def _first_bent(self) -> float:
        """The first place that counts in the deflection; inf where none does."""
        p = self.program
        return float(np.min(self._places[(p.bending != 0.0) | (p.shear != 0.0)], initial=math.inf))

    @cached_property
    def _deflection(self) -> tuple[Array, Array, Array]:
        return self.program.share, self.program.bending, self.program.shear

    def size(self, r: float, c: float, steep_r: float, steep_c: float) -> float:
        """Greatest size of (r, c); the slope limit, which loosens with r and tightens with small c, at its own pair."""
        p, g = self.program, self.program.scene.geometry
        limit = math.inf if p.limit is None else p.limit
        size = _greatest_size(
            r, c, self._places, self._bore, *self._deflection, p.law.a, p.law.b, limit, 1.0,
        )  # fmt: skip
        slope = p.limits.max_slope
        if slope is not None and steep_r < 1.0:
            size = min(size, slope * steep_c * 0.5 * g.length / (g.outer_diameter * (1.0 - steep_r)))
        return size

    def gain(self, r: float, c: float) -> float:
        """Volume of the greatest bore of this shape."""
        return self.size(r, c, r, c) ** 2 * hollow(r, c)

    def most(self, box: Box) -> float:
        """No shape of the box holds more."""
        r0, r1, c0, c1 = box
        first = self.size(r0, c0, r1, c1) ** 2 * hollow(r1, c1)
        # Far from small the range of slopes says nothing.
        if self.program.limit is None or max(r1 - r0, c1 - c0) > _SMALL:
            return first
        return min(first, second_order(box, self._rules(box)))

    def _rules(self, box: Box) -> list[Rule]:
        """The rules that hold the shapes of a box: stations that are the weakest somewhere, deflection, slope."""
        p, g = self.program, self.program.scene.geometry
        r0, r1, c0, c1 = box
        r, c = 0.5 * (r0 + r1), 0.5 * (c0 + c1)
        t, bore = self._places, self._bore
        weakest: set[int] = set()
        with np.errstate(divide="ignore"):
            for r_at, c_at in ((r, c), (r0, c1), (r1, c0)):
                weakest.add(int(np.argmin(bore / (1.0 - (1.0 - r_at) * np.minimum(t / c_at, 1.0)))))
        rules = [Rule(0.0, (0.0, 0.0, 0.0, 0.0))]
        for i in weakest:
            shape = 1.0 - (1.0 - r) * min(t[i] / c, 1.0)
            if bore[i] > 0.0 and shape > 0.0:
                rules.append(Rule(math.log(bore[i] / shape), station_slopes(box, float(t[i]))))
        least, middle, most = self._stiff(r1, c1), self._stiff(r, c), self._stiff(r0, c0)
        if least > 0.0 and math.isfinite(most):
            slopes = deflection_slopes(*box, least, most * (1.0 + _ROOT), t, *self._deflection, p.law.a, p.law.b)
            rules.append(Rule(math.log(middle) + _ROOT, slopes))
        if p.limits.max_slope is not None and r1 < 1.0:
            allowed = p.limits.max_slope * 0.5 * g.length / g.outer_diameter
            slopes = (1.0 / (1.0 - r0), 1.0 / (1.0 - r1), 1.0 / c1, 1.0 / c0)
            rules.append(Rule(math.log(allowed * c / (1.0 - r)), slopes))
        return rules

    def _stiff(self, r: float, c: float) -> float:
        """The greatest size that the deflection allows, be it beyond the outer diameter where no load bends."""
        p = self.program
        narrowest = 1.0 - (1.0 - r) * min(self._first_bent / c, 1.0)
        if self._first_bent == math.inf or narrowest <= 0.0:
            return math.inf
        return _greatest_size(
            r, c, self._places, self._endless, *self._deflection, p.law.a, p.law.b, p.limit,
            1.0 / narrowest,
        )  # fmt: skip

    @cached_property
    def _endless(self) -> Array:
        return np.full(self._bore.size, math.inf)


def _best(
    cones: _Cones, c_range: tuple[float, float], gap: float, boxes: int
) -> tuple[float, float, float, float, int]:
    """(r, c, bore volume, its upper bound, boxes looked at) by branch and bound, the widest promise first."""
    whole = (0.0, 1.0, *c_range)
    found = max((cones.gain(r, c), r, c) for r in np.linspace(0, 1, 21) for c in np.unique(np.linspace(*c_range, 9)))
    found = _climb(cones, found, c_range)
    queue = [(-cones.most(whole), whole)]
    looked = 0
    while queue and looked < boxes:
        if -queue[0][0] - found[0] <= gap * (1.0 - found[0]):
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
            if -lost > found[0]:
                heapq.heappush(queue, (lost, box))
        gain = cones.gain(*middle)
        if gain > found[0]:
            found = _climb(cones, (gain, *middle), c_range)
    bound = max(-queue[0][0], found[0]) if queue else found[0]
    return float(found[1]), float(found[2]), found[0], bound, looked


def _halves(cones: _Cones, boxes: tuple[Box, Box]) -> list[tuple[float, Box]]:
    """Boxes with what they can hold at most, its sign turned; the one that promises most first."""
    return sorted((-cones.most(box), box) for box in boxes)


def _climb(
    cones: _Cones, start: tuple[float, float, float], c_range: tuple[float, float]
) -> tuple[float, float, float]:
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
    """A double cone, or with ``cylinder`` a cone at each end and a cylinder between."""

    cylinder: bool = False

    @property
    def name(self) -> str:
        return "cone_cylinder" if self.cylinder else "double_cone"

    def find(self, program: Program, gap: float) -> Found | None:
        g, solid = program.scene.geometry, np.ones_like(program.lower)
        if program.limit is not None and program.deflection(solid) > program.limit * (1.0 + 1e-12):
            return None
        looked_at = program
        c_range, wanted = (1e-3, 1.0) if self.cylinder else (1.0, 1.0), min(max(gap, 1e-8), 8e-8)
        boxes = 0
        for _ in range(_LOOKS):
            half = folded(looked_at)
            r, c, _, most, looked = _best(_Cones(half), c_range, wanted, _BOXES[half.limit is not None])
            boxes += looked
            # Stations say nothing of what lies between them, nor rules of the corner that a cone ends in.
            looked_at, size = _closer(looked_at, r, c), _Cones(half).size(r, c, r, c)
            held = min(size, _Cones(folded(looked_at)).size(r, c, r, c))
            if size - held <= 0.1 * wanted * size:
                break
        size = held
        gain = size * size * hollow(r, c)

        def bored(half: Program) -> Array:
            t = half.stations.x / (0.5 * g.length)
            return solidity_of(1.0 - size * (1.0 - (1.0 - r) * np.minimum(t / c, 1.0)))

        evidence = {"boxes": boxes, "narrowing": r, "cone_share": c}
        if program.limit is not None:
            half = folded(looked_at)
            evidence["deflection_as_constrained_um"] = 1e6 * half.deflection(bored(half))
        solidity = bored(folded(program))
        end, middle, cone = size * g.outer_diameter, size * r * g.outer_diameter, c * 0.5 * g.length
        corners = [(0.0, end), (cone, middle)] + ([(g.length - cone, middle)] if c < 1.0 else []) + [(g.length, end)]
        return Found(
            unfolded(program, solidity), float(1.0 - gain), float(min(1.0 - most, 1.0 - gain)),
            "branch and bound over the cone's shape", evidence, corners=tuple(corners),
        )  # fmt: skip


def _closer(program: Program, r: float, c: float) -> Program:
    """The program with a panel's end where the cone ends, and ever shorter panels where it touches the walls."""
    g = program.scene.geometry
    place = c * 0.5 * g.length
    stations = program.stations.cut((place,) if program.scene.symmetric else (place, g.length - place))
    for _ in range(_ZOOMS):
        finer = assemble(program.scene, program.limits, program.criterion, program.physics, stations, program.law)
        t = np.minimum(stations.x, g.length - stations.x) / (0.5 * g.length)
        with np.errstate(divide="ignore"):
            room = bore_of(finer, finer.lower) / (1.0 - (1.0 - r) * np.minimum(t / c, 1.0))
        panels = room.reshape(-1, NODES).min(axis=1)
        touched = (panels <= panels.min() * (1.0 + _NEAR)) & (stations.right - stations.left > _NARROWEST * g.length)
        if not touched.any():
            break
        stations = refined(finer, touched)
    return finer
