"""Running with a motor and the blow, against an independent integration in time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solvers import linkage
from solvers.linkage.mechanism.angular_velocity_ratio import transfer_and_slope
from solvers.linkage.mechanism.kinematics import FourBar, of_family
from solvers.linkage.steady_state.periodic_solution import (
    SteadyState,
    rocker_inertia,
    speed_ratio_over_blow,
    steady_state_running,
)
from tests.solvers.linkage.machines import CLEANER

DRIVE = linkage.Drive(stall_torque=5.0, free_speed=2 * math.pi * 27, crank_inertia=2e-3)
BAR = of_family(linkage.LARGEST_BASE, 0.3, 3.2)
TOOL = 0.05


def running(
    bar: FourBar, scene: linkage.Scene, drive: linkage.Drive, restitution: float, wanted: float
) -> SteadyState | None:
    """The steady state of a tool at its own radius, whose blow has this restitution."""
    blow = linkage.Restitution(restitution, restitution)
    scene = replace(scene, restitution=blow, drive=drive, tool_radius=TOOL)
    return steady_state_running(linkage.Mechanism(bar, 0.01), scene, wanted)


def in_time(speed: float) -> tuple[float, float]:
    """(speed at the end of a turn, time it took), from J dw/dt + J' w^2/2 = M."""
    inertia = rocker_inertia(BAR, CLEANER)

    def motion(_: float, state: np.ndarray) -> list[float]:
        phi, w = state
        at = phi if phi <= math.pi else min(phi - 2 * math.pi, -1e-300)
        u, slope = (float(row[0]) for row in transfer_and_slope(BAR.coefficients, np.array([at])))
        total = DRIVE.crank_inertia + inertia * u * u
        torque = DRIVE.stall_torque * (1 - w / DRIVE.free_speed)
        return [w, (torque - inertia * u * slope * w * w) / total]

    def turned(_: float, state: np.ndarray) -> float:
        return state[0] - 2 * math.pi

    turned.terminal = True
    found = solve_ivp(motion, (0, 1.0), [0.0, speed], events=turned, rtol=1e-10, atol=1e-12)
    return float(found.y_events[0][0][1]), float(found.t_events[0][0])


@pytest.mark.parametrize("restitution", [0.2, 0.3, 0.4])
def test_steady_running_repeats_itself_in_time_too(restitution):
    found = running(BAR, CLEANER, DRIVE, restitution, 1e-9)
    end = found.impact_speed / (BAR.u31_end * TOOL)
    start = end * (1 + found.jump)
    reached, time = in_time(start)
    assert reached == pytest.approx(end, rel=1e-7)
    assert 1 / time == pytest.approx(found.blow_frequency, rel=1e-7)


def test_a_matched_blow_does_not_jolt_the_crank_and_a_mismatched_one_conserves_momentum():
    inertia = rocker_inertia(BAR, CLEANER)
    assert speed_ratio_over_blow(BAR, DRIVE.crank_inertia, inertia, 0.3) == pytest.approx(1.0, abs=1e-15)
    keep = speed_ratio_over_blow(BAR, DRIVE.crank_inertia, inertia, 0.4)
    assert keep > 1
    # Generalised momentum of crank and rocker over the contact of coupler and crank, the rocker already reflected.
    before = DRIVE.crank_inertia + inertia * BAR.u31_start * 0.4 * BAR.u31_end
    assert before == pytest.approx(keep * (DRIVE.crank_inertia + inertia * BAR.u31_start**2), rel=1e-14)


def test_the_estimated_error_is_not_exceeded():
    sharp = running(BAR, CLEANER, DRIVE, 0.35, 1e-11)
    for wanted in (1e-3, 1e-5, 1e-7):
        found = running(BAR, CLEANER, DRIVE, 0.35, wanted)
        assert found.error <= wanted
        assert abs(found.blow_frequency / sharp.blow_frequency - 1) <= max(found.error, 1e-12)
        assert abs(found.impact_speed / sharp.impact_speed - 1) <= max(found.error, 1e-12)
        assert abs(found.irregularity / sharp.irregularity - 1) <= max(wanted, 1e-9)


BY_CHANCE = [
    (
        (0.8294239874766527, 10.732996621142208, 5.395, 0.2226748),
        (2.7548036, 6.60047233, 0.0162053173),
        (6.56113907920983779, 2.06265553492026741, 0.016404646170788637, 0.676156499666217168),
    ),
    (
        (0.868256770868535, 14.183241537663974, 3.0841525161, 48.97011),
        (240.9008181, 3.88026064722, 8.07562634499),
        (3.83236953069389953, 1.20581684802377173, 0.0207876169374837117, 71.5616265200362391),
    ),
    (
        (0.0022631391263742574, 1.0250863803089352, 1.499327838, 45.38044),
        (719.334157864, 1.72624747949, 195.535111079),
        (1.68853087929609398, 0.533509914226379018, 0.721243851496149631, 100.329042680841442),
    ),
]
"""Largest bases that the campaign found: R, lambda0, blows a second, energy; stall torque, free turns a second, crank
inertia; frequency, speed, irregularity and power at 40 digits, by Gauss points of order 24 on u31 from intersecting
circles. Errors change their sign as the steps are halved, and pass by zero."""


@pytest.mark.parametrize(("blow", "motor", "exact"), BY_CHANCE)
@pytest.mark.parametrize("wanted", [1e-4, 1e-9, 1e-13])
def test_steps_that_were_right_by_chance_do_not_make_the_next_look_better(blow, motor, exact, wanted):
    restitution, ratio, frequency, energy = blow
    stall, free, inertia = motor
    bar = of_family(linkage.LARGEST_BASE, restitution, ratio)
    scene = linkage.Scene(linkage.Restitution(restitution, restitution), frequency, 5.0, energy)
    drive = linkage.Drive(stall, 2 * math.pi * free, inertia)
    found = running(bar, scene, drive, restitution, wanted)
    told = (found.blow_frequency, found.impact_speed, found.irregularity, found.power)
    assert max(abs(a / b - 1) for a, b in zip(told, exact, strict=True)) <= found.error <= max(wanted, 2e-14)


@pytest.mark.parametrize(("stall", "inertia"), [(3000.0, 1e-5), (3000.0, 1e-4)])
def test_a_motor_whose_line_is_steep_is_as_irregular_as_by_another_integrator(stall, inertia):
    # The motor makes good within a small angle what the blow takes, and its speed has its extremes there.
    bar = of_family(linkage.LARGEST_COUPLER, 0.01, 1.5)
    drive = linkage.Drive(stall, 2 * math.pi * 27, inertia)
    found = running(bar, CLEANER, drive, 0.01, 1e-7)
    rocker = rocker_inertia(bar, CLEANER)

    def speeds(phi, energy):
        u = bar.transfer(np.where(phi > math.pi, np.minimum(phi - 2 * math.pi, -1e-300), phi))
        return np.sqrt(2 * energy / (inertia + rocker * u * u))

    first = found.impact_speed / (bar.u31_end * TOOL) * (1 + found.jump)
    turn = solve_ivp(
        lambda phi, energy: stall - drive.slope * speeds(phi, energy),
        (0.0, 2 * math.pi),
        [0.5 * (inertia + rocker * bar.u31_start**2) * first**2],
        method="Radau",
        rtol=1e-9,
        atol=1e-15,
    )
    along = speeds(turn.t, turn.y[0])
    assert along[-1] == pytest.approx(found.impact_speed / (bar.u31_end * TOOL), rel=1e-5)
    assert found.irregularity == pytest.approx(np.ptp(along) / (2 * math.pi * found.blow_frequency), rel=1e-4)


def test_trends():
    def run(**drive: float) -> float:
        made = replace(DRIVE, **drive)
        return running(BAR, CLEANER, made, 0.3, 1e-8).irregularity

    assert run(crank_inertia=2e-2) < run(crank_inertia=4e-3) < run(crank_inertia=2e-3)


@pytest.mark.parametrize(
    ("stall", "free", "inertia"),
    [(1e-3, 0.02, 1e-6), (5000.0, 0.02, 1e-6), (1e-3, 1000.0, 10.0), (5000.0, 900.0, 1e-6)],
)
def test_extreme_drives_are_answered_or_marked(stall, free, inertia):
    drive = linkage.Drive(stall, 2 * math.pi * free, inertia)
    scene = replace(CLEANER, drive=drive)
    bar = linkage.of_ratio(scene, linkage.LARGEST_BASE, 3.2)
    found = linkage.check(scene, bar, effects=linkage.EffectSelection(include=frozenset({"impact_dynamics"}))).value
    if found.running is None:
        assert any("no steady running" in text for text in found.warnings)
    else:
        assert 0 < found.running.blow_frequency <= free * 1.01
        assert math.isfinite(found.running.irregularity)


def test_a_rocker_that_comes_within_a_thousandth_of_a_turn_is_not_stepped_over():
    # u31 rises to 1/e within e of the blow; steps of a hundredth of a turn would not see it.
    scene = linkage.Scene(linkage.Restitution(1e-3, 1e-3), 10.0, 5.0, 10.0)
    bar = of_family(linkage.LARGEST_COUPLER, 1e-3, 3.0)
    drive = linkage.Drive(8.0, 2 * math.pi * 11, crank_inertia=0.02)
    found = running(bar, scene, drive, 1e-3, 1e-10)
    crude, sharp = (running(bar, scene, drive, 1e-3, wanted) for wanted in (1e-2, 1e-12))
    for name in ("blow_frequency", "impact_speed", "irregularity", "power"):
        assert abs(getattr(crude, name) / getattr(sharp, name) - 1) <= crude.error
    # What the motor gives in a turn is what the blow takes: E- - E+, both from the blow's speeds.
    inertia = rocker_inertia(bar, scene)
    before = found.impact_speed / (bar.u31_end * TOOL)
    after = before * speed_ratio_over_blow(bar, drive.crank_inertia, inertia, 1e-3)
    taken = 0.5 * (drive.crank_inertia + inertia * bar.u31_end**2) * before**2
    taken -= 0.5 * (drive.crank_inertia + inertia * bar.u31_start**2) * after**2
    assert found.power == pytest.approx(taken * found.blow_frequency, rel=1e-9)


def test_a_heavy_flywheel_costs_no_digits():
    light, heavy = (
        running(BAR, CLEANER, replace(DRIVE, crank_inertia=inertia), 0.35, 1e-10) for inertia in (2e-3, 2e5)
    )
    assert heavy.irregularity < 1e-7 * light.irregularity
    assert heavy.error < 1e-10
    # All but constant speed: the motor's line and the blow's toll alone set it.
    inertia, speed = rocker_inertia(BAR, CLEANER), 2 * math.pi * heavy.blow_frequency
    toll = 0.5 * inertia * (BAR.u31_end**2 + BAR.u31_start**2 - 2 * 0.35 * BAR.u31_start * BAR.u31_end) * speed**2
    assert heavy.power == pytest.approx(toll * heavy.blow_frequency, rel=1e-6)
    torque = DRIVE.stall_torque - DRIVE.slope * speed
    assert heavy.power == pytest.approx(torque * speed, rel=1e-6)
