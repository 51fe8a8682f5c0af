"""The instants of a cycle at which its loads are greatest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.crank.cycle.forces import Array, Cycle
from solvers.crank.problem import LOADS
from solvers.numerics.pieces import Maxima


@dataclass(frozen=True)
class Worst:
    """The instant at which a force is greatest: its name, where [rad], its value [N] and the pressure [Pa] there."""

    name: str
    angle: float
    force: float
    pressure: float


def worst_instants(found: Maxima, cycle: Cycle) -> tuple[Worst, ...]:
    pressure, period = cycle.curve.pressure(found.place), cycle.scene.cylinder.period
    return tuple(
        Worst(name, _at_break(float(place), cycle.breaks) % period, float(force), float(p))
        for (name, _), place, force, p in zip(LOADS, found.place, found.value, pressure, strict=True)
    )


def _at_break(angle: float, breaks: Array) -> float:
    """The break itself for an angle that stands just beside it."""
    nearest = float(breaks[np.argmin(np.abs(breaks - angle))])
    return nearest if abs(nearest - angle) < 1e-12 else angle
