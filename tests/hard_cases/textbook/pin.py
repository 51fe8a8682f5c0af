"""The pin's bore as a textbook finds it: forces by Macaulay's brackets, d from d by iteration."""

from __future__ import annotations

import math

ROUNDS = 2000


def forces(case, x):
    """Shear force and moment at x by Macaulay's brackets over the whole pin."""
    a, b, gap, P = (case[name] for name in ("boss_length", "small_end_length", "gap", "force"))
    x1, x2, x3 = a + gap, a + gap + b, a + 2 * gap + b

    def step(at, power):
        return max(x - at, 0.0) ** power

    q = P / (2 * a * a) * (step(0, 2) - step(a, 2)) - P / a * step(a, 1) - P / b * (step(x1, 1) - step(x2, 1))
    q += P / a * step(x3, 1) - P / (2 * a * a) * step(x3, 2)
    m = P / (6 * a * a) * (step(0, 3) - step(a, 3)) - P / (2 * a) * step(a, 2)
    m -= P / (2 * b) * (step(x1, 2) - step(x2, 2))
    m += P / (2 * a) * step(x3, 2) - P / (6 * a * a) * step(x3, 3)
    return abs(q), m


def demand(case, x):
    """F(d/D) of the strength requirement 1 - (d/D)^4 >= F."""
    q, m = forces(case, x)
    D, sigma, nu, criterion = (case[n] for n in ("outer_diameter", "allowable_stress", "poisson", "criterion"))
    bending = 32 * m / (math.pi * D**3)

    def law(r):
        if criterion == "saint_venant":
            return 4 * q * (3 + 2 * nu + (1 + 2 * nu) * r * r) / (math.pi * (1 + nu) * D**2)
        return 16 * q * (1 + r + r * r) / (3 * math.pi * D**2)

    def value(r):
        if criterion in ("fibre", "saint_venant"):
            found = max(bending, 2 * law(r)) / sigma
        else:
            found = math.sqrt(bending**2 + (3 if criterion == "von_mises" else 4) * law(r) ** 2) / sigma
        shear = case["allowable_shear"]
        return found if shear is None else max(found, law(r) / shear)

    return value


def wall(case, share):
    """(D - d)/D at a share of half the pin; None where the iteration does not settle."""
    length = 2 * (case["boss_length"] + case["gap"]) + case["small_end_length"]
    needed, D = demand(case, share * length / 2), case["outer_diameter"]
    ratio = 0.5
    for _ in range(ROUNDS):
        rest = 1 - needed(ratio)
        if rest < 0:
            return None
        before, ratio = ratio, rest**0.25
        if abs(ratio - before) <= 4e-16:
            return (D - min(ratio * D, D - 2 * case["min_wall"])) / D
    return None
