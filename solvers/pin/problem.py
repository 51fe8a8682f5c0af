"""Definition of a design problem."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.errors import InvalidInput
from solvers.pin.scene import NO_LIMITS, BushingGeometry, Limits, Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.cone import Cone
from solvers.pin.shapes.constant import Constant
from solvers.pin.shapes.free import FREE, Free
from solvers.pin.shapes.stepped import Stepped

Form = Free | Constant | Stepped | Cone


@dataclass(frozen=True)
class PinProblem:
    """A scene, the limits to satisfy, the strength criterion, and the form of the sought diameter.

    Raises InvalidInput for a slope limit with steps, and for a cone as a bushing's outside.
    """

    scene: Scene
    limits: Limits = NO_LIMITS
    form: Form = FREE
    criterion: Criterion = CRITERIA["tresca_paper"]

    def __post_init__(self) -> None:
        if self.limits.max_slope is not None and isinstance(self.form, Stepped) and self.form.steps > 1:
            raise InvalidInput("limits.max_slope", "a step has no slope", "no slope limit with steps")
        if isinstance(self.form, Cone) and isinstance(self.scene.geometry, BushingGeometry):
            raise InvalidInput("form", "is no form of a bushing's outside", "free, drillable, constant, stepped")
