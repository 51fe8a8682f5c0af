"""Kinematics of a change-point four-bar over the cycle between two blows, free of cancellation.

The crank angle phi runs from 0 (just after the blow) to 2 pi (just before the next); a negative phi means 2 pi - |phi|,
so that both ends can be approached to full precision. With c = cos(phi/2), s = sin(phi/2):

    T^2 = lambda0 lambda2 lambda3 c^2 + M s^2,  D = lambda3 c + T,  A = T + lambda0 lambda2 c
    tan(phi3/2) = N s/D,  b = (D^2 + N^2 s^2)/lambda3,  u31 = dphi3/dphi = N A/(T b)
    du31/dphi = s X,  X = N/(T b) [(A/b) G^2/T - lambda0 lambda2 M/(2 T^2)],  G = T - sigma lambda0 c

with sigma = +1 for the largest coupler and -1 for the other two.

For c < 0 both D and A are evaluated as quotients: D = (lambda3 kappa c^2 + M s^2)/(T - lambda3 c) and
A = (M s^2 - lambda0 lambda2 kappa c^2)/(T - lambda0 lambda2 c), kappa = lambda0 lambda2 - lambda3 = |N| e; where
sigma c > 0, G = M/(T + sigma lambda0 c). The textbook acos form loses all digits 1e-7 away from the change point. Near
a kite (R -> 0) the two terms of X nearly cancel where u31 is almost constant: beyond mid-cycle for the largest base,
and before the blow for the others. There they are combined analytically.
Valid where M >= 0 (the crank rotates fully); lengths in cranks, angles in rad.
Derivation: docs/theory/impact-linkage.md; checked there against the raw loop equation to 60 digits.
"""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_NEAR_BLOW = 0.25
"""sin^2(phi/2) below which the terms of X are expanded about the blow; above it they are subtracted directly."""


@kernel
def transfer_and_rate(coefficients: Array, s: Array, c: Array, transfer: Array, rate: Array) -> None:
    """u31 and X = u31'/s of designs (rows of coefficients, (n, 7)) at half angles (m,), written to (n, m) arrays."""
    for i in range(coefficients.shape[0]):
        for j in range(s.size):
            transfer[i, j], rate[i, j], _ = motion(coefficients[i], s[j], c[j])


@kernel
def motion(row: Array, s: float, c: float) -> tuple[float, float, float]:
    """u31, X = u31'/s and T of a design (its row of coefficients) at a half angle."""
    base, coupler, rocker, numerator, margin, kappa, sigma = row
    lever, cc, ss = base * coupler, c * c, s * s
    root = np.sqrt(lever * rocker * cc + margin * ss)
    if c >= 0.0:
        d, a = rocker * c + root, root + lever * c
    else:
        d = (rocker * kappa * cc + margin * ss) / (root - rocker * c)
        a = (margin * ss - lever * kappa * cc) / (root - lever * c)
    along = sigma * base * c
    gap = margin / (root + along) if along > 0.0 else root - along
    b = (d * d + numerator * numerator * ss) / rocker
    factor = numerator / (root * b)
    if c < 0.0 and numerator < 0.0:
        rate = _largest_base_rate(base, coupler, rocker, numerator, root - base * c, gap, root, ss)
    elif c < 0.0 and ss < _NEAR_BLOW:
        gain = np.sqrt(lever / rocker)
        gain_less_one = kappa / rocker / (gain + 1.0)
        change = _change_to_blow(rocker, lever, numerator, sigma * base, gain, gain_less_one, gap, root, c, ss)
        falling = 2.0 * root * rocker * gap * gap * kappa * cc / (root - lever * c) + margin * d * d
        excess = margin * ss * change / (root - lever * c) - lever * falling
        rate = 0.5 * factor * excess / (root * root * b * rocker)
    else:
        rate = factor * (a / b * gap * gap / root - 0.5 * lever * margin / (root * root))
    return factor * a, rate, root


@kernel
def _largest_base_rate(
    base: float, coupler: float, rocker: float, numerator: float, wide: float, gap: float, root: float, ss: float
) -> float:
    """X of the largest base beyond mid-cycle, with terms of opposite sign combined analytically.

    With n = -N = lambda2 - 1, w = T - lambda0 c, G = M/w (so that T = (w + G)/2), k = n/G and v = n/(2 lambda0):

        D = G (1 - v + w k/(2 lambda0)),  D^2 + N^2 s^2 = G^2 q,  X = -lambda3 k E/(2 T^3 q^2)
        E = lambda3 (1 + n/2) G - w k [lambda3 (G + w/2) + lambda2 (v G/2 + H w + lambda0 k s^2)]
        H = 1 - v + w k/(4 lambda0)

    The terms in w alone, which cause the cancellation in X near a kite (n -> 0), add up to a multiple of n w = k G w by
    the closure lambda3 = lambda0 - n. One positive and one negative term remain; they are equal where u31 is extremal.
    """
    n = -numerator
    k, v = n / gap, 0.5 * n / base
    bend = 0.25 * wide * k / base
    d = 1.0 - v + 2.0 * bend
    q = d * d + k * k * ss
    falling = rocker * (gap + 0.5 * wide) + coupler * (0.5 * v * gap + (1.0 - v + bend) * wide + base * k * ss)
    excess = rocker * (1.0 + 0.5 * n) * gap - wide * k * falling
    return -0.5 * rocker * k * excess / (root * root * root * q * q)


@kernel
def _change_to_blow(
    rocker: float,
    lever: float,
    numerator: float,
    shift: float,
    gain: float,
    less_one: float,
    gap: float,
    root: float,
    c: float,
    ss: float,
) -> float:
    """F = 2 T lambda3 G^2 - lambda0 lambda2 N^2 U near the blow (c near -1), U = T - lambda0 lambda2 c.

    With A = (M s^2 - lambda0 lambda2 kappa c^2)/U and Q = D^2 + N^2 s^2,

        X = N lambda3/(2 T^3 Q^2) [M s^2 F/U - lambda0 lambda2 (2 T lambda3 G^2 kappa c^2/U + M D^2)]

    F is its value at the blow, g lambda3^2 (g - 1) (...), which tends to 0 with R, plus the contribution of s^2. There
    T0 = g lambda3, G0 = T0 + sigma lambda0 = N + (g - 1) lambda3 (in all three types N = lambda3 + sigma lambda0), and
    T0 - T = lambda0^2 s^2/(T0 + T). ``shift`` is sigma lambda0, ``lever`` lambda0 lambda2.
    """
    root_0, gap_0 = gain * rocker, numerator + less_one * rocker
    square = numerator * numerator
    growth = 5.0 + less_one * (4.0 + less_one)
    at_blow = (
        gain * rocker * rocker * less_one * (2.0 * rocker * (2.0 * numerator + less_one * rocker) - square * growth)
    )
    shorter, turned = shift * shift * ss / (root_0 + root), ss / (1.0 - c)
    narrower = shift * turned * (gap_0 + gap) / (root_0 + root)
    lost = 2.0 * rocker * (shorter * gap * gap + root_0 * narrower * (gap + gap_0))
    return at_blow - lost + lever * square * (shorter + lever * turned)
