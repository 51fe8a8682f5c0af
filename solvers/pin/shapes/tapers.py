"""The two directions of taper of a cone: bore greatest at the pin's end, or in the middle.

At the fraction t of the half the bore relative to its maximum is f = 1 - (1 - r) p(t, c): r the ratio of the
narrowest to the widest bore, c the fraction of the half that the cone occupies, p the fraction of the taper
completed there. Both f and the volume per size h increase with r. For a cone that narrows toward the middle they
increase with c, for one that widens they decrease.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]


@kernel
def relative_bore(turn: int, r: float, c: float, t: float) -> float:
    """f at position t; ``turn`` as in ``Taper``."""
    along = min(t / c, 1.0)
    return 1.0 - (1.0 - r) * (along if turn > 0 else 1.0 - along)


def hollow(turn: int, r: float, c: float) -> float:
    """h: volume of the bore of maximum diameter 1, relative to the cylinder.

    Narrowing c (1 + r + r^2)/3 + (1 - c) r^2, widening c (1 + r + r^2)/3 + 1 - c.
    """
    if turn > 0:
        return c * (1.0 + r + r * r) / 3.0 + (1.0 - c) * r * r
    return 1.0 - c * (1.0 - r) * (2.0 + r) / 3.0


compiled_hollow = kernel(hollow)
"""``hollow`` for other kernels."""


@dataclass(frozen=True)
class Taper:
    """A direction of taper. ``turn`` is the sign of df/dc.

    1 if the bore narrows toward the middle, p = min(t/c, 1); -1 if it widens, p = 1 - min(t/c, 1).
    """

    turn: int

    def lost(self, t: Array, c: float) -> Array:
        """p at positions t."""
        along = np.minimum(t / c, 1.0)
        return along if self.turn > 0 else 1.0 - along

    def hollow(self, r: float, c: float) -> float:
        """h (see ``hollow``)."""
        return hollow(self.turn, r, c)

    def hollow_slopes(self, box: Box) -> Box:
        """Return the ranges of d(ln h)/dr and d(ln h)/dc over a box."""
        r0, r1, c0, c1 = box
        low, high = self.hollow(*widest(self, box)), self.hollow(*narrowest(self, box))
        if self.turn < 0:
            in_c = [-(1.0 - r) * (2.0 + r) / 3.0 for r in (r0, r1)]
            return c0 * (1.0 + 2.0 * r0) / 3.0 / high, c1 * (1.0 + 2.0 * r1) / 3.0 / low, in_c[0] / low, in_c[1] / high
        in_r = [[c * (1.0 + 2.0 * r) / 3.0 + 2.0 * (1.0 - c) * r for c in (c0, c1)] for r in (r0, r1)]
        least, greatest, end = ((1.0 - r) * (1.0 + 2.0 * r) / 3.0 for r in (r0, min(max(0.25, r0), r1), r1))
        return min(in_r[0]) / high, max(in_r[1]) / low, min(least, end) / high, greatest / low

    def diameters(self, r: float) -> tuple[float, float]:
        """Return the bore at the end and in the middle, relative to its maximum."""
        return (1.0, r) if self.turn > 0 else (r, 1.0)


NARROWING, WIDENING = Taper(1), Taper(-1)


def widest(taper: Taper, box: Box) -> tuple[float, float]:
    """Return the shape of a box with the least f everywhere, which allows the maximum size in it."""
    r0, _, c0, c1 = box
    return (r0, c0) if taper.turn > 0 else (r0, c1)


def narrowest(taper: Taper, box: Box) -> tuple[float, float]:
    """Return the shape of a box with the greatest f everywhere, which also has the maximum volume per size."""
    _, r1, c0, c1 = box
    return (r1, c1) if taper.turn > 0 else (r1, c0)


def lost_range(taper: Taper, t: Array, c0: float, c1: float) -> tuple[Array, Array, Array, Array]:
    """Return at positions t for c in [c0, c1]: minimum and maximum p, and minimum and maximum |dp/dc|.

    p has a kink where the cone ends; the slope range there includes both sides.
    """
    ends = taper.lost(t, c0), taper.lost(t, c1)
    with np.errstate(divide="ignore"):
        steepest = np.where(t <= c1, t / np.maximum(c0, t) ** 2, 0.0)
    gentlest = np.where(t < c0, t / (c1 * c1), 0.0)
    return np.minimum(*ends), np.maximum(*ends), gentlest, steepest
