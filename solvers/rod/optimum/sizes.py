"""The sizes available for a strip: continuous within bounds, multiples of a step, or thicknesses from a stock."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.numerics.arrays import Array
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions


@dataclass(frozen=True)
class Sizes:
    """Bounds, the length's within the rod's, and the sizes available within them: stock thicknesses, steps of width and
    length [m]."""

    bounds: Bounds
    stock_h: tuple[float, ...] | None = None
    step_b: float | None = None
    step_l: float | None = None

    @property
    def discrete(self) -> bool:
        """Whether any size is discrete."""
        return len(self.free) < 3

    @property
    def free(self) -> tuple[int, ...]:
        """The indices of the continuous ones among b, h, l."""
        steps = self.step_b, self.stock_h, self.step_l
        return tuple(k for k, step in enumerate(steps) if step is None)

    def slices(self) -> Array:
        """The boxes (b1, b2, h1, h2) that together contain all sizes; one per stock thickness."""
        (b1, b2), (h1, h2) = self.bounds.b, self.bounds.h
        if self.stock_h is not None:
            return np.array([[b1, b2, h, h] for h in sorted(set(self.stock_h)) if h1 <= h <= h2])
        return np.array([[b1, b2, h1, h2]])

    def stock_near(self, h: float, steps: int) -> list[float]:
        """The stock thickness nearest to ``h`` and its neighbours up to ``steps`` places away; [h] without a stock."""
        if self.stock_h is None:
            return [h]
        low, high = self.bounds.h
        stock = sorted({s for s in self.stock_h if low <= s <= high})
        at = min(range(len(stock)), key=lambda n: abs(stock[n] - h))
        return stock[max(at - steps, 0) : at + steps + 1]

    def around(self, d: Dimensions) -> Bounds:
        """The bounds, with discrete dimensions fixed at the available sizes nearest to a strip."""
        b, h, l = self.bounds.b, self.bounds.h, self.bounds.l
        if self.stock_h is not None:
            h = (*self.stock_near(d.h, 0),) * 2
        if self.step_b is not None:
            b = (_nearest_multiple(d.b, self.step_b, b),) * 2
        if self.step_l is not None:
            l = (_nearest_multiple(d.l, self.step_l, l),) * 2
        return Bounds(b, h, l)


def _nearest_multiple(value: float, step: float, within: tuple[float, float]) -> float:
    first, last = math.ceil(within[0] / step * (1 - 1e-12)), math.floor(within[1] / step * (1 + 1e-12))
    # A multiple of the step may exceed a bound by one unit in the last place.
    return min(max(min(max(round(value / step), first), last) * step, within[0]), within[1])
