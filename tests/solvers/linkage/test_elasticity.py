"""The first pin-force peak of an elastic coupler, against Bessel functions and the elastic mechanism in time."""

from __future__ import annotations

import math
from itertools import pairwise

import mpmath as mp
import pytest
from scipy.integrate import solve_ivp

from solvers import linkage
from solvers.linkage.loads.coupler_elasticity import first_peak, worst_elastic_peak
from solvers.linkage.mechanism.kinematics import of_family
from solvers.references.linkage import SIGNS


def test_a_small_mismatch_is_a_bessel_function():
    def force(z):
        return z ** mp.mpf("0.75") * mp.besselj(mp.mpf("0.25"), z)

    at = mp.findroot(lambda z: mp.diff(force, z), 1.4)
    exact = float(2 ** mp.mpf("1.25") * mp.gamma(mp.mpf("1.25")) * force(at))
    assert exact == pytest.approx(1.82, abs=5e-3)
    assert first_peak(0.0) == pytest.approx(exact, rel=5e-8)
    # Either side of it by equal parts.
    assert first_peak(1e-5) + first_peak(-1e-5) == pytest.approx(2 * exact, rel=1e-7)


@pytest.mark.parametrize("mismatch", [-0.48, -0.3, -0.05, 0.02, 0.4, 0.94])
def test_the_scaled_motion_by_another_integrator(mismatch):
    def motion(phi, state):
        return [state[1], -state[0] * (phi + state[0]) * (phi + 2 * state[0])]

    def top(phi, state):
        return state[1] * (phi + state[0]) + state[0] * (1 + state[1])

    top.terminal, top.direction = True, -math.copysign(1.0, mismatch)
    start = [mismatch * 1e-12, mismatch]
    run = solve_ivp(motion, (1e-12, 40), start, "DOP853", events=top, rtol=1e-12, atol=1e-15)
    phi, y = run.t_events[0][0], run.y_events[0][0][0]
    assert first_peak(mismatch) == pytest.approx(y * (phi + y) / mismatch, rel=1e-7)


def blow(low: float, high: float, energy: float, stiffness: float) -> linkage.Scene:
    """A blow on a body of this restitution, with an elastic coupler."""
    return linkage.Scene(linkage.Restitution(low, high), 20.0, 5.0, energy, coupler_stiffness=stiffness)


def in_time(kind: str, made: float, parameter: float, restitution: float, stiffness: float) -> tuple[float, float]:
    """First peak of the coupler's force and the energy, the joints placed in the plane: crank 1, speed 1, J3 = 1."""
    bar = of_family(linkage.KINDS[kind], made, parameter)
    base, coupler, rocker = (float(x) for x in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    crank_sign, rocker_sign = SIGNS[kind]

    def placed(phi: float, angle: float) -> tuple[float, float]:
        """Stretch, and its change with the rocker's angle."""
        x, y = rocker_sign * rocker * math.cos(angle), rocker_sign * rocker * math.sin(angle)
        dx, dy = base + x - crank_sign * math.cos(phi), y - crank_sign * math.sin(phi)
        length = math.hypot(dx, dy)
        return length - coupler, (x * dy - y * dx) / length

    def motion(phi, state):
        stretch, lever = placed(phi, state[0])
        return [state[1], -stiffness * stretch * lever]

    back = math.copysign(restitution * bar.u31_end, float(bar.transfer(1e-9)))
    quick = 1 / math.sqrt(math.sqrt(stiffness))
    run = solve_ivp(motion, (0, 12 * quick), [0.0, back], rtol=1e-9, atol=1e-14, max_step=0.02 * quick)
    forces = [stiffness * abs(placed(phi, angle)[0]) for phi, angle in zip(run.t, run.y[0], strict=True)]
    first = next(f for f, g in pairwise(forces) if g < f)
    return first, 0.5 * bar.u31_end**2


@pytest.mark.parametrize(
    ("kind", "parameter"), [("largest_coupler", 2.5), ("largest_rocker", 5.0), ("largest_base", 3.2)]
)
@pytest.mark.parametrize("restitution", [0.15, 0.29, 0.5])
def test_the_elastic_mechanism_in_time(kind, parameter, restitution):
    stiffness = 1e11
    peak, energy = in_time(kind, 0.3, parameter, restitution, stiffness)
    bar = of_family(linkage.KINDS[kind], 0.3, parameter)
    assert worst_elastic_peak(bar, blow(restitution, restitution, energy, stiffness)) == pytest.approx(peak, rel=4e-3)


def test_the_worse_end_of_a_range_counts():
    bar = of_family(linkage.LARGEST_BASE, 0.2, 3.0)

    def peak(low, high):
        return worst_elastic_peak(bar, blow(low, high, 10.0, 1e7))

    assert peak(0.1, 0.3) == peak(0.1, 0.1) > peak(0.3, 0.3)
    assert peak(0.2, 0.2) == pytest.approx(0.0, abs=1e-9)
