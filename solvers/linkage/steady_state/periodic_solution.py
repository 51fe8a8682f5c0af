"""Periodic motion of the machine: motor on the crank, flywheel, rocker inertia, and the blow.

With the crank angle as the independent variable and the energy E = J(phi) omega^2/2, J = J1 + J3 u31(phi)^2, as the
state, the motion between blows is dE/dphi = M(omega), M = M0 - k omega: no event detection, no derivative of u31, and
no singularity at the change point. At the blow the rocker rebounds with R times its speed and imposes this on coupler
and crank: J1 omega- + J3 u0 (R u1 omega-) = (J1 + J3 u0^2) omega+ with u0 = |u31(0)|, u1 = |u31(2 pi)|. For R = R_k the
crank's speed does not jump.
SI units. Source of the blow: generalised momentum over an impulsive contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from operator import attrgetter

from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.scene import Scene
from solvers.linkage.steady_state.collocation import Machine, inertias, integrate_revolution, mesh, speed_spread

_MAX_STEPS, _MIN_PARTS, _MAX_PARTS = 1 << 14, 2, 1 << 9
_SAFETY = 1.5
"""Safety factor on the difference of two solutions as an estimate of the finer one's error."""
ROUNDING = 1e-14
"""Relative error of closed-form results."""
_COMPARED = attrgetter("blow_frequency", "impact_speed", "irregularity", "power")


@dataclass(frozen=True)
class SteadyState:
    """Steady state: blows per second, impact speed [m/s], irregularity (max - min)/mean of the crank's speed,
    relative jump of the crank's speed at the blow, mean motor power [W], steps per revolution and estimated relative
    error."""

    blow_frequency: float
    impact_speed: float
    irregularity: float
    jump: float
    power: float
    steps: int
    error: float


def rocker_inertia(bar: FourBar, scene: Scene) -> float:
    """J3 [kg m^2]: the rocker has the impact energy at the nominal crank speed."""
    return 2.0 * scene.impact_energy / (scene.crank_speed * bar.u31_end) ** 2


def speed_ratio_over_blow(bar: FourBar, crank_inertia: float, inertia: float, restitution: float) -> float:
    """omega+/omega- of the crank over a blow of physical restitution R."""
    u31_start = bar.u31_start
    return (crank_inertia + inertia * u31_start * restitution * bar.u31_end) / (crank_inertia + inertia * u31_start**2)


class _Unresolved(ArithmeticError):
    """The crank stops, or a step has no solution."""


def steady_state_running(mechanism: Mechanism, scene: Scene, wanted: float) -> SteadyState | None:
    """Steady state with the scene's drive and the middle of its restitution, to the relative accuracy ``wanted``.

    Steps are halved until two successive solutions agree. The error estimate is their difference, with a safety factor:
    at order 8 the finer one's error is about 1/256 of it. None if no mesh of up to 16384 steps per revolution yields a
    steady state.
    """
    parts, before = _MIN_PARTS, None
    while parts <= _MAX_PARTS:
        try:
            now = _steady(mechanism, scene, parts)
        except _Unresolved:
            now = None
        if now is not None and before is not None:
            pairs = zip(_COMPARED(before), _COMPARED(now), strict=True)
            error = _SAFETY * max(abs(a / b - 1.0) for a, b in pairs) + ROUNDING
            if error <= max(wanted, 2.0 * ROUNDING) or 2 * now.steps > _MAX_STEPS:
                return replace(now, error=error)
        before, parts = now, 2 * parts
    return None


def _energy_deficit(bar: FourBar, crank: float, rocker: float, restitution: float) -> float:
    """q = E-/E+ - 1, the fraction of the energy after a blow that the motor must restore before the next.

    E-/E+ = J(2 pi) J(0)/(J1 + J3 R u0 u1)^2; the difference of numerator and denominator is computed term by term.
    """
    u31_start, u31_end = bar.u31_start, bar.u31_end
    difference = (u31_end - u31_start) ** 2 + 2.0 * u31_start * u31_end * (1.0 - restitution)
    numerator = crank * difference + rocker * (u31_start * u31_end) ** 2 * (1.0 - restitution) * (1.0 + restitution)
    return rocker * numerator / (crank + rocker * restitution * u31_start * u31_end) ** 2


def _steady(mechanism: Mechanism, scene: Scene, parts: int) -> SteadyState:
    """The steady state on one mesh, its error not yet known. Raises _Unresolved."""
    from scipy.optimize import brentq

    bar, drive, restitution = mechanism.bar, scene.drive, scene.restitution.middle
    crank, rocker = drive.crank_inertia, rocker_inertia(bar, scene)
    machine = Machine(bar.coefficients, crank, rocker, drive.stall_torque, drive.slope)
    steps = mesh(bar.coefficients, parts)
    inertia = inertias(machine, steps)
    deficit = _energy_deficit(bar, crank, rocker, restitution)

    def excess(energy: float) -> float:
        """Motor work per revolution minus the energy lost in the blow; decreases with the energy after the blow."""
        work, _ = integrate_revolution(inertia, steps, energy, machine)
        if not math.isfinite(work[-1]):
            raise _Unresolved
        return float(work[-1]) - deficit * energy

    # If the speed never falls below the no-load speed, the motor only brakes.
    high = 0.5 * max(float(inertia.max()), crank + rocker * bar.u31_end**2) * drive.free_speed**2 * (1.0 + 1e-12)
    low = high
    for _ in range(60):
        low *= 0.25
        if excess(low) > 0.0:
            break
    else:
        raise _Unresolved
    energy = brentq(excess, low, 4.0 * low, xtol=1e-18 * high, rtol=1e-15)
    work, time = integrate_revolution(inertia, steps, energy, machine)
    speed_after = math.sqrt(2.0 * energy / (crank + rocker * bar.u31_start**2))
    ratio = speed_ratio_over_blow(bar, crank, rocker, restitution)
    spread = speed_spread(machine, steps, work, energy, bar.u31_start)
    if not math.isfinite(spread):
        raise _Unresolved
    impact_speed = speed_after / ratio * bar.u31_end * scene.striking_radius(mechanism)
    irregularity, power = spread * speed_after * time / (2.0 * math.pi), deficit * energy / time
    return SteadyState(1.0 / time, impact_speed, irregularity, ratio - 1.0, power, len(steps), error=math.inf)
