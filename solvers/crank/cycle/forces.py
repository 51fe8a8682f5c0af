"""Forces of one cylinder over its cycle: effect of gas and masses on piston, rod, crank pin and bearing.

With the axial force P on the wrist pin (toward the crank) and the rod angle beta: side force N = P tan(beta), rod
force S = P/cos(beta), tangential T = P sin(phi + beta)/cos(beta), radial (toward the shaft) Z = P cos(phi +
beta)/cos(beta), torque M = T r. All are expressed in tan(beta), so that Z^2 + T^2 = S^2 = P^2 + N^2 holds to
rounding. With a couple C on the rod N = P tan(beta) - C/(L cos(beta)), and the force on a pin is not along the rod;
S = P cos(beta) + N sin(beta) is its part that is, smooth where P changes its sign.

Source: any text on engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of, pressure_at, pressure_of, within
from solvers.crank.motion.slider_crank import ExactMotion, Frame, acceleration_of, stand_at, turning_of
from solvers.crank.scene import Engine, Scene
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

LONGEST_PIECE = math.pi / 24.0
_SHARP_LIMIT = 0.3
_NONE = np.empty(0)


@dataclass(frozen=True)
class Composition:
    """The physics of a scene: what the active effects add to the gas force of one in-line cylinder without masses.

    ``offset`` of the cylinder axis [m]; ``reciprocating`` mass and the ``piston``'s part of it [kg]; the rod's
    ``inertia_defect`` [kg m2]; the ``engine`` if several cylinders are evaluated together.
    """

    offset: float = 0.0
    reciprocating: float = 0.0
    piston: float = 0.0
    inertia_defect: float = 0.0
    engine: Engine | None = None


class Machine(NamedTuple):
    """Kernel data of a cylinder.

    Motion, omega [rad/s], piston area [m2] and crankcase pressure [Pa], the contributions of its composition, and
    the centrifugal forces [N] of the rod's big end and of all rotating masses.
    """

    frame: Frame
    speed: float
    area: float
    back: float
    reciprocating: float
    piston: float
    defect: float
    big_end: float
    turning: float


class Instant(NamedTuple):
    """p [Pa] and the forces [N] at one angle: gas, inertia, axial on the wrist pin, side, along the rod, tangential and
    radial."""

    pressure: float
    gas: float
    inertia: float
    on_pin: float
    side: float
    rod: float
    tangential: float
    radial: float


@dataclass(frozen=True)
class Forces:
    """Forces at angles, each of the angles' shape; N, N m, Pa. Rod force and axial force positive in compression.

    ``crank_pin_load`` acts between the rod's big end and the pin, including the rod's rotating mass;
    ``main_bearing_load`` acts from the shaft on its bearings for this throw.
    """

    pressure: Array
    gas: Array
    inertia: Array
    axial: Array
    side: Array
    rod: Array
    tangential: Array
    radial: Array
    torque: Array
    wrist_pin_load: Array
    crank_pin_load: Array
    main_bearing_load: Array


@inlined_kernel
def instant(phi: float, piece: int, machine: Machine, gas: Unrolled) -> Instant:
    """Return pressure and forces at an angle of a piece."""
    frame = machine.frame
    at = stand_at(phi, frame)
    # An effect's bound may evaluate the pressures of a mechanism with offset in one without.
    seen = frame.offset == gas.frame.offset
    pressure = pressure_of(phi, at, piece, gas) if seen else pressure_at(phi, piece, gas)
    force, hastened = (pressure - machine.back) * machine.area, -machine.speed * machine.speed
    across = machine.defect * hastened * turning_of(at, frame) * at.secant / frame.length
    hastened *= acceleration_of(at, frame)
    inertia = machine.reciprocating * hastened
    axial = force + inertia
    side = axial * at.tangent - across
    return Instant(
        pressure, force, inertia, force + machine.piston * hastened, side,
        axial * at.secant - across * at.tangent / at.secant,
        axial * at.sine + side * at.cosine, axial * at.cosine - side * at.sine,
    )  # fmt: skip


@inlined_kernel
def length_of(x: float, y: float) -> float:
    """sqrt(x^2 + y^2)."""
    return math.sqrt(x * x + y * y)


@kernel
def _forces(angle: Array, machine: Machine, gas: Unrolled) -> Array:
    """The rows of ``Forces``."""
    out = np.empty((12, angle.size))
    for i in range(angle.size):
        phi = within(angle[i], gas.breaks)
        at = instant(phi, piece_of(phi, gas.breaks), machine, gas)
        out[0, i], out[1, i], out[2, i] = at.pressure, at.gas, at.inertia
        out[3, i], out[4, i] = at.gas + at.inertia, at.side
        out[5, i] = at.rod
        out[6, i], out[7, i], out[8, i] = at.tangential, at.radial, at.tangential * machine.frame.r
        out[9, i] = length_of(at.on_pin, at.side)
        out[10, i] = length_of(at.tangential, at.radial - machine.big_end)
        out[11, i] = length_of(at.tangential, at.radial - machine.turning)
    return out


@dataclass(frozen=True)
class Cycle:
    """A scene with its physics and its unrolled pressures."""

    scene: Scene
    composition: Composition
    curve: Unrolled

    @property
    def motion(self) -> ExactMotion:
        mechanism = self.scene.mechanism
        return mechanism.motion if self.composition.offset else mechanism.motion_in_line

    @cached_property
    def machine(self) -> Machine:
        """One cylinder with its own rod on the crank pin."""
        scene, made = self.scene, self.composition
        masses, r, speed = scene.masses, scene.mechanism.crank_radius, scene.mechanism.angular_speed
        turned = r * speed**2
        return Machine(
            self.motion.frame, speed, scene.cylinder.area, scene.cylinder.crankcase_pressure, made.reciprocating,
            made.piston, made.inertia_defect, masses.rod.at_crank_pin * turned, masses.rotating(r) * turned,
        )  # fmt: skip

    @property
    def sharp_angles(self) -> Array:
        """Refinement angles [rad], ascending, around the positions with the crank perpendicular to the cylinder
        axis.

        There a rod hardly longer than its crank has a peak of tan(beta) within sqrt(1 - sin^2(beta)); the spacing is
        halved toward the peak. Empty for longer rods.
        """
        m = self.scene.mechanism
        sharp = math.sqrt(2.0 * (1.0 - (m.crank_radius + abs(m.offset)) / m.rod_length))
        if sharp > _SHARP_LIMIT:
            return _NONE
        beside = sharp * 2.0 ** np.arange(math.ceil(math.log2(_SHARP_LIMIT / sharp)) + 2)
        across = (np.arange(-1, 2 * self.scene.cylinder.strokes + 2, 2) * (0.5 * math.pi))[:, None]
        return np.unique(np.concatenate([across - beside, across, across + beside], axis=1))

    def forces(self, angle: ArrayLike) -> Forces:
        """Return all forces at the angles [rad], shape (n,)."""
        return Forces(*_forces(np.ascontiguousarray(angle, dtype=float), self.machine, self.curve))
