"""A scene with its strip as input of the influence estimates: one revolution with every closed-form effect."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.fatigue import serensen
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.composition import BEAM_COLUMN, strip_of
from solvers.rod.cycle.state import FORCE, MOMENT, ROWS, SIDE, Strip, fill_states
from solvers.rod.effect_bounds.corrected import Corrected, change_beside, corrected
from solvers.rod.effect_bounds.inertia import FOLLOWED, NODES, SIGNED, Inert
from solvers.rod.effect_bounds.main_results import (
    MASS,
    SHEARING,
    Judged,
    Judging,
    changes_without,
    judge_turn,
    without_part,
)
from solvers.rod.effect_bounds.sampling import Sampling, Sharp, even_angles, sharp_angles, with_sharp
from solvers.rod.load.axial_force import Drive, drive_of
from solvers.rod.piston.friction import travel
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import coupling_of
from solvers.rod.strip.elastica_kernels import Collocation, collocation, nodes_for
from solvers.rod.strip.shear import critical_coupling

Array = NDArray[np.float64]

_EVEN, _MAX_EVEN, _MAX_EVEN_IF_SHARP = 128, 1024, 4096
"""Initial and maximum number of uniform angles; doubled until the reactions are resolved."""

_LEAST = 1e-3
"""Change by inertia from which the motion is worth more angles where the load is sharp."""

_APART, _APART_IF_SHARP = 1e-2, 1e-3
"""Change by corrections up to which they and other effects are judged one by one, for smooth and for sharp loads."""

_MAX_EXCITED = 25.0
"""Pace of the first mode, relative to the revolution's sharpness, above which smooth loads do not excite it."""

_FEWER_NODES = 12
"""Of large displacement than for full precision."""

_MAX_SECOND_DIFFERENCE = 0.03
"""Second difference of a reaction at uniform angles, relative to its maximum, up to which it is resolved."""


@kernel
def _states(drive: Drive, strip: Strip, angle: Array, even: int) -> tuple[Array, Array, float, float]:
    """The states at the angles, |dx/dphi| [m], and the maximum second differences of the reactions at the uniform
    angles and at every other one, relative to their maxima."""
    states, moved = np.empty((ROWS, angle.size)), np.empty(angle.size)
    fill_states(drive, strip, angle, states)
    for i in range(angle.size):
        moved[i] = drive.crank_radius * travel(drive.crank_radius / drive.rod_length, angle[i])
    bent, thinned = 0.0, 0.0
    for row in (SIDE, MOMENT):
        reaction, most, once, twice = states[row], 0.0, 0.0, 0.0
        for i in range(even):
            most = max(most, abs(reaction[i]))
            once = max(once, abs(reaction[i - 1 if i > 0 else even - 1] - 2.0 * reaction[i] + reaction[(i + 1) % even]))
            twice = max(twice, abs(reaction[(i - 2) % even] - 2.0 * reaction[i] + reaction[(i + 2) % even]))
        if most > 0.0:
            bent, thinned = max(bent, once / most), max(thinned, twice / most)
    return states, moved, bent, thinned


@dataclass(frozen=True)
class Turn:
    """A sampled revolution of a strip: P_cr [N], the states (``cycle.state``) at all angles, and at those ``seen`` by
    the results, whose parameters are ``judging``: of a smooth load every ``step``-th one, if these resolve it.

    ``sharpness`` is the square root of the ratio of the reactions' maximum second derivative to their maximum.
    """

    sampling: Sampling
    drive: Drive
    strip: Strip
    critical: float
    sharpness: float
    states: Array
    step: int
    seen: Array
    judging: Judging

    @cached_property
    def judged(self) -> Judged:
        """The main results."""
        return judge_turn(self.judging, self.drive, self.strip, self.seen, self.critical)

    @cached_property
    def tables(self) -> Collocation:
        """Those of large displacement, which is smooth: fewer nodes suffice than for full precision."""
        force, per_force = self.states[FORCE], self.strip.length**2 / self.strip.stiffness
        return collocation(nodes_for(float(force.min()) * per_force, float(force.max()) * per_force) - _FEWER_NODES)

    @property
    def smooth(self) -> bool:
        return self.sampling.even == self.sampling.angle.size

    @property
    def stands(self) -> bool:
        return float(self.states[FORCE].min()) > -self.critical


def _finer(turn: Turn, found: Corrected) -> int | None:
    """How many uniform angles the first mode asks for, if more than there are; None where no number up to the greatest
    is enough, or where that mode hardly moves.

    Smooth loads hardly make it ring, so that its excitation is to be resolved. Corners and jumps do, and only where its
    motion is resolved the phases count of what they excite; else its amplitudes are added up.
    """
    even, turns = turn.sampling.even, found.pace * TURN
    if turn.smooth:
        excited = FOLLOWED * even <= turns and found.pace <= _MAX_EXCITED * turn.sharpness
        return 2 * even if excited and 2 * even <= _MAX_EVEN else None
    wanted = turns / SIGNED
    if not even < wanted <= _MAX_EVEN_IF_SHARP or found.by_inertia < _LEAST:
        return None
    return 2 ** math.ceil(math.log2(wanted))


@dataclass(frozen=True)
class Situation:
    """A scene with its strip; derived quantities are computed on first use.

    ``excluded``: effects that are left out regardless of their influence.
    """

    scene: Scene
    dimensions: Dimensions
    excluded: frozenset[str] = frozenset()

    @cached_property
    def drive(self) -> Drive:
        """Gas load and all inertia."""
        return drive_of(self.scene, self.scene.piston.reciprocating_mass)

    @cached_property
    def sharp(self) -> Sharp:
        """Where the load is sharp."""
        return sharp_angles(self.scene.load, self.drive)

    @cached_property
    def strip(self) -> Strip:
        """The strip with every closed-form effect: coupling, shear, friction feedback."""
        friction = self.scene.piston.friction_coefficient
        return strip_of(self.scene, self.dimensions, BEAM_COLUMN.with_shear(), friction)

    @cached_property
    def in_plane(self) -> float:
        """P_cr [N] of bending in the crank's plane, rigid in shear."""
        return -self.strip.stiffness * coupling_of(self.dimensions.l, self.scene.mechanism.rod_length)

    @property
    def critical(self) -> float:
        """P_cr [N] about the weaker axis, rigid in shear."""
        return self.in_plane * min(1.0, (self.dimensions.b / self.dimensions.h) ** 2)

    @property
    def critical_with_shear(self) -> float:
        """P_cr [N] about the weaker axis, bending in the crank's plane with shear."""
        strip = self.strip
        coupling = critical_coupling(strip.length, strip.rod_length, strip.compliance)
        return min(self.critical, -strip.stiffness * coupling)

    @cached_property
    def turn(self) -> Turn:
        """The revolution with every closed-form effect."""
        return self._resolved(self.drive, self.strip)

    @cached_property
    def upright(self) -> Turn | None:
        """The revolution by which shape corrections are judged.

        If the strip buckles in ``turn``, the revolution without friction and mass, provided that they are excluded.
        None if it still buckles: only forces are then defined, and no shape correction changes them.
        """
        if self.turn.stands:
            return self.turn
        drive = self.drive._replace(mass=0.0) if "reciprocating_inertia" in self.excluded else self.drive
        strip = self.strip._replace(friction=0.0) if "friction_feedback" in self.excluded else self.strip
        turn = self._resolved(drive, strip)
        return turn if turn.stands else None

    @cached_property
    def without(self) -> Array:
        """Maximum relative changes of the forces and of the shape without each part, (PARTS, 2), beside no
        corrections."""
        turn, still = self.turn, self.drive._replace(mass=0.0)
        return changes_without(turn.judging, turn.drive, still, turn.strip, turn.critical, self.critical, turn.judged)

    @cached_property
    def inert(self) -> Inert:
        """What the strip's inertia depends on."""
        d, material = self.dimensions, self.scene.material
        line_mass = material.density * d.b * d.h * self.scene.mechanism.angular_speed**2
        return Inert(line_mass, material.loss_factor, self.in_plane)

    @property
    def corrected(self) -> Corrected | None:
        """The corrections of the revolution; None if the strip buckles."""
        return self._corrections[1] if self._corrections else None

    @cached_property
    def _corrections(self) -> tuple[Turn, Corrected] | None:
        """They, and the revolution they belong to: at as many angles as resolve the first mode."""
        turn = self.upright
        while turn is not None:
            found = corrected(
                turn.judging, turn.strip, turn.seen, turn.judged, turn.states, turn.sampling, turn.step, self.inert,
                collocation(NODES), turn.tables, _APART if turn.smooth else _APART_IF_SHARP,
            )  # fmt: skip
            finer = _finer(turn, found)
            if finer is None:
                return turn, found
            turn = self._resolved(turn.drive, turn.strip, finer)
        return None

    def changes_without(self, part: int) -> tuple[float, float]:
        """Maximum relative changes of the forces and of the shape without a part (``main_results.PARTS``), beside the
        corrections if these are large."""
        if not self.turn.stands or not self.corrected or not self.corrected.interact:
            forces, shape = self.without[part].tolist()
            return forces, shape
        turn, found = self._corrections
        drive = turn.drive._replace(mass=0.0) if part == MASS else turn.drive
        strip = without_part(turn.strip, part)
        if drive.mass == turn.drive.mass and strip == turn.strip:
            return 0.0, 0.0
        critical = self.critical if part == SHEARING else turn.critical
        return change_beside(
            turn.judging, turn.sampling, turn.step, self.inert, collocation(NODES), turn.tables, found, drive, strip,
            critical,
        )  # fmt: skip

    def _resolved(self, drive: Drive, strip: Strip, even: int = _EVEN) -> Turn:
        sharp = self.sharp.ends.size > 0
        while True:
            sampling = with_sharp(even, self.sharp) if sharp else even_angles(even)
            states, moved, bent, thinned = _states(drive, strip, sampling.angle, even)
            step = 2 if thinned <= _MAX_SECOND_DIFFERENCE and not sharp else 1
            judging, seen = self._judging(sampling, moved, step), np.ascontiguousarray(states[:, ::step])
            sharpness = math.sqrt(bent) * even / TURN
            turn = Turn(sampling, drive, strip, self.critical_with_shear, sharpness, states, step, seen, judging)
            if sharp or not bent > _MAX_SECOND_DIFFERENCE or even >= _MAX_EVEN or not turn.stands:
                return turn
            even *= 2 if bent <= 4.0 * _MAX_SECOND_DIFFERENCE else 4

    def _judging(self, sampling: Sampling, moved: Array, step: int) -> Judging:
        d, piston, material = self.dimensions, self.scene.piston, self.scene.material
        share = step * sampling.share[::step]
        return Judging(
            sampling.angle[::step].copy(),
            share,
            share * moved[::step],
            self.strip.lever,
            piston.clamp_offset,
            4.0 / math.pi * piston.friction_coefficient,
            1.0 / (d.b * d.h),
            0.5 * material.elastic_modulus * d.h,
            *serensen(material).diagram(),
            self.in_plane,
        )
