"""University lectures on crank dynamics and the laboratory work on mass reduction: their forms, and how far they reach.

The lectures print no numbers; the figures here follow from their formulas and were computed apart from this project.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from solvers import crank
from solvers.crank.motion import slider_crank as kinematics


@pytest.mark.parametrize(("ratio", "displacement", "acceleration"), [(0.25, "0.20", "0.66"), (0.3, "0.35", "1.1")])
def test_greatest_errors_of_the_two_harmonic_forms(ratio, displacement, acceleration):
    """In per cent of r and of r omega^2 (1 + lambda)."""
    r, length, angle = 0.04, 0.04 / ratio, np.linspace(0, math.pi, 20001)
    motion = crank.ExactMotion(r, length)
    moved = kinematics.brix_displacement(angle, r, length) - motion.displacement(angle)
    assert f"{100 * np.max(np.abs(moved)) / r:.2f}" == displacement
    acceleration_error = kinematics.two_harmonic_acceleration(angle, r, length, 1.0) - motion.acceleration(angle)
    digits = len(acceleration.split(".")[1])
    assert f"{100 * np.max(np.abs(acceleration_error)) / (r * (1 + ratio)):.{digits}f}" == acceleration


MEASURED = {"pivot_distance": 0.16, "rod_mass": 0.62, "gravity": 9.81}


def test_the_pendulum_gives_back_the_rod_whose_periods_it_is_given():
    """L = 160 mm, m = 0.62 kg, l_A = 115 mm, J_0 = 0.0030 kg m2 swing in 0.7950600227 s and 0.7834631249 s."""

    def period(arm):
        return 2 * math.pi * math.sqrt((0.0030 + 0.62 * arm**2) / (0.62 * 9.81 * arm))

    small, big = period(0.115), period(0.045)
    assert (f"{small:.10f}", f"{big:.10f}") == ("0.7950600227", "0.7834631249")
    found = crank.swing(crank.Pendulum(period_small_end=small, period_big_end=big, **MEASURED)).values
    assert found["rod_cg_from_pin"] == pytest.approx(0.115, rel=1e-9)
    assert found["rod_inertia"] == pytest.approx(0.0030, rel=1e-9)
    assert found["rod_mass_at_pin"] == pytest.approx(0.62 * 0.045 / 0.16, rel=1e-9)
    assert found["rod_mass_at_crank"] == pytest.approx(0.62 * 0.115 / 0.16, rel=1e-9)
    # Printed to ten digits, the periods themselves carry 1.4e-10 m.
    rounded = crank.swing(crank.Pendulum(period_small_end=0.7950600227, period_big_end=0.7834631249, **MEASURED)).values
    assert rounded["rod_cg_from_pin"] == pytest.approx(0.115, abs=1e-9)


def test_a_tenth_of_a_per_cent_in_both_periods_moves_the_centre_by_more_than_two_millimetres():
    late = crank.Pendulum(period_small_end=0.7950600227 * 1.001, period_big_end=0.7834631249 * 1.001, **MEASURED)
    found = crank.swing(late)
    assert f"{found.values['rod_cg_from_pin'] * 1e3:.3f}" == "117.292"
    assert "weighing" in found.warnings[0]
