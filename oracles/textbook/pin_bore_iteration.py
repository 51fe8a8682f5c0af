"""The paper's own iteration for the bore, kept to show where it converges: beta <- (1 - F(beta))^(1/4).

Each pass computes the utilisation F from the previous bore ratio beta = d/D, and the next ratio from F. The error is
multiplied by F'(beta)/(4 beta^3) per pass, so the iteration converges only where that is less than 1 in magnitude: for
slightly less than half of all loads that a pin can carry (the quarter disc m^2 + q^2 <= 1). Newton's method in the wall
(``solvers.pin.section.strength``) converges from everywhere; this function returns None where the iteration does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_MOST_PASSES = 10_000


@dataclass(frozen=True)
class Iterated:
    """The bore ratio, the number of passes, and the factor by which a pass reduces the error there."""

    ratio: float
    passes: int
    factor: float


def factor(m: float, q: float, ratio: float) -> float:
    """dbeta_next/dbeta at a fixed point: -F'(beta)/(4 beta^3), F = sqrt(m^2 + q^2 (1 + beta + beta^2)^2)."""
    s = 1.0 + ratio + ratio * ratio
    f = math.hypot(m, q * s)
    if f == 0.0:
        return 0.0
    return -(q * q * s * (1.0 + 2.0 * ratio) / f) / (4.0 * ratio**3) if ratio > 0.0 else -math.inf


def iterate(m: float, q: float, start: float = 0.5, tolerance: float = 1e-12) -> Iterated | None:
    """The paper's iteration for m = 32 M/(pi sigma D^3), q = 32 Q/(3 pi sigma D^2); None where it does not converge.

    ``start`` is the first bore ratio. Leaving [0, 1] (no real root) and cycling both count as divergence.
    """
    ratio = start
    for passes in range(1, _MOST_PASSES + 1):
        rest = 1.0 - math.hypot(m, q * (1.0 + ratio + ratio * ratio))
        if rest < 0.0:
            return None
        following = rest**0.25
        if abs(following - ratio) <= tolerance:
            return Iterated(following, passes, factor(m, q, following))
        ratio = following
    return None
