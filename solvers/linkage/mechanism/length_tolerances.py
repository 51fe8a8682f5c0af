"""A restitution and a closure that lengths within their tolerance may have.

While the closure holds, R_k moves with the lengths by
dR_k/R_k = g/(g^2 - 1) (dlambda0/lambda0 + dlambda2/lambda2 - dlambda3/lambda3).
Lengths in m where not said otherwise. Derivation: docs/theory/impact-linkage.md.
"""

from __future__ import annotations

import math

from solvers.linkage.mechanism.kinematics import FourBar


def restitution_sensitivity(gain: float) -> float:
    """dR_k/R_k for a relative error of lambda0 or lambda2 (of lambda3: the negative), while the closure holds."""
    return gain / abs(gain * gain - 1.0) if gain != 1.0 else math.inf


def restitution_error(bar: FourBar, crank: float, tolerance: float) -> float:
    """Greatest relative error of R_k when every length may be off by ``tolerance`` [m], while the closure holds."""
    base, coupler, rocker = (crank * r for r in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    return restitution_sensitivity(bar.gain) * tolerance * (1.0 / base + 1.0 / coupler + 1.0 / rocker)


def closure_error(crank: float, tolerance: float) -> float:
    """Greatest closure surplus [cranks] when each of the four lengths may be off by ``tolerance`` [m]."""
    return 4.0 * tolerance / crank
