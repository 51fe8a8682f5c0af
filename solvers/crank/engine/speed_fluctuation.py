"""Several like cylinders on one shaft: summed torque and the swing of the speed.

Cylinder i runs through its cycle by psi_i later than the first. Source: any text on engine balance, e.g. C. F. Taylor,
The Internal Combustion Engine in Theory and Practice II; the flywheel from the work between the speed's extremes,
Delta W = J omega^2 delta.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Array, Cycle
from solvers.crank.scene import Engine
from solvers.numerics.pieces import gauss, gauss_between, maxima, subdivide

MOST_BREAKS, LEAST_MOST = 20_000, 500
"""Breaks for one cylinder, and for however many: more are replaced by equal pieces, so that time stays bounded."""
LONGEST_PIECE = math.pi / 45.0
_FEWEST_NODES, _MOST_NODES = 3, 24
_LOOKS, _MOST_ROUNDS = 65, 8
_ROUNDING = 32.0 * np.finfo(float).eps


@dataclass(frozen=True)
class SpeedSwing:
    """The work [J] between the extremes of the speed, and what follows for the shaft.

    ``irregularity`` is (omega_max - omega_min)/omega for the inertia there is, None without any;
    ``torque_irregularity`` is (M_max - M_min)/M_mean, None for a mean torque of zero.
    """

    work_fluctuation: float
    inertia: float
    irregularity: float | None
    torque_max: float
    torque_min: float
    torque_mean: float
    torque_irregularity: float | None
    flywheel_inertia_wanted: float | None
    error: float


def shifted_breaks(cycle: Cycle, engine: Engine) -> Array:
    period, start = cycle.scene.cylinder.period, float(cycle.breaks[0])
    shifted = [start + np.mod(cycle.breaks[:-1] + phase - start, period) for phase in engine.phases]
    found = np.unique(np.concatenate([*shifted, [start, start + period]]))
    most = max(MOST_BREAKS // len(engine.phases), LEAST_MOST)
    if found.size > most:
        found = np.linspace(start, start + period, most)
    return found


def _summed(cycle: Cycle, engine: Engine, angle: Array) -> Array:
    total = np.zeros_like(angle)
    for phase in engine.phases:
        total += cycle.torque(angle - phase)
    return total


def shaft_inertia(cycle: Cycle) -> float:
    """J [kg m2] of everything that turns: flywheel, throws, and the rods' shares at the crank pins."""
    scene, engine, radius = cycle.scene, cycle.scene.engine, cycle.motion.crank_radius
    rods = len(engine.phases)
    throws = max(rods // scene.masses.rods_per_pin, 1)
    rotating = throws * scene.masses.throw.inertia(radius) + rods * scene.masses.rod.at_crank_pin * radius**2
    return engine.flywheel_inertia + rotating


def speed_swing(cycle: Cycle, engine: Engine, tolerance: float, one: tuple[float, float]) -> SpeedSwing:
    """Summed torque and the swing of the speed, the speed taken as nearly constant (irregularity far below 1).

    The work since the start of the cycle is summed piece by piece; its extremes lie where the torque crosses its mean,
    found in the piece that holds them. ``one`` is the mean torque of one cylinder [N m] and its error.
    """
    breaks = shifted_breaks(cycle, engine)

    def torque(angle: Array) -> Array:
        return _summed(cycle, engine, angle)

    average, average_error = (len(engine.phases) * part for part in one)
    extremes = maxima(lambda a: (t := torque(a), np.stack([t, -t]))[1], breaks, tolerance)
    bounds = subdivide(breaks, LONGEST_PIECE)
    work, work_error = _work(bounds, lambda angle: torque(angle) - average, tolerance)
    limits = torque(np.concatenate([np.nextafter(bounds[:-1], np.inf), np.nextafter(bounds[1:], -np.inf)])) - average
    highest, high_error = _inside(bounds, work, torque, average, tolerance, limits)
    lowest, low_error = _inside(bounds, -work, lambda angle: -torque(angle), -average, tolerance, -limits)
    high, low = max(float(work.max()), highest), min(float(work.min()), -lowest)
    fluctuation = high - low
    inertia, wanted = shaft_inertia(cycle), engine.wanted_irregularity
    speed = cycle.angular_speed
    greatest, least = float(extremes.value[0]), -float(extremes.value[1])
    return SpeedSwing(
        work_fluctuation=fluctuation,
        inertia=inertia,
        irregularity=fluctuation / (inertia * speed**2) if inertia > 0 else None,
        torque_max=greatest,
        torque_min=least,
        torque_mean=average,
        torque_irregularity=(greatest - least) / abs(average) if abs(average) > average_error else None,
        flywheel_inertia_wanted=None
        if wanted is None
        else max(fluctuation / (wanted * speed**2) - (inertia - engine.flywheel_inertia), 0.0),
        error=average_error * float(np.ptp(breaks)) + work_error + high_error + low_error,
    )


def _work(bounds: Array, surplus: Callable[[Array], Array], tolerance: float) -> tuple[Array, float]:
    """The integral from the first bound to every other, and what the last doubling of the nodes changed."""

    def summed(nodes: int) -> Array:
        place, weight = gauss(bounds, nodes)
        pieces = np.sum(surplus(place.ravel()).reshape(place.shape) * weight, axis=1)
        return np.concatenate([[0.0], np.cumsum(pieces)])

    nodes = _FEWEST_NODES
    work = summed(nodes)
    while True:
        nodes *= 2
        finer = summed(nodes)
        change, work = float(np.max(np.abs(finer - work))), finer
        if change <= tolerance * np.ptp(work) or nodes >= _MOST_NODES:
            return work, change + _ROUNDING * float(np.sum(np.abs(np.diff(work))))


def _inside(
    bounds: Array, work: Array, torque: Callable[[Array], Array], average: float, tolerance: float, limits: Array
) -> tuple[float, float]:
    """The greatest work inside the pieces where the surplus falls through zero, and its error [J].

    Pieces are seen by the one-sided limits of the surplus, first those at their beginnings, then those at their ends.
    All crossings are closed in on together, ``_LOOKS`` places a time, until the work between the two sides of each is
    small; what is left of it up to the chord's zero is a triangle.
    """
    low, high = np.nextafter(bounds[:-1], np.inf), np.nextafter(bounds[1:], -np.inf)
    before, after = np.split(limits, 2)
    at = np.flatnonzero((before > 0) & (after < 0))
    if not at.size:
        return -math.inf, 0.0
    left, right, share = low[at], high[at], np.linspace(0.0, 1.0, _LOOKS)
    for _ in range(_MOST_ROUNDS):
        grid = left[:, None] + (right - left)[:, None] * share
        surplus = torque(grid.ravel()).reshape(grid.shape) - average
        fallen = np.argmax(surplus <= 0, axis=1).clip(1)[:, None]
        left, right = (np.take_along_axis(grid, fallen - k, axis=1)[:, 0] for k in (1, 0))
        above, below = (np.take_along_axis(surplus, fallen - k, axis=1)[:, 0] for k in (1, 0))
        if float(np.max(above * (right - left))) <= tolerance * np.ptp(work):
            break
    # Summed over another number of angles, a surplus next to zero may have the other sign.
    above, below = np.maximum(above, np.finfo(float).tiny), np.minimum(below, 0.0)
    triangle = 0.5 * above * (right - left) * (above / (above - below))
    # How far the surplus leaves its chord, seen in the middle: of a parabola two thirds of it lie between the two, and
    # twice as much is trusted to cover what is no parabola.
    bent = np.abs(torque(0.5 * (left + right)) - average - 0.5 * (above + below))
    missed = float(np.max(np.minimum(above, 4.0 / 3.0 * bent) * (right - left)))
    place, weight = gauss_between(bounds[at], left, _MOST_NODES)
    total = np.sum((torque(place.ravel()).reshape(place.shape) - average) * weight, axis=1)
    return float(np.max(work[at] + total + triangle)), missed
