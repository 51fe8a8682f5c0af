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
from solvers.linkage.swept_area.outline import arc_ends
from solvers.numerics.arrays import Array
from solvers.numerics.intervals import add, divide, scaled, square_root, squared
from solvers.numerics.jit import kernel


@kernel
def radius_lower_bounds(
    low: Array, rows: Array, high: Array, outlines: Array, swing_deficits: Array, gain: float
) -> Array:
    """Lower bounds of the enclosing radius per V over ranges of the free ratio, shape (n,).

    ``low``, ``rows`` and ``high`` as in ``load_bounds.load_lower_bounds``; ``outlines`` per V of the members inside,
    and ``swing_deficits``, the largest amount [rad] by which the swing of other members of the range is smaller.
    """
    out = np.empty(rows.shape[0])
    for i in range(out.size):
        out[i] = _radius_lower_bound(low[i], rows[i], high[i], outlines[i], swing_deficits[i], gain)
    return out


@kernel
def _contact_directions(outline: Array) -> Array:
    """Contacts of the smallest circle: cosine and sine of their directions from its centre, and weights; (k, 3)."""
    _, x, y, parts = smallest_circle(outline)
    count = parts.shape[0]
    out = np.empty((count, 3))
    for k in range(count):
        distance = math.hypot(parts[k, 0] - x, parts[k, 1] - y)
        if distance == 0.0:
            # The crank's circle is itself the smallest.
            return np.array([[1.0, 0.0, 0.5], [-1.0, 0.0, 0.5]])
        out[k, 0], out[k, 1], out[k, 2] = (parts[k, 0] - x) / distance, (parts[k, 1] - y) / distance, 0.5
    if count == 3:
        for k in range(3):
            first, second = out[(k + 1) % 3], out[(k + 2) % 3]
            out[k, 2] = abs(first[0] * second[1] - first[1] * second[0])
        out[:, 2] /= max(out[0, 2] + out[1, 2] + out[2, 2], 1e-300)
    return out


@kernel
def _length_factors(outline: Array, swing_deficit: float) -> Array:
    """Factors of l1, l0, l3, the position at the blow, the joint's displacement along the base and its rise in
    sum w_i h(n_i), lowered by 1 + |sum w_i n_i|."""
    crank, base, rocker, blow, _, rise, first, last = outline
    tips = arc_ends(outline)
    sign_along, sign_across = math.copysign(1.0, tips[2] - tips[0]), math.copysign(1.0, rise)
    contacts, factors, x, y = _contact_directions(outline), np.zeros(6), 0.0, 0.0
    for k in range(contacts.shape[0]):
        cos, sin, weight = contacts[k]
        x, y = x + weight * cos, y + weight * sin
        support_at_blow, support_at_end = blow * cos, tips[2] * cos + tips[3] * sin
        support = max(max(crank, base * cos), max(support_at_blow, support_at_end))
        # Only the part of the arc that every member of the range has.
        angle_in_arc = (math.atan2(sin, cos) - first - swing_deficit) % (2.0 * math.pi)
        if angle_in_arc <= last - first - 2.0 * swing_deficit and base * cos + rocker > support:
            factors[1] += weight * cos
            factors[2] += weight
        elif support == crank:
            factors[0] += weight
        elif support == base * cos:
            factors[1] += weight * cos
        else:
            factors[3] += weight * cos
            if support == support_at_end:
                factors[4] += weight * cos * sign_along
                factors[5] += weight * sin * sign_across
    return factors / (1.0 + math.hypot(x, y))


@kernel
def _radius_lower_bound(
    low: Array, row: Array, high: Array, outline: Array, swing_deficit: float, gain: float
) -> float:
    """Lower bound over one range; 0 if none can be proven."""
    y, n, w, m, extent = ratios(low, row, high, gain)
    if not (n[1] > 0.0 and w[1] > 0.0 and m[1] > 0.0):
        return 0.0
    crank, base, rocker, blow, along, rise = _length_factors(outline, swing_deficit)
    ww, s = squared(w, extent), abs(outline[3])
    links = add(scaled(divide(y, w, extent), crank), scaled(divide(y, n, extent), base), extent)
    links = add(links, scaled(divide((1.0, 1.0, 1.0, 0.0, 0.0), n, extent), rocker), extent)
    displacement = add(
        scaled(n, 2.0 * gain * gain * along),
        scaled(square_root(m, extent), 2.0 * gain * math.sqrt(s * (gain + 1.0)) * rise),
        extent,
    )
    return max(s * add(links, divide(displacement, ww, extent), extent)[1] + blow * outline[3], 0.0)
