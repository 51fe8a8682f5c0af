"""One half of a discretised pin or bushing for the step search; positions are fractions t of the half.

u is the material of a section (the pin's u, the bushing's y); the mass is the integral of u over t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.pieces import piece_at
from solvers.pin.optimum.lagrangian import Segments, minimum_segment_volume
from solvers.pin.optimum.program import Program, least_walls_at
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES, kinks

COINCIDENT = 1e-12
"""Distance below which two positions of the half, 0 to 1, are regarded as identical."""
_SAMPLES_PER_EDGE = 8


@dataclass(frozen=True)
class Steps:
    """Steps that end at ``places`` (fractions of the half, the last 1), their lightest walls and their mass.

    ``walls``: u of every step, non-decreasing; the ``multiplier`` of the deflection limit as in ``DualSolution``.
    """

    places: Array
    walls: Array
    volume: float
    multiplier: float


class Sums(NamedTuple):
    """Integrals of the deflection coefficients (bending and shear, over the limit) from the end to any position.

    Within each panel the coefficients are their interpolating polynomials: exact for Macaulay loads. ``left`` ends and
    ``width`` of the panels, (panels,); Legendre series of densities and integrals, (panels, 2, NODES + 1).
    """

    left: Array
    width: Array
    density_series: Array
    integral_series: Array

    def integrals(self, t: Array) -> Array:
        """Return both integrals from 0 to positions t, shape (2, n)."""
        return _evaluate(self.left, self.width, self.integral_series, t)

    def density(self, t: Array) -> Array:
        """Return both densities at positions t, shape (2, n)."""
        return _evaluate(self.left, self.width, self.density_series, t)


def _sums(program: Program) -> Sums:
    """Return the cumulative deflection coefficients under a program's limit."""
    s, legendre = program.stations, np.polynomial.legendre
    left, width = (s.left - s.left[0]) / s.span, s.width / s.span
    values = np.stack([(c / program.limit).reshape(-1, NODES) for c in (program.bending, program.shear)], axis=1)
    series = values @ np.linalg.inv(legendre.legvander(NODE_PLACES, NODES - 1)).T
    sums = legendre.legint(series, lbnd=-1.0, axis=2) * (0.5 * width)[:, None, None]
    sums[1:, :, 0] += np.cumsum(sums.sum(axis=2), axis=0)[:-1]
    padded = np.concatenate([series, np.zeros((left.size, 2, 1))], axis=2)
    return Sums(left, width, np.ascontiguousarray(padded), np.ascontiguousarray(sums))


@dataclass(frozen=True)
class Half:
    """One half; solid beyond the position ``solid_from`` [m]."""

    program: Program
    solid_from: float = math.inf

    @cached_property
    def peaks(self) -> Array:
        """The running maximum of the lower bound of u at the stations."""
        return np.maximum.accumulate(self.program.lower)

    @cached_property
    def sums(self) -> Sums | None:
        """The cumulative deflection coefficients; None without a limit."""
        return None if self.program.limit is None else _sums(self.program)

    def lower_bound(self, t: Array) -> Array:
        """Return the running maximum of the lower bound of u from the end to positions in any order."""
        p, order = self.program, np.argsort(t, kind="stable")
        x = t[order] * (0.5 * p.scene.geometry.length)
        least = p.variable.solidity_of(least_walls_at(p.scene, p.criterion, p.floor, x))
        least = np.where(x > self.solid_from, 1.0, least)
        before = np.clip(np.searchsorted(p.stations.x, x, side="right") - 1, 0, None)
        found = np.empty_like(t)
        found[order] = np.maximum.accumulate(np.maximum(self.peaks[before], least))
        return found

    def lightest_walls(self, places: Array) -> Steps | None:
        """Return steps that end at these positions with their lightest walls; None if even solid steps exceed the
        deflection limit."""
        weight, least = places - np.append(0.0, places[:-1]), self.lower_bound(places)
        if self.sums is None:
            return Steps(places, least, float(weight @ least), 0.0)
        sums = np.diff(self.sums.integrals(np.concatenate([[0.0], places])), axis=1)
        mean = np.divide(sums, weight, out=np.zeros_like(sums), where=weight > 0.0)
        found = minimum_segment_volume(Segments(weight, *np.maximum(mean, 0.0), self.program.law), least, True)
        return found and Steps(places, found.solidity, float(weight @ found.solidity), found.multiplier)

    def edges(self, count: int) -> Array:
        """Return the edges of the initial cells, from 0 to 1: at the half's kinks and at most 1/``count`` apart."""
        jump = min(self.solid_from / (0.5 * self.program.scene.geometry.length), 1.0)
        edges = np.union1d(np.linspace(0.0, 1.0, count + 1), np.append(kinks(self.program.scene), jump))
        edges = np.union1d(edges, _plateau_ends(self, edges))
        return edges[np.concatenate([[True], np.diff(edges) > COINCIDENT])]


def _plateau_ends(half: Half, edges: Array) -> list[float]:
    """Return where the lower bound of u stops and resumes increasing: kinks, and frequent break points."""
    t = np.unique(edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, _SAMPLES_PER_EDGE + 1))
    level = half.lower_bound(t)
    flat = np.concatenate([[False], np.diff(level) <= 0.0, [False]])
    begins, ends = (np.flatnonzero(where) for where in (~flat[:-1] & flat[1:], flat[:-1] & ~flat[1:]))
    found = []
    for begin, end in zip(begins, ends, strict=True):
        top = level[begin]
        if begin:
            found.append(_crossing(half, t[begin - 1], t[begin], top, 1.0))
        if end + 1 < t.size:
            found.append(_crossing(half, t[end], t[end + 1], top, 1.0 + 1e-14))
    return found


def _crossing(half: Half, low: float, high: float, top: float, factor: float) -> float:
    """Return the position at which f reaches ``factor`` times ``top``."""
    while high - low > 1e-15:
        grid = np.linspace(low, high, 65)
        first = int(np.argmax(half.lower_bound(grid) >= top * factor))
        if first == 0 or (grid[first - 1] <= low and grid[first] >= high):
            break
        low, high = float(grid[first - 1]), float(grid[first])
    return high if factor == 1.0 else low


def step_vertices(places: Array, sizes: Array, length: float) -> tuple[tuple[float, float], ...]:
    """Return the vertices of steps of these sizes, with ends at positions of the half, over the whole length."""
    begins = np.concatenate([[0.0], places[:-1]])
    half = [(float(x), float(d)) for b, e, d in zip(begins, places, sizes, strict=True) for x in (b, e)]
    return (*half, *((length - x, d) for x, d in reversed(half)))


def at_stations(program: Program, steps: Steps) -> Array:
    """Return u at a program's stations."""
    step = np.searchsorted(steps.places[:-1] * program.stations.span, program.stations.side, side="right")
    return steps.walls[step]


@kernel
def _evaluate(left: Array, wide: Array, series: Array, t: Array) -> Array:
    """Evaluate panelwise Legendre series at positions by Clenshaw's recurrence."""
    found, panel = np.empty((2, t.size)), 0
    for i in range(t.size):
        panel = piece_at(left, t[i], panel)
        x = min(max((t[i] - left[panel]) / wide[panel], 0.0), 1.0) * 2.0 - 1.0
        for kind in range(2):
            c, one, two = series[panel, kind], 0.0, 0.0
            for n in range(c.size - 1, 0, -1):
                one, two = c[n] + (2.0 * n + 1.0) / (n + 1.0) * x * one - (n + 1.0) / (n + 2.0) * two, one
            found[kind, i] = c[0] + x * one - 0.5 * two
    return found
