"""The full model of a strip as the search sees it: peaks, rows near them, and the exact check.

Everything that a design asks of effects beyond the core's physics goes through ``FullModel``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from solvers.effects import EffectSelection
from solvers.fatigue import FatigueCriterion
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck, check_chosen, tolerance_of
from solvers.rod.cycle.composition import Array, Composition, Cycle
from solvers.rod.effects import choose_for
from solvers.rod.optimum.full_model.corrections import CURVED, CURVED_ACROSS, FLAT, Added, Stencil, stands
from solvers.rod.optimum.full_model.rows_at_peaks import RowsAtPeaks
from solvers.rod.optimum.full_model.smooth_parts import Parts
from solvers.rod.optimum.full_model.strip import FullStrip, dimensions_of, logarithms
from solvers.rod.optimum.peaks import ANGLE_STEP, Peaks, RequiredResults, compression_peaks, find_peaks
from solvers.rod.optimum.sqp import ALL
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.steady_response import FEW_CORNERS, RodInertia

_STEP, _CORRECTION_STEP, _FINE_STEP = 1e-6, 2e-3, 1e-4
"""Of differences in ln b, ln h, ln l: of closed forms, of corrections, whose time meshes change between strips, and of
these where the last digits count: long ones lead past small valleys, short ones to the bottom of one."""
_CHECKED, _CLOSEST_CHECK = 0.7, 1e-12
"""Share of the accuracy that is asked of a check, as the rest is for what a search leaves; the least that may be."""
_LOOSER = 5.0
"""Times the accuracy of checks: the rows of a strip, which its check corrects."""
_FINE_LOOSER = 0.5
"""The same where the last digits count."""
_BESIDE = 0.1
"""In ln b, ln h, ln l: so near strips the same resolution is enough, roughly."""
_DAMPED = 0.003
"""Loss factor from which on results are smooth between resonances."""
_FINE_ANGLE_STEP = 1e-3
_SMOOTH, _RINGING, _FINE = 1e-7, 5e-4, 1e-5
"""Radii that no trust is left in: where results are smooth, between resonances, and there where the last digits
count."""
_KEPT, _STENCILS = 64, 3
"""Strips and stencils that are remembered."""
_CONTACT = frozenset({"friction"})
"""The effect that changes no other results."""

Watch = Callable[[], None]


def no_watch() -> None:
    """No limit on the time."""


@dataclass
class FullModel:
    """The physics chosen for a scene, its criterion, what is looked at, and the accuracy of all that.

    ``effects`` are those that run, settled, ``free`` the indices of the sizes that may be chosen at will. ``strips``
    counts the strips evaluated by rows, ``checks`` the exact ones. Corrections are taken as linear in ln b, ln h, ln l,
    as quadratic where the model is ``curved``: so resonances are followed closely, with rows as good as checks where it
    is ``fine``; what they change beside a strip is that of strips of a ``coarse`` model, if there is one: differences
    between strips of one resolution are as good. ``watch`` is called before each strip and check and may raise
    OutOfTime.
    """

    scene: Scene
    composition: Composition
    criterion: FatigueCriterion
    effects: EffectSelection
    effect_tolerance: float
    accuracy: float
    wanted: RequiredResults
    free: tuple[int, ...] = (0, 1, 2)
    watch: Watch = no_watch
    fine: bool = False
    curved: bool = False
    coarse: FullModel | None = None
    strips: int = 0
    checks: int = 0
    _strips: dict[Dimensions, FullStrip] = field(default_factory=dict)
    _checks: dict[Dimensions, Outcome[RodCheck]] = field(default_factory=dict)
    _stencils: list[Stencil] = field(default_factory=list)
    _sought: list[Cycle] = field(default_factory=list)
    """Of which resolutions have been found."""

    @property
    def rings(self) -> bool:
        """Whether the strip's inertia rings, so that there are optima close to each other."""
        return any(isinstance(part, RodInertia) for part in self.composition.corrections)

    @property
    def textured(self) -> bool:
        """Whether a table's points set the strip ringing: to follow that takes long, and noise limits what may be known
        of it."""
        return self.rings and self.scene.load.corners().size > FEW_CORNERS

    @property
    def ripples(self) -> bool:
        """Whether hardly anything damps what rings, so that narrow valleys lie side by side between resonances."""
        return self.rings and self.scene.material.loss_factor < _DAMPED

    @property
    def least_radius(self) -> float:
        """A trust region smaller than that, in ln b, ln h, ln l, is not worth a step."""
        if not self.rings:
            return _SMOOTH
        return _FINE if self.fine else _RINGING

    @property
    def correction_step(self) -> float:
        """Of differences of corrections, in ln b, ln h, ln l."""
        return _FINE_STEP if self.fine else _CORRECTION_STEP

    @property
    def angle_step(self) -> float:
        """Between the three angles through which a peak is followed [rad]: close ones, where friction's corners lie
        beside peaks and the last digits count."""
        return _FINE_ANGLE_STEP if self.fine else ANGLE_STEP

    def at_accuracy(self, accuracy: float) -> FullModel:
        """The same at another accuracy; its checks are its own."""
        return replace(self._anew(), accuracy=accuracy, _checks={})

    def rougher(self, accuracy: float) -> FullModel:
        """The same, less accurate, with corrections to second order; its checks are its own, without contact and
        friction power where nobody looks at them: to resolve these takes twice the time of the rest."""
        looks, chosen = self.wanted.reactions or self.wanted.power, self.effects
        effects = chosen if looks else EffectSelection(chosen.include - _CONTACT, chosen.exclude | _CONTACT)
        return replace(self.at_accuracy(max(self.accuracy, accuracy)), effects=effects, curved=True)

    def finer(self, coarse: FullModel | None = None) -> FullModel:
        """The same with corrections to second order over short steps and rows as good as checks; its checks are the
        same."""
        return replace(self._anew(), fine=True, curved=True, coarse=coarse)

    def _anew(self) -> FullModel:
        """The same without its strips."""
        return replace(self, strips=0, checks=0, _strips={}, _stencils=[], _sought=[])

    @property
    def corrected(self) -> bool:
        """Whether the physics has corrections, which cost far more than the rest."""
        return bool(self.composition.corrections)

    def strip(self, d: Dimensions, corrected: bool = True) -> FullStrip:
        """One strip at any angles and sections, with its corrections or without; the last few with are kept."""
        if not (corrected and self.corrected):
            return self._new(Cycle(self.scene, d, self.composition.linear, self._tolerance))
        if d not in self._strips:
            self._keep(self._new(self._cycle(d, self._tolerance)))
        return self._strips[d]

    def _new(self, cycle: Cycle) -> FullStrip:
        self.watch()
        self.strips += 1
        return FullStrip(cycle)

    def _cycle(self, d: Dimensions, tolerance: float) -> Cycle:
        """The turn of a strip, its corrections roughly at the resolution that was found for one near it, if there is
        one: what that leaves unknown is hardly more."""
        within = tolerance_of(max(_CHECKED * self.accuracy, _CLOSEST_CHECK))
        sought = Cycle(self.scene, d, self.composition, min(tolerance, within))
        if self.fine or not self.rings or not stands(sought):
            return sought
        x = logarithms(d)
        for known in self._sought:
            near = known.tolerance <= tolerance and np.max(np.abs(logarithms(known.dimensions) - x)) <= _BESIDE
            beside = known.neighbours([d])[0] if near else None
            if beside is not None:
                return beside
        self._sought = [sought, *self._sought[: _KEPT - 1]]
        return sought

    @property
    def _tolerance(self) -> float:
        """Of the corrections of strips."""
        return self.accuracy * (_FINE_LOOSER if self.fine else 1.0 if self.curved else _LOOSER)

    def _keep(self, strip: FullStrip) -> None:
        while len(self._strips) >= _KEPT:
            del self._strips[next(iter(self._strips))]
        self._strips[strip.dimensions] = strip

    def check(self, d: Dimensions, accuracy: float | None = None) -> Outcome[RodCheck]:
        """The exact check of a strip; to a lesser accuracy if that is all that is asked for."""
        if d in self._checks:
            return self._checks[d]
        self.watch()
        self.checks += 1
        within = accuracy or max(_CHECKED * self.accuracy, _CLOSEST_CHECK)
        choice = choose_for(self.scene, d, self.effects, self.effect_tolerance)
        known = self._strips.get(d)
        solved = known is not None and known.cycle.tolerance <= tolerance_of(within)
        cycle = known.cycle if solved else self._cycle(d, tolerance_of(within))
        found = check_chosen(cycle, choice, within, self.criterion)
        if cycle.tolerance <= self._tolerance:
            self._keep(FullStrip(cycle))
        if accuracy is None or accuracy <= self.accuracy:
            self._checks[d] = found
        return found

    def checked(self) -> Iterable[Outcome[RodCheck]]:
        """All checks so far."""
        return self._checks.values()

    def peaks(self, d: Dimensions) -> Peaks:
        """Where a strip's results peak; it must not buckle."""
        strip = self.strip(d)
        pushed = compression_peaks(strip.cycle.axial_force)
        peaks = find_peaks(strip, self.criterion.diagram(), self.wanted)._replace(compressions=pushed)
        return peaks.split_at_jumps(self.scene.load.jumps(), self.angle_step)

    def rows_near(self, peaks: Peaks, d: Dimensions) -> FullRows:
        """The rows of strips near this one, which has these peaks, maybe with those of others."""
        stresses = self.strip(d).stresses(peaks.stencils(self.angle_step), peaks.stations())
        parts = Parts.near_the_worst(stresses, peaks.angles, self.criterion.diagram())
        return FullRows(self, peaks, parts, d, self._stencil_for(d) if self.corrected else None)

    def _stencil_for(self, d: Dimensions) -> Stencil:
        """One that serves a strip: one of the last, or a new one around it."""
        if self.coarse is not None and self.textured:
            return self.coarse._stencil_for(d)
        for stencil in self._stencils:
            if stencil.serves(d):
                return stencil
        # Beside what noise makes of a strip the other curvatures are not worth the time of six motions.
        bends = (CURVED_ACROSS if self.textured else CURVED) if self.curved else FLAT
        centre = (self.coarse or self).strip(d)
        stencil = Stencil.around(centre, self.correction_step, bends, self.free, self.watch)
        self._stencils = [stencil, *self._stencils[: _STENCILS - 1]]
        return stencil


@dataclass(frozen=True)
class FullRows:
    """All rows of strips near one whose peaks are known, as functions of x = ln(b, h, l).

    Of strips away from ``home`` the physics without corrections is evaluated anew; what the corrections add to its rows
    is a polynomial in x (``corrections``). So a local search does not pay for them at every strip that it looks at.
    """

    model: FullModel
    peaks: Peaks
    parts: Parts
    home: Dimensions
    stencil: Stencil | None
    """What slopes of corrections are taken from; None where there are none."""

    _plain: dict[bytes, Array] = field(default_factory=dict)
    """Rows without corrections that have been asked for."""

    @cached_property
    def _added(self) -> Added | None:
        home = self.model.strip(self.home)
        return None if self.stencil is None else Added.near(home, self.stencil, self._read.added)

    @cached_property
    def _read(self) -> RowsAtPeaks:
        m = self.model
        return RowsAtPeaks(m.scene, m.criterion.diagram(), self.peaks, self.parts, m.angle_step, m.wanted.power)

    @property
    def home_cycle(self) -> Cycle:
        """The turn of the strip at home, without corrections."""
        return self.model.strip(self.home, corrected=False).cycle

    @property
    def layout(self) -> Layout:
        return self._read.layout

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        own, at_home = self.plain_values(x), self._dimensions(x) is self.home
        if self._added is None or not (own[rows.STABILITY] < 0.0 or at_home):
            return own
        return own + (self._added.at_home if at_home else self._added.at(x))

    def plain_values(self, x: Array) -> Array:
        """The rows without corrections."""
        key = x.tobytes()
        if key not in self._plain:
            self._plain[key] = self._read(self.model.strip(self._dimensions(x), corrected=False))
        return self._plain[key]

    def corrected_values(self, x: Array) -> Array:
        """All rows with the corrections evaluated anew."""
        return self._read(self.model.strip(self._dimensions(x)))

    def taken_apart(self, x: Array) -> tuple[Array, Array]:
        """All rows without corrections, and what the corrections, evaluated anew, add to them."""
        return self.plain_values(x), self._read.added(self.model.strip(self._dimensions(x)))

    def jacobian(self, x: Array, free: Array = ALL) -> Array:
        """Derivatives of all rows by x, shape (rows, 3), by differences to one side; those with other indices are
        zero."""
        plain = self.plain_slopes(x, free)
        if self._added is None or not self.plain_values(x)[rows.STABILITY] < 0.0:
            return plain
        return plain + self._added.slopes(x, free)

    def slopes_at_ratio(self, x: Array) -> Array:
        """The same with what corrections add at a constant frequency ratio: nothing across it."""
        return self.plain_slopes(x) + (0.0 if self._added is None else self._added.slopes_at_ratio)

    def plain_slopes(self, x: Array, free: Array = ALL) -> Array:
        """The same of the rows without corrections."""
        here, out = self.plain_values(x), np.zeros((self.layout.size, 3))
        for v in free:
            step = _STEP * np.eye(3)[v]
            # Beside buckling only the other side has strips.
            for side in (-1.0,) if v == 2 and self._ends(x + step) else (1.0, -1.0):
                values = self.plain_values(x + side * step)
                if values[rows.UTILISATION] != rows.BUCKLED:
                    out[:, v] = (values - here) / (side * _STEP)
                    break
        return out

    def _dimensions(self, x: Array) -> Dimensions:
        """The strip of the logarithms x; the one that the rows are of has its sizes to the last place."""
        return self.home if x.tobytes() == self._at else dimensions_of(x, self.model.scene)

    @cached_property
    def _at(self) -> bytes:
        return logarithms(self.home).tobytes()

    def _ends(self, x: Array) -> bool:
        """Whether a strip would be longer than the rod."""
        return x[2] > math.log(self.model.scene.mechanism.rod_length)
