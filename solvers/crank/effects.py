"""The selectable effects of a crank mechanism, each with an a-priori bound of its influence.

The bounds compare closed forms with the effect of the gas alone at sampled angles of the cycle; they are
conservative by test over random machines, not by proof. They refer to the maximum forces (including the rod's
tension), the mean torque and the work between the extremes of the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from solvers.crank.cycle.forces import Composition, Cycle, Machine, instant
from solvers.crank.gas.unrolled_pressure import Unrolled, wrapped
from solvers.crank.scene import Scene
from solvers.effects import AUTO, Choice, Effect, EffectSelection, choose
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_ANGLES_PER_REVOLUTION = 128
"""Sampled angles per revolution; a sampled maximum is a lower estimate, which makes the bounds conservative."""

_CAPTURED_FRACTION = 0.9
"""Assumed lower bound of the fraction of the work fluctuation captured by sums over the sampled angles."""


class ReferenceLoads(NamedTuple):
    """Loads without an effect, from sampled angles of the cycle: the reference for its relative influence.

    Maximum magnitude of the gas force [N]; minimum of the maximum loads on rod, crank pin and main bearings [N];
    maximum magnitude of the side force [N]; magnitude of one cylinder's mean torque [N m]; work between the extremes
    of the speed, all cylinders together [J].
    """

    gas_force: float
    minimum_load: float
    side_force: float
    mean_torque: float
    work_fluctuation: float

    def relative_change(self, load: float, side: float, work: float) -> float:
        """Return the maximum relative change by an effect that adds at most these amounts to the three quantities."""
        return max(
            _relative_change(load, self.minimum_load),
            _relative_change(side, self.side_force),
            _relative_change(work, self.work_fluctuation),
        )


@kernel
def _reference_loads(machine: Machine, gas: Unrolled, phases: Array, count: int) -> ReferenceLoads:
    """Loads of one cylinder, and the work fluctuation of all with these ``phases`` [rad], at ``count`` angles."""
    period, last = gas.breaks[-1] - gas.breaks[0], gas.stroke.size - 1
    torque, k = np.empty(count), 0
    force = side = rod = crank_pin = bearing = mean = 0.0
    for i in range(count):
        phi = wrapped((i + 0.5) * period / count, gas.breaks)
        if phi < gas.breaks[k]:
            k = 0
        while k < last and gas.breaks[k + 1] <= phi:
            k += 1
        at = instant(phi, k, machine, gas)
        axial, square = at.gas + at.inertia, at.tangential * at.tangential
        force, side = max(force, abs(at.gas)), max(side, abs(at.side))
        rod = max(rod, axial * axial + at.side * at.side)
        crank_pin = max(crank_pin, square + (at.radial - machine.big_end) ** 2)
        bearing = max(bearing, square + (at.radial - machine.rotating) ** 2)
        torque[i] = at.tangential * machine.geometry.r
        mean += torque[i] / count
    surplus = np.full(count, -mean * phases.size)
    for phase in phases:
        # The other cylinders' torque, interpolated between the sampled angles of the first.
        position = (-phase * count / period) % count
        weight, low = position - math.floor(position), math.floor(position) % count
        for i in range(count):
            high = low + 1 if low + 1 < count else 0
            surplus[i] += (1.0 - weight) * torque[low] + weight * torque[high]
            low = high
    work = least = greatest = 0.0
    for i in range(count):
        work += surplus[i]
        least, greatest = min(least, work), max(greatest, work)
    swing = _CAPTURED_FRACTION * (greatest - least) * period / count
    return ReferenceLoads(force, math.sqrt(min(rod, crank_pin, bearing)), side, abs(mean), swing)


@dataclass(frozen=True)
class Situation:
    """A scene with its pressures, its reference loads without individual effects, and its maximum rod angle.

    Effects may cancel, above all inertia and gas: an effect is compared with the smallest load it may combine with.
    """

    scene: Scene
    curve: Unrolled

    @cached_property
    def gas(self) -> ReferenceLoads:
        """The gas alone, in line."""
        return self._reference_loads(False, False)

    @cached_property
    def in_line(self) -> tuple[ReferenceLoads, ...]:
        """Without an offset: the gas alone, and with the reciprocating inertia."""
        return self.gas, self._reference_loads(False, True)

    @cached_property
    def without_inertia(self) -> tuple[ReferenceLoads, ...]:
        """The gas alone, in line and with the offset."""
        return (self.gas, self._reference_loads(True, False)) if self.scene.mechanism.offset else (self.gas,)

    @cached_property
    def all_references(self) -> tuple[ReferenceLoads, ...]:
        """All reference loads."""
        both = (self._reference_loads(True, True),) if self.scene.mechanism.offset else ()
        return (*self.in_line, *self.without_inertia[1:], *both)

    def _reference_loads(self, offset: bool, inertia: bool) -> ReferenceLoads:
        scene, composition = self.scene, Composition()
        composition = PinOffset().join(composition, scene) if offset else composition
        composition = ReciprocatingInertia().join(composition, scene) if inertia else composition
        machine = Cycle(scene, composition, self.curve).machine
        count = _ANGLES_PER_REVOLUTION * scene.cylinder.strokes // 2
        return _reference_loads(machine, self.curve, np.array(scene.engine.phases), count)

    @property
    def cylinders(self) -> int:
        return len(self.scene.engine.phases)

    @property
    def ratio(self) -> float:
        m = self.scene.mechanism
        return m.crank_radius / m.rod_length

    @property
    def acceleration(self) -> float:
        """r omega^2 [m/s2]."""
        m = self.scene.mechanism
        return m.crank_radius * m.angular_speed**2

    @property
    def min_rod_cosine(self) -> float:
        """cos(beta) at the maximum rod angle."""
        m = self.scene.mechanism
        sine = (m.crank_radius + abs(m.offset)) / m.rod_length
        return math.sqrt((1.0 - sine) * (1.0 + sine))

    @property
    def max_rod_tangent(self) -> float:
        """tan(beta) at the maximum rod angle."""
        return math.sqrt(1.0 / self.min_rod_cosine**2 - 1.0)


class CrankEffect(Effect[Situation], Protocol):
    """An effect, and its contribution to the composition."""

    def join(self, composition: Composition, scene: Scene) -> Composition:
        """Return the composition with this effect added."""


def _relative_change(part: float, whole: float) -> float:
    """part/(whole - part): a change relative to the changed value; inf if the two may cancel."""
    return part / (whole - part) if part < whole else (0.0 if part == 0 else math.inf)


@dataclass(frozen=True)
class ReciprocatingInertia:
    """P_j = -m_j a on the mechanism, of which the wrist pin carries the piston group's share -m_p a."""

    name: str = "reciprocating_inertia"
    summary: str = "inertia of the piston group and the rod's upper share"
    measure: str = (
        "m_j r omega^2 (1 + lambda)/cos^3(beta) against loads and side force of the gas, m_j v^2/2 against its work"
    )

    def influence(self, situation: Situation) -> float:
        mass, cosine = situation.scene.masses.reciprocating, situation.min_rod_cosine
        force = mass * situation.acceleration * (1.0 + situation.ratio) / cosine**3
        m = situation.scene.mechanism
        energy = 0.5 * mass * (m.crank_radius * m.angular_speed / cosine) ** 2
        side = force * situation.max_rod_tangent
        return max(
            reference.relative_change(force / cosine, side, situation.cylinders * energy)
            for reference in situation.without_inertia
        )

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, reciprocating=scene.masses.reciprocating, piston=scene.masses.piston)


@dataclass(frozen=True)
class RodInertiaCouple:
    """The rod's true moment of inertia: a couple Delta J beta'' in addition to the two-mass model.

    The balancing pair of forces, Delta J beta''/(L cos beta) at piston and crank pin, does no net work: its torque
    is the derivative of Delta J beta'^2/2, the excess kinetic energy of the two-mass model.
    """

    name: str = "rod_inertia_couple"
    summary: str = "the moment of inertia by which the rod differs from its two masses"
    measure: str = (
        "|Delta J| beta''/(L cos beta) against loads and side force of the gas, its energy against their work"
    )

    def influence(self, situation: Situation) -> float:
        scene, rod = situation.scene, situation.min_rod_cosine
        turning = situation.ratio * (1.0 + situation.ratio / rod**2) / rod * scene.mechanism.angular_speed**2
        defect = abs(scene.masses.rod.inertia_defect)
        force = defect * turning / (scene.mechanism.rod_length * rod)
        energy = 0.5 * defect * (situation.ratio * scene.mechanism.angular_speed) ** 2
        return max(
            reference.relative_change(force, force, situation.cylinders * energy)
            for reference in situation.all_references
        )

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, inertia_defect=scene.masses.rod.inertia_defect)


@dataclass(frozen=True)
class PinOffset:
    name: str = "pin_offset"
    summary: str = "the cylinder axis does not meet the shaft"
    measure: str = (
        "2 |e|/r, and |e|/(L cos^3 beta) of gas and inertia against side force, loads, torque and work of the gas"
    )

    def influence(self, situation: Situation) -> float:
        m, masses = situation.scene.mechanism, situation.scene.masses
        if m.offset == 0.0:
            return 0.0
        side_factor = abs(m.offset) / (m.rod_length * situation.min_rod_cosine**3)
        force = situation.gas.gas_force + (1.0 + 3.0 * situation.ratio) * masses.reciprocating * situation.acceleration
        side_load, work = force * side_factor, situation.cylinders * force * side_factor * m.crank_radius * math.pi
        return max(
            2.0 * _relative_change(abs(m.offset), m.crank_radius),
            _relative_change(situation.gas.gas_force * side_factor * m.crank_radius, situation.gas.mean_torque),
            *(reference.relative_change(side_load, side_load, work) for reference in situation.in_line),
        )

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, offset=scene.mechanism.offset)


@dataclass(frozen=True)
class SeveralCylinders:
    """Summed torque, unbalance and speed fluctuation, which are results of this effect only."""

    name: str = "engine"
    summary: str = "several cylinders on one shaft: summed torque, unbalanced forces and couples"
    measure: str = "1 where there are several cylinders: its results exist only when it runs"

    def influence(self, situation: Situation) -> float:
        return 1.0 if len(situation.scene.engine.phases) > 1 else 0.0

    def join(self, composition: Composition, scene: Scene) -> Composition:
        return replace(composition, engine=scene.engine)


EFFECTS: tuple[CrankEffect, ...] = (PinOffset(), ReciprocatingInertia(), RodInertiaCouple(), SeveralCylinders())
"""All effects, in the order in which they are composed: motion, forces, cylinders."""


def choose_for(
    scene: Scene,
    curve: Unrolled,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
) -> Choice[CrankEffect]:
    """Select the effects for a scene (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation(scene, curve), selection, tolerance)


def compose(choice: Choice[CrankEffect], scene: Scene) -> Composition:
    """Return the physics of the selected effects, in addition to the gas force in an in-line mechanism."""
    composition = Composition()
    for effect in choice.active:
        composition = effect.join(composition, scene)
    return composition
