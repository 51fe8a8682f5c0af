"""Design problem of the flexible rod: free dimensions, requirements, objective."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.effects import Demand
from solvers.errors import InvalidInput, require_positive
from solvers.numerics.arrays import Array
from solvers.rod.check import RodCheck
from solvers.rod.constraints import CONSTRAINTS, LEAST_STABILITY, Constraint, Limits
from solvers.rod.objectives import Objective
from solvers.rod.rows import STABILITY
from solvers.rod.scene import Dimensions, Scene

Range = tuple[float, float]


@dataclass(frozen=True)
class Bounds:
    """Closed ranges [m] of width b, thickness h, free length l."""

    b: Range
    h: Range
    l: Range

    def __post_init__(self) -> None:
        for name in ("b", "h", "l"):
            low, high = getattr(self, name)
            if not (math.isfinite(high) and 0 < low <= high):
                raise InvalidInput(f"bounds.{name}", "is not a range of positive lengths", "0 < lower <= upper")

    @property
    def logarithms(self) -> Array:
        """The ranges of ln(b, h, l), sizes in m, (3, 2)."""
        return np.log([self.b, self.h, self.l])

    @property
    def stiffest(self) -> Dimensions:
        """The strip with the highest buckling load and natural frequency."""
        return Dimensions(self.b[1], self.h[1], self.l[0])

    def up_to(self, length: float) -> Bounds:
        """The same bounds, with the strip's length at most ``length`` [m]."""
        return replace(self, l=(self.l[0], min(self.l[1], length)))

    @property
    def middle(self) -> Dimensions:
        """The strip with the geometric mean of each size's bounds."""
        return Dimensions(*(math.sqrt(low * high) for low, high in (self.b, self.h, self.l)))


@dataclass(frozen=True)
class Requirements:
    """Limits on the results, SI units; None: no limit. Safeties have minima, other results maxima."""

    min_fatigue_safety: float
    min_stability_safety: float
    max_contact_pressure: float | None = None
    max_friction_power: float | None = None
    min_yield_safety: float | None = None

    def __post_init__(self) -> None:
        require_positive(self, "requirements", *self.__dataclass_fields__)
        if self.min_stability_safety < 1:
            raise InvalidInput("requirements.min_stability_safety", "lets the strip buckle", "[1, inf)")

    def requested(self) -> tuple[tuple[Constraint, float], ...]:
        """The constraints requested, with their values."""
        found = ((constraint, getattr(self, constraint.name)) for constraint in CONSTRAINTS)
        return tuple((constraint, required) for constraint, required in found if required is not None)

    def demands(self) -> tuple[Demand, ...]:
        """The effects that these limits require."""
        limited = ((c.result.effect, c.name) for c, _ in self.requested())
        return tuple(Demand(effect, f"requirements.{name}") for effect, name in limited if effect is not None)

    def limits(self, scene: Scene) -> Limits:
        """The limits by row of the search, always including stability."""
        limits = {c.row: c.log_limit(required, scene) for c, required in self.requested()}
        return {STABILITY: -math.log(LEAST_STABILITY)} | limits

    def relaxed(self, slack: float) -> Requirements:
        """These requirements, each relaxed by a relative slack of any size, as far as no strip may buckle."""
        looser = {c.name: required * (1.0 + slack) ** (-1 if c.is_minimum else 1) for c, required in self.requested()}
        return replace(self, **looser | {"min_stability_safety": max(looser["min_stability_safety"], 1.0)})

    def met_by(self, check: RodCheck) -> bool:
        """Whether a strip meets every requirement; a buckled strip never does."""
        return all(c.meets(check, required) for c, required in self.requested())


@dataclass(frozen=True)
class RodProblem:
    """A scene and the requirements on its strip. ``stock_h`` lists the available thicknesses; width and length are
    rounded to multiples of ``step_b`` and ``step_l``."""

    scene: Scene
    bounds: Bounds
    requirements: Requirements
    objective: Objective
    stock_h: tuple[float, ...] | None = None
    step_b: float | None = None
    step_l: float | None = None

    def __post_init__(self) -> None:
        if self.bounds.l[0] > self.scene.mechanism.rod_length:
            raise InvalidInput("bounds.l", "starts beyond the rod's own length", "at most mechanism.rod_length")
        if self.stock_h is not None:
            if not self.stock_h or not all(math.isfinite(h) and h > 0 for h in self.stock_h):
                raise InvalidInput("stock_h", "must list positive thicknesses", "at least one, each above 0")
            if not any(self.bounds.h[0] <= h <= self.bounds.h[1] for h in self.stock_h):
                raise InvalidInput("stock_h", "has no thickness within the bounds", "one within the bounds of h")
        for name, step, (low, high) in (("b", self.step_b, self.bounds.b), ("l", self.step_l, self.bounds.l)):
            if step is None:
                continue
            if not (math.isfinite(step) and step > 0):
                raise InvalidInput(f"step.{name}", "must be positive", "(0, inf)")
            if math.floor(high / step * (1 + 1e-12)) < math.ceil(low / step * (1 - 1e-12)):
                raise InvalidInput(f"step.{name}", "has no multiple within the bounds", "a finer step")
            if (high - low) / step > 2000:
                raise InvalidInput(f"step.{name}", "makes more than 2000 sizes", "a coarser step")
