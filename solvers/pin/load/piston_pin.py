"""The piston pin's own load and its internal forces, in closed form.

The rod's small end is loaded uniformly, each boss triangularly with its peak at the inner edge. Half the pin has three
pieces, t measured from the start of each; the other half is its mirror image:

    boss        0 <= t <= a        Q = P t^2/(2 a^2)      M = P t^3/(6 a^2)
    gap         0 <= t <= delta    Q = P/2                M = P a/6 + P t/2
    small end   0 <= t <= b/2      Q = P (b/2 - t)/b      M = P a/6 + P delta/2 + P t (b - t)/(2 b)

The moment in the middle is the textbook's P (L + 2(b + 2 delta) - 1.5 b)/12. Source: the paper's equations (4) and (5),
after figure 2.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def forces_in_piece(piece: int, t: float, a: float, b: float, gap: float, p: float) -> tuple[float, float]:
    """Return moment [N m] and shear force [N] at position t in a piece: boss, gap, half the small end."""
    if piece == 0:
        s = t / a
        return p * a * s * s * s / 6.0, 0.5 * p * s * s
    if piece == 1:
        return p * (a / 6.0 + 0.5 * t), 0.5 * p
    return p * (a / 6.0 + 0.5 * gap + 0.5 * t * (b - t) / b), p * (0.5 * b - t) / b


@kernel
def own_forces(x: Array, side: Array, a: float, b: float, gap: float, p: float) -> Array:
    """Return moment M [N m], magnitude of the shear force Q [N], and M m [N m^2] and Q q [N] at stations, (4, n).

    m and q are moment and shear of a unit force on the middle between the inner edges of the bosses, (x - a)/2 and 1/2
    in the first half; outside the span both are 0. A station belongs to the piece that contains its ``side``.
    """
    out, rod, length = np.zeros((4, x.size)), a + gap, 2.0 * (a + gap) + b
    for i in range(x.size):
        place, inside = x[i], side[i]
        if inside > 0.5 * length:
            place, inside = length - place, length - inside
        piece = 0 if inside < a else (1 if inside < rod else 2)
        t = max(place - (0.0 if piece == 0 else (a if piece == 1 else rod)), 0.0)
        out[0, i], out[1, i] = forces_in_piece(piece, t if piece < 2 else min(t, 0.5 * b), a, b, gap, p)
        if piece > 0:
            out[2, i], out[3, i] = 0.5 * max(place - a, 0.0) * out[0, i], 0.5 * out[1, i]
    return out


def deflection_integrals(force: float, boss_length: float, small_end_length: float, gap: float) -> tuple[float, float]:
    """Return the integrals of M m [N m^3] and Q q [N m] along the pin, m and q as in ``own_forces``.

    2 P [a delta^2/24 + delta^3/12 + c (delta h + h^2/2)/2 + delta b^2/48 + 5 b^3/768] and 2 P [delta/4 + b/16], with
    c = a/6 + delta/2 and h = b/2.
    """
    a, b, h = boss_length, small_end_length, 0.5 * small_end_length
    bend = a * gap**2 / 24.0 + gap**3 / 12.0 + 0.5 * (a / 6.0 + 0.5 * gap) * (gap * h + 0.5 * h * h)
    bend += gap * b * b / 48.0 + 5.0 * b**3 / 768.0
    return 2.0 * force * bend, 2.0 * force * (0.25 * gap + b / 16.0)
