"""Conical bores: a double cone, and cones from both ends with a cylinder in the middle.

A shape (``tapers``) is defined by its direction of taper, by r, the ratio of its narrowest to its widest bore, and
by c, the fraction of the half that the cone occupies; its size is the greatest that strength, wall, deflection and
slope allow. For a shape that is wider everywhere the maximum size is smaller and the volume per size greater: on a
box of (r, c) the size at one corner and the shape at the opposite one bound the bore's volume, and branch and bound
converges to the best cone of either direction. Small boxes are also bounded to second order (``cone_bounds``).
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
_MAX_BOXES = {False: 20_000, True: 8_000}
"""Maximum number of boxes without and with a deflection limit, which requires a root per box."""
_MAX_ASPECT_RATIO = 64.0
"""Aspect ratio above which boxes are split across their longer side."""
_GAP, _GAP_FRACTION = 8e-8, 0.08
"""Relative gap at convergence, and the same as a fraction of the requested gap if that is larger."""
_CORNER_ERROR, _SEARCH_STEP = 0.125, 1e-4
"""As fractions of that gap: the tolerated error of the corner's bore between samples, and the shape search step."""
_GRID = 9
"""Initial grid points in r and in c."""
_MAX_REFINEMENTS = 12
"""Maximum number of refinements of the stations around contact points."""
_ZOOMS, _CLEARANCE, _SAMPLES = 4, 1e-2, np.linspace(0.0, 1.0, 17)
"""Zoom levels, relative clearance below which panels are checked between their stations, and samples per zoom."""


def _branch_and_bound(
    cones: Cones, c_range: tuple[float, float], gap: float, boxes: int, start: Shape, known: float
) -> tuple[Shape, float, int]:
    """Return (best shape, upper bound of every bore's volume, boxes examined) by best-first branch and bound.

    ``start`` is an initial shape. Stops once no box can exceed ``known``, the volume of another bore.
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
        if max(wide, long) <= SMALL and wide < _MAX_ASPECT_RATIO * long and long < _MAX_ASPECT_RATIO * wide:
            # Near a ridge or for a short cone one side dominates: try both splits and take the better.
            halves = min(
                _bounded_boxes(cones, across),
                _bounded_boxes(cones, along),
                key=lambda pair: -sum(lost for lost, _ in pair),
            )
        else:
            halves = _bounded_boxes(cones, across if wide >= long else along)
        for lost, box in halves:
            if -lost > max(found[0], known):
                heapq.heappush(queue, (lost, box))
        gain = cones.gain(*middle)
        if gain > found[0]:
            found = max(found, cones.closed_in(*np.array(middle)[:, None], c_range, _SEARCH_STEP * gap))
    bound = max(-queue[0][0] if queue else 0.0, found[0], known)
    return found, bound, looked


def _bounded_boxes(cones: Cones, boxes: tuple[Box, Box]) -> list[tuple[float, Box]]:
    """Return the boxes with their negated upper bounds, best first."""
    return sorted((-cones.most(box), box) for box in boxes)


@dataclass(frozen=True)
class Cone:
    """A double cone, or with ``cylinder`` a cone at each end and a cylinder between.

    Narrowest in the middle or at the ends, whichever is lighter.
    """

    cylinder: bool = False

    @property
    def name(self) -> str:
        return "cone_cylinder" if self.cylinder else "double_cone"

    def find(self, program: Program, gap: float) -> Found | None:
        g, solid = program.scene.geometry, np.ones_like(program.lower)
        if program.limit is not None and program.deflection(solid) > program.limit * (1.0 + 1e-12):
            return None
        looked_at = program
        c_range, wanted = (1e-3, 1.0) if self.cylinder else (1.0, 1.0), max(_GAP, _GAP_FRACTION * gap)
        grid = np.linspace(0.0, 1.0, _GRID), np.unique(np.linspace(*c_range, _GRID))
        boxes = 0
        allowed, bounds = _MAX_BOXES[program.limit is not None], {NARROWING: math.inf, WIDENING: math.inf}
        for _ in range(_MAX_REFINEMENTS):
            ways = {taper: Cones(folded(looked_at), taper, _CORNER_ERROR * wanted) for taper in bounds}
            found = {taper: cones.closed_in(*grid, c_range, _SEARCH_STEP * wanted) for taper, cones in ways.items()}
            for taper in sorted(found, key=found.get, reverse=True):
                best = max(found.values())[0]
                # A bound on fewer stations remains valid.
                if bounds[taper] - best > wanted * (1.0 - best):
                    found[taper], bounds[taper], looked = _branch_and_bound(
                        ways[taper], c_range, wanted, allowed, found[taper], best
                    )  # fmt: skip
                    boxes += looked
            taper = max(found, key=found.get)
            _, r, c = found[taper]
            # Stations do not cover the positions between them, nor the bounding rules the corner where a cone ends.
            looked_at, size = _refined_at_contacts(looked_at, taper, r, c, wanted), ways[taper].held(r, c)
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


def _refined_at_contacts(program: Program, taper: Taper, r: float, c: float, gap: float) -> Program:
    """Refine the program with a panel boundary where the cone ends and at contact points between stations.

    Only contacts tighter than every station of their panel by more than a hundredth of ``gap`` count.
    """
    scene, length = program.scene, program.scene.geometry.length

    def cut(old: Program, places: tuple[float, ...]) -> Program:
        stations = old.stations.cut(places if scene.symmetric else (*places, *(length - place for place in places)))
        return assemble(scene, old.limits, old.criterion, old.physics, stations, old.law)

    finer = cut(program, (c * 0.5 * length,))
    touched = _contacts(folded(finer), taper, r, c, 0.01 * gap)
    return cut(finer, touched) if touched else finer


def _contacts(half: Program, taper: Taper, r: float, c: float, harder: float) -> tuple[float, ...]:
    """Return the positions [m] between stations with less clearance to a shape than any station of their panel."""

    def room_at(x: Array, bore: Array) -> Array:
        f = 1.0 - (1.0 - r) * taper.lost(x.ravel() / (0.5 * half.scene.geometry.length), c)
        return np.divide(bore, f, out=np.full_like(f, math.inf), where=f > 0.0).reshape(x.shape)

    x = half.stations.x.reshape(-1, NODES)
    room = room_at(x, bore_of(half, half.lower) / half.scene.geometry.outer_diameter)
    near = room.min(axis=1) <= room.min() * (1.0 + _CLEARANCE)
    x, room, row = x[near], room[near], np.arange(np.count_nonzero(near))
    known, looked_at = room.min(axis=1), x
    for _ in range(_ZOOMS):
        k = np.argmin(room, axis=1)
        low, high = looked_at[row, np.maximum(k - 1, 0)], looked_at[row, np.minimum(k + 1, room.shape[1] - 1)]
        looked_at = low[:, None] + (high - low)[:, None] * _SAMPLES
        walls = least_walls_at(half.scene, half.criterion, half.floor, looked_at.ravel())
        room = room_at(looked_at, 1.0 - walls)
    lower = room.min(axis=1) < known * (1.0 - harder)
    return tuple(looked_at[row, np.argmin(room, axis=1)][lower].tolist())
