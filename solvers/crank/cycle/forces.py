"""Forces of one cylinder over its cycle: from gas and masses, on piston, rod, crank pin and bearing.

With the axial force P on the wrist pin (toward the crank) and the rod angle beta: side force N = P tan(beta), rod
force S = P/cos(beta), tangential T = P sin(phi + beta)/cos(beta), radial (toward the shaft) Z = P cos(phi +
beta)/cos(beta), torque M = T r. All are expressed in tan(beta), so that Z^2 + T^2 = S^2 = P^2 + N^2 holds to
rounding. With a couple C on the rod N = P tan(beta) - C/(L cos(beta)), and the force on a pin is not along the rod;
S = P cos(beta) + N sin(beta) is its component along the rod, smooth where P changes sign.

Source: any text on engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of, pressure_of, wrapped
from solvers.crank.motion.slider_crank import (
    AngleFunctions,
    ExactMotion,
    Geometry,
    acceleration_of,
    angle_functions,
    rod_acceleration_of,
)
from solvers.crank.scene import SINGLE, Engine, Scene
from solvers.numerics.arrays import Array
from solvers.numerics.jit import inlined_kernel, kernel

LONGEST_PIECE = math.pi / 24.0
_MAX_PEAK_WIDTH = 0.3


class Machine(NamedTuple):
    """Kernel data of a cylinder.

    Motion, omega [rad/s], piston area [m2] and crankcase pressure [Pa]; the reciprocating mass and the piston's part
    of it [kg] and the rod's inertia defect [kg m2], zero for effects left out; and the centrifugal forces [N] of the
    rod's big end and of all rotating masses.
    """

    geometry: Geometry
    speed: float
    area: float
    back_pressure: float
    reciprocating: float
    piston: float
    defect: float
    big_end: float
    rotating: float


class Instant(NamedTuple):
    """The mechanism, p [Pa] and the forces [N] at one angle: gas, inertia, axial on the wrist pin, side, along the rod,
    tangential and radial."""

    at: AngleFunctions
    pressure: float
    gas: float
    inertia: float
    wrist_pin_axial: float
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
    at = angle_functions(phi, machine.geometry)
    return forces_at(at, pressure_of(phi, at, piece, gas), machine)


@inlined_kernel
def forces_at(at: AngleFunctions, pressure: float, machine: Machine) -> Instant:
    """Return the forces under a pressure."""
    geometry, factor = machine.geometry, -machine.speed * machine.speed
    gas_force = (pressure - machine.back_pressure) * machine.area
    couple_force = machine.defect * factor * rod_acceleration_of(at, geometry) * at.secant / geometry.length
    factor *= acceleration_of(at, geometry)
    inertia = machine.reciprocating * factor
    axial = gas_force + inertia
    side = axial * at.tangent - couple_force
    return Instant(
        at, pressure, gas_force, inertia, gas_force + machine.piston * factor, side,
        axial * at.secant - couple_force * at.tangent / at.secant,
        axial * at.sine + side * at.cosine, axial * at.cosine - side * at.sine,
    )  # fmt: skip


@inlined_kernel
def kinetic_energy(at: AngleFunctions, machine: Machine) -> float:
    """Return m_j v^2/2 - Delta J (omega beta')^2/2 [J], the part of a cylinder's kinetic energy that varies: the
    rod's two point masses have Delta J too much inertia."""
    crank_pin_speed = machine.speed * machine.geometry.r
    piston_speed = crank_pin_speed * (at.sine + at.cosine * at.tangent)
    rod_speed = crank_pin_speed / machine.geometry.length * at.cosine * at.secant
    return 0.5 * (machine.reciprocating * piston_speed * piston_speed - machine.defect * rod_speed * rod_speed)


@inlined_kernel
def norm(x: float, y: float) -> float:
    """sqrt(x^2 + y^2)."""
    return math.sqrt(x * x + y * y)


@kernel
def _forces(angle: Array, machine: Machine, gas: Unrolled) -> Array:
    """The rows of ``Forces``."""
    out = np.empty((12, angle.size))
    for i in range(angle.size):
        phi = wrapped(angle[i], gas.breaks)
        at = instant(phi, piece_of(phi, gas.breaks), machine, gas)
        out[0, i], out[1, i], out[2, i] = at.pressure, at.gas, at.inertia
        out[3, i], out[4, i], out[5, i] = at.gas + at.inertia, at.side, at.rod
        out[6, i], out[7, i], out[8, i] = at.tangential, at.radial, at.tangential * machine.geometry.r
        out[9, i] = norm(at.wrist_pin_axial, at.side)
        out[10, i] = norm(at.tangential, at.radial - machine.big_end)
        out[11, i] = norm(at.tangential, at.radial - machine.rotating)
    return out


@dataclass(frozen=True)
class Cycle:
    """A scene with the names of the effects it is evaluated with, and its unrolled pressures."""

    scene: Scene
    effects: frozenset[str]
    curve: Unrolled

    @property
    def motion(self) -> ExactMotion:
        mechanism = self.scene.mechanism
        return mechanism.motion if "pin_offset" in self.effects else mechanism.motion_in_line

    @cached_property
    def machine(self) -> Machine:
        """One cylinder with its own rod on the crank pin."""
        scene, masses, r = self.scene, self.scene.masses, self.scene.mechanism.crank_radius
        inertia, speed = "reciprocating_inertia" in self.effects, scene.mechanism.angular_speed
        centripetal = r * speed**2
        return Machine(
            self.motion.geometry, speed, scene.cylinder.area, scene.cylinder.crankcase_pressure,
            masses.reciprocating if inertia else 0.0, masses.piston if inertia else 0.0,
            masses.rod.inertia_defect if "rod_inertia_couple" in self.effects else 0.0,
            masses.rod.at_crank_pin * centripetal, masses.rotating(r) * centripetal,
        )  # fmt: skip

    @cached_property
    def engine(self) -> Engine:
        """The cylinders evaluated together: one alone if ``engine`` is left out."""
        return self.scene.engine if "engine" in self.effects else SINGLE

    @property
    def peaks(self) -> Array:
        """Angles [rad] around the positions with the crank perpendicular to the cylinder axis, ascending.

        There a rod hardly longer than its crank has a peak of tan(beta) within sqrt(1 - sin^2(beta)); the spacing is
        halved toward the peak. For longer rods there are none.
        """
        m = self.scene.mechanism
        peak_width = math.sqrt(2.0 * (1.0 - (m.crank_radius + abs(m.offset)) / m.rod_length))
        if peak_width > _MAX_PEAK_WIDTH:
            return np.empty(0)
        distances = peak_width * 2.0 ** np.arange(math.ceil(math.log2(_MAX_PEAK_WIDTH / peak_width)) + 2)
        centres = (np.arange(-1, 4 * self.scene.cylinder.strokes + 2, 2) * (0.5 * math.pi))[:, None]
        return (centres + np.concatenate([-distances[::-1], [0.0], distances])).ravel()

    @property
    def pieces(self) -> Unrolled:
        """The pressures, with breaks at the ``peaks``."""
        gas, peaks = self.curve, self.peaks
        if not peaks.size:
            return gas
        breaks = np.union1d(gas.breaks, peaks[(gas.breaks[0] < peaks) & (peaks < gas.breaks[-1])])
        piece = np.searchsorted(gas.breaks, breaks[:-1], side="right") - 1
        return gas._replace(breaks=breaks, origin=gas.origin[piece], cubic=gas.cubic[piece], stroke=gas.stroke[piece])

    def forces(self, angle: ArrayLike) -> Forces:
        """Return all forces at the angles [rad], shape (n,)."""
        return Forces(*_forces(np.ascontiguousarray(angle, dtype=float), self.machine, self.curve))
