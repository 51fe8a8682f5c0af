"""The paper's own iteration for the bore, kept to show where it works: beta <- (1 - F(beta))^(1/4).

It takes the bore ratio beta = d/D of the last pass to compute the section's forces' share F, and F to compute the next
bore. Its error shrinks by F'(beta)/(4 beta^3) a pass, so it settles only where that is less than 1 in magnitude: over
the quarter disc m^2 + q^2 <= 1 of all loads that a pin can carry that is a little less than half. Newton's method in
the wall (``solvers.pin.section.strength``) settles from everywhere;
this tier answers None where the iteration does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_MOST_PASSES = 10_000


@dataclass(frozen=True)
class Iterated:
    """The bore ratio, the passes it took, and the factor by which a pass shrinks its error there."""

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
    """The paper's iteration for m = 32 M/(pi sigma D^3), q = 32 Q/(3 pi sigma D^2); None where it does not settle.

    ``start`` is the first bore ratio. Leaving [0, 1] (no real root) counts as not settling, as does wandering on.
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
