"""Torque and pin force against differences of the rocker's angle, and their peaks."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from solvers.linkage.loads.torque_and_pin_force import peaks, series
from solvers.linkage.mechanism.change_point import KINDS, Gain
from solvers.linkage.mechanism.kinematics import of_family
from tests.solvers.linkage import brute_force

CASES = [(kind, r, f) for kind in KINDS for r, f in ((0.1, 1.3), (0.3, 1.7), (0.5, 2.5))]


@pytest.mark.parametrize(("kind", "restitution", "factor"), CASES)
def test_loads_are_those_of_the_moving_rocker(kind, restitution, factor):
    p, crank, energy = KINDS[kind].parameter_limit(Gain(restitution)) * factor, 0.02, 7.0
    bar = of_family(KINDS[kind], restitution, p)
    lambda0, lambda2, lambda3 = brute_force.ratios(kind, restitution, p)
    swept = brute_force.cycle(kind, (crank * lambda0, crank, crank * lambda2, crank * lambda3), 1201)
    phi, torque, force = brute_force.loads(swept, energy)
    # Near the blow the levers vanish, and differences with them.
    inside = (phi > 0.15) & (phi < 2 * math.pi - 0.15)
    found_torque, found_force = series(bar, crank, energy, phi)
    assert found_torque[inside] == pytest.approx(torque[inside], rel=2e-4, abs=2e-6 * np.abs(torque).max())
    assert found_force[inside] == pytest.approx(force[inside], rel=5e-4, abs=2e-5 * found_force.max())


@pytest.mark.parametrize("phi", ["1e-6", "0.1", "6.2", "6.283185"])
@pytest.mark.parametrize(("kind", "restitution", "factor"), CASES)
def test_beside_the_blow_loads_are_those_of_the_triangles_at_60_digits(kind, restitution, factor, phi):
    """The rocker's angle from two circles, differentiated; the force from its lever about the rocker's pivot."""
    p, crank, energy = KINDS[kind].parameter_limit(Gain(restitution)) * factor, 0.02, 7.0
    bar = of_family(KINDS[kind], restitution, p)
    with mp.workdps(60):
        base, coupler, rocker = brute_force.ratios(kind, mp.mpf(restitution), mp.mpf(p))
        way, inward = (-1 if kind == "largest_base" else 1), (1 if kind == "largest_coupler" else -1)

        def joints(angle, side):
            pin = way * mp.expj(angle)
            apart = base - pin
            along = (coupler**2 - rocker**2 + abs(apart) ** 2) / (2 * abs(apart))
            across = side * mp.sqrt(coupler**2 - along**2)
            return pin, pin + apart / abs(apart) * mp.mpc(along, across)

        def turned(angle, side):
            return mp.arg((joints(angle, side)[1] - base) * inward)

        def speed(angle, side, order=1):
            return mp.diff(lambda x: turned(x, side), angle, order, h=mp.mpf(10) ** -18)

        close = mp.mpf(10) ** -8
        # Of the two ways to assemble the links, that which strikes at the end of the turn is the faster there.
        side = max((1, -1), key=lambda each: abs(speed(-close, each)))
        ratio, rate = speed(mp.mpf(phi), side), speed(mp.mpf(phi), side, 2)
        struck = abs(speed(-close, side))
        pin, joint = joints(mp.mpf(phi), side)
        lever = abs(mp.im(mp.conj(joint - base) * (joint - pin) / coupler)) * crank
        torque = 2 * energy * ratio * rate / struck**2
        force = 2 * energy * abs(rate) / struck**2 / lever
    found_torque, found_force = series(bar, crank, energy, np.array([float(phi)]))
    assert found_torque[0] == pytest.approx(float(torque), rel=1e-7, abs=1e-14)
    assert found_force[0] == pytest.approx(float(force), rel=1e-7)


@pytest.mark.parametrize(("kind", "restitution", "factor"), CASES)
def test_peaks_are_the_greatest_of_many_angles(kind, restitution, factor):
    bar = of_family(KINDS[kind], restitution, KINDS[kind].parameter_limit(Gain(restitution)) * factor)
    found = peaks(bar, 0.02, 7.0)
    torque, force = series(bar, 0.02, 7.0, np.linspace(0, 2 * math.pi, 20_001))
    assert found.torque >= np.abs(torque).max() * (1 - 1e-12)
    assert found.torque == pytest.approx(np.abs(torque).max(), rel=1e-5)
    assert found.force >= force.max() * (1 - 1e-12)
    assert found.force == pytest.approx(force.max(), rel=1e-5)


def test_near_the_second_change_point_a_narrow_peak_is_found():
    bar = of_family(KINDS["largest_base"], 0.3, Gain(0.3).value * (1 + 1e-9))
    found = peaks(bar, 0.02, 7.0)
    near = math.pi + np.geomspace(1e-9, 1.0, 40_001)
    _, force = series(bar, 0.02, 7.0, np.concatenate([near, 2 * math.pi - near]))
    assert found.force >= force.max() * (1 - 1e-9)


NEARLY_AS_HIGH = [
    ("largest_coupler", 0.84, 13.798),
    ("largest_coupler", 0.59, 4.1557),
    ("largest_rocker", 0.019, 1.084582),
    ("largest_base", 0.51, 4.9631),
    ("largest_base", 0.06, 1.6605),
]
"""Mechanisms with two humps of the torque or of the force that differ by less than samples of them do."""

BESIDE_A_QUARTER_TURN = [("largest_base", 0.399, 5.661), ("largest_base", 0.084, 12.855)]


@pytest.mark.parametrize(("kind", "restitution", "parameter"), NEARLY_AS_HIGH + BESIDE_A_QUARTER_TURN)
def test_no_angle_carries_more_than_the_peaks(kind, restitution, parameter):
    bar = of_family(KINDS[kind], restitution, parameter)
    found = peaks(bar, 0.02, 7.0)
    torque, force = series(bar, 0.02, 7.0, np.linspace(0, 2 * math.pi, 400_001))
    assert found.torque == pytest.approx(np.abs(torque).max(), rel=2e-8)
    assert found.torque >= np.abs(torque).max() * (1 - 1e-14)
    assert found.force == pytest.approx(force.max(), rel=2e-8)
    assert found.force >= force.max() * (1 - 1e-14)
