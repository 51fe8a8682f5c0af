"""Kinematics against 50-digit geometry."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from solvers.crank.motion import slider_crank as kinematics
from solvers.crank.motion.slider_crank import ExactMotion, angle_functions, crank_angle_at, rod_acceleration_of

EPS = np.finfo(float).eps
CASES = [(0.04, 0.16, 0.0), (0.04, 0.14, 0.006), (0.04, 0.14, -0.006), (1.5e-3, 45.5e-3, 0.0), (0.04, 0.041, 0.0005)]


def derivative(motion, angle):
    """dx/dphi as the kernels have it where they multiply it with forces."""
    at = angle_functions(angle, motion.geometry)
    return motion.crank_radius * (at.sine + at.cosine * at.tangent)


def position(r, length, e):
    """x(phi) from Pythagoras, at 50 digits."""
    r, length, e = mp.mpf(r), mp.mpf(length), mp.mpf(e)
    top = mp.sqrt((length + r) ** 2 - e**2)
    return lambda phi: top - r * mp.cos(phi) - mp.sqrt(length**2 - (r * mp.sin(phi) - e) ** 2)


@pytest.mark.parametrize(("r", "length", "e"), CASES)
def test_displacement_velocity_and_acceleration_against_differentiated_geometry(r, length, e):
    motion = ExactMotion(r, length, e)
    with mp.workdps(50):
        x = position(r, length, e)
        for phi in np.linspace(0.1, 6.2, 13):
            at = mp.mpf(float(phi))
            assert motion.displacement(phi) == pytest.approx(float(x(at)), rel=2e-13)
            assert derivative(motion, phi) == pytest.approx(float(mp.diff(x, at)), rel=1e-11, abs=1e-14 * r)
            assert motion.acceleration(phi) == pytest.approx(float(mp.diff(x, at, 2)), rel=1e-10, abs=1e-12 * r)
            beta = mp.diff(lambda f: mp.asin((r * mp.sin(f) - e) / length), at, 2)
            swing = rod_acceleration_of(angle_functions(phi, motion.geometry), motion.geometry)
            assert swing == pytest.approx(float(beta), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("r", "length", "e"), CASES)
def test_displacement_keeps_its_digits_at_the_upper_dead_centre(r, length, e):
    motion = ExactMotion(r, length, e)
    top, bottom = motion.dead_centres
    assert motion.displacement(bottom) == pytest.approx(motion.stroke, rel=4 * EPS)
    with mp.workdps(60):
        exact_top = mp.asin(mp.mpf(e) / (mp.mpf(length) + mp.mpf(r)))
        x = position(r, length, e)
        for gap in (1e-3, 1e-6):
            # The angle itself is only known to rounding, so its own distance to the dead centre is what counts.
            phi = top + gap
            scale = 2 * EPS * max(abs(top), gap) / gap
            assert motion.displacement(phi) == pytest.approx(float(x(mp.mpf(phi))), rel=20 * EPS + 2 * scale)
        assert float(x(exact_top)) == pytest.approx(0, abs=1e-40)


def test_inverse_of_position_to_four_epsilon_from_1e_300_to_the_lower_dead_centre():
    r, length = 0.04, 0.16
    near_bottom = 2 * r - 10.0 ** np.linspace(-17, -2, 60)
    places = np.concatenate([10.0 ** np.linspace(-300, -1.2, 120), near_bottom, [2 * r]])
    with mp.workdps(60):
        big_r, big_l = mp.mpf(r), mp.mpf(length)
        for x in places.tolist():
            at, angle = mp.mpf(x), crank_angle_at(x, r, length, 0.0)
            down, up = mp.sqrt(at * (2 * big_l - at)), mp.sqrt((2 * big_r - at) * (2 * big_r + 2 * big_l - at))
            exact = 2 * mp.atan2(down, up)
            assert abs(mp.mpf(angle) - exact) <= 4 * EPS * exact


@pytest.mark.parametrize(("r", "length", "e"), CASES)
def test_inverse_with_offset_returns_the_angle(r, length, e):
    motion = ExactMotion(r, length, e)
    angle = np.linspace(*motion.dead_centres, 101)
    of_motion = motion.crank_radius, motion.rod_length, motion.offset
    found = np.array([crank_angle_at(x, *of_motion) for x in motion.displacement(angle).tolist()])
    assert found[1:-1] == pytest.approx(angle[1:-1], abs=1e-11)
    assert found[[0, -1]] == pytest.approx(angle[[0, -1]], abs=1e-7)


@pytest.mark.parametrize("ratio", [1e-6, 0.03, 0.3, 0.999999])
def test_in_line_motion_against_fifty_digit_derivatives(ratio):
    r, length, omega = 2e-3, 2e-3 / ratio, 300.0
    motion = ExactMotion(r, length)
    with mp.workdps(50):
        exact_length = mp.mpf(length)

        def position(a):
            return r * (1 - mp.cos(a)) + exact_length * (1 - mp.sqrt(1 - (r / exact_length * mp.sin(a)) ** 2))

        for angle in (1e-8, 0.3, 1.5, 3.0, 4.4, 6.2831853):
            found = [
                motion.displacement(angle),
                derivative(motion, angle) * omega,
                motion.acceleration(angle) * omega**2,
            ]
            for order, value in enumerate(found):
                reference = mp.diff(position, mp.mpf(angle), order) * mp.mpf(omega) ** order
                scale = max(abs(reference), r * omega**order * (0 if order == 0 else 1e-3))
                condition = 1 / (1 - ratio) if ratio > 0.9 else 1
                assert abs(mp.mpf(float(value)) - reference) <= 3e-15 * condition * scale


@pytest.mark.parametrize("ratio", [0.05, 0.25, 0.6, 0.95])
def test_brixs_displacement(ratio):
    r, length = 0.04, 0.04 / ratio
    angle = np.linspace(0.0, math.pi, 200)
    textbook = r * ((1 - np.cos(angle)) + ratio / 4 * (1 - np.cos(2 * angle)))
    assert kinematics.brix_displacement(angle, r, length) == pytest.approx(textbook, abs=1e-16)


def test_the_two_harmonic_acceleration_is_that_of_brixs_displacement():
    angle, step = np.linspace(0, 6, 50), 1e-3
    before, here, after = (kinematics.brix_displacement(angle + side * step, 0.04, 0.14) for side in (-1, 0, 1))
    bend = (before - 2 * here + after) / step**2
    assert kinematics.two_harmonic_acceleration(angle, 0.04, 0.14, 1.0) == pytest.approx(bend, abs=1e-7)


def test_the_error_of_two_harmonics_falls_with_the_square_of_the_ratio():
    angle = np.linspace(0, 2 * math.pi, 721)

    def wrong(ratio):
        short = kinematics.two_harmonic_acceleration(angle, ratio, 1.0, 1.0)
        return np.max(np.abs(ExactMotion(ratio, 1.0).acceleration(angle) - short)) / ratio

    assert wrong(0.1) / wrong(0.05) == pytest.approx(8.0, rel=0.02)
