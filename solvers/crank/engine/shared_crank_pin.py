"""Two rods on one crank pin: which cylinders may share one, and its loads."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Cycle
from solvers.crank.cycle.worst_instants import CRANK_PIN, greatest
from solvers.crank.scene import Engine
from solvers.errors import InvalidInput

_SAME_DIRECTION = 1e-6


@dataclass(frozen=True)
class SharedPin:
    """Maximum loads [N] of the first crank pin and its main bearings from all its rods together."""

    crank_pin_load: float
    main_bearing_load: float


def require_pairs(engine: Engine, rods_per_pin: int) -> None:
    """Raise InvalidInput unless consecutive cylinders that share a crank pin have their cranks in one direction."""
    if rods_per_pin == 1 or len(engine.phases) == 1:
        return
    if len(engine.phases) % 2:
        raise InvalidInput("engine.phases", "an odd number of rods cannot share crank pins in pairs", "an even number")
    directions = np.asarray(engine.axes) - np.asarray(engine.phases)
    difference = directions[1::2] - directions[::2]
    difference = np.abs(np.remainder(difference + math.pi, 2.0 * math.pi) - math.pi)
    for index in np.flatnonzero(difference > _SAME_DIRECTION):
        raise InvalidInput(
            f"engine.phases.{2 * index + 1}",
            "shares a crank pin with the cylinder before it, but their cranks stand in different directions",
            "a phase that follows by the angle between the two axes, or that and a turn",
        )


def shared_pin(cycle: Cycle, engine: Engine, tolerance: float) -> SharedPin | None:
    """Return the first crank pin's loads with both rods on it; None if every rod has its own."""
    masses = cycle.scene.masses
    if masses.rods_per_pin == 1 or len(engine.phases) == 1:
        return None
    # The throw counts once, so only the rods' big ends are multiplied; the total rotating mass already includes both
    # rods.
    machine = cycle.machine._replace(big_end=masses.rods_per_pin * cycle.machine.big_end)
    pair = np.array(engine.phases[:2])
    found = greatest(machine, cycle.curve, cycle.sharp_angles, pair, CRANK_PIN, 2, tolerance).value
    return SharedPin(float(found[0]), float(found[1]))
