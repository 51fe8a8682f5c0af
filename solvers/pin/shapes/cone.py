"""Conical bores: a double cone, and cones from both ends with a cylinder in the middle.

A shape (``tapers``) is defined by its direction of taper, by r, the ratio of its narrowest to its widest bore, and
by c, the fraction of the half that the cone occupies; its size is the greatest that strength, wall, deflection and
slope allow (``cone_sizes``). Branch and bound over r and c (``cone_bounds``) converges to the best cone of either
direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.discretised import assemble, least_walls_at
from solvers.pin.optimum.found import Found
from solvers.pin.optimum.program import Program, folded, unfolded
from solvers.pin.shapes.cone_bounds import branch_and_bound
from solvers.pin.shapes.cone_sizes import bar_of, climb, corners_of, size_of, workspace
from solvers.pin.shapes.tapers import NARROWING, WIDENING, hollow, relative_bores
from solvers.pin.stations.lobatto_panels import NODES

Array = NDArray[np.float64]
_MAX_BOXES = {False: 20_000, True: 8_000}
"""Maximum number of boxes of a direction, without and with a deflection limit, which requires a root per box."""
_GAP, _GAP_FRACTION = 8e-8, 0.08
"""Relative gap at convergence, and the same as a fraction of the requested gap if that is larger."""
_CORNER_ERROR = 0.05
"""Tolerated error of the corner's bore between samples as a fraction of that gap."""
_GRID = 9
"""Initial grid points in r and in c."""
_MAX_REFINEMENTS = 12
"""Maximum number of refinements of corners, and of the stations around contact points."""
_ZOOMS, _CLEARANCE, _SAMPLES = 4, 1e-2, np.linspace(0.0, 1.0, 17)
"""Zoom levels, relative clearance below which panels are checked between their stations, and samples per zoom."""


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
        looked_at, boxes = program, 0
        c_low, wanted = 1e-3 if self.cylinder else 1.0, max(_GAP, _GAP_FRACTION * gap)
        grid = np.linspace(0.0, 1.0, _GRID), np.unique(np.linspace(c_low, 1.0, _GRID))
        bounds = dict.fromkeys((NARROWING, WIDENING), math.inf)
        left = dict.fromkeys(bounds, _MAX_BOXES[program.limit is not None])
        ends: tuple[float, ...] = ()
        for _ in range(_MAX_REFINEMENTS):
            corners = corners_of(folded(program), _CORNER_ERROR * wanted, ends) if self.cylinder else None
            bars = {NARROWING: bar_of(folded(looked_at)), WIDENING: bar_of(folded(looked_at), corners)}
            found = {turn: climb(bar, turn, *grid, c_low, wanted, workspace(bar)) for turn, bar in bars.items()}
            for turn in sorted(found, key=found.get, reverse=True):
                best = max(found.values())[0]
                # A bound on fewer stations remains valid.
                if bounds[turn] - best > wanted * (1.0 - best) and left[turn] > 0:
                    found[turn], bound, looked = branch_and_bound(
                        bars[turn], turn, c_low, wanted, left[turn], np.array(found[turn]), best
                    )  # fmt: skip
                    bounds[turn], left[turn], boxes = min(bounds[turn], bound), left[turn] - looked, boxes + looked
            turn = max(found, key=found.get)
            gain, r, c = found[turn]
            # The bound does not cover positions between stations, nor does interpolation cover the corner where a cone
            # ends.
            looked_at = _refined_at_contacts(looked_at, turn, r, c, wanted)
            bar = bar_of(folded(looked_at))
            size = size_of(bar, turn, r, c, 0.0, workspace(bar))
            if size * size * hollow(turn, r, c) >= gain * (1.0 - 0.2 * wanted):
                break
            ends = (*ends, c)
        most = max(bounds.values())

        def bored(half: Program) -> Array:
            return half.sought.solidity_of(1.0 - size * relative_bores(turn, r, c, bar_of(half).x))

        evidence: dict[str, float | int | str] = {"boxes": boxes, "cone_share": c}
        evidence["narrowing" if turn == NARROWING else "widening"] = r
        if program.limit is not None:
            half = folded(looked_at)
            evidence["deflection_as_constrained_um"] = 1e6 * half.deflection(bored(half))
        bores = size * g.outer_diameter, r * size * g.outer_diameter
        (end, middle), cone = bores[::turn], c * 0.5 * g.length
        corners = [(0.0, end), (cone, middle)] + ([(g.length - cone, middle)] if c < 1.0 else []) + [(g.length, end)]
        solidity = unfolded(program, bored(folded(program)))
        return Found(
            solidity, 1.0 - size * size * hollow(turn, r, c), partial(float, 1.0 - most),
            "branch and bound over the cone's shape, narrowing and widening", evidence, corners=tuple(corners),
        )  # fmt: skip


def _refined_at_contacts(program: Program, turn: int, r: float, c: float, gap: float) -> Program:
    """Refine the program with a panel boundary where the cone ends and at contact points between stations.

    Only contacts tighter than every station of their panel by more than a hundredth of ``gap`` count.
    """
    scene, length = program.scene, program.scene.geometry.length

    def cut(old: Program, places: tuple[float, ...]) -> Program:
        stations = old.stations.cut(places if scene.symmetric else (*places, *(length - place for place in places)))
        return assemble(scene, old.limits, old.criterion, old.physics, stations, old.law)

    finer = cut(program, (c * 0.5 * length,))
    touched = _contacts(folded(finer), turn, r, c, 0.01 * gap)
    return cut(finer, touched) if touched else finer


def _contacts(half: Program, turn: int, r: float, c: float, harder: float) -> tuple[float, ...]:
    """Return the positions [m] between stations with less clearance to a shape than any station of their panel."""

    def room_at(x: Array, bore: Array) -> Array:
        f = relative_bores(turn, r, c, x.ravel() / (0.5 * half.scene.geometry.length))
        return np.divide(bore, f, out=np.full_like(f, math.inf), where=f > 0.0).reshape(x.shape)

    x = half.stations.x.reshape(-1, NODES)
    room = room_at(x, bar_of(half).bore)
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
