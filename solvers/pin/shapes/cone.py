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
from functools import partial

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.discretised import assemble, least_walls_at
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.program import Program, folded, unfolded
from solvers.pin.optimum.slope_limit import bore_of
from solvers.pin.section.variables import solidity_of
from solvers.pin.shapes.cone_sizes import SMALL, Cones, Shape
from solvers.pin.shapes.tapers import NARROWING, WIDENING, Box, Taper
from solvers.pin.stations.lobatto_panels import NODES

Array = NDArray[np.float64]
_BOXES = {False: 20_000, True: 8_000}
"""How many boxes are looked at without and with a deflection limit, which costs a root for each."""
_SLENDER = 64.0
"""Boxes this much longer than wide are cut across."""
_GAP, _SHARE = 8e-8, 0.08
"""How close bound and best come, relative, and as a share of the gap asked for where that is more."""
_STRAIGHT, _STEP = 0.125, 1e-4
"""Of that gap: what a corner's bore may be off between the places looked at, and how finely shapes are searched."""
_GRID = 9
"""Shapes to begin with, in r and in c."""
_LOOKS = 12
"""How often the best shape is sought anew on stations that lie closer where the last one touched the walls."""
_ZOOMS, _NEAR, _LOOKED = 4, 1e-2, np.linspace(0.0, 1.0, 17)
"""Panels that come this near, relative, to touching are looked at between their stations, ever closer around the place
that leaves least room."""


def _best(
    cones: Cones, c_range: tuple[float, float], gap: float, boxes: int, start: Shape, known: float
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
        if max(wide, long) <= SMALL and wide < _SLENDER * long and long < _SLENDER * wide:
            # Near a ridge or on a short cone one side counts most: the better cut is told by trying both.
            halves = min(_halves(cones, across), _halves(cones, along), key=lambda pair: -sum(lost for lost, _ in pair))
        else:
            halves = _halves(cones, across if wide >= long else along)
        for lost, box in halves:
            if -lost > max(found[0], known):
                heapq.heappush(queue, (lost, box))
        gain = cones.gain(*middle)
        if gain > found[0]:
            found = max(found, cones.closed_in(*np.array(middle)[:, None], c_range, _STEP * gap))
    bound = max(-queue[0][0] if queue else 0.0, found[0], known)
    return found, bound, looked


def _halves(cones: Cones, boxes: tuple[Box, Box]) -> list[tuple[float, Box]]:
    """Boxes with what they can hold at most, its sign turned; the one that promises most first."""
    return sorted((-cones.most(box), box) for box in boxes)


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
        c_range, wanted = (1e-3, 1.0) if self.cylinder else (1.0, 1.0), max(_GAP, _SHARE * gap)
        grid = np.linspace(0.0, 1.0, _GRID), np.unique(np.linspace(*c_range, _GRID))
        boxes = 0
        allowed, bounds = _BOXES[program.limit is not None], {NARROWING: math.inf, WIDENING: math.inf}
        for _ in range(_LOOKS):
            ways = {taper: Cones(folded(looked_at), taper, _STRAIGHT * wanted) for taper in bounds}
            found = {taper: cones.closed_in(*grid, c_range, _STEP * wanted) for taper, cones in ways.items()}
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
            looked_at, size = _closer(looked_at, taper, r, c, wanted), ways[taper].held(r, c)
            held = min(size, Cones(folded(looked_at), taper).held(r, c))
            if size - held <= 0.1 * wanted * size:
                break
            bounds[taper] = math.inf
        most = max(bounds.values())
        size = held
        gain = size * size * taper.hollow(r, c)

        def bored(half: Program) -> Array:
            return solidity_of(1.0 - size * Cones(half, taper).shape(r, c))

        end, middle = (size * g.outer_diameter * share for share in taper.diameters(r))
        evidence: dict[str, float | int | str] = {"boxes": boxes, "cone_share": c}
        evidence["narrowing" if taper == NARROWING else "widening"] = r
        if program.limit is not None:
            half = folded(looked_at)
            evidence["deflection_as_constrained_um"] = 1e6 * half.deflection(bored(half))
        solidity, cone = bored(folded(program)), c * 0.5 * g.length
        corners = [(0.0, end), (cone, middle)] + ([(g.length - cone, middle)] if c < 1.0 else []) + [(g.length, end)]
        return Found(
            unfolded(program, solidity), float(1.0 - gain), partial(float, 1.0 - most),
            "branch and bound over the cone's shape, narrowing and widening", evidence, corners=tuple(corners),
        )  # fmt: skip


def _closer(program: Program, taper: Taper, r: float, c: float, gap: float) -> Program:
    """The program with a panel's end where the cone ends, and wherever it touches the walls between stations, harder
    by more than a hundredth of ``gap`` than at any station beside."""
    scene, length = program.scene, program.scene.geometry.length

    def cut(old: Program, places: tuple[float, ...]) -> Program:
        stations = old.stations.cut(places if scene.symmetric else (*places, *(length - place for place in places)))
        return assemble(scene, old.limits, old.criterion, old.physics, stations, old.law)

    finer = cut(program, (c * 0.5 * length,))
    touched = _touched(folded(finer), taper, r, c, 0.01 * gap)
    return cut(finer, touched) if touched else finer


def _touched(half: Program, taper: Taper, r: float, c: float, harder: float) -> tuple[float, ...]:
    """The places [m] between stations that leave a shape less room than any station of their panel."""

    def room_at(x: Array, bore: Array) -> Array:
        f = 1.0 - (1.0 - r) * taper.lost(x.ravel() / (0.5 * half.scene.geometry.length), c)
        return np.divide(bore, f, out=np.full_like(f, math.inf), where=f > 0.0).reshape(x.shape)

    x = half.stations.x.reshape(-1, NODES)
    room = room_at(x, bore_of(half, half.lower) / half.scene.geometry.outer_diameter)
    near = room.min(axis=1) <= room.min() * (1.0 + _NEAR)
    x, room, row = x[near], room[near], np.arange(np.count_nonzero(near))
    known, looked_at = room.min(axis=1), x
    for _ in range(_ZOOMS):
        k = np.argmin(room, axis=1)
        low, high = looked_at[row, np.maximum(k - 1, 0)], looked_at[row, np.minimum(k + 1, room.shape[1] - 1)]
        looked_at = low[:, None] + (high - low)[:, None] * _LOOKED
        walls = least_walls_at(half.scene, half.criterion, half.floor, looked_at.ravel())
        room = room_at(looked_at, 1.0 - walls)
    lower = room.min(axis=1) < known * (1.0 - harder)
    return tuple(looked_at[row, np.argmin(room, axis=1)][lower].tolist())
