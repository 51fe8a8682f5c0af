"""Definition of a design problem."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.free import FREE
from solvers.pin.shapes.shape import Form


@dataclass(frozen=True)
class PinProblem:
    """A scene, the limits to satisfy, the strength criterion, and the form of the sought diameter."""

    scene: Scene
    limits: Limits = NO_LIMITS
    form: Form = FREE
    criterion: Criterion = CRITERIA["tresca_paper"]
