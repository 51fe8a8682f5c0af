"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``natural_frequencies``, periodic with the turn (``motion``), which in the strip's modes obeys an ordinary differential
equation (``equation``) between the corners of the force (``excitation``). A first resolution is chosen by how fast the
modes are and how fast the force changes, and added to where most is left unknown, until that is little enough, does not
help, or has cost too much; what is left is ``error``. What the strip does beside the quasi-static shape is damped
mode by mode by the material's loss factor (``equation``). With none, the answer exactly at a resonance is not finite,
and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Array, Cycle
from solvers.rod.cycle.section import Rippling
from solvers.rod.cycle.state import ANGLE
from solvers.rod.vibration.equation import StripEquation, quasi_static
from solvers.rod.vibration.excitation import RULE, TURN, Excitation, off_jumps, states_at
from solvers.rod.vibration.motion import (
    EXPONENT,
    MOST_RINGING,
    NARROW,
    Errors,
    Motion,
    least_turned,
    motion,
    motion_beside,
)

LEAST_ERROR = 3e-11
"""Below it lies the rounding of V''' from many polynomials."""

LADDER = (9, 11, 13, 16, 20, 26, 34)
_RUNGS, _RUNGS_BEHIND_CORNERS = (3e-6, 5e-8, 5e-10), (3e-6, 2e-7, 5e-9, 5e-9, 5e-10, 5e-10)
"""Below these errors fewer polynomials than the next of ``LADDER`` have hardly ever been enough; behind corners more
modes have to be known."""

MOST_WORK, ENOUGH_WORK = 12_000_000, 6_000_000
"""Of one motion, and of all but the last, as ``_work`` counts it: 6 000 000 are some tenth of a second."""

FEW_CORNERS, _ENOUGH_WORK_BEHIND_MANY, _ENOUGH_WORK_ROUGHLY, _LOOSELY = 32, 1_850_000, 500_000, 1e-6
"""Corners beyond which they are those of a table; what of the work is then enough, and where no less is wanted than
that."""
_FALLS, _FALLS_BEHIND_JUMPS, _FALLS_UNDAMPED = 4.0, 10.0, 1.0
"""Behind them what faster modes ring with falls about like this power of the number of those that are known; and what
greatest values suffer from it behind jumps of the force, with damping, which ends it the sooner, and without."""

_MOST_TRIES, _MOST_VAIN = 8, 2
_WORST, _FINER = 0.03, 0.75
"""Of the worst element's error, from which on others are halved too; what that makes of the step."""

_NARROW_LOOSELY, _NARROW_HALF, _CHANGING = 2.0, 9.0, 5.0
"""Radians of the slowest mode that follows without ringing: in the narrowest element behind many corners where few
digits are wanted; in the half of an element, which is made where more are; and, in a narrow one, while the force
changes altogether, below which it does not follow."""

_FASTER = 1.2
"""Than under the mean force, a mode in the mean."""

_ENDS = 8
"""Angles at which the weights of a mean jump or turn, taken for so many: there what oscillates leaves something."""

_MISSED, _LOOSER, _LOOSEST = 1e3, 30.0, 1e-4
"""Times the error wanted that are worth another start; by which that wants less, and down to what."""

_RESONANT = 1e5
_UNKNOWN = 0.1


@dataclass(frozen=True)
class RodInertia:
    """Adds the steady vibration of the strip to whatever quasi-static shape it is given."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        with one_thread():
            return _vibration(cycle)

    def beside(self, found: SteadyVibration, cycles: Sequence[Cycle]) -> list[SteadyVibration | None]:
        """At the resolution of a vibration that was found, all at once; None where corners come or go."""
        with one_thread():
            return [_beside(found, cycle) for cycle in cycles]


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle.

    ``error`` estimates what truncation leaves out, relative to the greatest bending, ``lasting_error`` what of it
    remains of a mean over the turn.
    """

    motion: Motion
    error: float
    lasting_error: float
    excitation: Excitation

    inclines = False

    @property
    def pace(self) -> float:
        """Highest frequency [1/rad] of the modes that are followed."""
        return self.motion.pace

    @property
    def few_corners(self) -> bool:
        """Whether the corners are no table's."""
        return self.excitation.corners.size <= FEW_CORNERS

    @property
    def bent_terms(self) -> int:
        """Legendre coefficients of V''."""
        return self._bent.shape[0]

    @property
    def sunk_terms(self) -> int:
        """Legendre coefficients of V."""
        return self._sunk.shape[0]

    @cached_property
    def quiet(self) -> SteadyVibration:
        return replace(self, motion=self.motion.quiet) if self.motion.ringing.modes else self

    @cached_property
    def ringing(self) -> Rippling:
        """V'', V, T and M0 of what rings."""
        side, moment = self._reactions
        begins = self.excitation.corners.size
        return Rippling(self.motion.ringing, self._bent, self._sunk, side, moment, begins)

    @cached_property
    def _bent(self) -> Array:
        """Series of V'' of the basis' unit amplitudes."""
        return self.motion.basis.series(2)

    @cached_property
    def _sunk(self) -> Array:
        """Series of V."""
        return self.motion.basis.series(0)

    @cached_property
    def _reactions(self) -> tuple[Array, Array]:
        """T [N] and M0 [N m] of the basis' unit amplitudes."""
        stiffness, basis, clamp = self.motion.strip.stiffness, self.motion.basis, np.zeros(1)
        return -stiffness * basis.values(clamp, 3)[0], stiffness * basis.values(clamp, 2)[0]

    def add(self, states: Array, bent: Array, sunk: Array) -> tuple[Array, Array]:
        """Add d to the series of V'' and V at the states' angles; what it adds to T [N] and M0 [N m] there."""
        return spread(self._amplitudes(states), self._bent, self._sunk, *self._reactions, bent, sunk)

    def _amplitudes(self, states: Array) -> Array:
        """d at the states' angles, (basis, angles). Within a step that replaces a jump of the force the strip as a
        whole stays where it is, so that d makes up for the quasi-static shape."""
        angle, excitation = np.ascontiguousarray(states[ANGLE]), self.excitation
        still_at = off_jumps(angle, excitation.jumps)
        found, within = self.motion.at(still_at), still_at != angle
        if within.any():
            sides = states_at(excitation.drive, excitation.strip, still_at[within])
            equation, inside = self._equation, np.ascontiguousarray(states[:, within])
            still, moved = (quasi_static(equation, states)[1] for states in (inside, sides))
            found[:, within] += equation.modes @ (moved - still).T
        return found

    @cached_property
    def _equation(self) -> StripEquation:
        e, polynomials = self.excitation, self.motion.basis.polynomials
        return StripEquation.of(e.strip, e.inertia, e.mean, polynomials, 0.0)


@kernel
def spread(
    amplitude: Array, of_bent: Array, of_sunk: Array, side: Array, moment: Array, bent: Array, sunk: Array
) -> tuple[Array, Array]:
    """``SteadyVibration.add`` from amplitudes (basis, angles) and what unit amplitudes make."""
    for out, share in ((bent, of_bent), (sunk, of_sunk)):
        for t in range(share.shape[0]):
            for b in range(share.shape[1]):
                if share[t, b] != 0.0:
                    for i in range(amplitude.shape[1]):
                        out[t, i] += share[t, b] * amplitude[b, i]
    force, couple = np.zeros(amplitude.shape[1]), np.zeros(amplitude.shape[1])
    for b in range(amplitude.shape[0]):
        for i in range(amplitude.shape[1]):
            force[i] += side[b] * amplitude[b, i]
            couple[i] += moment[b] * amplitude[b, i]
    return force, couple


def _vibration(cycle: Cycle) -> SteadyVibration:
    """To half the tolerance; where that leads to elements too narrow for series, as near to it as others come."""
    wanted, best = max(0.5 * cycle.tolerance, LEAST_ERROR), None
    while best is None or (best.error > _MISSED * wanted and wanted < _LOOSEST and best.few_corners):
        one = _resolved(cycle, wanted, wanted < _LOOSEST)
        best = min((known for known in (best, one) if known), key=lambda one: one.error, default=None)
        wanted *= _LOOSER
    if best.motion.amplification > _RESONANT and not best.error < _UNKNOWN:
        if best.motion.errors.excited > _UNKNOWN:
            raise unknown_vibration()
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        )
    return best


def unknown_vibration() -> InvalidInput:
    """A load of which too many modes of the strip feel every change."""
    return InvalidInput(
        "load",
        "the pressure changes within too small an angle for the strip's vibration to be found",
        "points farther apart or less noise, or no effect rod_inertia",
    )


def _beside(found: SteadyVibration, cycle: Cycle) -> SteadyVibration | None:
    """That of a strip next to the one found, whatever its resolution leaves unknown."""
    excitation = found.excitation.beside(cycle)
    if excitation is None:
        return None
    loss, wanted = cycle.scene.material.loss_factor, max(0.5 * cycle.tolerance, LEAST_ERROR)
    beside = motion_beside(found.motion, found.excitation, excitation, loss, wanted)
    return replace(found, motion=beside, excitation=excitation)


def _equation(cycle: Cycle, excitation: Excitation, rung: int) -> StripEquation:
    loss = cycle.scene.material.loss_factor
    return StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, LADDER[rung], loss)


def _vibration_of(found: Motion, excitation: Excitation, pace: float) -> SteadyVibration:
    ends = (excitation.corners.size + _ENDS) / (0.5 * TURN * pace)
    return SteadyVibration(found, found.errors.total, found.errors.lasting(min(ends, 1.0)), excitation)


def _resolved(cycle: Cycle, wanted: float, or_none: bool) -> SteadyVibration | None:
    """Resolutions are added to where most is left unknown, until that is little enough or does not help. None, if that
    is an answer, where more modes would have to be followed than there is time for, as in steep rises."""
    excitation = Excitation.of(cycle, 0.1 * wanted)
    rung = sum(wanted < bound for bound in (_RUNGS_BEHIND_CORNERS if excitation.corners.size else _RUNGS))
    equation, step = _equation(cycle, excitation, rung), _step(excitation, wanted)
    slow, many = _slow(equation, excitation, wanted), excitation.corners.size > FEW_CORNERS
    # The polynomials are to know the modes that are followed, but for a table's; better fewer of them than fewer modes.
    while not many and _known(rung) < slow and rung + 1 < len(LADDER):
        rung += 1
        equation = _equation(cycle, excitation, rung)
        slow = _slow(equation, excitation, wanted)
    for fewer in range(rung, -1, -1):
        other = _equation(cycle, excitation, fewer) if fewer < rung else equation
        knows = many or fewer == rung or _known(fewer) >= slow
        if knows and _affordable(other, excitation, slow, step, MOST_WORK) >= slow:
            rung, equation = fewer, other
            break
    if not many and _affordable(equation, excitation, slow, step, MOST_WORK) < slow - 1:
        if or_none:
            return None
        most = ENOUGH_WORK if cycle.tolerance < _LOOSELY else _ENOUGH_WORK_BEHIND_MANY
        rung, known = -1, -1
        while known < slow:
            rung += 1
            equation = _equation(cycle, excitation, rung)
            known, slow = _known(rung), _affordable(equation, excitation, slow, step, most)
    enough = (_ENOUGH_WORK_ROUGHLY if wanted > _LOOSELY else _ENOUGH_WORK_BEHIND_MANY) if many else ENOUGH_WORK
    best, vain, before, spent = None, 0, np.inf, 0.0
    for _ in range(_MOST_TRIES):
        slow = _affordable(equation, excitation, slow, step, MOST_WORK)
        found = motion(equation, excitation, slow, step, wanted)
        errors, vain = found.errors, vain + 1
        spent += _work_behind(found, rung) if many else _work(found.edges.size - 1, slow, equation.slowness.size)
        if best is None or errors.total < best.error:
            best, vain = _vibration_of(found, excitation, float(equation.pace[0])), 0
        if errors.total <= cycle.tolerance or vain == _MOST_VAIN or spent > enough:
            break
        rest = max(errors.series, errors.phase, errors.excited)
        if max(errors.space, errors.omitted) > max(errors.elements, rest):
            full = errors.omitted > errors.space and found.ringing.modes == MOST_RINGING
            if full or rung == len(LADDER) - 1:
                break
            if many or excitation.jumps.size:
                damped = _FALLS_BEHIND_JUMPS if equation.loss else _FALLS_UNDAMPED
                rung = _enough_polynomials(rung, errors, wanted, damped if excitation.jumps.size else _FALLS)
            else:
                rung += 1
            if rung == len(LADDER) or (many and spent + _work_behind(found, rung) > enough):
                break
            equation = _equation(cycle, excitation, rung)
            continue
        worst = _worst_elements(equation, excitation, slow, found)
        # Halving elements did help the time before, if there was one.
        if errors.elements > rest and errors.elements < 0.5 * before and worst.any():
            before, excitation, step = errors.elements, excitation.halved(worst), _FINER * step
        elif spent + _work_of(equation, excitation, slow + 1, step) > enough:
            break
        else:
            slow, before = slow + 1, np.inf
    return best


def _enough_polynomials(rung: int, errors: Errors, wanted: float, falls: float) -> int:
    """The rung that is enough by how errors fall; beyond the ladder where none is, as noise may have it: what it leaves
    unknown is not worth the time of any other."""
    called_for = _known(rung) * (2.0 * max(errors.omitted, errors.space) / wanted) ** (1.0 / falls)
    return next((one for one in range(rung + 1, len(LADDER)) if _known(one) >= called_for), len(LADDER))


def _known(rung: int) -> int:
    """So many modes the polynomials know (``omitted.known_modes``)."""
    return (LADDER[rung] - 1) // 2 - 1


def _step(excitation: Excitation, wanted: float) -> float:
    """Radians in an element of the fastest mode followed: more than so many have never been enough. That mode rings
    behind corners, and has to be followed the more closely."""
    if not excitation.corners.size:
        return 8.0 if wanted > 1e-6 else 6.0 if wanted > 1e-10 else 4.5
    return 8.0 if wanted > 1e-6 else 6.0 if wanted > 1e-8 else 4.0 if wanted > 1e-9 else 3.0


def _slow(equation: StripEquation, excitation: Excitation, wanted: float) -> int:
    """So many of the slowest modes do not merely follow the force: it excites them, by how fast it changes, or elements
    behind many corners are too narrow for series. Behind few the first one rings so much that following it takes less
    time."""
    analytic, narrow, changing = least_turned(equation, excitation.edges, excitation.smoothness)
    many = excitation.corners.size > FEW_CORNERS
    enough = (narrow > (_NARROW_LOOSELY if wanted > _LOOSELY else NARROW)) if many else (changing > _CHANGING)
    follows = (np.exp(-analytic / EXPONENT) < wanted) & enough
    return max(int(np.argmax(np.append(follows[:-1], True))), min(excitation.corners.size, 1))


def _worst_elements(equation: StripEquation, excitation: Excitation, slow: int, found: Motion) -> NDArray[np.bool_]:
    """Those of the excitation whose errors are great, and whose halves are not too narrow."""
    time = found.errors.time
    places = 0.5 * (found.edges[:-1] + found.edges[1:])[time > _WORST * time.max()]
    where = np.zeros(excitation.edges.size - 1, dtype=np.bool_)
    where[np.searchsorted(excitation.edges, places) - 1] = True
    turned = 0.5 * equation.pace[min(slow, equation.slowness.size - 1)] * np.diff(excitation.edges)
    return where & (turned > _NARROW_HALF)


def _affordable(equation: StripEquation, excitation: Excitation, slow: int, step: float, most: float) -> int:
    """As many slow modes as are called for, or as many as take no more than the ``most`` work."""
    for m in range(min(slow, equation.slowness.size), 0, -1):
        if _work_of(equation, excitation, m, step) <= most:
            return m
    return 0


def _work_of(equation: StripEquation, excitation: Excitation, slow: int, step: float) -> float:
    """What so many slow modes are going to take."""
    pace = equation.pace[min(slow, equation.slowness.size) - 1]
    elements = np.sum(np.ceil(np.diff(excitation.edges) * _FASTER * pace / step))
    return _work(elements, slow, equation.slowness.size)


def _work_behind(found: Motion, rung: int) -> float:
    """What a motion behind many corners takes with so many polynomials, where much of it rings."""
    modes, slow, ringing = LADDER[rung] - 1, found.slow, found.ringing
    followed = (2 * slow + 1) * (found.edges.size - 1)
    rung_by = max(ringing.modes, modes // 2 - 1 - slow) * (ringing.edges.size - 1)
    return (followed + ringing.points.size / RULE.points.size * rung_by) * (modes + 5 * slow) ** 2


def _work(elements: float, slow: int, modes: int) -> float:
    """About proportional to the time that so many elements take."""
    return elements * (2 * slow + 1) * (modes + 5 * slow) ** 2
