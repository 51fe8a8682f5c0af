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

from solvers.pin.load.macaulay import LIMIT_TOLERANCE
from solvers.pin.optimum.program import Program, ShapeResult, assemble
from solvers.pin.shapes.cone_bounds import branch_and_bound
from solvers.pin.shapes.cone_sizes import corner_table, half_bar, pattern_search, size_of, workspace
from solvers.pin.shapes.tapers import NARROWING, WIDENING, relative_bores, unit_volume
from solvers.pin.stations.between_nodes import maximum_excess

_MAX_BOXES = {False: 20_000, True: 8_000}
"""Maximum number of boxes per direction, without and with a deflection limit (which requires a root per box)."""
_GAP, _GAP_FRACTION = 8e-8, 0.08
"""Relative gap at convergence, and the same as a fraction of the requested gap if that is larger."""
_CORNER_ERROR = 0.05
"""Tolerance of the corner's bore between samples, as a fraction of the gap at convergence."""
_GRID = 9
"""Initial grid points in r and in c."""
_MAX_REFINEMENTS = 12
"""Maximum number of refinements of corners, and of the stations around contact points."""
_MAX_HALVINGS = 20


@dataclass(frozen=True)
class Cone:
    """A double cone, or with ``cylinder`` a cone at each end and a cylinder between.

    The bore is narrowest in the middle or at the ends, whichever is lighter.
    """

    cylinder: bool = False

    @property
    def name(self) -> str:
        return "cone_cylinder" if self.cylinder else "double_cone"

    def find(self, program: Program, gap: float) -> ShapeResult | None:
        g, solid = program.scene.geometry, np.ones_like(program.lower)
        if program.limit is not None and program.deflection(solid) > program.limit * (1.0 + LIMIT_TOLERANCE):
            return None
        refined_program, boxes = program, 0
        c_low, target_gap = 1e-3 if self.cylinder else 1.0, max(_GAP, _GAP_FRACTION * gap)
        grid = np.linspace(0.0, 1.0, _GRID), np.unique(np.linspace(c_low, 1.0, _GRID))
        bounds = dict.fromkeys((NARROWING, WIDENING), math.inf)
        starts = dict.fromkeys(bounds, grid)
        boxes_left = dict.fromkeys(bounds, _MAX_BOXES[program.limit is not None])
        ends: tuple[float, ...] = ()
        for _ in range(_MAX_REFINEMENTS):
            corners = corner_table(program, _CORNER_ERROR * target_gap, ends) if self.cylinder else None
            bars = {NARROWING: half_bar(refined_program), WIDENING: half_bar(refined_program, corners)}
            found = {
                direction: pattern_search(bar, direction, *starts[direction], c_low, target_gap, workspace(bar))
                for direction, bar in bars.items()
            }
            for direction in sorted(found, key=found.get, reverse=True):
                best = max(found.values())[0]
                # A bound on fewer stations remains valid.
                if bounds[direction] - best > target_gap * (1.0 - best) and boxes_left[direction] > 0:
                    found[direction], bound, examined = branch_and_bound(
                        bars[direction], direction, c_low, target_gap, boxes_left[direction],
                        np.array(found[direction]), best,
                    )  # fmt: skip
                    bounds[direction], boxes = min(bounds[direction], bound), boxes + examined
                    boxes_left[direction] -= examined
            # The next round starts from the best shapes of this one.
            starts = {direction: (np.array([r]), np.array([c])) for direction, (_, r, c) in found.items()}
            direction = max(found, key=found.get)
            gain, r, c = found[direction]
            # The bound ignores positions between stations, and interpolation ignores the corner where a cone ends.
            refined_program = _refined_at_contacts(refined_program, direction, r, c, 0.01 * target_gap)
            bar = half_bar(refined_program)
            size = size_of(bar, direction, r, c, 0.0, workspace(bar))
            if size * size * unit_volume(direction, r, c) >= gain - 0.2 * target_gap * (1.0 - gain):
                break
            ends = (*ends, c)
        most = max(bounds.values())

        evidence = {"boxes": boxes, "cone_share": c, "narrowing" if direction == NARROWING else "widening": r}
        bores = size * g.outer_diameter, r * size * g.outer_diameter
        (end, middle), cone = bores[::direction], c * 0.5 * g.length
        corners = [(0.0, end), (cone, middle)] + ([(g.length - cone, middle)] if c < 1.0 else []) + [(g.length, end)]
        solidity = program.variable.solidity_of(1.0 - size * relative_bores(direction, r, c, half_bar(program).x))
        return ShapeResult(
            solidity, 1.0 - size * size * unit_volume(direction, r, c), partial(float, 1.0 - most),
            "branch and bound over the cone's shape, narrowing and widening", evidence, corners=tuple(corners),
        )  # fmt: skip


def _refined_at_contacts(program: Program, direction: int, r: float, c: float, gap: float) -> Program:
    """Refine where the cone ends, and panels that may hold a clearance less than at stations by more than ``gap``."""
    stations, half = program.stations.cut((c * program.stations.span,)), program
    for _ in range(_MAX_HALVINGS):
        half = assemble(program.scene, program.limits, program.criterion, program.physics, stations)
        bar = half_bar(half)
        f = relative_bores(direction, r, c, bar.x)
        nearness = np.divide(f, bar.bore, out=np.full_like(f, math.inf), where=bar.bore > 0.0)
        closer = maximum_excess(stations.x, nearness[None]) > gap
        if not closer.any():
            break
        stations = stations.halved(closer)
    return half
