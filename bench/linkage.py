"""The impact linkage: u31 over the cycle and complete designs, compared with alternatives.

u31 of a largest-coupler linkage (R = 0.3, lambda2 = 2.5) at 360 crank angles starting half a degree after the blow: the
closed form, pylinkage's compiled steps with and without velocities, and scipy's fsolve on the loop equation from angle
to angle. The design is the example breaker's smallest box over all three types: branch and bound with its proof, and
pylinkage's particle swarm over free ratio and orientation of each type, simulated at 72 angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import fsolve

from bench.kernels import median_time
from solvers import linkage
from solvers.linkage.mechanism.angular_velocity_ratio import transfer_and_slope
from solvers.linkage.mechanism.kinematics import FourBar, of_family
from solvers.linkage.optimum.family import Family
from solvers.linkage.swept_area.bounding_box import minimum_box
from solvers.linkage.swept_area.outline import sweep

ANGLES = 360
RESTITUTION, RATIO = 0.3, 2.5
SCENE = linkage.Scene(linkage.Restitution(0.05, 0.3), blow_frequency=20.0, impact_speed=8.0, impact_energy=10.0)
LIMITS = linkage.Limits(min_link=8e-3, joint_radius=6e-3)
SWARM, ROUNDS, STEPS = 30, 40, 72


@dataclass(frozen=True)
class Row:
    """One method: median time [s], and its error or distance from the optimum."""

    name: str
    seconds: float
    error: float | None


def angles() -> np.ndarray:
    """Half a degree, one and a half, …; beyond 180 counted back from the blow."""
    phi = np.radians(np.arange(ANGLES) * 360.0 / ANGLES + 180.0 / ANGLES)
    return np.where(phi > math.pi, phi - 2.0 * math.pi, phi)


def exact() -> np.ndarray:
    """u31 at the angles from the joints' velocities at 50 digits."""
    import mpmath as mp

    with mp.workdps(50):
        r, p = mp.mpf(RESTITUTION), mp.mpf(RATIO)
        square = ((1 + r) / (1 - r)) ** 2
        rocker = (1 + p) / (1 + square / p)
        base = square * rocker / p
        out = []
        for degrees in np.arange(ANGLES) * 360.0 / ANGLES + 180.0 / ANGLES:
            phi = mp.radians(mp.mpf(float(degrees)))
            x, y = mp.cos(phi) - base, mp.sin(phi)
            distance = mp.sqrt(x * x + y * y)
            along = (rocker**2 + distance**2 - p**2) / (2 * distance)
            across = mp.sqrt(rocker**2 - along**2)
            cx, cy = (along * x + across * y) / distance, (along * y - across * x) / distance
            if cy < 0:
                cx, cy = (along * x - across * y) / distance, (along * y + across * x) / distance
            dx, dy = cx - x, cy - y
            out.append(float((-mp.sin(phi) * dx + mp.cos(phi) * dy) / (-cy * dx + cx * dy)))
        return np.array(out)


def loop_by_fsolve(bar: FourBar) -> np.ndarray:
    """Coupler's and rocker's angle by fsolve from angle to angle, then u31 from the velocities."""
    base, coupler, rocker = (float(x) for x in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    phi = np.radians(np.arange(ANGLES) * 360.0 / ANGLES + 180.0 / ANGLES)
    at, out = np.array([0.01, 0.02]), np.empty(ANGLES)
    for k, p in enumerate(phi.tolist()):

        def closes(x: np.ndarray, p: float = p) -> list[float]:
            return [
                math.cos(p) + coupler * math.cos(x[0]) - base - rocker * math.cos(x[1]),
                math.sin(p) + coupler * math.sin(x[0]) - rocker * math.sin(x[1]),
            ]

        at = fsolve(closes, at)
        out[k] = math.sin(p - at[0]) / (rocker * math.sin(at[1] - at[0]))
    return out


def pylinkage_mechanism(bar: FourBar, steps: int):
    """pylinkage's own four-bar, standing one step before the first angle, on the branch that strikes."""
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    base, coupler, rocker = (float(x) for x in (bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker))
    step, first = 2.0 * math.pi / steps, math.pi / steps
    _, joint = bar.joints(first)
    turned = 0.0 if bar.kind.crank_sign > 0 else math.pi
    left, right = Ground(0.0, 0.0, name="A"), Ground(base, 0.0, name="D")
    crank = Crank(left, radius=1.0, angular_velocity=step, initial_angle=first + turned, name="B")
    dyad = RRRDyad(crank.output, right, distance1=coupler, distance2=rocker, x=float(joint[0, 0]), y=float(joint[1, 0]))
    made = Linkage((left, right, crank, dyad), name="impact linkage")
    made.set_input_velocity(crank, 1.0)
    made.compile()
    return made


def by_pylinkage(bar: FourBar) -> tuple[Callable[[], object], Callable[[], object], np.ndarray]:
    """Its compiled steps over the cycle without and with velocities, and u31 from the latter."""
    made = pylinkage_mechanism(bar, ANGLES)
    positions, velocities, _ = made.step_fast_with_kinematics(ANGLES)
    base = float(bar.ratios.base)
    arm, speed = positions[:, 3] - [base, 0.0], velocities[:, 3]
    u = (arm[:, 0] * speed[:, 1] - arm[:, 1] * speed[:, 0]) / (arm**2).sum(axis=1)
    # The first step leads to the second angle, the last to the first.
    return lambda: made.step_fast(ANGLES), lambda: made.step_fast_with_kinematics(ANGLES), np.roll(u, 1)


def curve_rows() -> list[Row]:
    """u31: seconds per (design, angle)."""
    bar, phi, truth = of_family(linkage.LARGEST_COUPLER, RESTITUTION, RATIO), angles(), exact()
    scale = np.abs(truth).max()

    def error(values: np.ndarray) -> float:
        return float(np.abs(values - truth).max() / scale)

    plain, full, u = by_pylinkage(bar)
    return [
        Row("closed form, with du31/dphi", median_time(lambda: transfer_and_slope(bar.coefficients, phi), 301) / ANGLES,
            error(transfer_and_slope(bar.coefficients, phi)[0])),
        Row("pylinkage, compiled steps, positions alone", median_time(plain, 101) / ANGLES, None),
        Row("pylinkage, compiled steps with velocities", median_time(full, 101) / ANGLES, error(u)),
        Row("scipy fsolve from angle to angle", median_time(lambda: loop_by_fsolve(bar), 3) / ANGLES,
            error(loop_by_fsolve(bar))),
    ]  # fmt: skip


def swarm() -> float:
    """Area [m^2] of the box found by pylinkage's particle swarm over every type, measured by the exact box."""
    from pylinkage.optimization import particle_swarm_optimization

    best = math.inf
    gain = SCENE.restitution.gain
    for kind in linkage.KINDS.values():
        family = Family(kind, gain)
        low, high = family.design_range[0] / 2, math.log(8.0)

        def sized(q: float, family: Family = family) -> tuple[FourBar, float] | None:
            bar = family.member(q)
            crank = SCENE.impact_speed / (SCENE.crank_speed * bar.ratios.rocker * bar.u31_end)
            met = crank * min(1.0, bar.ratios.base, bar.ratios.coupler, bar.ratios.rocker) >= LIMITS.min_link
            inside = LIMITS.transmission_angle[0] <= bar.middle_transmission_angle <= LIMITS.transmission_angle[1]
            return (bar, crank) if met and inside else None

        def score(_linkage: object, values: list[float], _places: object, sized: Callable = sized) -> float:
            found = sized(values[0])
            if found is None:
                return 1.0
            bar, crank = found
            points = pylinkage_mechanism(bar, STEPS).step_fast(STEPS).reshape(-1, 2) * crank
            cos, sin = math.cos(values[1]), math.sin(values[1])
            along, across = points @ [cos, sin], points @ [-sin, cos]
            return float((np.ptp(along) + 2 * LIMITS.joint_radius) * (np.ptp(across) + 2 * LIMITS.joint_radius))

        start = pylinkage_mechanism(family.member(0.0), STEPS)
        found = particle_swarm_optimization(
            score, start, dimensions=2, n_particles=SWARM, iterations=ROUNDS, neighbors=7,
            bounds=([low, 0.0], [high, 0.5 * math.pi]), order_relation=min, verbose=False,
        )  # fmt: skip
        member = sized(float(found[0].dimensions[0]))
        if member is not None:
            best = min(best, minimum_box(sweep(*member), LIMITS.joint_radius).area)
    return best


def design_rows() -> list[Row]:
    """Whole designs: seconds each; the distance from the proven best as error."""
    problem = linkage.LinkageProblem(SCENE, LIMITS, linkage.OBJECTIVES["box_area"])
    outcome = linkage.design(problem)
    best = outcome.value.value
    reached: list[float] = []
    return [
        Row("branch and bound, with proof", median_time(lambda: linkage.design(problem), 21), outcome.certificate.gap),
        Row(f"pylinkage particle swarm, {SWARM} particles, {ROUNDS} rounds a type",
            median_time(lambda: reached.append(swarm()), 1), abs(reached[0] / best - 1.0) if reached else None),
    ]  # fmt: skip


def table() -> list[str]:
    """The two tables in Markdown."""
    curves, designs = curve_rows(), design_rows()
    out = ["| way | time per (design, angle) | against the best | error of u31 |", "|---|---|---|---|"]
    for row in curves:
        error = "" if row.error is None else f"{row.error:.0e}"
        out.append(f"| {row.name} | {row.seconds * 1e9:,.1f} ns | {row.seconds / curves[0].seconds:,.0f} | {error} |")
    out += ["", "| way | time per design | against the best | above the least area |", "|---|---|---|---|"]
    for row in designs:
        error = "" if row.error is None else f"{row.error:.0e}"
        out.append(f"| {row.name} | {row.seconds * 1e3:,.1f} ms | {row.seconds / designs[0].seconds:,.0f} | {error} |")
    return out
