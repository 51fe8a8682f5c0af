"""Definition of a design problem."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.pin.scene import NO_LIMITS, Limits, Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.cone import Cone
from solvers.pin.shapes.constant import Constant
from solvers.pin.shapes.free import FREE, Free
from solvers.pin.shapes.stepped import Stepped

Form = Free | Constant | Stepped | Cone


@dataclass(frozen=True)
class PinProblem:
    """A scene, the limits to satisfy, the strength criterion, and the form of the sought diameter."""

    scene: Scene
    limits: Limits = NO_LIMITS
    form: Form = FREE
    criterion: Criterion = CRITERIA["tresca_paper"]
