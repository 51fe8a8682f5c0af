"""Bores of straight lines: a double cone, and a cone from each end that runs into a cylinder in the middle.

A shape is fixed by r = d_middle/d_end and by c, the share of the half that the cone takes; its size is the greatest
that strength, wall, deflection and slope allow. Where r or c grow the shape is wider everywhere, so its greatest size
falls and its volume per size grows: on a box of (r, c) the size at the least corner and the shape at the greatest
corner bound the bore's volume, and branch and bound closes in on the best cone.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.flexibility import bending, cowper, phi
from solvers.pin.form import Found
from solvers.pin.program import Program, assemble, bore_of, folded, refined, unfolded
from solvers.pin.section import solidity_of
from solvers.pin.stations import NODES

Array = NDArray[np.float64]
_BOXES = {False: 20_000, True: 1_500}
"""How many boxes are looked at without and with a deflection limit, which costs a root for each."""
_LOOKS = 4
"""How often the best shape is sought anew on stations that lie closer where the last one touched the walls."""
_ZOOMS, _NEAR, _NARROWEST = 16, 1e-4, 1e-4
"""Halvings of the panels that come this near, relative, to touching; shorter shares of the length are not halved."""


@kernel
def _greatest_size(
    r: float, c: float, t: Array, bore: Array, share: Array, bend: Array, shear: Array,
    a: float, b: float, knee: float, limit: float,
) -> float:  # fmt: skip
    """The greatest end bore, over the outer diameter, of the shape (r, c) on stations t = x/(L/2) in [0, 1]."""
    size = 1.0
    n = t.size
    for i in range(n):
        shape = 1.0 - (1.0 - r) * min(t[i] / c, 1.0)
        if bore[i] < size * shape:
            size = bore[i] / shape
    if limit == np.inf:
        return size
    low, high = 0.0, size
    for step in range(60):
        at = high if step == 0 else 0.5 * (low + high)
        total = 0.0
        for i in range(n):
            if bend[i] == 0.0 and shear[i] == 0.0:
                continue
            d = at * (1.0 - (1.0 - r) * min(t[i] / c, 1.0))
            u = (1.0 - d) * (1.0 + d)
            if u <= 0.0:
                total = np.inf
                break
            total += share[i] * (bend[i] * bending(u)[0] + shear[i] * phi(u, a, b, knee))
        if total <= limit:
            if step == 0:
                return size
            low = at
        else:
            high = at
        if high - low <= 1e-15:
            break
    return low


def hollow(r: float, c: float) -> float:
    """Volume of the bore of end diameter 1, relative: c (1 + r + r^2)/3 + (1 - c) r^2."""
    return c * (1.0 + r + r * r) / 3.0 + (1.0 - c) * r * r


@dataclass(frozen=True)
class _Cones:
    """The sizes of shapes on a program's stations."""

    program: Program

    def size(self, r: float, c: float, steep_r: float, steep_c: float) -> float:
        """Greatest size of (r, c); the slope limit, which loosens with r and tightens with small c, at its own pair."""
        p, g = self.program, self.program.scene.geometry
        limit = math.inf if p.limit is None else p.limit
        size = _greatest_size(
            r, c, p.stations.x / (0.5 * g.length), bore_of(p, p.lower) / g.outer_diameter, p.share, p.bending, p.shear,
            p.law.a, p.law.b, p.law.knee, limit,
        )  # fmt: skip
        slope = p.limits.max_slope
        if slope is not None and steep_r < 1.0:
            size = min(size, slope * steep_c * 0.5 * g.length / (g.outer_diameter * (1.0 - steep_r)))
        return size

    def gain(self, r: float, c: float) -> float:
        """Volume of the greatest bore of this shape."""
        return self.size(r, c, r, c) ** 2 * hollow(r, c)

    def most(self, box: tuple[float, float, float, float]) -> float:
        """No shape of the box holds more."""
        r0, r1, c0, c1 = box
        return self.size(r0, c0, r1, c1) ** 2 * hollow(r1, c1)


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
        if (r1 - r0) >= (c1 - c0):
            m = 0.5 * (r0 + r1)
            halves = ((r0, m, c0, c1), (m, r1, c0, c1))
        else:
            m = 0.5 * (c0 + c1)
            halves = ((r0, r1, c0, m), (r0, r1, m, c1))
        for box in halves:
            most = cones.most(box)
            if most > found[0]:
                heapq.heappush(queue, (-most, box))
        middle = (0.5 * (r0 + r1), 0.5 * (c0 + c1))
        gain = cones.gain(*middle)
        if gain > found[0]:
            found = _climb(cones, (gain, *middle), c_range)
    bound = max(-queue[0][0], found[0]) if queue else found[0]
    return float(found[1]), float(found[2]), found[0], bound, looked


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
        # Nothing here asks for convexity, so shear obeys the exact law.
        looked_at = replace(program, law=cowper(program.scene.material.poisson))
        c_range, wanted = (1e-3, 1.0) if self.cylinder else (1.0, 1.0), min(max(gap, 1e-8), 1e-7)
        boxes = 0
        for _ in range(_LOOKS):
            half = folded(looked_at)
            r, c, _, most, looked = _best(_Cones(half), c_range, wanted, _BOXES[half.limit is not None])
            boxes += looked
            # Stations say nothing of what lies between them, nor rules of the corner that a cone ends in.
            looked_at, size = _closer(looked_at, r, c), _Cones(half).size(r, c, r, c)
            held = min(size, _Cones(folded(looked_at)).size(r, c, r, c))
            if size - held <= 0.1 * max(gap, wanted) * size:
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
