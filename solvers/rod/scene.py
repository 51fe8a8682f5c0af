"""Inputs of the flexible rod: mechanism, piston, load, material, dimensions. SI units throughout.

Every dataclass rejects values outside the model with ``InvalidInput``; all others can be computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from solvers.errors import require, require_not_negative, require_positive
from solvers.materials import Material
from solvers.numerics.arrays import Array
from solvers.numerics.periodic import TURN


@dataclass(frozen=True)
class Mechanism:
    """Crank radius r, rod length L (clamp in the piston to crank pin), rotational frequency f [Hz]."""

    crank_radius: float
    rod_length: float
    speed: float

    def __post_init__(self) -> None:
        require_positive(self, "mechanism", "crank_radius", "rod_length", "speed")
        require(
            self.crank_radius < self.rod_length,
            "mechanism.crank_radius",
            "the crank is not shorter than the rod, so the mechanism cannot turn",
            "less than mechanism.rod_length",
        )

    @property
    def angular_speed(self) -> float:
        return TURN * self.speed


@dataclass(frozen=True)
class Piston:
    """Piston diameter D, skirt length Lp, reciprocating mass m_j, clamp offset e, friction coefficient mu."""

    diameter: float
    skirt_length: float
    reciprocating_mass: float = 0.0
    clamp_offset: float = 0.0
    friction_coefficient: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, "piston", "diameter", "skirt_length")
        require_not_negative(self, "piston", "reciprocating_mass", "friction_coefficient")
        require(math.isfinite(self.clamp_offset), "piston.clamp_offset", "must be finite", "(-inf, inf)")

    @property
    def area(self) -> float:
        return math.pi * self.diameter**2 / 4


JUMP = 1e-6
"""Half-width [rad] of the smooth step that replaces a jump of the pressure."""


class PressureCurve(NamedTuple):
    """Kernel representation of a pressure cycle.

    Without breaks it is level (1 + sharpness)/(1 - sharpness cos(phi - phase)); with them, of shape (pieces + 1,) over
    one revolution, ``pieces`` holds the coefficients of cubics in phi - break, highest power first, shape (4, pieces).
    """

    level: float
    sharpness: float
    phase: float
    breaks: Array
    pieces: Array


class Load(Protocol):
    """A pressure cycle of one revolution, in Pa over the crank angle from top dead centre.

    back_pressure          [Pa] as given, if it is
    default_back_pressure  [Pa] otherwise: the mean of the cycle
    """

    back_pressure: float | None

    @property
    def default_back_pressure(self) -> float: ...

    def reference_pressure(self) -> float:
        """The back pressure [Pa]."""
        return self.default_back_pressure if self.back_pressure is None else self.back_pressure

    def pressure(self, angle: ArrayLike) -> Array:
        """p(phi) [Pa], 2 pi periodic, same shape as the angles [rad]."""
        level, sharpness, phase, ends, pieces = self.curve
        phi = np.asarray(angle, dtype=float)
        if not ends.size:
            half = np.sin(0.5 * (phi - phase))
            return level * (1.0 + sharpness) / ((1.0 - sharpness) + 2.0 * sharpness * half**2)
        phi = ends[0] + np.mod(phi - ends[0], TURN)
        piece = np.clip(np.searchsorted(ends, phi, side="right") - 1, 0, ends.size - 2)
        x = phi - ends[piece]
        return ((pieces[0, piece] * x + pieces[1, piece]) * x + pieces[2, piece]) * x + pieces[3, piece]

    def sharp_angles(self) -> Array:
        """Angles [rad] between which the pressure is smooth; uniform sampling might miss a peak or jump there."""
        return np.empty(0)

    @property
    def curve(self) -> PressureCurve:
        """Kernel representation of the pressure."""

    def corners(self) -> Array:
        """Angles [rad] at which a derivative of the pressure jumps, or the pressure itself."""
        return np.empty(0)

    def jumps(self) -> Array:
        """The subset of ``corners`` at which the pressure itself jumps; ``curve`` replaces a jump by a smooth step of
        half-width ``JUMP``."""
        return np.empty(0)


@dataclass(frozen=True)
class Scene:
    """A machine and its load: everything except the strip's dimensions."""

    mechanism: Mechanism
    piston: Piston
    load: Load
    material: Material


@dataclass(frozen=True)
class Dimensions:
    """The strip: width b, thickness h (bending in the plane of the crank), free length l."""

    b: float
    h: float
    l: float

    def __post_init__(self) -> None:
        require_positive(self, "dimensions", "b", "h", "l")
