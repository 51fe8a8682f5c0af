"""Restitution and closure errors due to length tolerances.

With the closure satisfied, R_k varies with the lengths as
dR_k/R_k = g/(g^2 - 1) (dlambda0/lambda0 + dlambda2/lambda2 - dlambda3/lambda3).
Lengths in m unless stated otherwise. Derivation: docs/theory/impact-linkage.md.
"""

from __future__ import annotations

import math

from solvers.linkage.mechanism.kinematics import FourBar


def restitution_sensitivity(gain: float) -> float:
    """Relative sensitivity of R_k to lambda0 or lambda2 (to lambda3: the negative), with the closure satisfied."""
    return gain / abs(gain * gain - 1.0) if gain != 1.0 else math.inf


def restitution_error(bar: FourBar, crank: float, tolerance: float) -> float:
    """Maximum relative error of R_k for a tolerance [m] of every length, with the closure satisfied."""
    base, coupler, rocker = (crank * r for r in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    return restitution_sensitivity(bar.gain) * tolerance * (1.0 / base + 1.0 / coupler + 1.0 / rocker)


def closure_error(crank: float, tolerance: float) -> float:
    """Maximum closure surplus [cranks] for a tolerance [m] of each of the four lengths."""
    return 4.0 * tolerance / crank
