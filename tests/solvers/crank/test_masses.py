"""Reduced masses, their conditions, and finding them by experiment."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from solvers import crank
from solvers.crank.masses.measurement import amplitude_factor
from solvers.errors import InvalidInput
from solvers.numerics.uncertainty import combined, sensitivities

ROD = crank.RodMass(0.16, 0.62, 0.115, 0.0030)


def test_two_masses_keep_mass_and_centre_and_break_the_third_condition():
    assert ROD.at_wrist_pin + ROD.at_crank_pin == pytest.approx(0.62)
    assert ROD.at_wrist_pin * 0.115 == pytest.approx(ROD.at_crank_pin * 0.045)
    assert ROD.inertia_defect == pytest.approx(0.62 * 0.115 * 0.045 - 0.0030)
    assert crank.RodMass(0.16, 0.62, 0.115).inertia_defect == 0.0


def test_the_crank_throw_reduced_to_its_pin():
    throw = crank.CrankThrow(0.4, 0.7, 0.02, 0.5, 0.03)
    assert throw.at_crank_pin(0.04) * 0.04 == pytest.approx(0.4 * 0.04 + 2 * 0.7 * 0.02 - 0.5 * 0.03)
    masses = crank.Masses(0.45, crank.RodMass(0.14, 0.6, 0.1), throw, rods_per_pin=2)
    assert masses.rotating(0.04) == pytest.approx(throw.at_crank_pin(0.04) + 2 * 0.6 * 0.1 / 0.14)
    assert masses.reciprocating == pytest.approx(0.45 + 0.6 * 0.04 / 0.14)


@pytest.mark.parametrize("degrees", [1, 6, 30, 80])
def test_the_period_of_a_wide_swing_against_the_elliptic_integral(degrees):
    k = math.sin(math.radians(degrees) / 2)
    integral, _ = quad(lambda u: 1 / math.sqrt(1 - (k * math.sin(u)) ** 2), 0, math.pi / 2, epsabs=1e-14)
    assert amplitude_factor(math.radians(degrees)) == pytest.approx(2 / math.pi * integral, rel=1e-12)


def test_the_series_of_the_small_swing_ends_where_it_says():
    theta = np.radians([5.0, 7.0])
    series = 1 + theta**2 / 16 + 11 * theta**4 / 3072
    assert amplitude_factor(theta) == pytest.approx(series, abs=1e-8)
    assert (amplitude_factor(theta) - 1) * 100 == pytest.approx([0.048, 0.093], abs=1e-3)


def period(inertia, mass, arm, gravity, amplitude):
    return (
        2 * math.pi * math.sqrt((inertia + mass * arm**2) / (mass * arm * gravity)) * float(amplitude_factor(amplitude))
    )


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.05, 1.0), st.floats(0.55, 0.8), st.floats(0.3, 0.9), st.floats(0.1, 50.0),
    st.floats(0.0, 0.3), st.floats(0.0, 0.15), st.floats(0.0, 0.2),
)  # fmt: skip
def test_swinging_finds_the_rod_again(length, share, fill, mass, amplitude, small_bore, big_bore):
    cg, small, big = share * length, small_bore * length, big_bore * length
    # Gyration well inside that of the two masses, so that the denominator keeps away from zero.
    inertia = fill * mass * (cg + small) * (length - cg + big)
    found = crank.swing(
        crank.Pendulum(
            length + small + big,
            period(inertia, mass, cg + small, 9.81, amplitude),
            period(inertia, mass, length - cg + big, 9.81, amplitude),
            mass,
            amplitude,
            9.81,
            small,
            big,
        )
    ).values
    assert found["rod_cg_from_pin"] == pytest.approx(cg, rel=1e-9)
    assert found["rod_inertia"] == pytest.approx(inertia, rel=1e-8)
    assert found["rod_mass_at_pin"] + found["rod_mass_at_crank"] == pytest.approx(mass, rel=1e-14)


def reference(**uncertainty):
    return crank.Pendulum(
        0.16, period(0.0030, 0.62, 0.115, 9.81, 0.0), period(0.0030, 0.62, 0.045, 9.81, 0.0), 0.62,
        gravity=9.81, uncertainty=uncertainty,
    )  # fmt: skip


def test_linear_propagation_against_finite_differences():
    found = crank.swing(reference(period_small_end=1e-5, period_big_end=2e-5, pivot_distance=2e-5, rod_mass=1e-4))
    total = 0.0
    base = reference()
    for name, u in (("period_small_end", 1e-5), ("period_big_end", 2e-5), ("pivot_distance", 2e-5)):
        moved = []
        for sign in (1, -1):
            values = {f: getattr(base, f) for f in ("pivot_distance", "period_small_end", "period_big_end", "rod_mass")}
            values[name] += sign * 1e-3 * u
            moved.append(crank.swing(crank.Pendulum(**values, gravity=9.81)).values["rod_cg_from_pin"])
        total += ((moved[0] - moved[1]) / 2e-3) ** 2
    assert found.uncertainty.method == "linear"
    assert found.uncertainty.standard["rod_cg_from_pin"] == pytest.approx(math.sqrt(total), rel=1e-5)


def test_monte_carlo_takes_over_where_the_linear_law_fails():
    found = crank.swing(reference(period_small_end=2.8e-3, period_big_end=2.8e-3))
    assert found.uncertainty.method == "Monte Carlo"
    low, high = found.uncertainty.interval["rod_cg_from_pin"]
    assert low < 0.115 < high
    again = crank.swing(reference(period_small_end=2.8e-3, period_big_end=2.8e-3))
    assert again.uncertainty == found.uncertainty


def test_the_warning_tells_what_longer_periods_do_not_what_their_derivative_does():
    measured = crank.Pendulum(0.160, 0.7950600227, 0.7834631249, 0.62, gravity=9.81)
    (warning,) = crank.swing(measured).warnings
    assert "+2.29 mm" in warning  # as by hand; the derivative says 2.15


def test_a_result_that_only_linear_propagation_calls_certain_is_refused():
    """Linear propagation gives 15.5 mm for this rod of 160 mm; some draws lie beyond the singularity."""
    measured = {"pivot_distance": 1.4e-3, "period_small_end": 2.8e-3, "period_big_end": 2.8e-3, "rod_mass": 0.028}
    with pytest.raises(InvalidInput, match=r"uncertain by 89\.5 % of the rod's length") as refusal:
        crank.swing(reference(**measured))
    assert refusal.value.field == "period_big_end"


def test_a_meaningless_result_is_refused_with_its_uncertainty():
    with pytest.raises(InvalidInput, match=r"uncertain by 14\.6 % of the rod's length"):
        crank.swing(reference(period_small_end=5e-3, period_big_end=5e-3))


@pytest.mark.parametrize("nearness", [0.0, 1e-9, 1e-6])
def test_a_rod_that_is_two_masses_cannot_be_found_by_swinging(nearness):
    """A_C = A_D = L, Kater's reversible pendulum: every centre of mass fits. Weighing finds it."""
    inertia = 0.62 * 0.115 * 0.045 * (1 + nearness)
    periods = period(inertia, 0.62, 0.115, 9.81, 0.0), period(inertia, 0.62, 0.045, 9.81, 0.0)
    with pytest.raises(InvalidInput, match="almost every centre of mass"):
        crank.swing(crank.Pendulum(0.16, *periods, 0.62, gravity=9.81))
    found = crank.weigh(crank.Weighing(0.16, 0.62 * 0.045 / 0.16, 0.62 * 0.115 / 0.16, 0.62, periods[0], gravity=9.81))
    assert found.values["rod_cg_from_pin"] == pytest.approx(0.115, rel=1e-12)
    assert found.values["rod_inertia"] == pytest.approx(inertia, rel=1e-12)


@pytest.mark.parametrize("defect", [2e-4, -2e-3, 0.1])
def test_the_rounding_of_nearly_two_masses_is_estimated(defect):
    """The nearer to two masses, the more the same digits of the periods leave open."""
    length, cg, mass = 0.16, 0.115, 0.62
    inertia = mass * cg * (length - cg) * (1.0 - defect)
    small, big = (period(inertia, mass, arm, 9.81, 0.0) for arm in (cg, length - cg))
    found = crank.swing(crank.Pendulum(length, small, big, mass, gravity=9.81))
    with mp.workdps(40):
        a, b = (mp.mpf(9.81) * mp.mpf(t) ** 2 / (4 * mp.pi**2) for t in (small, big))
        x = mp.mpf(length) * (b - mp.mpf(length)) / (a + b - 2 * mp.mpf(length))
        exact = {"rod_cg_from_pin": x, "rod_inertia": mp.mpf(mass) * x * (a - x)}
        errors = [float(abs(found.values[name] / value - 1)) for name, value in exact.items()]
    assert max(errors) < found.rounding < 2e-14 / abs(defect)
    assert abs(defect) > 1e-3 or max(errors) > 1e-14


def test_periods_that_no_rod_has_are_refused():
    with pytest.raises(InvalidInput, match="no rod has these periods"):
        crank.swing(crank.Pendulum(0.16, 0.2, 0.9, 0.62))


def test_weighing_propagates_and_tells_readings_that_do_not_close():
    found = crank.weigh(crank.Weighing(0.16, 0.174375, 0.445625, uncertainty={"small_end_reading": 1e-3}))
    assert found.uncertainty.method == "linear"
    assert found.uncertainty.standard["rod_mass_at_pin"] == pytest.approx(1e-3, rel=1e-9)
    assert found.uncertainty.standard["rod_cg_from_pin"] == pytest.approx(0.16 * 0.445625e-3 / 0.62**2, rel=1e-9)
    assert "rod_inertia" not in found.values
    with pytest.raises(InvalidInput, match="differs by"):
        crank.weigh(crank.Weighing(0.16, 0.2, 0.445625, 0.62))


def test_readings_that_add_up_to_the_rod_need_no_warning():
    assert crank.weigh(crank.Weighing(0.144, 0.15, 0.42, 0.57)).warnings == ()
    assert "by -0.175 %" in crank.weigh(crank.Weighing(0.144, 0.15, 0.419, 0.57)).warnings[0]


def test_estimates_scale_with_the_piston_and_tell_an_unusual_figure():
    found = crank.estimate(crank.Estimate(0.08, 100.0, 700.0))
    assert found.values["piston_mass"] == pytest.approx(100 * math.pi * 0.08**2 / 4)
    assert len(found.warnings) == 1
    assert "rod" in found.warnings[0]


def test_the_complex_step_is_the_derivative():
    def square(x):
        return {"y": x["a"] ** 2 * x["b"]}

    derivatives = sensitivities(square, {"a": 3.0, "b": 2.0})["y"]
    assert derivatives == {"a": 12.0, "b": 9.0}
    assert combined(derivatives, {"a": 0.1, "b": 0.2}) == pytest.approx(math.hypot(1.2, 1.8))
