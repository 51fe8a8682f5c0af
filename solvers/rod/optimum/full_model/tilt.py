"""How the full model's results leave the search's own as the strip changes.

With x = (ln b, ln h, ln l) the ratio of the two is taken as ln(full/own) = c + t x beside a strip. Its value there
shifts a limit (``solvers.rod.optimum.full_model.matching``); its slopes t, added to those of the search's own rows, put
the optimum where the full model has it to second order, and not beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solvers.rod.check import RodCheck
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.peak_model import FIRST_GROUP, SIDEWAYS, STRESS, Array, Focus, first_peak, row_count, rows_at
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_STEP = 1e-2
_LEAST_STEP = 1e-5


class Tilt(NamedTuple):
    """``at`` is x of the strip that it was measured at, ``slopes`` those of ln(full/own), shape (FIRST_GROUP, 3), and
    ``full`` those of ln(full)."""

    at: Array
    slopes: Array
    full: Array

    def change(self, x: Array) -> Array:
        """Of ln(full/own) since ``at``, by row."""
        return self.slopes @ (x - self.at)

    def apply(self, x: Array, focus: Focus, values: Array, slopes: Array) -> None:
        """Tilt all rows of a strip in focus, and their slopes, in place."""
        change, peaks = self.change(x), first_peak(focus)
        values[:FIRST_GROUP] += change
        slopes[:FIRST_GROUP] += self.slopes
        for part, row in (
            (slice(FIRST_GROUP, peaks), rows.UTILISATION),
            (slice(peaks, None, 2), rows.SIDE),
            (slice(peaks + 1, None, 2), rows.PRESSURE),
        ):
            values[part] += change[row]
            slopes[part] += self.slopes[row]


def logarithms(d: Dimensions) -> Array:
    """x."""
    return np.log([d.b, d.h, d.l])


def own_rows(focus: Focus, d: Dimensions) -> Array:
    """All rows of a strip on the search's model."""
    values = np.empty(row_count(focus))
    rows_at(focus, d.b, d.h, d.l, np.empty((focus.force.size, focus.eta.size)), values)
    return values


def measured(
    focus: Focus, at: Dimensions, full: RodCheck, look: Callable[[Dimensions], RodCheck], bounds: Bounds
) -> Tilt:
    """By differences between ``full`` at a strip and a ``look`` at one beside it for every size that is free.

    A size at whose neighbour the strip buckles has no slope.
    """
    x, own, theirs = logarithms(at), own_rows(focus, at)[:FIRST_GROUP], full_rows(full)
    slopes, alone = np.zeros((FIRST_GROUP, 3)), np.zeros((FIRST_GROUP, 3))
    for v, (low, high) in enumerate((bounds.b, bounds.h, bounds.l)):
        up, down = math.log(high) - x[v], x[v] - math.log(low)
        step = min(_STEP, up) if up >= down else -min(_STEP, down)
        if abs(step) < _LEAST_STEP:
            continue
        beside = x.copy()
        beside[v] += step
        strip = Dimensions(*np.exp(beside).tolist())
        found = look(strip)
        if found.stresses is not None:
            alone[:, v] = (full_rows(found) - theirs) / step
            slopes[:, v] = alone[:, v] - (own_rows(focus, strip)[:FIRST_GROUP] - own) / step
    slopes[~np.isfinite(slopes)], alone[~np.isfinite(alone)] = 0.0, 0.0
    return Tilt(x, slopes, alone)


def full_rows(check: RodCheck) -> Array:
    """The logarithms of a check's results in the order of the rows, up to constants; nan where there is none."""
    s, out = check.stresses, np.full(FIRST_GROUP, np.nan)
    for row, value, sign in (
        (rows.STABILITY, check.stability_safety, -1.0),
        (SIDEWAYS, check.stability_safety, -1.0),
        (rows.UTILISATION, s.fatigue_safety, -1.0),
        (STRESS, s.yield_safety, -1.0),
        (rows.SIDE, s.side_force_max, 1.0),
        (rows.PRESSURE, s.contact_pressure_max, 1.0),
        (rows.POWER, s.friction_power, 1.0),
    ):
        if value:
            out[row] = sign * math.log(value)
    return out
