"""Lower bounds of the enclosing radius over ranges of the free ratio.

With directions n_i and weights w_i >= 0, the sum of which is 1, a circle of radius R about c around an outline with
support function h (see ``outline``) satisfies

    R >= sum w_i (h(n_i) - c.n_i) >= sum w_i h(n_i) - R |sum w_i n_i|,

the latter because the crank's pivot, the origin, lies within it; and h is at least the support function of any of the
outline's parts. With the directions, weights and parts at which the circle of the member in the middle touches, the sum
is that circle's radius there. It is a function of y (``ratio_of_base_to_rocker``) without maxima, of which interval
arithmetic with derivatives finds a lower bound: the error decreases by the square of the range's width. Per V, with
s = g - 1,

    l1 = s y/w,  l0 = s y/n,  l3 = s/n,  2 lambda2/lambda0 l1 = 2 g^2 s n/w^2,
    rise of the rocker's joint = 2 g s sqrt((g^2 - 1) m)/w^2,  its position at the blow +-s.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.linkage.optimum.ratio_of_base_to_rocker import ratios
from solvers.linkage.swept_area.enclosing_circle import smallest_circle
from solvers.linkage.swept_area.outline import tips_of
from solvers.numerics.arrays import Array
from solvers.numerics.intervals import over, plus, rooted, scaled, squared
from solvers.numerics.jit import kernel


@kernel
def least_radii(low: Array, rows: Array, high: Array, outlines: Array, turns: Array, gain: float) -> Array:
    """Lower bounds of the enclosing radius per V over ranges of the free ratio, shape (n,).

    ``low``, ``rows`` and ``high`` as in ``load_bounds.least_loads``; ``outlines`` per V of the members within, and by
    how much the swing of others in the range is smaller at most.
    """
    out = np.empty(rows.shape[0])
    for i in range(out.size):
        out[i] = _least_radius(low[i], rows[i], high[i], outlines[i], turns[i], gain)
    return out


@kernel
def _contacts(outline: Array) -> Array:
    """Where the smallest circle touches: cosine and sine of the directions from its centre, and weights; (k, 3)."""
    _, x, y, parts = smallest_circle(outline)
    count = parts.shape[0]
    out = np.empty((count, 3))
    for k in range(count):
        away = math.hypot(parts[k, 0] - x, parts[k, 1] - y)
        if away == 0.0:
            # The crank's circle is itself the smallest.
            return np.array([[1.0, 0.0, 0.5], [-1.0, 0.0, 0.5]])
        out[k, 0], out[k, 1], out[k, 2] = (parts[k, 0] - x) / away, (parts[k, 1] - y) / away, 0.5
    if count == 3:
        for k in range(3):
            one, other = out[(k + 1) % 3], out[(k + 2) % 3]
            out[k, 2] = abs(one[0] * other[1] - one[1] * other[0])
        out[:, 2] /= max(out[0, 2] + out[1, 2] + out[2, 2], 1e-300)
    return out


@kernel
def _shares(outline: Array, turn: float) -> tuple[float, float, float, float, float, float]:
    """Factors of l1, l0, l3, the position at the blow, the joint's displacement along the base and its rise in
    sum w_i h(n_i), lowered by 1 + |sum w_i n_i|."""
    crank, base, rocker, blow, _, rise, first, last = outline
    tips = tips_of(outline)
    outward, upward = math.copysign(1.0, tips[2] - tips[0]), math.copysign(1.0, rise)
    contacts, shares, x, y = _contacts(outline), np.zeros(6), 0.0, 0.0
    for k in range(contacts.shape[0]):
        cos, sin, weight = contacts[k]
        x, y = x + weight * cos, y + weight * sin
        at_blow, at_end = blow * cos, tips[2] * cos + tips[3] * sin
        reached = max(max(crank, base * cos), max(at_blow, at_end))
        # Only the part of the arc that every member of the range has.
        turned = (math.atan2(sin, cos) - first - turn) % (2.0 * math.pi)
        if turned <= last - first - 2.0 * turn and base * cos + rocker > reached:
            shares[1] += weight * cos
            shares[2] += weight
        elif reached == crank:
            shares[0] += weight
        elif reached == base * cos:
            shares[1] += weight * cos
        else:
            shares[3] += weight * cos
            if reached == at_end:
                shares[4] += weight * cos * outward
                shares[5] += weight * sin * upward
    shares /= 1.0 + math.hypot(x, y)
    return shares[0], shares[1], shares[2], shares[3], shares[4], shares[5]


@kernel
def _least_radius(low: Array, row: Array, high: Array, outline: Array, turn: float, gain: float) -> float:
    """The bound over one range; 0 if there is none."""
    y, n, w, m, reach = ratios(low, row, high, gain)
    if not (n[1] > 0.0 and w[1] > 0.0 and m[1] > 0.0):
        return 0.0
    crank, base, rocker, blow, along, rise = _shares(outline, turn)
    ww, s = squared(w, reach), abs(outline[3])
    links = plus(scaled(over(y, w, reach), crank), scaled(over(y, n, reach), base), reach)
    links = plus(links, scaled(over((1.0, 1.0, 1.0, 0.0, 0.0), n, reach), rocker), reach)
    moved = plus(
        scaled(n, 2.0 * gain * gain * along),
        scaled(rooted(m, reach), 2.0 * gain * math.sqrt(s * (gain + 1.0)) * rise),
        reach,
    )
    return max(s * plus(links, over(moved, ww, reach), reach)[1] + blow * outline[3], 0.0)
