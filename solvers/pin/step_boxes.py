"""Stepped bores under a deflection limit: a bound over all break points, by branch and bound.

With break points y_k in [a_k, b_k] and walls u_k that rise toward the middle, the mass sum u_k (y_k - y_{k-1}) falls
where a break moves inward, and so does the deflection where it moves outward. So no stepped bore of such a box is
lighter than the separable convex program

    minimise  sum u_k (b_k - b_{k-1})   subject to  u_k >= f(a_k),  sum of deflections over [a_{k-1}, a_k] <= limit,

f being the greatest least wall up to a place. Every multiplier lambda >= 0 of the limit bounds its optimum from below:

    sum min over u >= f(a_k) of (u (b_k - b_{k-1}) + lambda G_k(u)) - lambda.

A box of no width is exact. The box that promises most is halved until the best bore found is met.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.flexibility import bending, phi
from solvers.pin.separable import place

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ROUNDS = 60
"""Of the multiplier; any is valid, so what they leave only loosens the bound."""
ROUNDING = 1e-12
"""What rounding may do to a bound, relative."""


@dataclass(frozen=True)
class Sums:
    """At the ends of panels, from the pin's end on: the share of the length, the deflection's two coefficients summed
    up to there and over the limit, and f, the greatest least wall up to there. The constants are those of the shear."""

    share: Array
    bend: Array
    shear: Array
    least: Array
    a: float
    b: float
    knee: float


@kernel
def _lagrangian(
    lam: float, low: Indices, high: Indices, share: Array, bend: Array, shear: Array, least: Array,
    a: float, b: float, knee: float, u: Array,
) -> tuple[float, float]:  # fmt: skip
    """The bound of a box for one multiplier, and its derivative (deflection over limit, less one); walls into u."""
    total, bent = 0.0, 0.0
    for k in range(u.size):
        inner, outer = high[k + 1], high[k]
        width = share[inner] - share[outer]
        gb, gs = bend[low[k + 1]] - bend[low[k]], shear[low[k + 1]] - shear[low[k]]
        floor = least[low[k + 1]]
        if gb <= 0.0 and gs <= 0.0:
            u[k] = floor
        elif width <= 0.0:
            u[k] = 1.0
        else:
            u[k] = place(lam, width, gb, gs, floor, u[k], a, b, knee)
        total += width * u[k]
        if gb > 0.0 or gs > 0.0:
            # Where nothing is left to hold, no finite multiplier was asked for.
            bent += gb * bending(max(u[k], 1e-12))[0] + gs * phi(max(u[k], 1e-12), a, b, knee)
    return total + lam * (bent - 1.0), bent - 1.0


@kernel
def _bound(
    low: Indices, high: Indices, start: float, share: Array, bend: Array, shear: Array, least: Array,
    a: float, b: float, knee: float, u: Array,
) -> tuple[float, float]:  # fmt: skip
    """The greatest bound found over multipliers, and its multiplier; u as left by the last one."""
    value, slope = _lagrangian(0.0, low, high, share, bend, shear, least, a, b, knee, u)
    if slope <= 0.0:
        return value, 0.0
    best, at = value, 0.0
    left, right, lam = 0.0, np.inf, start
    left_slope, right_slope = slope, 0.0
    for _ in range(_ROUNDS):
        value, slope = _lagrangian(lam, low, high, share, bend, shear, least, a, b, knee, u)
        if value > best:
            best, at = value, lam
        if slope > 0.0:
            left, left_slope = lam, slope
        else:
            right, right_slope = lam, slope
        if abs(slope) < 1e-10:
            break
        if right == np.inf:
            lam *= min(2.0 * (1.0 + slope) * (1.0 + slope), 1e3)
        else:
            # The deflection falls about as 1/sqrt(lambda): straight in its inverse square.
            e0, e1 = (1.0 + left_slope) ** -2, (1.0 + right_slope) ** -2
            part = (1.0 - e0) / (e1 - e0) if e1 > e0 else 0.5
            lam = left + min(max(part, 0.02), 0.98) * (right - left)
        if right < np.inf and right - left <= 1e-12 * right:
            break
    return best, at


@kernel
def _rises(u: Array) -> bool:
    """Whether the walls do not fall toward the middle; without that the bore cannot be drilled."""
    return not np.any(u[:-1] > u[1:] * (1.0 + 1e-9))


@kernel
def _descend(
    at: Indices, start: float, share: Array, bend: Array, shear: Array, least: Array,
    a: float, b: float, knee: float, u: Array,
) -> tuple[float, float]:  # fmt: skip
    """Moves the break points, one or two neighbours at a time, to where the bore is lightest; into ``at``."""
    best, lam = _bound(at, at, start, share, bend, shear, least, a, b, knee, u)
    n, trial = at.size, at.copy()
    step = max(share.size // 16, 1)
    while step >= 1:
        moved = False
        for first in range(1, n - 1):
            for last in (first, first + 1):
                if last > n - 2:
                    continue
                for sign in (-1, 1):
                    for other in (-1, 1):
                        if last == first and other == 1:
                            continue
                        trial[:] = at
                        trial[first] += sign * step
                        if last > first:
                            trial[last] += other * step
                        if trial[first] <= trial[first - 1] or trial[last] >= trial[last + 1]:
                            continue
                        if trial[last] < trial[first]:
                            continue
                        value, price = _bound(
                            trial, trial, max(lam, 1e-3), share, bend, shear, least, a, b, knee, u
                        )  # fmt: skip
                        if value < best * (1.0 - 1e-14) and _rises(u):
                            best, lam, moved = value, price, True
                            at[:] = trial
        if not moved:
            step //= 2
    return best, lam


@kernel
def _close(
    at: Indices, best: float, start: float, gap: float, most: int, share: Array, bend: Array, shear: Array,
    least: Array, a: float, b: float, knee: float,
) -> tuple[float, float, int]:  # fmt: skip
    """(best, bound, boxes) by branch and bound, the most promising box first; the best break points into ``at``."""
    n = at.size
    lows, highs = np.empty((most + 2, n), dtype=np.int64), np.empty((most + 2, n), dtype=np.int64)
    prices, cuts = np.empty(most + 2), np.empty(most + 2, dtype=np.int64)
    u, trial = np.full(n - 1, 0.5), np.empty(n, dtype=np.int64)
    lows[0], highs[0] = 0, share.size - 1
    highs[0, 0], lows[0, n - 1] = 0, share.size - 1
    prices[0], cuts[0] = start, (n - 1) // 2
    queue = [(0.0, 0)]
    used, bound, final = 1, 0.0, np.inf
    while len(queue) > 0:
        bound = min(queue[0][0], final)
        if bound >= final or bound >= best * (1.0 - gap) or used + 2 > most:
            break
        _, box = heapq.heappop(queue)
        k = cuts[box]
        middle = (lows[box, k] + highs[box, k]) // 2
        for side in range(2):
            low, high = lows[used], highs[used]
            low[:], high[:] = lows[box], highs[box]
            if side == 0:
                high[k] = middle
            else:
                low[k] = middle
            for j in range(1, n):
                low[j] = max(low[j], low[j - 1])
            for j in range(n - 2, -1, -1):
                high[j] = min(high[j], high[j + 1])
            empty = False
            for j in range(n):
                empty = empty or low[j] > high[j]
            if empty:
                continue
            value, lam = _bound(low, high, max(prices[box], 1e-3), share, bend, shear, least, a, b, knee, u)
            value = max(value * (1.0 - 1e-12), bound)
            if value >= best * (1.0 - gap):
                continue
            # Cut where the box's width costs the bound most.
            cut, loss = -1, 0.0
            for j in range(1, n - 1):
                if high[j] - low[j] > 1:
                    cost = (share[high[j]] - share[low[j]]) * (abs(u[j] - u[j - 1]) + 1e-3)
                    if cost > loss:
                        cut, loss = j, cost
            prices[used], cuts[used] = lam, cut
            for j in range(n):
                trial[j] = (low[j] + high[j]) // 2
            found, _ = _bound(trial, trial, max(lam, 1e-3), share, bend, shear, least, a, b, knee, u)
            if found < best and _rises(u):
                best = found
                at[:] = trial
            if cut < 0:
                # Between two neighbouring ends everywhere: this box's bound is final.
                final = min(final, value)
                continue
            heapq.heappush(queue, (value, used))
            used += 1
    if len(queue) == 0:
        bound = min(best * (1.0 - gap), final)
    return best, min(bound, best), used


def closed(sums: Sums, start: Indices, gap: float, most: int) -> tuple[Indices, float, int]:
    """(ends of the steps, lower bound of the mass over all break points, boxes).

    ``start`` are indices of ends, from 0 to the last, where the search begins; the bound is within ``gap`` of the best
    unless ``most`` boxes were looked at before.
    """
    arrays = (sums.share, sums.bend, sums.shear, sums.least, sums.a, sums.b, sums.knee)
    at, u = start.copy(), np.full(start.size - 1, 0.5)
    best, price = _descend(at, 0.5, *arrays, u)
    if start.size == 2:
        return at, best * (1.0 - ROUNDING), 1
    _, bound, boxes = _close(at, best, max(price, 1e-3), gap, most, *arrays)
    return at, float(bound) * (1.0 - ROUNDING), int(boxes)
