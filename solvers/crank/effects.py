"""The selectable effects of a crank mechanism, and what leaving one out would change.

The main results, the maximum loads, the mean torque and the work between the extremes of the speed, are computed at
sampled angles with and without each effect, beside every combination of the others, so that the changes of several
omitted effects add up. The changes are estimates, checked over random machines, not proven bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.crank.cycle.forces import Cycle, Machine, forces_at, kinetic_energy
from solvers.crank.gas.unrolled_pressure import Unrolled, piece_of, pressure_of, wrapped
from solvers.crank.motion.slider_crank import angle_functions
from solvers.crank.scene import Scene
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel

_ANGLES_PER_STROKE = 60
_SAFETY = 1.25
"""Safety factor on changes, whose maxima lie between the sampled angles."""
_PHYSICAL = ("pin_offset", "reciprocating_inertia", "rod_inertia_couple")
"""The effects that change results."""
_RESULTS = 8


@dataclass(frozen=True)
class Situation:
    """A scene with what its effects change."""

    scene: Scene

    @cached_property
    def _curve(self) -> Unrolled:
        """The pressures with the offset."""
        return self.scene.pressure.unroll(self.scene.mechanism.motion, self.scene.cylinder)

    def cycle(self, effects: frozenset[str]) -> Cycle:
        """Return the cycle with the effects of these names. Raises InvalidInput for faulty pressures."""
        scene, curve = self.scene, self._curve
        if scene.mechanism.offset and "pin_offset" not in effects:
            curve = scene.pressure.unroll(scene.mechanism.motion_in_line, scene.cylinder)
        return Cycle(scene, effects, curve)

    @cached_property
    def changes(self) -> Array:
        """Maximum relative change of the results if each effect of ``_PHYSICAL`` is left out."""
        with_offset = in_line = self._results(frozenset(_PHYSICAL))
        if self.scene.mechanism.offset:
            try:
                in_line = self._results(frozenset(_PHYSICAL[1:]))
            except InvalidInput:  # without the offset the piston does not reach the diagram's volumes
                in_line = np.full_like(with_offset, np.inf)
        return _SAFETY * _changes(np.concatenate([in_line, with_offset]))

    def _results(self, effects: frozenset[str]) -> Array:
        cycle = self.cycle(effects)
        count = _ANGLES_PER_STROKE * self.scene.cylinder.strokes
        return _sampled_results(cycle.machine, cycle.curve, np.array(self.scene.engine.phases), count, cycle.peaks)


@kernel
def _sampled_results(machine: Machine, gas: Unrolled, phases: Array, count: int, peaks: Array) -> Array:
    """Return the main results from ``count`` equally spaced angles, (4, results): without inertia and couple, with the
    couple, with the inertia, with both. Forces are also taken at the ``peaks`` [rad] and in the middle between two.

    Of one cylinder the rod's maximum compression and tension, side force, loads of wrist pin, crank pin and bearing
    [N], and the mean torque [N m]; of those with these ``phases`` [rad] together the work between the extremes of the
    speed [J].
    """
    period, between = gas.breaks[-1] - gas.breaks[0], max(2 * peaks.size - 1, 0)
    found, torque, energy = np.zeros((4, _RESULTS)), np.empty(count), np.empty((4, count))
    found[:, :2] = -np.inf
    for i in range(-between, count):
        phi = gas.breaks[0] + (i + 0.5) * period / count
        if i < 0:
            phi = wrapped(0.5 * (peaks[(-1 - i) // 2] + peaks[-i // 2]), gas.breaks)
        k = piece_of(phi, gas.breaks)
        at = angle_functions(phi, machine.geometry)
        pressure = pressure_of(phi, at, k, gas)
        for n in range(4):
            inertia, couple = n // 2, n % 2
            active = Machine(
                machine.geometry, machine.speed, machine.area, machine.back_pressure, inertia * machine.reciprocating,
                inertia * machine.piston, couple * machine.defect, machine.big_end, machine.rotating,
            )  # fmt: skip
            f = forces_at(at, pressure, active)
            square = f.tangential * f.tangential
            found[n, 0], found[n, 1] = max(found[n, 0], f.rod), max(found[n, 1], -f.rod)
            found[n, 2] = max(found[n, 2], f.side * f.side)
            found[n, 3] = max(found[n, 3], f.wrist_pin_axial * f.wrist_pin_axial + f.side * f.side)
            found[n, 4] = max(found[n, 4], square + (f.radial - machine.big_end) ** 2)
            found[n, 5] = max(found[n, 5], square + (f.radial - machine.rotating) ** 2)
            if n == 0:
                torque[max(i, 0)] = f.tangential * machine.geometry.r
            energy[n, max(i, 0)] = kinetic_energy(at, active)
    found[:, 6] = torque.sum() / count
    surplus = (torque - found[0, 6]) * (period / count)
    gas_work = np.cumsum(surplus) - 0.5 * surplus
    for n in range(4):
        for result in range(2, 6):
            found[n, result] = np.sqrt(found[n, result])
        work = np.zeros(count)
        for phase in phases:
            whole = np.floor(phase * count / period)
            part, place = phase * count / period - whole, int(whole % count)
            before = gas_work[-1] - energy[n, -1]
            for i in range(count):
                here = gas_work[i] - energy[n, i]
                work[place] += here + part * (before - here)
                before, place = here, place + 1 if place + 1 < count else 0
        found[n, 7] = work.max() - work.min()
    return found


@kernel
def _changes(results: Array) -> Array:
    """Return the maximum relative change of the results (8, results) if one of three effects is left out; bit 2 - n of
    the first index tells whether effect n is active."""
    out = np.zeros(3)
    for n in range(3):
        for active in range(8):
            without = active & ~(4 >> n)
            rod = max(results[active, 0], results[active, 1])
            for i in range(_RESULTS if without != active else 0):
                change = abs(results[active, i] - results[without, i])
                if change > 0.0:
                    # Tension may be much smaller than compression.
                    out[n] = max(out[n], change / (rod if i < 2 else abs(results[active, i])))
    return out


@dataclass(frozen=True)
class CrankEffect:
    """An effect: its measure is what ``Situation`` finds."""

    name: str
    summary: str
    measure: str = "greatest relative change of loads, mean torque and work between the extremes of the speed"

    def influence(self, situation: Situation) -> float:
        if self.name in _PHYSICAL:
            return float(situation.changes[_PHYSICAL.index(self.name)])
        return 1.0 if len(situation.scene.engine.phases) > 1 else 0.0


EFFECTS = (
    CrankEffect("pin_offset", "the cylinder axis does not meet the shaft"),
    CrankEffect("reciprocating_inertia", "inertia of the piston group and the rod's upper share"),
    CrankEffect("rod_inertia_couple", "the moment of inertia by which the rod differs from its two masses"),
    CrankEffect(
        "engine",
        "several cylinders on one shaft: summed torque, unbalanced forces and couples",
        measure="1 where there are several cylinders: its results exist only when it runs",
    ),
)
"""All effects: motion, forces, cylinders."""
