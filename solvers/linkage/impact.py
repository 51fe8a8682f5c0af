"""The machine in motion: a motor on the crank, a flywheel, the rocker's inertia, and the blow.

With the crank angle as the independent variable and the energy E = J(phi) omega^2/2, J = J1 + J3 u31(phi)^2, as the
state, the motion between blows is dE/dphi = M(omega), M = M0 - k omega: no event search, no derivative of u31, and
nothing singular at the change point. At the blow the rocker leaves with R times its speed, and coupler and crank take
it along: J1 omega- + J3 u0 (R u1 omega-) = (J1 + J3 u0^2) omega+ with u0 = |u31(0)|, u1 = |u31(2 pi)|. Where R = R_k
the two agree and the crank feels no jump.

Of an elastic coupler of stiffness k_c the first peak of the pin force after a blow is about
1.82 sqrt(2 k_c E) |R - R_k|: the number is of the simulated elastic mechanism, not of a closed form.
SI units. Source of the blow: generalised momentum over an impulsive contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.linkage.four_bar import FourBar, transfer_and_rate
from solvers.linkage.scene import Drive, Scene

ELASTIC_PEAK = 1.82
_MOST_STEPS = 1 << 14
_LEAST_IRREGULARITY = 1e-6
"""An irregularity below this is not told to a relative accuracy of its own."""


@dataclass(frozen=True)
class Running:
    """Steady running: blows per second, speed of the blow [m/s], irregularity (greatest - least)/mean of the crank's
    speed, jump of the crank's speed at the blow relative to it, mean motor power [W], steps a turn and estimated
    relative error."""

    blow_frequency: float
    impact_speed: float
    irregularity: float
    jump: float
    power: float
    steps: int
    error: float


def rocker_inertia(bar: FourBar, scene: Scene) -> float:
    """J3 [kg m^2]: the rocker brings the impact energy at the asked-for crank speed."""
    return 2.0 * scene.impact_energy / (scene.crank_speed * bar.end) ** 2


def after_blow(bar: FourBar, crank_inertia: float, inertia: float, restitution: float) -> float:
    """omega+/omega- of the crank over a blow of physical restitution R."""
    start = bar.start
    return (crank_inertia + inertia * start * restitution * bar.end) / (crank_inertia + inertia * start**2)


def elastic_peak(stiffness: float, energy: float, mismatch: float) -> float:
    """First pin-force peak [N] after a blow, from the coupler's elasticity alone."""
    return ELASTIC_PEAK * math.sqrt(2.0 * stiffness * energy) * abs(mismatch)


class _Unresolved(ArithmeticError):
    """The crank stops, or the steps are too long for so stiff a motor."""


def steady_running(
    bar: FourBar, scene: Scene, drive: Drive, tool: float, restitution: float, wanted: float
) -> Running | None:
    """The steady state with a motor, to a wanted relative accuracy. ``tool`` is the striking radius [m].

    None where no steps up to 16384 a turn find one: the motor stalls, or its line is far too steep for the inertias.
    """
    steps, coarse = 64, None
    while True:
        try:
            fine = _steady(bar, scene, drive, tool, restitution, steps)
        except _Unresolved:
            if steps >= _MOST_STEPS:
                return None
            coarse, steps = None, 2 * steps
            continue
        if coarse is not None:
            error = max(abs(a / b - 1.0) for a, b in zip(coarse[:2], fine[:2], strict=True)) / 15.0
            # Extremes of the cubics between steps converge one order slower.
            error += abs(coarse[2] - fine[2]) / (7.0 * max(fine[2], _LEAST_IRREGULARITY))
            if error <= wanted or steps >= _MOST_STEPS:
                return Running(*fine, steps=steps, error=error)
        coarse, steps = fine, 2 * steps


def _greatest(values: np.ndarray, slopes: np.ndarray, step: float) -> float:
    """Greatest value of a curve known by values and slopes at even steps: of the cubics beside its greatest sample."""
    top = int(np.argmax(values))
    best = float(values[top])
    for k in (top - 1, top):
        if 0 <= k < values.size - 1:
            rise, left, right = values[k + 1] - values[k], step * slopes[k], step * slopes[k + 1]
            # v = v_k + left t + (3 rise - 2 left - right) t^2 + (left + right - 2 rise) t^3
            square, cube = 3.0 * rise - 2.0 * left - right, left + right - 2.0 * rise
            for t in np.roots([3.0 * cube, 2.0 * square, left]):
                if abs(t.imag) < 1e-12 and 0.0 < t.real < 1.0:
                    t = t.real
                    best = max(best, float(values[k] + t * (left + t * (square + t * cube))))
    return best


def _steady(
    bar: FourBar, scene: Scene, drive: Drive, tool: float, restitution: float, steps: int
) -> tuple[float, float, float, float, float]:
    inertia = rocker_inertia(bar, scene)
    keep = after_blow(bar, drive.crank_inertia, inertia, restitution)
    # Steps that end at mid-steps too: the classical Runge-Kutta rule needs both.
    phi = np.linspace(0.0, 2.0 * math.pi, 2 * steps + 1)
    half = 0.5 * phi
    transfer, rate = np.empty((1, phi.size)), np.empty((1, phi.size))
    transfer_and_rate(bar.coefficients[None], np.sin(half), np.cos(half), transfer, rate)
    total = drive.crank_inertia + inertia * transfer[0] ** 2
    step = 2.0 * math.pi / steps
    stall, slope = drive.motor.stall_torque, drive.motor.slope

    def turn(start: float) -> np.ndarray:
        """Crank speeds at whole steps over one turn from a speed just after the blow."""
        energy = 0.5 * total[0] * start * start
        speeds = np.empty(steps + 1)
        speeds[0] = start
        for n in range(steps):
            a, m, b = total[2 * n], total[2 * n + 1], total[2 * n + 2]
            k1 = stall - slope * math.sqrt(max(2.0 * energy / a, 0.0))
            k2 = stall - slope * math.sqrt(max(2.0 * (energy + 0.5 * step * k1) / m, 0.0))
            k3 = stall - slope * math.sqrt(max(2.0 * (energy + 0.5 * step * k2) / m, 0.0))
            k4 = stall - slope * math.sqrt(max(2.0 * (energy + step * k3) / b, 0.0))
            energy += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            if not 0.0 < energy < math.inf:
                raise _Unresolved
            speeds[n + 1] = math.sqrt(2.0 * energy / b)
        return speeds

    from scipy.optimize import brentq

    def excess(start: float) -> float:
        return keep * float(turn(start)[-1]) - start

    high = 2.0 * drive.motor.free_speed
    for _ in range(60):
        if excess(high) < 0.0:
            break
        high *= 2.0
    else:
        raise _Unresolved
    start = brentq(excess, 0.0, high, xtol=1e-13 * high, rtol=1e-13)
    if start <= 0:
        raise _Unresolved
    speeds = turn(start)
    # Simpson's rule on the whole steps: time of a turn, and work of the motor.
    weights = np.full(steps + 1, 2.0)
    weights[1::2] = 4.0
    weights[0] = weights[-1] = 1.0
    weights *= step / 3.0
    time = float(weights @ (1.0 / speeds))
    work = float(weights @ (stall - slope * speeds))
    mean = 2.0 * math.pi / time
    whole = slice(None, None, 2)
    torque = stall - slope * speeds
    bend = inertia * transfer[0, whole] * np.sin(half[whole]) * rate[0, whole]
    slopes = (torque / speeds - bend * speeds) / total[whole]
    irregularity = (_greatest(speeds, slopes, step) + _greatest(-speeds, -slopes, step)) / mean
    return 1.0 / time, float(speeds[-1]) * bar.end * tool, irregularity, keep - 1.0, work / time
