"""What the approximations of the textbooks get wrong: Brix's construction and two harmonics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solvers.crank.cycle.forces import Array
from solvers.crank.gas.indicator_diagram import IndicatorCurve
from solvers.crank.motion import in_line as kinematics
from solvers.crank.motion.slider_crank import TwoHarmonicMotion
from solvers.crank.scene import Curve, Scene
from solvers.numerics.pieces import maxima


@dataclass(frozen=True)
class TierErrors:
    """What the textbooks' forms get wrong for this mechanism (without offset).

    ``brix_displacement``  greatest |x_Brix - x|/r
    ``two_harmonic_acceleration``  greatest |a_2 - a|/(r omega^2 (1 + lambda))
    ``brix_pressure``  greatest |p_Brix(phi) - p(phi)| [Pa]; None where nothing is unrolled
    """

    brix_displacement: float
    two_harmonic_acceleration: float
    brix_pressure: float | None


def brix_curve(scene: Scene, curve: Curve) -> Curve | None:
    """The same diagram unrolled by Brix's construction; None where there is none, or with an offset."""
    m = scene.mechanism
    if not isinstance(curve, IndicatorCurve) or curve.motion.offset != 0.0:
        return None
    return replace(curve, mapping=TwoHarmonicMotion(m.crank_radius, m.rod_length))


def tier_errors(scene: Scene, curve: Curve, brix: Curve | None, tolerance: float) -> TierErrors:
    displacement, acceleration = _kinematic_errors(scene.mechanism.crank_radius, scene.mechanism.rod_length)
    pressure = None
    if brix is not None:
        gap = maxima(lambda a: np.abs(brix.pressure(a) - curve.pressure(a))[None], curve.breaks, tolerance)
        pressure = float(gap.value[0])
    return TierErrors(displacement, acceleration, pressure)


@lru_cache(maxsize=256)
def _kinematic_errors(r: float, length: float) -> tuple[float, float]:
    """The errors of Brix's displacement, of r, and of the two-harmonic acceleration, of its greatest."""

    def wrong(angle: Array) -> Array:
        moved = kinematics.brix_displacement(angle, r, length) - kinematics.displacement(angle, r, length)
        exact = kinematics.acceleration(angle, r, length, 1.0)
        hastened = kinematics.two_harmonic_acceleration(angle, r, length, 1.0) - exact
        return np.stack([np.abs(moved) / r, np.abs(hastened) / (r * (1.0 + r / length))])

    found = maxima(wrong, np.array([0.0, np.pi]), 1e-8).value
    return float(found[0]), float(found[1])
