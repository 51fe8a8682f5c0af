"""Two rods on one crank pin: which cylinders may share one, and what it then carries."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Array, Cycle
from solvers.crank.engine.speed_fluctuation import shifted_breaks
from solvers.crank.scene import Engine
from solvers.errors import InvalidInput
from solvers.numerics.pieces import maxima

_SAME_DIRECTION = 1e-6


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

    found = maxima(loads, shifted_breaks(cycle, pair), tolerance).value
    return SharedPin(float(found[0]), float(found[1]))
