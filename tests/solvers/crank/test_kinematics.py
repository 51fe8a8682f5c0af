"""Piston kinematics against fifty-digit derivatives."""

from __future__ import annotations

import mpmath as mp
import pytest

from solvers.crank.motion import in_line as kinematics


@pytest.mark.parametrize("ratio", [1e-6, 0.03, 0.3, 0.999999])
def test_kinematics_against_fifty_digit_derivatives(ratio):
    r, length, omega = 2e-3, 2e-3 / ratio, 300.0
    with mp.workdps(50):
        exact_length = mp.mpf(length)

        def position(a):
            return r * (1 - mp.cos(a)) + exact_length * (1 - mp.sqrt(1 - (r / exact_length * mp.sin(a)) ** 2))

        for angle in (1e-8, 0.3, 1.5, 3.0, 4.4, 6.2831853):
            found = [
                kinematics.displacement(angle, r, length),
                kinematics.velocity(angle, r, length, omega),
                kinematics.acceleration(angle, r, length, omega),
            ]
            for order, value in enumerate(found):
                reference = mp.diff(position, mp.mpf(angle), order) * mp.mpf(omega) ** order
                scale = max(abs(reference), r * omega**order * (0 if order == 0 else 1e-3))
                condition = 1 / (1 - ratio) if ratio > 0.9 else 1
                assert abs(mp.mpf(float(value)) - reference) <= 2e-15 * condition * scale
