"""One turn of a machine, sampled on panels finely enough for everything that is asked of it.

Panels end where the load's pieces do and where the piston begins or ceases to bear on both walls (``state``); they are
halved until axial force, side force, clamp moment and the bending at the head and the middle of the strip are resolved.
From then on extremes, zeros and means are those of polynomials: nothing is computed at another angle. What the strip
rings with behind corners is not resolved by panels but kept beside them, in closed form (``solvers.numerics.ripple``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.numerics.panels import Panels, Rule, greatest, inside, resolve, rule_of, values_at
from solvers.numerics.radau import radau
from solvers.numerics.ripple import no_ripple, reaches
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.composition import Cycle, Rippling
from solvers.rod.cycle.section import Field
from solvers.rod.cycle.state import CLAMP, FORCE, HEAD, MOMENT, ROWS, SIDE, Strip, fill_states, friction_corners
from solvers.rod.load.axial_force import Drive

Array = NDArray[np.float64]

TURN = 2.0 * math.pi
_GRID = TURN / 128 * np.arange(129)
_WIDEST = TURN / 4
_APART = 1e-9
"""Breaks closer than this [rad] are one."""
_SMOOTH, _PIECES, _MANY = 16, 8, 6
"""Points of a panel for a load of one piece, of some, of many."""
_SOME, _MOST_SOME = 24, 256
_MOST_PANELS = 6000
_CHECKED = 5
NO_RINGING = Rippling(no_ripple(1, radau(10)), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1), np.zeros(1), 0)


@dataclass(frozen=True)
class Extreme:
    """A greatest value over the turn, an estimate of its absolute error, and its crank angle [rad]."""

    value: float
    error: float
    angle: float

    @property
    def relative_error(self) -> float:
        return self.error / abs(self.value) if self.value else 0.0


@dataclass(frozen=True)
class SampledCycle:
    """A turn on panels.

    ``table`` has the rows of ``state`` and behind them those of ``field``'s series; ``side`` and ``moment`` hold T [N]
    and M0 [N m] with all corrections. ``error`` is what the panels leave, relative to the greatest of each quantity.
    Where the strip ``buckles`` there is only the force, without what friction would add to it.
    """

    cycle: Cycle
    tolerance: float
    panels: Panels
    field: Field
    side: Array
    moment: Array
    ringing: Rippling
    error: float
    buckles: bool

    @staticmethod
    def of(cycle: Cycle, tolerance: float, begin: Panels | None = None) -> SampledCycle:
        """Sample a cycle so that its quantities are known to ``tolerance`` of their greatest magnitudes, beginning with
        panels of the same cycle without corrections if there are such."""
        strip = cycle.strip
        buckles = bool(strip.couples) and _buckles(cycle.drive, strip)
        if buckles:
            # Nothing but the force has a meaning there.
            cycle = cycle.without_feedback()
            strip = cycle.strip
        edges, rule = begin or _first_panels(cycle, strip)
        sampler = _Sampler(cycle, strip, rule)
        panels, rows, error = resolve(sampler, edges, rule, _CHECKED, tolerance, _MOST_PANELS)
        states = rows[_CHECKED : _CHECKED + ROWS]
        series = rows[_CHECKED + ROWS :]
        d, ringing = cycle.dimensions, sampler.ringing
        field = Field(
            edges=panels.edges,
            rule=panels.rule,
            states=states,
            side=states[SIDE],
            bent=series[: sampler.bent_terms],
            sunk=series[sampler.bent_terms :],
            ripple=ringing.ripple,
            bent_parts=ringing.bent,
            sunk_parts=ringing.sunk,
            length=d.l,
            compliance=sampler.strip.compliance,
            direct=1.0 / (d.b * d.h),
            bending=0.5 * cycle.scene.material.elastic_modulus * d.h,
            inclined=sampler.inclined,
        )
        return SampledCycle(cycle, tolerance, panels, field, rows[1], rows[2], ringing, error, buckles)

    @property
    def force(self) -> Array:
        """P [N] at the panels' points."""
        return self.field.states[FORCE]

    def greatest(self, quantity: Array, parts: Array | None = None) -> Extreme:
        """The greatest value over the turn of a quantity at the panels' points, to the tolerance of its magnitude; of
        one that rings with these weights of the ringing's ``parts``."""
        wanted, (edges, rule) = self.tolerance * float(np.abs(quantity).max()), self.panels
        if parts is None or not self.ringing.ripple.modes:
            value, error, angle = greatest(edges, rule, quantity, 1.0, wanted)
        else:
            ripple = self.ringing.ripple
            reach = reaches(ripple, parts)
            value, error, angle = greatest_with_ripple(edges, rule, quantity, 1.0, wanted, ripple, parts, reach)
        return Extreme(value, error, angle % TURN)

    def at(self, quantities: Array, angle: Array) -> Array:
        """Quantities at the panels' points (rows, n) at other angles between the first panel's begin and a turn on."""
        return values_at(self.panels.edges, self.panels.rule, quantities, angle)


class _Sampler:
    """The rows of a cycle at any angles: what is resolved, the states, and the corrections' series."""

    def __init__(self, cycle: Cycle, strip: Strip, rule: Rule) -> None:
        self.strip, self._cycle, self._rule = strip, cycle, rule
        self._corrections = [refinement.quiet for refinement in cycle.refinements]
        self.ringing = next((r.ringing for r in cycle.refinements if r.ringing is not None), NO_RINGING)
        self.bent_terms = max((c.bent_terms for c in self._corrections), default=0)
        self.sunk_terms = max((c.sunk_terms for c in self._corrections), default=0)
        self.inclined = any(c.inclines for c in self._corrections)

    def __call__(self, angle: Array) -> Array:
        if self.ringing is not NO_RINGING:
            # What does not ring jumps at corners.
            angle = inside(angle, self._rule)
        rows = np.zeros((_CHECKED + ROWS + self.bent_terms + self.sunk_terms, angle.size))
        states = rows[_CHECKED : _CHECKED + ROWS]
        fill_states(self._cycle.drive, self.strip, angle, states)
        rows[0], rows[1], rows[2] = states[FORCE], states[SIDE], states[MOMENT]
        # Bending at the head and in the middle, each beside that at the clamp: a whole rod's head is not bent at all.
        rows[3] = states[CLAMP] + states[HEAD]
        rows[4] = states[CLAMP]
        bent, sunk = rows[_CHECKED + ROWS :][: self.bent_terms], rows[_CHECKED + ROWS + self.bent_terms :]
        for correction in self._corrections:
            side, moment = correction.add(states, bent, sunk)
            rows[1] += side
            rows[2] += moment
        if self.bent_terms:
            rows[3] += bent.sum(axis=0)
            rows[4] += legendre.legval(0.0, bent)
        return rows


def _buckles(drive: Drive, strip: Strip) -> bool:
    """Whether an even sample of the turn, friction included, goes beyond the critical load."""
    states = np.empty((ROWS, _GRID.size))
    fill_states(drive, strip, _GRID, states)
    return float(states[FORCE].min()) <= 0.5 * strip.buckled


def panel_edges(drive: Drive, strip: Strip, sharp: Array) -> Array:
    """Ends of panels over one turn: where the load's pieces end or it is sharp, the corners that friction makes, and as
    many between as it takes for none to be wider than a quarter of a turn."""
    breaks = drive.breaks if drive.breaks.size else sharp
    breaks = np.unique(np.mod(breaks, TURN))
    if strip.friction:
        corners = friction_corners(drive, strip, np.unique(np.concatenate([_GRID, breaks])))
        breaks = np.unique(np.concatenate([breaks, np.mod(corners, TURN)]))
    if not breaks.size:
        return np.linspace(0.0, TURN, round(TURN / _WIDEST) + 1)
    breaks = breaks[np.diff(breaks, prepend=breaks[-1] - TURN) > _APART]
    ends = np.append(breaks, breaks[0] + TURN)
    parts = np.maximum(np.ceil(np.diff(ends) / _WIDEST * (1.0 - 1e-9)), 1.0).astype(int)
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)]
    return np.append(np.concatenate(pieces), ends[-1])


def _first_panels(cycle: Cycle, strip: Strip) -> Panels:
    edges = panel_edges(cycle.drive, strip, cycle.scene.load.sharp_angles())
    count = edges.size - 1
    return Panels(edges, rule_of(_SMOOTH if count <= _SOME else _PIECES if count <= _MOST_SOME else _MANY))
