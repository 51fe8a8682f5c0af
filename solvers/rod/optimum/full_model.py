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
from solvers.rod.check import RodCheck, check
from solvers.rod.cycle.composition import Array, Composition, Cycle
from solvers.rod.optimum.corrections import Added, Stencil, difference
from solvers.rod.optimum.full_strip import FullStrip, dimensions_of, logarithms
from solvers.rod.optimum.peak_model import buckled_rows
from solvers.rod.optimum.peaks import ANGLE_STEP, Peaks, Wanted, compression_peaks, peaks_of
from solvers.rod.optimum.smooth_parts import Parts, vertex
from solvers.rod.optimum.sqp import ALL
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.rows import Layout
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.steady_response import RodInertia

_STEP, _CORRECTION_STEP = 1e-6, 2e-3
"""Of differences in ln b, ln h, ln l: of closed forms, and of corrections, whose time meshes change between strips."""
_CHECKED, _CLOSEST_CHECK = 0.7, 1e-12
"""Share of the accuracy that is asked of a check, as the rest is for what a search leaves; the least that may be."""
_LOOSER = 5.0
"""Times the accuracy of checks: the rows of a strip, which its check corrects."""
_FINE_LOOSER, _FINE_STEP, _CLOSEST = 0.5, 2e-4, 1e-5
"""The same for a closer look at ripples, and the radius that no trust is left in then."""
_ROUGH_CURVED_STEP, _CURVED_STEP, _LAST_CURVED_STEP = 2e-3, 1e-3, 1e-4
"""Of differences to both sides, where what corrections add is taken as quadratic: the long ones lead past small
valleys, the last to the bottom of one."""
_DAMPED = 0.003
"""Loss factor from which on results are smooth between strips that a search can tell apart."""
_FINE_ANGLE_STEP = 1e-3
_RIPPLE, _SMOOTH = 2e-3, 1e-7
"""Radii that no trust is left in where results ripple, and where they do not."""
_KEPT, _STENCILS = 16, 3
"""Strips and stencils that are remembered."""
_LEAST = 1e-300

Watch = Callable[[], None]


def no_watch() -> None:
    """No limit on the time."""


@dataclass
class FullModel:
    """The physics chosen for a scene, its criterion, what is looked at, and the accuracy of all that.

    ``effects`` are those that run, settled. ``strips`` counts the strips evaluated by rows, ``checks`` the exact ones.
    Corrections are taken as linear in ln b, ln h, ln l, as quadratic where the model is ``curved``: so damped
    resonances are followed closely, over the shortest steps where it is the ``last``. ``watch`` is called before each
    strip and check and may raise OutOfTime.
    """

    scene: Scene
    composition: Composition
    criterion: FatigueCriterion
    effects: EffectSelection
    effect_tolerance: float
    accuracy: float
    wanted: Wanted
    watch: Watch = no_watch
    fine: bool = False
    curved: bool = False
    last: bool = False
    strips: int = 0
    checks: int = 0
    _strips: dict[tuple[Dimensions, bool], FullStrip] = field(default_factory=dict)
    _checks: dict[Dimensions, Outcome[RodCheck]] = field(default_factory=dict)
    _stencils: list[Stencil] = field(default_factory=list)

    @property
    def rings(self) -> bool:
        """Whether the strip's inertia rings, so that there are optima close to each other."""
        return any(isinstance(part, RodInertia) for part in self.composition.corrections)

    @property
    def ripples(self) -> bool:
        """Whether results ripple from strip to strip more closely than a search can follow: what rings is not damped,
        or hardly."""
        return self.rings and self.scene.material.loss_factor < _DAMPED

    @property
    def least_radius(self) -> float:
        """A trust region smaller than that, in ln b, ln h, ln l, is not worth a step."""
        return _SMOOTH if not self.rings else _CLOSEST if self.fine else _RIPPLE

    @property
    def correction_step(self) -> float:
        """Of differences of corrections, in ln b, ln h, ln l."""
        if self.curved:
            return _LAST_CURVED_STEP if self.last else _CURVED_STEP if self.fine else _ROUGH_CURVED_STEP
        return _FINE_STEP if self.fine else _CORRECTION_STEP

    @property
    def angle_step(self) -> float:
        """Between the three angles through which a peak is followed [rad]: close ones, where friction's corners lie
        beside peaks and the last digits count."""
        return _FINE_ANGLE_STEP if self.fine else ANGLE_STEP

    def rougher(self, accuracy: float) -> FullModel:
        """The same, less accurate; its checks are its own."""
        return replace(self._anew(), accuracy=max(self.accuracy, accuracy), checks=0, _checks={})

    def finer(self) -> FullModel:
        """The same with rows as good as checks, for steps among ripples; its checks are the same."""
        return replace(self._anew(), fine=True, curved=not self.ripples)

    def closest(self) -> FullModel:
        """The same with differences over the shortest steps; its strips and its checks are the same."""
        return replace(self, last=True, _stencils=[])

    def bent(self) -> FullModel:
        """The same with corrections to second order; its checks are the same."""
        return replace(self._anew(), curved=True)

    def _anew(self) -> FullModel:
        """The same without its strips."""
        return replace(self, strips=0, checks=0, _strips={}, _stencils=[])

    @property
    def corrected(self) -> bool:
        """Whether the physics has corrections, which cost far more than the rest."""
        return bool(self.composition.corrections)

    def strip(self, d: Dimensions, corrected: bool = True) -> FullStrip:
        """One strip at any angles and sections, with its corrections or without; the last few are kept."""
        key = d, corrected and self.corrected
        if key not in self._strips:
            self.watch()
            self.strips += 1
            while len(self._strips) >= _KEPT:
                del self._strips[next(iter(self._strips))]
            looser = _FINE_LOOSER if self.fine else 1.0 if self.curved else _LOOSER
            cycle = Cycle(self.scene, d, self.composition, looser * self.accuracy)
            self._strips[key] = FullStrip(cycle if corrected else cycle.without_corrections())
        return self._strips[key]

    def check(self, d: Dimensions, accuracy: float | None = None) -> Outcome[RodCheck]:
        """The exact check of a strip; to a lesser accuracy if that is all that is asked for."""
        if d in self._checks:
            return self._checks[d]
        self.watch()
        self.checks += 1
        found = check(
            self.scene,
            d,
            self.effects,
            self.effect_tolerance,
            accuracy or max(_CHECKED * self.accuracy, _CLOSEST_CHECK),
            self.criterion,
        )
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
        return peaks_of(strip, self.criterion.diagram(), self.wanted)._replace(pushed=pushed)

    def following(self, peaks: Peaks, d: Dimensions) -> FullRows:
        """The rows of strips near this one, which has these peaks, maybe with those of others."""
        stresses = self.strip(d).stresses(peaks.threes(self.angle_step), peaks.stations())
        parts = Parts.near_the_worst(stresses, peaks.angles, self.criterion.diagram())
        return FullRows(self, peaks, parts, d, self._stencil_for(d) if self.corrected else None)

    def _stencil_for(self, d: Dimensions) -> Stencil:
        """One that serves a strip: one of the last, or a new one around it."""
        for stencil in self._stencils:
            if stencil.serves(d):
                return stencil
        stencil = Stencil.around(self.strip(d), self.correction_step, self.curved, self.watch)
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

    @cached_property
    def _added(self) -> Added | None:
        home = self.model.strip(self.home)
        return None if self.stencil is None else Added.near(home, self.stencil, self._rows)

    @property
    def home_cycle(self) -> Cycle:
        """The turn of the strip at home, without corrections."""
        return self.model.strip(self.home, corrected=False).cycle

    @property
    def layout(self) -> Layout:
        parts = self.parts
        return Layout(parts.utilisations.shape[1], parts.stresses.shape[1], self.peaks.reactions.size)

    def values(self, x: Array) -> Array:
        """All rows, shape (rows,)."""
        d, out = self._dimensions(x), self.plain_values(x)
        if self._added is not None and (out[rows.STABILITY] < 0.0 or d is self.home):
            out += self._added.at_home if d is self.home else self._added.at(x)
        return out

    def corrected_values(self, x: Array) -> Array:
        """The same with the corrections evaluated anew."""
        return self._rows(self.model.strip(self._dimensions(x)))

    def taken_apart(self, x: Array) -> tuple[Array, Array]:
        """All rows without corrections, and what the corrections, evaluated anew, add to them."""
        d = self._dimensions(x)
        plain = self.model.strip(d, corrected=False)
        return self._rows(plain), difference(self._rows, plain, self.model.strip(d))

    def _rows(self, strip: FullStrip) -> Array:
        out = np.zeros(self.layout.size)
        scene, diagram, d = self.model.scene, self.model.criterion.diagram(), strip.dimensions
        apart = self.model.angle_step
        piston = scene.piston
        out[rows.TAU], out[rows.LENGTH] = -math.log(d.b * d.h**3), math.log(d.l)
        out[rows.THICKNESS] = math.log(d.h)
        pushed = float(np.max(vertex(*-strip.cycle.axial_force(self.peaks.pushed_threes(apart)).reshape(-1, 3).T)))
        out[[rows.STABILITY, rows.SIDEWAYS]] = (
            np.log(pushed / np.array(strip.critical)) if pushed > 0.0 else rows.NEVER_COMPRESSED
        )
        if out[rows.STABILITY] >= 0.0:
            buckled_rows(out)
            return out
        stresses = strip.stresses(self.peaks.threes(apart), self.peaks.stations())
        used, strained = self.parts.values(stresses, diagram)
        self._put(out, rows.UTILISATION, used)
        self._put(out, rows.STRESS, strained)
        if self.peaks.reactions.size:
            side, contact = (
                vertex(*row.reshape(-1, 3).T) for row in strip.reactions(self.peaks.reaction_threes(apart))
            )
            self._put(out, rows.SIDE, side)
            self._put(out, rows.PRESSURE, contact * pressure_per_load(piston.diameter, piston.skirt_length))
        if self.model.wanted.power:
            out[rows.POWER] = math.log(max(strip.friction_power(), _LEAST))
        if not np.all(np.isfinite(out)):
            buckled_rows(out)
        return out

    def _dimensions(self, x: Array) -> Dimensions:
        """The strip of the logarithms x; the one that the rows are of has its sizes to the last place."""
        return self.home if np.array_equal(x, logarithms(self.home)) else dimensions_of(x, self.model.scene)

    def _put(self, out: Array, row: int, parts: Array) -> None:
        """A row and its parts."""
        logs = np.log(np.maximum(parts, _LEAST))
        out[self.layout.parts(row)], out[row] = logs, logs.max()

    def slopes(self, x: Array, free: Array = ALL) -> Array:
        """Their derivatives by x, shape (rows, 3), by differences to one side; those with other indices are zero."""
        return self._slopes(self.values, x, free)

    def plain_values(self, x: Array) -> Array:
        """The rows without corrections."""
        return self._rows(self.model.strip(self._dimensions(x), corrected=False))

    def plain_slopes(self, x: Array) -> Array:
        """Their derivatives."""
        return self._slopes(self.plain_values, x, ALL)

    def slopes_at_ratio(self, x: Array) -> Array:
        """The same with what corrections add at a constant frequency ratio: nothing across it."""
        return self.plain_slopes(x) + (0.0 if self._added is None else self._added.slopes_at_ratio())

    def _slopes(self, values: Callable[[Array], Array], x: Array, free: Array) -> Array:
        here, out = values(x), np.zeros((self.layout.size, 3))
        for v in free:
            unit = np.eye(3)[v]
            for step in (_STEP, -_STEP):
                # Beside buckling, and at the rod's end, only the other side has strips.
                beside = None if v == 2 and self._ends(x + step * unit) else values(x + step * unit)
                if beside is not None and beside[rows.UTILISATION] != rows.BUCKLED:
                    out[:, v] = (beside - here) / step
                    break
        return out

    def _ends(self, x: Array) -> bool:
        """Whether a strip would be longer than the rod."""
        return x[2] > math.log(self.model.scene.mechanism.rod_length)
