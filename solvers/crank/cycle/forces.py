"""One cylinder's forces over its cycle: what the gas and the masses do to piston, rod, crank pin and bearing.

With the axial force P on the wrist pin (toward the crank) and the rod's angle beta:
side force N = P tan(beta), rod force S = P/cos(beta), tangential T = P sin(phi + beta)/cos(beta), radial (toward the
shaft) Z = P cos(phi + beta)/cos(beta), torque M = T r. All are written in tan(beta), so that Z^2 + T^2 = S^2 = P^2 +
N^2 holds to rounding in every motion. With a couple on the rod its end forces no longer point along it; S is then the
magnitude of what the rod passes from pin to pin.

Source: any text on engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.crank.motion.slider_crank import Motion, Posture
from solvers.crank.scene import SINGLE, Curve, Engine, Scene

Array = NDArray[np.float64]

_SHARP = 0.3


class AxialTerm(Protocol):
    """A force along the cylinder axis, toward the crank, on top of the gas force."""

    def axial_force(self, cycle: Cycle, at: Posture) -> Array:
        """On the mechanism [N]."""

    def on_wrist_pin(self, cycle: Cycle, at: Posture) -> Array:
        """The part of it that the wrist pin carries [N]."""


class LateralTerm(Protocol):
    """A pair of forces across the cylinder axis, opposite at piston and crank pin."""

    def side_force(self, cycle: Cycle, at: Posture) -> Array:
        """From the piston on the wall [N], positive as N is."""


@dataclass(frozen=True)
class Composition:
    """The physics of a scene: its motion and the terms that the chosen effects add to the gas force."""

    motion: Motion
    axial: tuple[AxialTerm, ...] = ()
    lateral: tuple[LateralTerm, ...] = ()
    engine: Engine = SINGLE


@dataclass(frozen=True)
class Forces:
    """Forces at angles, each of the angles' shape; N, N m, Pa. Rod force and axial force positive in compression.

    ``crank_pin_load`` is what the rod's big end and the pin exchange, the rod's rotating share included;
    ``main_bearing_load`` what the shaft passes to its bearings for this throw.
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


@dataclass(frozen=True)
class Cycle:
    """A scene with its physics and its unrolled pressures."""

    scene: Scene
    composition: Composition
    curve: Curve

    @property
    def motion(self) -> Motion:
        return self.composition.motion

    @cached_property
    def breaks(self) -> Array:
        """Angles of one period between which all forces are smooth on the scale of the pieces.

        Beside the pressure's breaks: with a rod hardly longer than its crank, tan(beta) peaks within
        sqrt(1 - sin^2(beta)) of the crank standing across; there the pieces halve toward the peak.
        """
        found = self.curve.breaks
        m = self.scene.mechanism
        sharp = math.sqrt(2.0 * (1.0 - (m.crank_radius + abs(m.offset)) / m.rod_length))
        if sharp > _SHARP:
            return found
        beside = sharp * 2.0 ** np.arange(math.ceil(math.log2(_SHARP / sharp)) + 2)
        across = (np.arange(-1, 2 * self.scene.cylinder.strokes + 2, 2) * (0.5 * math.pi))[:, None]
        places = np.concatenate([across - beside, across, across + beside], axis=1).ravel()
        return np.unique(np.concatenate([found, places[(places > found[0]) & (places < found[-1])]]))

    @property
    def angular_speed(self) -> float:
        return self.scene.mechanism.angular_speed

    def centrifugal(self, mass: float) -> float:
        """m r omega^2 [N]: outward along the crank, constant."""
        return mass * self.motion.crank_radius * self.angular_speed**2

    def torque(self, angle: Array) -> Array:
        """The torque alone [N m]."""
        at = self.motion.posture(angle)
        return self._torque(at, self._gas(self.curve.pressure(angle)))

    def torque_and_power(self, angle: Array) -> Array:
        """The torque [N m] and the power of the gas, (p - p_0) A dx/dt [W]: shape (2, n)."""
        at = self.motion.posture(angle)
        gas = self._gas(self.curve.pressure(angle))
        speed = self.motion.crank_radius * self.angular_speed * (at.sine + at.cosine * at.tangent)
        return np.stack([self._torque(at, gas), gas * speed])

    def _gas(self, pressure: Array) -> Array:
        cylinder = self.scene.cylinder
        return (pressure - cylinder.crankcase_pressure) * cylinder.area

    def _torque(self, at: Posture, gas: Array) -> Array:
        axial = gas
        for term in self.composition.axial:
            axial = axial + term.axial_force(self, at)
        side = axial * at.tangent
        for lateral in self.composition.lateral:
            side = side + lateral.side_force(self, at)
        return (axial * at.sine + side * at.cosine) * self.motion.crank_radius

    def forces(self, angle: Array) -> Forces:
        """Everything at the angles [rad]."""
        scene, motion, composition = self.scene, self.motion, self.composition
        at = motion.posture(angle)
        pressure = self.curve.pressure(angle)
        gas = self._gas(pressure)
        inertia, on_pin = np.zeros_like(gas), gas
        for term in composition.axial:
            inertia = inertia + term.axial_force(self, at)
            on_pin = on_pin + term.on_wrist_pin(self, at)
        axial = gas + inertia
        side = axial * at.tangent
        for lateral in composition.lateral:
            side = side + lateral.side_force(self, at)
        tangential, radial = axial * at.sine + side * at.cosine, axial * at.cosine - side * at.sine
        masses = scene.masses
        big_end = self.centrifugal(masses.rod.at_crank_pin)
        whole = self.centrifugal(masses.rotating(motion.crank_radius))
        return Forces(
            pressure=pressure,
            gas=gas,
            inertia=inertia,
            axial=axial,
            side=side,
            rod=np.copysign(np.hypot(axial, side), axial),
            tangential=tangential,
            radial=radial,
            torque=tangential * motion.crank_radius,
            wrist_pin_load=np.hypot(on_pin, side),
            crank_pin_load=np.hypot(tangential, radial - big_end),
            main_bearing_load=np.hypot(tangential, radial - whole),
        )
