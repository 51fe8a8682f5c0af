"""Inputs of a crank mechanism's dynamics: mechanism, cylinder, pressure, masses, engine. SI units throughout.

Every dataclass raises ``InvalidInput`` for values outside the model's domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from solvers.crank.gas.unrolled_pressure import Cylinder, Pressure
from solvers.crank.masses.two_mass_model import CrankThrow, RodMass
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import require, require_not_negative, require_positive


@dataclass(frozen=True)
class Mechanism:
    """Crank radius r, rod length L (wrist pin to crank pin), rotational frequency f [Hz], offset e.

    The offset of the cylinder axis is positive toward the side to which the crank turns from the top dead centre.
    """

    crank_radius: float
    rod_length: float
    speed: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, "mechanism", "crank_radius", "rod_length", "speed")
        require(
            self.crank_radius < self.rod_length,
            "mechanism.crank_radius",
            "the crank is not shorter than the rod, so the mechanism cannot turn",
            "less than mechanism.rod_length",
        )
        require(
            math.isfinite(self.offset) and abs(self.offset) < self.rod_length - self.crank_radius,
            "mechanism.offset",
            "the offset keeps the mechanism from turning",
            "less than the rod length less the crank radius, on either side",
        )

    @property
    def angular_speed(self) -> float:
        return 2.0 * math.pi * self.speed

    @cached_property
    def motion(self) -> ExactMotion:
        """The exact motion."""
        return ExactMotion(self.crank_radius, self.rod_length, self.offset)

    @cached_property
    def motion_in_line(self) -> ExactMotion:
        """The exact motion without the offset."""
        return ExactMotion(self.crank_radius, self.rod_length) if self.offset else self.motion


@dataclass(frozen=True)
class Masses:
    """Piston group m_p (including pin and rings), rod, crank throw, and the number of rods per crank pin."""

    piston: float
    rod: RodMass
    throw: CrankThrow
    rods_per_pin: int = 1

    def __post_init__(self) -> None:
        require_not_negative(self, "masses", "piston")
        require(self.rods_per_pin in (1, 2), "masses.rods_per_pin", "is neither one nor two", "1 or 2")

    @property
    def reciprocating(self) -> float:
        """m_j = m_p + m_A [kg]."""
        return self.piston + self.rod.at_wrist_pin

    def rotating(self, crank_radius: float) -> float:
        """m_rot = m_k + m_B for each rod on the crank pin [kg]."""
        return self.throw.at_crank_pin(crank_radius) + self.rods_per_pin * self.rod.at_crank_pin


@dataclass(frozen=True)
class Engine:
    """Several identical cylinders on one shaft.

    phases     crank angle [rad] by which each cylinder's cycle follows the first one's
    axes       direction [rad] of each cylinder's axis about the shaft, in the sense of rotation
    positions  axial position of each cylinder along the shaft [m]; empty: no couples are computed
    flywheel_inertia, wanted_irregularity  of the whole shaft, for the speed fluctuation
    """

    phases: tuple[float, ...]
    axes: tuple[float, ...]
    positions: tuple[float, ...] = ()
    flywheel_inertia: float = 0.0
    wanted_irregularity: float | None = None

    def __post_init__(self) -> None:
        count = len(self.phases)
        require(1 <= count <= 64, "engine.phases", "needs one phase per cylinder", "1 … 64 phases")
        for name, values in (("phases", self.phases), ("axes", self.axes), ("positions", self.positions)):
            for index, value in enumerate(values):
                require(math.isfinite(value), f"engine.{name}.{index}", "must be finite", "(-inf, inf)")
        require(len(self.axes) == count, "engine.bank", "needs one direction per cylinder", f"{count} directions")
        require(
            len(self.positions) in (0, count), "engine.positions", "needs one position per cylinder", f"{count} or none"
        )
        require_not_negative(self, "engine", "flywheel_inertia")
        wanted = self.wanted_irregularity
        require(
            wanted is None or 1e-9 <= wanted <= 1,
            "engine.wanted_irregularity",
            "must lie in [1e-9, 1]",
            "[1e-9, 1] or none",
        )


_SAME_DIRECTION = 1e-6
SINGLE = Engine((0.0,), (0.0,))
"""A single cylinder."""


@dataclass(frozen=True)
class Scene:
    """A machine and the cycle that drives it.

    Two rods on a crank pin are those of consecutive cylinders, whose cranks must stand in one direction.
    """

    mechanism: Mechanism
    cylinder: Cylinder
    pressure: Pressure
    masses: Masses
    engine: Engine = SINGLE

    def __post_init__(self) -> None:
        if not self.shares_pins:
            return
        odd = len(self.engine.phases) % 2 == 1
        require(not odd, "engine.phases", "an odd number of rods cannot share crank pins in pairs", "an even number")
        directions = [axis - phase for axis, phase in zip(self.engine.axes, self.engine.phases, strict=True)]
        for index in range(1, len(directions), 2):
            require(
                abs(math.remainder(directions[index] - directions[index - 1], 2.0 * math.pi)) <= _SAME_DIRECTION,
                f"engine.phases.{index}",
                "shares a crank pin with the cylinder before it, but their cranks stand in different directions",
                "a phase that follows by the angle between the two axes, or that and a turn",
            )

    @property
    def shares_pins(self) -> bool:
        """Whether two rods of several cylinders are on one crank pin."""
        return self.masses.rods_per_pin > 1 and len(self.engine.phases) > 1
