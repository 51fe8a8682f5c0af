"""Several like cylinders on one shaft: summed torque, the swing of the speed, unbalanced forces and couples.

Cylinder i runs through its cycle by psi_i later than the first; its axis stands at alpha_i about the shaft. Its crank
stands at phi - psi_i from its own axis, hence at phi - psi_i + alpha_i in space.

Source: any text on engine balance, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II; the
flywheel from the work between the speed's extremes, Delta W = J omega^2 delta.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle import Array, Cycle
from solvers.crank.scene import Engine
from solvers.errors import InvalidInput
from solvers.numerics.pieces import gauss, gauss_between, maxima, subdivide

ORDERS = (1, 2, 4)
MOST_BREAKS, LEAST_MOST = 20_000, 500
"""Breaks for one cylinder, and for however many: more are replaced by equal pieces, so that time stays bounded."""
MOST_SAMPLES = 2**16
LONGEST_PIECE = math.pi / 45.0
_FEWEST_NODES, _MOST_NODES = 3, 24
_SAME_DIRECTION = 1e-6
_LOOKS, _MOST_ROUNDS = 65, 8
_ROUNDING = 32.0 * np.finfo(float).eps


@dataclass(frozen=True)
class OrderUnbalance:
    """Greatest unbalanced force [N] and couple [N m] of one order; the couple is None without positions."""

    order: int
    force: float
    couple: float | None


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


@dataclass(frozen=True)
class Balance:
    """Unbalance of the reciprocating masses by order, and of the rotating masses (constant, turning with the shaft)."""

    reciprocating: tuple[OrderUnbalance, ...]
    rotating_force: float
    rotating_couple: float | None


@dataclass(frozen=True)
class SharedPin:
    """Greatest loads [N] of the first crank pin and its main bearings, all rods on it together."""

    crank_pin_load: float
    main_bearing_load: float


def require_pairs(engine: Engine, rods_per_pin: int) -> None:
    """Raise InvalidInput unless consecutive cylinders that share a crank pin have their cranks in one direction."""
    if rods_per_pin == 1 or len(engine.phases) == 1:
        return
    if len(engine.phases) % 2:
        raise InvalidInput("engine.phases", "an odd number of rods cannot share crank pins in pairs", "an even number")
    directions = np.asarray(engine.axes) - np.asarray(engine.phases)
    apart = directions[1::2] - directions[::2]
    apart = np.abs(np.remainder(apart + math.pi, 2.0 * math.pi) - math.pi)
    for index in np.flatnonzero(apart > _SAME_DIRECTION):
        raise InvalidInput(
            f"engine.phases.{2 * index + 1}",
            "shares a crank pin with the cylinder before it, but their cranks stand in different directions",
            "a phase that follows by the angle between the two axes, or that and a turn",
        )


def _shifted_breaks(cycle: Cycle, engine: Engine) -> Array:
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
    breaks = _shifted_breaks(cycle, engine)

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


def _harmonic_samples(cycle: Cycle) -> int:
    """Angles that keep aliases below rounding: harmonics fall as exp(-k acosh((L - |e|)/r))."""
    m = cycle.scene.mechanism
    fall = math.acosh((m.rod_length - abs(m.offset)) / m.crank_radius)
    return min(max(256, 2 ** math.ceil(math.log2(40.0 / fall))), MOST_SAMPLES)


def balance(cycle: Cycle, engine: Engine) -> Balance:
    """Unbalanced forces and couples, order by order, from the harmonics of the motion itself.

    With a = r omega^2 Re sum c_k exp(i k phi), the force of order k is the sum of two vectors, one turning with the
    shaft, sum c_k exp(i(alpha - k psi))/2, and one against it, sum conj(c_k) exp(i(alpha + k psi))/2; its greatest
    magnitude is the sum of theirs. Couples are taken about the middle of the cylinders.
    """
    samples = _harmonic_samples(cycle)
    angle = np.arange(samples) * (2.0 * math.pi / samples)
    harmonics = np.fft.rfft(cycle.motion.acceleration(angle)) / (samples / 2)
    masses, speed = cycle.scene.masses, cycle.angular_speed
    phase, axis = np.asarray(engine.phases), np.asarray(engine.axes)
    arm = np.asarray(engine.positions) if engine.positions else None
    if arm is not None:
        arm = arm - 0.5 * (arm.min() + arm.max())

    def greatest(order: int, weight: Array) -> float:
        c = harmonics[order] * masses.reciprocating * speed**2
        with_shaft = np.sum(weight * np.exp(1j * (axis - order * phase)))
        against = np.sum(weight * np.exp(1j * (axis + order * phase)))
        return 0.5 * float(abs(c) * (abs(with_shaft) + abs(against)))

    one = np.ones_like(phase)
    found = tuple(
        OrderUnbalance(order, greatest(order, one), None if arm is None else greatest(order, arm)) for order in ORDERS
    )
    # Rods on one pin share one crank.
    sharing = masses.rods_per_pin if phase.size > 1 else 1
    turning = cycle.centrifugal(masses.rotating(cycle.motion.crank_radius) / sharing)
    direction = np.exp(1j * (axis - phase))
    couple = None if arm is None else float(abs(np.sum(arm * direction))) * abs(turning)
    return Balance(found, float(abs(np.sum(direction))) * abs(turning), couple)


def shared_pin(cycle: Cycle, engine: Engine, tolerance: float) -> SharedPin | None:
    """The first crank pin's loads with both rods on it; None where every rod has its own."""
    masses = cycle.scene.masses
    if masses.rods_per_pin == 1 or len(engine.phases) == 1:
        return None
    pair = Engine(engine.phases[:2], engine.axes[:2])
    radius = cycle.motion.crank_radius
    rods = cycle.centrifugal(masses.rods_per_pin * masses.rod.at_crank_pin)
    whole = cycle.centrifugal(masses.rotating(radius))

    def loads(angle: Array) -> Array:
        parts = [cycle.forces(angle - phase) for phase in pair.phases]
        tangential, radial = sum(p.tangential for p in parts), sum(p.radial for p in parts)
        return np.stack([np.hypot(tangential, radial - rods), np.hypot(tangential, radial - whole)])

    found = maxima(loads, _shifted_breaks(cycle, pair), tolerance).value
    return SharedPin(float(found[0]), float(found[1]))
