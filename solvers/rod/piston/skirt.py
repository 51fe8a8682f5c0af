"""The piston in its cylinder: guide loads due to the rod's side force and clamp moment.

A close-fitting skirt of length Lp carries the side force T and the moment M = M0 + T e (the clamp lies e from the
middle of the skirt toward the crank) as a line load

    q(s) = T/Lp + 12 M s/Lp^3,   s in [-Lp/2, Lp/2],

on one wall where q > 0 and on the other where q < 0. Around the circumference the pressure follows the cosine:

    p_max = 4 max|q|/(pi D),   friction force F = mu (4/pi) int |q| ds.

With the dimensionless skew w = 6 |M|/(|T| Lp): int |q| ds is |T| for w <= 1 and |T| (w + 1/w)/2 for w > 1, where the
piston contacts both walls. The paper does not print its method for contact pressures; this one is fully stated, so that
its results can be judged.
"""

from __future__ import annotations

import math

from solvers.numerics.jit import kernel


@kernel
def couple_of(side: float, moment: float, lever: float, offset: float) -> float:
    """6 (M0 + T e)/Lp [N] from side force T and clamp moment M0, or from arrays or parts of both; ``lever`` is 6/Lp."""
    return lever * (moment + offset * side)


@kernel
def contact_load(side: float, couple: float) -> float:
    """Lp max|q| [N] from |T| and 6 |M|/Lp: times ``pressure_per_load`` the maximum contact pressure."""
    return side + couple


def pressure_per_load(diameter: float, skirt_length: float) -> float:
    """4/(pi D Lp) [1/m^2]: the maximum contact pressure per contact load."""
    return 4.0 / (math.pi * diameter * skirt_length)


@kernel
def both_walls(side: float, couple: float) -> float:
    """int |q| ds [N] from |T| and 6 |M|/Lp: |T| for contact with one wall, (couple + T^2/couple)/2 with both."""
    return 0.5 * (couple + side * (side / couple)) if couple > side else side
