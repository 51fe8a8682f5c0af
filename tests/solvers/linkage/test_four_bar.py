"""The transfer function against the raw loop equation at 120 digits, to the last bits of both ends."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from solvers.linkage.mechanism.angular_velocity_ratio import transfer_and_slope
from solvers.linkage.mechanism.change_point import KINDS, Gain
from solvers.linkage.mechanism.kinematics import of_family
from solvers.references import linkage as oracle

REFERENCE = [
    ("largest_coupler", 0.3, 2.5, 1.0, 0.8032904654672456),
    ("largest_coupler", 0.3, 2.5, math.pi, 0.3301245753114383),
    ("largest_coupler", 0.3, 2.5, -1e-3, -2.77618481016066),
    ("largest_rocker", 0.1, 2.4, 1.0, 0.1854473693730912),
    ("largest_base", 0.3, 3.0, 2.0, -0.4275226663007653),
]


@pytest.mark.parametrize(("kind", "restitution", "parameter", "phi", "expected"), REFERENCE)
def test_reference_values_to_all_printed_digits(kind, restitution, parameter, phi, expected):
    bar = of_family(KINDS[kind], restitution, parameter)
    assert float(bar.transfer(phi)) == pytest.approx(expected, rel=4e-15)


ANGLES = [1e-15, 1e-12, 1e-9, 1e-7, 1e-4, 0.03, 0.7, 1.9, 3.0, math.pi, -2.2, -0.9, -0.02, -1e-4, -1e-7, -1e-11, -1e-15]


@pytest.mark.parametrize("restitution", [1e-6, 0.05, 0.3, 1.0 / 3.0, 0.95])
def test_differences_from_g_are_correctly_rounded(restitution):
    gain = Gain(restitution)
    g = (1 + Fraction(restitution)) / (1 - Fraction(restitution))
    for power, difference in ((1, gain.excess_of), (2, gain.square_excess_of)):
        nearest = float(g**power)
        for ratio in (nearest, math.nextafter(nearest, 0.0), nearest * (1 + 1e-12), 1.7 * nearest, 1e-3, 1e9):
            assert difference(ratio) == float(Fraction(ratio) - g**power)


FAR = {
    "largest_coupler": (1 + 1e-12, 1 + 1e-6, 1.01, 1.4, 3.0, 50.0),
    "largest_base": (1 + 1e-12, 1 + 1e-6, 1.01, 1.4, 3.0, 50.0),
    "largest_rocker": (1 + 1e-6, 1.01, 1.3, 2.5, 40.0),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [1e-6, 1e-3, 0.05, 0.3, 0.7, 0.95])
def test_it_agrees_with_the_loop_equation_at_120_digits(kind, restitution):
    with mp.workdps(120):
        for factor in FAR[kind]:
            parameter = KINDS[kind].parameter_limit(Gain(restitution)) * factor
            bar = of_family(KINDS[kind], restitution, parameter)
            if not bar.rotatable:
                continue
            links = oracle.ratios(kind, restitution, parameter)
            for phi in ANGLES:
                angle = mp.mpf(phi) if phi > 0 else 2 * mp.pi + mp.mpf(phi)
                exact = oracle.transfer(kind, links, angle)
                h = mp.mpf(10) ** -30
                slope = (oracle.transfer(kind, links, angle + h) - oracle.transfer(kind, links, angle - h)) / (2 * h)
                scale = max(abs(exact), abs(slope))
                found, rate = (float(row[0]) for row in transfer_and_slope(bar.coefficients, np.array([phi])))
                assert abs(found - exact) <= 1e-14 * scale, (kind, restitution, factor, phi)
                assert abs(rate - slope) <= 1e-13 * abs(slope) + 1e-14 * scale, (kind, restitution, factor, phi)


@pytest.mark.parametrize("kind", KINDS)
def test_joints_keep_every_link_its_length(kind):
    bar = of_family(KINDS[kind], 0.2, 2.9)
    phi = np.linspace(-math.pi, math.pi, 361)
    pin, joint = bar.joints(phi)
    assert np.hypot(*(joint - pin)) == pytest.approx(np.full(361, bar.ratios.coupler), rel=1e-13)
    assert np.ptp(bar.rocker_angle(phi)) == pytest.approx(bar.swing, rel=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_ends_and_restitution_are_those_asked_for(kind):
    bar = of_family(KINDS[kind], 0.3, 4.0)
    assert bar.restitution == pytest.approx(0.3, rel=1e-14)
    assert abs(float(bar.transfer(0.0))) == pytest.approx(bar.u31_start, rel=1e-14)
    assert abs(float(bar.transfer(-0.0)) * bar.u31_end / bar.u31_start) == pytest.approx(bar.u31_end, rel=1e-14)
    assert abs(float(bar.transfer(-1e-15))) == pytest.approx(bar.u31_end, rel=1e-14)
