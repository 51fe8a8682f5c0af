"""The full model of a strip for the search: peaks, rows near them, and the exact check.

A design evaluates all effects beyond the core's physics through ``FullModel``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from solvers.effects import Choice
from solvers.fatigue import FatigueCriterion
from solvers.numerics.arrays import Array
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck, check_chosen, tolerance_of
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.effects import RodEffect, compose
from solvers.rod.optimum.full_model.corrections import (
    ALL_CURVATURES,
    RATIO_CURVATURE,
    CorrectionPolynomial,
    Stencil,
)
from solvers.rod.optimum.full_model.frequency_ratio import is_stable
from solvers.rod.optimum.full_model.rows_at_peaks import RowsAtPeaks
from solvers.rod.optimum.full_model.smooth_parts import Parts
from solvers.rod.optimum.full_model.strip import FullStrip, dimensions_of, logarithms
from solvers.rod.optimum.peaks import ANGLE_STEP, Peaks, RequiredResults, compression_peaks, find_peaks, stencils
from solvers.rod.optimum.sqp import ALL
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.adiabatic_response import AdiabaticRodInertia
from solvers.rod.vibration.excitation import FEW_CORNERS
from solvers.rod.vibration.steady_response import RodInertia
from solvers.watch import no_watch

_STEP = 1e-6
"""Step of differences of closed forms, in ln b, ln h, ln l."""
_CHECK_SHARE, _MIN_CHECK_ACCURACY = 0.7, 1e-12
"""Share of the accuracy that is requested of a check, the rest being left to the search; and the smallest accuracy
requested."""
_SAME_RESOLUTION = 0.1
"""Distance in ln b, ln h, ln l within which strips need about the same discretisation."""
_SMOOTH_LOSS_FACTOR = 0.003
"""Loss factor above which results vary smoothly between resonances."""
_SMOOTH_ANGLE_STEP = 3e-4
"""Spacing of a peak's three angles without corrections, whose time meshes are the noise that longer spacings average
out. Two peaks closer than a cluster are one part: a parabola a little beside the higher one overestimates it by the
square of its spacing."""
_MIN_RADIUS = 1e-7
"""Trust-region radius in ln b, ln h, ln l at which a search without resonances ends."""
_MAX_STRIPS, _MAX_STENCILS = 64, 3
"""Numbers of strips and stencils that are stored."""
_UNRESOLVED_SHARE = 0.3
"""Share of a check's error within the accuracy that a gain has to exceed."""


class Fidelity(NamedTuple):
    """How finely a model resolves the corrections of strips, whose time meshes vary between strips.

    correction_step    step of their differences, in ln b, ln h, ln l: long steps smooth out narrow minima, short ones
                       resolve them
    angle_step         spacing [rad] of the three angles whose parabola represents a peak: small where corners of the
                       friction force may lie close to peaks
    min_radius         trust-region radius in ln b, ln h, ln l at which a search with resonances ends
    shares_meshes      whether a strip is solved with the discretisation found for another near it
    """

    correction_step: float
    angle_step: float
    min_radius: float
    shares_meshes: bool


EXPLORATORY = Fidelity(2e-3, ANGLE_STEP, 5e-4, True)
FINE = Fidelity(1e-4, 1e-3, 1e-5, False)
"""Of the searches over gaps between resonances, and of the last ones, which refine their results."""


@dataclass
class FullModel:
    """The physics selected for a scene, with fatigue criterion, required results and accuracy.

    choice          the active effects
    free            indices of the continuous sizes
    strip_count     number of strips evaluated by rows
    fidelity        how finely corrections are resolved
    stencil_model   a less accurate model whose strips supply the differences of corrections between strips, if any:
                    differences between strips of one discretisation are equally accurate
    adiabatic       whether vibration is solved in adiabatic modes
    power           whether checks include the friction power
    watch           is called before each strip and check and may raise OutOfTime
    """

    scene: Scene
    choice: Choice[RodEffect]
    criterion: FatigueCriterion
    accuracy: float
    required: RequiredResults
    free: tuple[int, ...] = (0, 1, 2)
    watch: Callable[[], None] = no_watch
    fidelity: Fidelity = EXPLORATORY
    stencil_model: FullModel | None = None
    adiabatic: bool = False
    power: bool = True
    strip_count: int = 0
    _strips: dict[Dimensions, FullStrip] = field(default_factory=dict)
    _checks: dict[Dimensions, Outcome[RodCheck]] = field(default_factory=dict)
    _stencils: list[Stencil] = field(default_factory=list)
    _resolved: list[Cycle] = field(default_factory=list)
    """Cycles whose discretisation has been determined."""

    @property
    def has_resonances(self) -> bool:
        """Whether the strip's inertia is modelled by its vibration, which leads to local optima close to each other."""
        return self.choice.has("rod_inertia")

    @property
    def is_excited_by_corners(self) -> bool:
        """Whether the many corners of a tabulated load excite vibration: it is expensive to resolve, and noise limits
        the attainable accuracy."""
        return self.has_resonances and self.scene.load.corners().size > FEW_CORNERS

    @cached_property
    def composition(self) -> Composition:
        """The physics of the active effects."""
        exact = compose(self.choice)
        if not self.adiabatic:
            return exact
        parts = (AdiabaticRodInertia() if isinstance(part, RodInertia) else part for part in exact.corrections)
        return replace(exact, corrections=tuple(parts))

    def unresolved_gain(self, found: Outcome[RodCheck]) -> float:
        """The gain in ln objective of a step that cannot be told from the error of the check ``found``; 0 if no corners
        of the load excite vibration, and in adiabatic modes, whose error hardly changes over a step."""
        if not self.is_excited_by_corners or self.adiabatic:
            return 0.0
        error = found.accuracy.estimated
        return _UNRESOLVED_SHARE * error if error <= self.accuracy else error

    @property
    def is_lightly_damped(self) -> bool:
        """Whether vibration is hardly damped, so that narrow minima lie close to each other between resonances."""
        return self.has_resonances and self.scene.material.loss_factor < _SMOOTH_LOSS_FACTOR

    @property
    def min_radius(self) -> float:
        """Trust-region radius in ln b, ln h, ln l below which a step is not worth its cost."""
        return self.fidelity.min_radius if self.has_resonances else _MIN_RADIUS

    @property
    def angle_step(self) -> float:
        """Spacing [rad] of the three angles whose parabola represents a peak."""
        return self.fidelity.angle_step if self.corrected else _SMOOTH_ANGLE_STEP

    def at_accuracy(self, accuracy: float) -> FullModel:
        """This model at another accuracy, with its own checks."""
        return replace(self._without_cache(), accuracy=accuracy, _checks={})

    def coarser(self, accuracy: float) -> FullModel:
        """This model at a lower accuracy, with its own checks. They omit contact and friction power if these are not
        required: resolving them takes twice the time of the rest, the power alone a third of it."""
        needs_contact, choice = self.required.reactions or self.required.power, self.choice
        active = tuple(effect for effect in choice.active if needs_contact or effect.name != "friction")
        rough = self.at_accuracy(max(self.accuracy, accuracy))
        return replace(
            rough, choice=replace(choice, active=active), adiabatic=self.is_excited_by_corners,
            power=self.required.power,
        )  # fmt: skip

    def finer(self, stencil_model: FullModel | None = None) -> FullModel:
        """The fine version of this model; it shares the checks, and the strips solved for them."""
        fine = replace(self._without_cache(), fidelity=FINE, stencil_model=stencil_model)
        fine._strips |= {d: strip for d, strip in self._strips.items() if strip.cycle.tolerance <= fine._tolerance}
        return fine

    def _without_cache(self) -> FullModel:
        """This model without its stored strips."""
        return replace(self, strip_count=0, _strips={}, _stencils=[], _resolved=[])

    @property
    def corrected(self) -> bool:
        """Whether the physics has corrections, which cost far more than the rest."""
        return bool(self.composition.corrections)

    def strip(self, d: Dimensions, corrected: bool = True) -> FullStrip:
        """One strip at any angles and sections, with or without its corrections; the last ones with corrections are
        stored."""
        if not (corrected and self.corrected):
            return self._counted_strip(Cycle(self.scene, d, self.composition.linear, self._tolerance))
        if d not in self._strips:
            self._keep(self._counted_strip(self._resolved_cycle(d)))
        return self._strips[d]

    def _counted_strip(self, cycle: Cycle) -> FullStrip:
        self.watch()
        self.strip_count += 1
        return FullStrip(cycle)

    def _resolved_cycle(self, d: Dimensions) -> Cycle:
        """The cycle of a strip with the discretisation found for a strip near it, if there is one: in coarse models its
        error is hardly larger."""
        cycle = Cycle(self.scene, d, self.composition, self._tolerance)
        if not (self.fidelity.shares_meshes and self.has_resonances) or not is_stable(cycle):
            return cycle
        x = logarithms(d)
        for known in self._resolved:
            near = np.max(np.abs(logarithms(known.dimensions) - x)) <= _SAME_RESOLUTION
            neighbour = known.neighbours([d])[0] if near else None
            if neighbour is not None:
                return neighbour
        self._resolved = [cycle, *self._resolved[: _MAX_STRIPS - 1]]
        return cycle

    @property
    def _tolerance(self) -> float:
        """Tolerance of the corrections of strips, which checks rely on."""
        return tolerance_of(self._check_accuracy)

    @property
    def _check_accuracy(self) -> float:
        return max(_CHECK_SHARE * self.accuracy, _MIN_CHECK_ACCURACY)

    def _keep(self, strip: FullStrip) -> None:
        while len(self._strips) >= _MAX_STRIPS:
            del self._strips[next(iter(self._strips))]
        self._strips[strip.dimensions] = strip

    def check(self, d: Dimensions) -> Outcome[RodCheck]:
        """The exact check of a strip."""
        if d in self._checks:
            return self._checks[d]
        self.watch()
        if d not in self._strips:
            self._keep(FullStrip(self._resolved_cycle(d)))
        cycle = self._strips[d].cycle
        self._checks[d] = check_chosen(cycle, self.choice, self._check_accuracy, self.criterion, self.power)
        return self._checks[d]

    def all_checks(self) -> Iterable[Outcome[RodCheck]]:
        """All checks so far."""
        return self._checks.values()

    def peaks(self, d: Dimensions) -> Peaks:
        """Locations of the peaks of a strip's results; the strip must not buckle."""
        strip = self.strip(d)
        compressions = compression_peaks(strip.cycle.axial_force)
        peaks = find_peaks(strip, self.criterion.diagram(), self.required)._replace(compressions=compressions)
        return peaks.split_at_jumps(self.scene.load.jumps(), self.angle_step)

    def rows_near(self, peaks: Peaks, d: Dimensions) -> FullRows:
        """The rows of strips near this one at the given peaks, which are its own and possibly those of other strips."""
        stresses = self.strip(d).stresses(stencils(peaks.angles, self.angle_step), peaks.stations())
        parts = Parts.near_maximum(stresses, peaks.angles, self.criterion.diagram())
        return FullRows(self, peaks, parts, d, self._stencil_for(d) if self.corrected else None)

    def _stencil_for(self, d: Dimensions) -> Stencil:
        """A stored stencil that covers a strip, or a new one around it."""
        if self.stencil_model is not None and self.is_excited_by_corners:
            return self.stencil_model._stencil_for(d)
        for stencil in self._stencils:
            if stencil.covers(d):
                return stencil
        # Under a noisy load the other curvatures are not worth the time of six solutions.
        curvature_pairs = RATIO_CURVATURE if self.is_excited_by_corners else ALL_CURVATURES
        centre = (self.stencil_model or self).strip(d)
        stencil = Stencil.around(centre, self.fidelity.correction_step, curvature_pairs, self.free, self.watch)
        self._stencils = [stencil, *self._stencils[: _MAX_STENCILS - 1]]
        return stencil


@dataclass(frozen=True)
class FullRows:
    """All rows of strips near one with known peaks, as functions of x = ln(b, h, l).

    At strips other than ``base`` the physics without corrections is evaluated exactly, and the contribution of the
    corrections is a polynomial in x (``corrections``), so that a local search solves them at few strips only.
    """

    model: FullModel
    peaks: Peaks
    parts: Parts
    base: Dimensions
    stencil: Stencil | None
    """Stencil for the derivatives of corrections; None without corrections."""

    _uncorrected: dict[bytes, Array] = field(default_factory=dict)
    """Rows without corrections evaluated so far."""

    @cached_property
    def _corrections(self) -> CorrectionPolynomial | None:
        base = self.model.strip(self.base)
        return None if self.stencil is None else CorrectionPolynomial.near(base, self.stencil, self._rows.corrections)

    @cached_property
    def _rows(self) -> RowsAtPeaks:
        m = self.model
        return RowsAtPeaks(m.scene, m.criterion.diagram(), self.peaks, self.parts, m.angle_step, m.required.power)

    @property
    def base_cycle(self) -> Cycle:
        """The cycle of the strip ``base``, without corrections."""
        return self.model.strip(self.base, corrected=False).cycle

    @property
    def layout(self) -> Layout:
        return self._rows.layout

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        uncorrected, at_base = self.uncorrected_values(x), self._dimensions(x) is self.base
        if self._corrections is None or not (uncorrected[rows.STABILITY] < 0.0 or at_base):
            return uncorrected
        return uncorrected + (self._corrections.at_base if at_base else self._corrections.at(x))

    def uncorrected_values(self, x: Array) -> Array:
        """All rows without corrections."""
        key = x.tobytes()
        if key not in self._uncorrected:
            self._uncorrected[key] = self._rows(self.model.strip(self._dimensions(x), corrected=False))
        return self._uncorrected[key]

    def corrected_values(self, x: Array) -> Array:
        """All rows with the corrections solved at x."""
        return self._rows(self.model.strip(self._dimensions(x)))

    def jacobian(self, x: Array, free: Array = ALL) -> Array:
        """Derivatives of all rows with respect to x, shape (rows, 3), by one-sided differences; columns not in ``free``
        are zero."""
        slopes = self.uncorrected_jacobian(x, free)
        if self._corrections is None or not self.uncorrected_values(x)[rows.STABILITY] < 0.0:
            return slopes
        return slopes + self._corrections.slopes(x, free)

    def jacobian_at_ratio(self, x: Array) -> Array:
        """The same, with the derivatives of corrections projected onto constant frequency ratio."""
        return self.uncorrected_jacobian(x) + (
            0.0 if self._corrections is None else self._corrections.jacobian_at_ratio
        )

    def uncorrected_jacobian(self, x: Array, free: Array = ALL) -> Array:
        """Derivatives of the rows without corrections."""
        here, out = self.uncorrected_values(x), np.zeros((self.layout.size, 3))
        for v in free:
            step = _STEP * np.eye(3)[v]
            # At the maximum length, or where the neighbour buckles, the difference is taken to the other side.
            for side in (-1.0,) if v == 2 and self._exceeds_rod(x + step) else (1.0, -1.0):
                values = self.uncorrected_values(x + side * step)
                if values[rows.UTILISATION] != rows.BUCKLED:
                    out[:, v] = (values - here) / (side * _STEP)
                    break
        return out

    def _dimensions(self, x: Array) -> Dimensions:
        """The strip at x; exactly ``base`` at its logarithms."""
        return self.base if x.tobytes() == self._base_key else dimensions_of(x, self.model.scene)

    @cached_property
    def _base_key(self) -> bytes:
        return logarithms(self.base).tobytes()

    def _exceeds_rod(self, x: Array) -> bool:
        """Whether a strip would be longer than the rod."""
        return x[2] > math.log(self.model.scene.mechanism.rod_length)
