"""First pin-force peak after a blow with mismatched restitution, due to the coupler's elasticity.

Near the change point the coupler's elongation is a quadratic form of crank angle phi and rocker angle phi3 that
vanishes on both branches of rigid motion, phi3 = u0 phi and phi3 = -u1 phi (u0, u1: |u31| after and before the blow). A
rocker rebounding with R instead of R_k = u0/u1 leads the first branch by theta = (u0 + u1) y; with the angle scaled so
that the stiffness is 1

    y'' = -y (phi + y)(phi + 2 y),   y(0) = 0,   y'(0) = m = (R - R_k)/(1 + R_k),
    force = C(m) sqrt(2 k_c E) |R - R_k|,   C(m) = first peak of |y (phi + y)/m|.

For a small mismatch y is a Bessel function of order 1/4 and C(0) = 2^(5/4) Gamma(5/4) max z^(3/4) J_1/4(z) = 1.8165...
Without damping later peaks grow as the square root of the coupler's lever about the rocker's pivot; with a damping
ratio of the vibration above 0.12 the first one is the highest.
Valid for a stiff coupler: the peak occurs within a small crank angle at constant crank speed.
Source: derived for this package; verified against the elastic mechanism integrated in time.
"""

from __future__ import annotations

import math

from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.scene import Scene
from solvers.numerics.jit import kernel

_STEP = 0.004
_MIN_MISMATCH = 1e-9


@kernel
def first_peak(mismatch: float) -> float:
    """C(m) for -1/2 < m < 1, to 1e-7: classical Runge-Kutta steps, the peak by a parabola through three of them."""
    m = mismatch if abs(mismatch) > _MIN_MISMATCH else _MIN_MISMATCH
    # y = m w avoids cancellation for small m.
    w, slope, phi = 0.0, 1.0, 0.0
    previous_but_one, previous = 0.0, 0.0
    while phi < 50.0:
        a1, b1 = slope, -w * (phi + m * w) * (phi + 2.0 * m * w)
        mid, x = phi + 0.5 * _STEP, w + 0.5 * _STEP * a1
        a2, b2 = slope + 0.5 * _STEP * b1, -x * (mid + m * x) * (mid + 2.0 * m * x)
        x = w + 0.5 * _STEP * a2
        a3, b3 = slope + 0.5 * _STEP * b2, -x * (mid + m * x) * (mid + 2.0 * m * x)
        end, x = phi + _STEP, w + _STEP * a3
        a4, b4 = slope + _STEP * b3, -x * (end + m * x) * (end + 2.0 * m * x)
        w += _STEP * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        slope += _STEP * (b1 + 2.0 * b2 + 2.0 * b3 + b4) / 6.0
        phi = end
        force = w * (phi + m * w)
        if force < previous:
            second_difference = previous_but_one - 2.0 * previous + force
            return previous - (force - previous_but_one) ** 2 / (8.0 * second_difference)
        previous_but_one, previous = previous, force
    return previous


def worst_elastic_peak(bar: FourBar, scene: Scene) -> float:
    """First pin-force peak [N] due to elasticity alone, after a blow at the worse end of the restitution's range."""
    mismatches = [end - bar.restitution for end in (scene.restitution.low, scene.restitution.high)]
    peaks = (first_peak(mismatch / (1.0 + bar.restitution)) * abs(mismatch) for mismatch in mismatches)
    return math.sqrt(2.0 * scene.coupler_stiffness * scene.impact_energy) * max(peaks)
