"""A scene with its strip as input of the influence estimates: one revolution with every closed-form effect."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.fatigue import serensen
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.cycle.composition import Composition, strip_of
from solvers.rod.cycle.state import FORCE, MOMENT, SIDE, Strip, least_critical_force, states_of
from solvers.rod.influences.corrected import CorrectedRevolution, change_with_corrections, corrected_revolution
from solvers.rod.influences.inertia import MAX_PHASE_FOR_EXCITATION, MAX_PHASE_FOR_SIGN, NODES, InertiaParameters
from solvers.rod.influences.main_results import (
    RECIPROCATING_MASS,
    SHEAR_FLEXIBILITY,
    MainResults,
    ResultParameters,
    changes_without,
    evaluate_linear,
    without_part,
)
from solvers.rod.influences.sampled_angles import Sampling, SharpAngles, sharp_angles, uniform_angles, with_sharp_angles
from solvers.rod.load.axial_force import Drive, drive_of
from solvers.rod.piston.friction import travel
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.buckling import critical_coupling
from solvers.rod.strip.elastica_kernels import Collocation, collocation, nodes_for
from solvers.rod.vibration.natural_frequencies import all_polynomials

_UNIFORM, _MAX_UNIFORM, _MAX_UNIFORM_IF_SHARP = 128, 1024, 4096
"""Initial and maximum numbers of uniform angles; the number is doubled until the reactions are resolved."""

_MIN_CHANGE = 1e-3
"""Change by inertia from which more angles for the motion are worth their time if the load is sharp."""

_MAX_INDEPENDENT, _MAX_INDEPENDENT_IF_SHARP = 1e-2, 1e-3
"""Change by corrections up to which their influence and that of other effects are independent, for smooth and for sharp
loads."""

_MAX_EXCITED_FREQUENCY = 25.0
"""Natural frequency of the first mode, relative to the revolution's sharpness, above which smooth loads do not excite
it."""

_FEWER_NODES = 12
"""Number of nodes for large displacement saved in comparison with full precision."""

_MAX_SECOND_DIFFERENCE = 0.03
"""Second difference of a reaction at uniform angles, relative to its maximum, up to which it is resolved."""


@kernel
def _states(drive: Drive, strip: Strip, angle: Array, count: int) -> tuple[Array, Array, float, float]:
    """Return the states at the angles, |dx/dphi| [m], and the maximum second differences of the reactions at the
    uniform angles and at every other one, relative to their maxima."""
    states, piston_travel = states_of(drive, strip, angle), np.empty(angle.size)
    for i in range(angle.size):
        piston_travel[i] = drive.crank_radius * travel(drive.crank_radius / drive.rod_length, angle[i])
    second_difference, thinned_difference = 0.0, 0.0
    for row in (SIDE, MOMENT):
        reaction, most, once, twice = states[row], 0.0, 0.0, 0.0
        for i in range(count):
            before, after = reaction[i - 1 if i > 0 else count - 1], reaction[(i + 1) % count]
            most = max(most, abs(reaction[i]))
            once = max(once, abs(before - 2.0 * reaction[i] + after))
            twice = max(twice, abs(reaction[(i - 2) % count] - 2.0 * reaction[i] + reaction[(i + 2) % count]))
        if most > 0.0:
            second_difference = max(second_difference, once / most)
            thinned_difference = max(thinned_difference, twice / most)
    return states, piston_travel, second_difference, thinned_difference


@dataclass(frozen=True)
class Revolution:
    """A sampled revolution of a strip: P_cr [N], the states (``cycle.state``) at all angles, and at those of the
    results, whose ``parameters`` it holds. For a smooth load these are every ``step``-th angle, if that resolves the
    results.

    ``sharpness`` is the square root of the ratio of the reactions' maximum second derivative to their maximum.
    """

    sampling: Sampling
    drive: Drive
    strip: Strip
    critical: float
    sharpness: float
    states: Array
    step: int
    result_states: Array
    parameters: ResultParameters

    @cached_property
    def results(self) -> MainResults:
        """The main results."""
        return evaluate_linear(self.parameters, self.drive, self.strip, self.result_states, self.critical)

    @cached_property
    def tables(self) -> Collocation:
        """Collocation tables for large displacement, which is smooth: fewer nodes suffice than for full precision."""
        force, per_force = self.states[FORCE], self.strip.length**2 / self.strip.stiffness
        return collocation(nodes_for(float(force.min()) * per_force, float(force.max()) * per_force) - _FEWER_NODES)

    @property
    def smooth(self) -> bool:
        return self.sampling.uniform == self.sampling.angle.size

    @property
    def is_stable(self) -> bool:
        return float(self.states[FORCE].min()) > -self.critical


def _finer_count(revolution: Revolution, found: CorrectedRevolution) -> int | None:
    """Return the number of uniform angles required by the first mode if it exceeds the present one; None if no
    admissible number suffices or the mode's motion is negligible.

    A smooth load excites little ringing, but the excitation must be resolved. Ringing after corners and jumps has known
    phases only if the mode's motion is resolved; otherwise the amplitudes are added.
    """
    uniform, phase = revolution.sampling.uniform, found.frequency * TURN
    if revolution.smooth:
        resolved = MAX_PHASE_FOR_EXCITATION * uniform > phase
        max_frequency = _MAX_EXCITED_FREQUENCY * revolution.sharpness
        is_excited = not resolved and found.frequency <= max_frequency
        return 2 * uniform if is_excited and 2 * uniform <= _MAX_UNIFORM else None
    required = phase / MAX_PHASE_FOR_SIGN
    if not uniform < required <= _MAX_UNIFORM_IF_SHARP or found.by_inertia < _MIN_CHANGE:
        return None
    return 2 ** math.ceil(math.log2(required))


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
    def sharp(self) -> SharpAngles:
        """Angles at which the load is sharp."""
        return sharp_angles(self.scene.load, self.drive)

    @cached_property
    def strip(self) -> Strip:
        """The strip with every closed-form effect: coupling, shear, friction feedback."""
        return strip_of(self.scene, self.dimensions, Composition(couples=True, shears=True, feedback=True))

    @cached_property
    def in_plane_critical(self) -> float:
        """P_cr [N] of bending in the crank's plane, rigid in shear."""
        return -self.strip.stiffness * critical_coupling(self.dimensions.l, self.scene.mechanism.rod_length)

    @property
    def critical(self) -> float:
        """P_cr [N] about the weaker axis, rigid in shear."""
        return self.strip.critical

    @cached_property
    def revolution(self) -> Revolution:
        """The revolution with every closed-form effect."""
        return self._resolved(self.drive, self.strip)

    @cached_property
    def stable_revolution(self) -> Revolution | None:
        """The revolution for shape corrections: ``revolution`` if the strip is stable in it, otherwise the one without
        friction and mass, provided that these are excluded.

        None if the strip still buckles: only forces are then defined, and no shape correction changes them.
        """
        if self.revolution.is_stable:
            return self.revolution
        drive = self.drive._replace(mass=0.0) if "reciprocating_inertia" in self.excluded else self.drive
        strip = self.strip._replace(friction=0.0) if "friction_feedback" in self.excluded else self.strip
        revolution = self._resolved(drive, strip)
        return revolution if revolution.is_stable else None

    @cached_property
    def uncorrected_changes(self) -> Array:
        """Maximum relative changes of the forces and of the shape without each part, (PARTS, 2), in a revolution
        without corrections."""
        full, massless_drive = self.revolution, self.drive._replace(mass=0.0)
        return changes_without(
            full.parameters, full.drive, massless_drive, full.strip, full.critical, self.critical, full.results
        )

    @cached_property
    def inertia(self) -> InertiaParameters:
        """Parameters of the strip's inertia."""
        inertia = self.strip.line_mass * self.scene.mechanism.angular_speed**2
        return InertiaParameters(inertia, self.scene.material.loss_factor, all_polynomials())

    @property
    def corrected(self) -> CorrectedRevolution | None:
        """The corrections of the revolution; None if the strip buckles."""
        return self._corrections[1] if self._corrections else None

    @cached_property
    def _corrections(self) -> tuple[Revolution, CorrectedRevolution] | None:
        """The corrected revolution, preceded by the revolution it belongs to, which has enough angles to resolve the
        first mode."""
        revolution = self.stable_revolution
        while revolution is not None:
            max_independent = _MAX_INDEPENDENT if revolution.smooth else _MAX_INDEPENDENT_IF_SHARP
            found = corrected_revolution(
                revolution.parameters, revolution.strip, revolution.result_states, revolution.results,
                revolution.states, revolution.sampling, revolution.step, self.inertia, collocation(NODES),
                revolution.tables, max_independent,
            )  # fmt: skip
            count = _finer_count(revolution, found)
            if count is None:
                return revolution, found
            revolution = self._resolved(revolution.drive, revolution.strip, count)
        return None

    def changes_without(self, part: int) -> tuple[float, float]:
        """Maximum relative changes of the forces and of the shape without a part (``main_results.PARTS``), including
        the changes of large corrections."""
        if not self.revolution.is_stable or not self.corrected or not self.corrected.interact:
            forces, shape = self.uncorrected_changes[part].tolist()
            return forces, shape
        full, found = self._corrections
        drive = full.drive._replace(mass=0.0) if part == RECIPROCATING_MASS else full.drive
        strip = without_part(full.strip, part)
        if drive.mass == full.drive.mass and strip == full.strip:
            return 0.0, 0.0
        critical = self.critical if part == SHEAR_FLEXIBILITY else full.critical
        return change_with_corrections(
            full.parameters, full.sampling, full.step, self.inertia, collocation(NODES), full.tables, found, drive,
            strip, critical,
        )  # fmt: skip

    def _resolved(self, drive: Drive, strip: Strip, count: int = _UNIFORM) -> Revolution:
        sharp = self.sharp.ends.size > 0
        while True:
            sampling = with_sharp_angles(count, self.sharp) if sharp else uniform_angles(count)
            states, piston_travel, second_difference, thinned_difference = _states(drive, strip, sampling.angle, count)
            step = 2 if thinned_difference <= _MAX_SECOND_DIFFERENCE and not sharp else 1
            parameters = self._result_parameters(sampling, piston_travel, step)
            result_states = np.ascontiguousarray(states[:, ::step])
            sharpness = math.sqrt(second_difference) * count / TURN
            critical = least_critical_force(self.strip)
            revolution = Revolution(
                sampling, drive, strip, critical, sharpness, states, step, result_states, parameters
            )
            resolved = sharp or not second_difference > _MAX_SECOND_DIFFERENCE
            if resolved or count >= _MAX_UNIFORM or not revolution.is_stable:
                return revolution
            count *= 2 if second_difference <= 4.0 * _MAX_SECOND_DIFFERENCE else 4

    def _result_parameters(self, sampling: Sampling, piston_travel: Array, step: int) -> ResultParameters:
        weight = step * sampling.weight[::step]
        return ResultParameters(
            sampling.angle[::step].copy(),
            weight,
            weight * piston_travel[::step],
            4.0 / math.pi * self.scene.piston.friction_coefficient,
            *serensen(self.scene.material).diagram(),
            self.in_plane_critical,
        )
