"""The machine in motion: a motor on the crank, a flywheel, the rocker's inertia, and the blow.

With the crank angle as the independent variable and the energy E = J(phi) omega^2/2, J = J1 + J3 u31(phi)^2, as the
state, the motion between blows is dE/dphi = M(omega), M = M0 - k omega: no event search, no derivative of u31, and
nothing singular at the change point. At the blow the rocker leaves with R times its speed, and coupler and crank take
it along: J1 omega- + J3 u0 (R u1 omega-) = (J1 + J3 u0^2) omega+ with u0 = |u31(0)|, u1 = |u31(2 pi)|. Where R = R_k
the two agree and the crank feels no jump.
SI units. Source of the blow: generalised momentum over an impulsive contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.scene import Drive, Scene
from solvers.linkage.steady_state.collocation import MATRIX, NODES, WEIGHTS, inertias, mesh, spread, turn

_MOST_STEPS, _MOST_PARTS = 1 << 14, 1 << 8
_CAUTION, _BEST_RATE = 4.0, 1.0 / 8.0
_ORDER_RATE = 1.0 / 256.0
"""By what halving short steps divides an error of order 8."""
_ROUNDING = 1e-14


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


class _Unresolved(ArithmeticError):
    """The crank stops, or a step has no solution."""


def steady_running(
    bar: FourBar, scene: Scene, drive: Drive, tool: float, restitution: float, wanted: float
) -> Running | None:
    """The steady state with a motor, to a wanted relative accuracy. ``tool`` is the striking radius [m].

    Steps are halved until three rounds agree; the error is what the last halving changed, times what is believed to be
    left of it. None where no steps up to 16384 a turn find a steady state.
    """
    parts, before, change = 1, None, None
    while True:
        try:
            now, steps = _steady(bar, scene, drive, tool, restitution, parts)
        except _Unresolved:
            now = None
        if now is not None and before is not None:
            last, change = change, max(abs(a / b - 1.0) for a, b in zip(before, now, strict=True))
            if last is not None:
                error = change * _left(last, change) + _ROUNDING
                if error <= max(wanted, 2.0 * _ROUNDING) or 2 * steps > _MOST_STEPS:
                    return Running(*now[:3], after_blow_of(bar, scene, drive, restitution) - 1.0, now[3], steps, error)
        if parts > _MOST_PARTS:
            return None
        before, parts = now, 2 * parts
        if now is None:
            change = None


def _left(last: float, change: float) -> float:
    """The share of the last change that the results may still be off.

    Four times the rate at which changes fall is believed, and no better than 1/8. Changes that fall faster than the
    order of the rule lets them tell that the steps before the last were right by chance, on the way from an error of
    one sign to one of the other: then the last may be off by all of its change.
    """
    rate = change / max(last, change, 1e-300)
    return 1.0 if rate < _ORDER_RATE else min(max(_CAUTION * rate, _BEST_RATE), 1.0)


def after_blow_of(bar: FourBar, scene: Scene, drive: Drive, restitution: float) -> float:
    """omega+/omega- of a scene's machine."""
    return after_blow(bar, drive.crank_inertia, rocker_inertia(bar, scene), restitution)


def _lost(bar: FourBar, crank: float, rocker: float, restitution: float) -> float:
    """q = E-/E+ - 1, the share of the energy after a blow that the motor has to make good before the next.

    E-/E+ = J(2 pi) J(0)/(J1 + J3 R u0 u1)^2; the difference of numerator and denominator is formed term by term.
    """
    start, end = bar.start, bar.end
    apart = (end - start) ** 2 + 2.0 * start * end * (1.0 - restitution)
    whole = crank * apart + rocker * (start * end) ** 2 * (1.0 - restitution) * (1.0 + restitution)
    return rocker * whole / (crank + rocker * restitution * start * end) ** 2


def _steady(
    bar: FourBar, scene: Scene, drive: Drive, tool: float, restitution: float, parts: int
) -> tuple[tuple[float, float, float, float], int]:
    """Frequency, impact speed, irregularity and power, with the number of steps."""
    from scipy.optimize import brentq

    crank, rocker = drive.crank_inertia, rocker_inertia(bar, scene)
    stall, slope = drive.motor.stall_torque, drive.motor.slope
    steps = mesh(bar.coefficients, parts)
    total = inertias(bar.coefficients, crank, rocker, steps, NODES)
    lost = _lost(bar, crank, rocker, restitution)

    def excess(energy: float) -> float:
        """What the motor gives in a turn beyond what the blow takes; falls with the energy after the blow."""
        work, _ = turn(total, steps, energy, stall, slope, WEIGHTS, MATRIX)
        if not math.isfinite(work[-1]):
            raise _Unresolved
        return float(work[-1]) - lost * energy

    # Nowhere below its free speed, the motor only brakes.
    high = 0.5 * max(float(total.max()), crank + rocker * bar.end**2) * drive.motor.free_speed**2 * (1.0 + 1e-12)
    low = high
    for _ in range(60):
        low *= 0.25
        if excess(low) > 0.0:
            break
    else:
        raise _Unresolved
    energy = brentq(excess, low, 4.0 * low, xtol=1e-18 * high, rtol=1e-15)
    work, time = turn(total, steps, energy, stall, slope, WEIGHTS, MATRIX)
    first = math.sqrt(2.0 * energy / (crank + rocker * bar.start**2))
    before = first / after_blow(bar, crank, rocker, restitution)
    apart = spread(
        bar.coefficients, crank, rocker, steps, work, energy, bar.start, stall, slope, NODES, WEIGHTS, MATRIX
    )
    if not math.isfinite(apart):
        raise _Unresolved
    irregularity = apart * first * time / (2.0 * math.pi)
    return (1.0 / time, before * bar.end * tool, irregularity, lost * energy / time), len(steps)
