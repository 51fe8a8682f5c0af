"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``vibration``, which is solved for in modes (``strip_modes``) by collocation in time (``steady_motion``) on elements
between the corners of the force: those that the load names and those of friction, which bisection closes in on.

First all modes are taken on elements that follow the force; what these cannot follow of the modes' own motion they
damp. Polynomials and elements are added until both leave less than the cycle's tolerance. Corners of the force make
every mode ring, the more weakly the faster it is; how strongly is known beforehand (``ringing``), and so are the
collocation's own phase errors. From both follow how many of the slowest modes need elements that follow them, and how
fine ones, within ``MOST_FOLLOWING`` and ``MOST_ELEMENTS``: these modes are solved for again, alone. What is still left
is ``error``. Near k omega = omega_1 the remainder grows as it must. There is no damping, so exactly at a
resonance the answer is not finite, and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.periodic import grid
from solvers.numerics.periodic_radau import phase_error
from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Array, Cycle
from solvers.rod.cycle.state import ANGLE
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.modes import Driven, Motion, StripModes
from solvers.rod.vibration.natural_frequencies import StripBasis
from solvers.rod.vibration.time_mesh import WIDEST, interpolate, points, smooth_pieces, split

LEAST_ERROR = 3e-11
"""Below it lies the rounding of V''' from many polynomials."""

LADDER = (8, 11, 14, 20, 28, 40)
MOST_ELEMENTS = 2048
MOST_WORK, MOST_FOLLOWING = 4_000_000, 1_500_000
"""Of one resolution, of all modes and of some, as ``_work`` counts it: some tenth of a second and half of that."""

_MEAN_SAMPLES = 256
_STEPS = (6.0, 5.0, 4.0, 3.2, 2.5, 2.0, 1.6, 1.2)
"""Radians of the fastest mode followed that an element may have."""

_LAST_FOLLOWED = 3

_MARGIN = 4.0
"""On what modes ring, known to the leading order only."""

_SMOOTH = 0.05
"""Of the change when elements are halved, which takes twelve binary digits off an error that they resolve."""

_ROUNDING = 1e-15
_RESONANT = 1e5
_UNKNOWN = 0.1


@dataclass(frozen=True)
class RodInertia:
    """Adds the steady vibration of the strip to whatever quasi-static shape it is given."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        with one_thread():
            return _vibration(cycle)


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle: a polynomial in every element, by its values at the elements' points.

    ``samples`` has shape (elements, points, basis). ``error`` estimates what truncation leaves out, relative to the
    greatest bending; none of it is trusted to average out.
    """

    basis: StripBasis
    stiffness: float
    edges: Array
    samples: Array
    error: float
    lasting_error: float

    inclines = False

    @property
    def bent_terms(self) -> int:
        """Legendre coefficients of V''."""
        return self.basis.series(2).shape[0]

    @property
    def sunk_terms(self) -> int:
        """Legendre coefficients of V."""
        return self.basis.series(0).shape[0]

    def add(self, states: Array, bent: Array, sunk: Array) -> tuple[Array, Array]:
        """Add d to the series of V'' and V at the states' angles; what it adds to T [N] and M0 [N m] there."""
        amplitude = interpolate(self.edges, self.samples, states[ANGLE])
        bent[: self.bent_terms] += self.basis.series(2) @ amplitude
        sunk[: self.sunk_terms] += self.basis.series(0) @ amplitude
        side, moment = (self.stiffness * self.basis.values(np.zeros(1), order)[0] @ amplitude for order in (3, 2))
        return -side, moment


@dataclass(frozen=True)
class _Following:
    """As many of the slowest modes as are to be solved for alone, on elements no wider than this, and the ringing that
    leaves unknown, as shares of V'' or V''' at the clamp: their own, of a wrong phase, and that of others.

    ``closing`` is by what closing the turn was taken to enlarge theirs.
    """

    modes: int
    width: float
    phase: float
    others: float
    closing: float

    @property
    def missed(self) -> float:
        return self.phase + self.others


def _vibration(cycle: Cycle) -> SteadyVibration:
    wanted = max(0.25 * cycle.tolerance, LEAST_ERROR)
    edges, mean = smooth_pieces(cycle, wanted), float(np.mean(cycle.axial_force(grid(_MEAN_SAMPLES))))
    rungs = [n for n in LADDER if _work(edges.size, n) <= MOST_WORK] or [LADDER[0]]
    for polynomials in rungs[min(_first_rung(wanted), len(rungs) - 1) :]:
        strip = StripModes.of(cycle, polynomials, mean)
        driven = strip.driven(edges)
        found = strip.solve(driven, strip.pace.size)
        following = _following(strip, driven, found, wanted, found.amplification)
        # Where every mode known well enough to be followed is, and that is too few, more polynomials let more be.
        short = following.missed > wanted and following.modes == _followable(strip)
        if strip.tail(found) <= (wanted if short else max(wanted, 0.5 * following.missed)):
            break
    found, error = _refined(strip, found, following, wanted)
    base, closing = found, following.closing
    if following.modes:
        found = _followed(strip, base, following)
        if following.phase * (found.amplification / closing) ** 2 > wanted:
            following = _following(strip, driven, base, wanted, found.amplification)
            found = _followed(strip, base, following) if following.modes else base
    # A wrong phase counts twice where a turn nearly closes on itself: for the ringing, and for what is wrong with it.
    error += following.phase * max(1.0, found.amplification / following.closing) ** 2 + following.others
    error += strip.tail(found) + _ROUNDING * found.amplification
    if found.amplification > _RESONANT and not error < _UNKNOWN:
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        )
    samples = found.amplitudes @ strip.modes.T
    return SteadyVibration(
        strip.basis, bending_stiffness(cycle.scene, cycle.dimensions), found.edges, samples, error, error
    )


def _first_rung(wanted: float) -> int:
    """Fewer polynomials than of this one of ``LADDER`` have never been enough."""
    return 2 if wanted < 1e-7 else 1 if wanted < 1e-4 else 0


def _work(elements: int, modes: int) -> int:
    """Proportional to the time that so many elements take."""
    return elements * (modes + 6) ** 3


def _following(strip: StripModes, driven: Driven, found: Motion, wanted: float, amplification: float) -> _Following:
    """The least work that leaves less than wanted, or what leaves least within the bounds.

    Closing the turn is known to enlarge motions by as much as ``amplification``.
    """
    widths = np.minimum(np.diff(driven.edges), 0.5 * WIDEST)
    added, closing = strip.ringing(driven.edges, found.whole)
    closing = np.maximum(closing, amplification)
    ringing = _MARGIN * added * closing
    # What the elements that all modes have do not follow, and what that does to faster modes.
    share = np.minimum(np.sum(phase_error(strip.pace[:, None] * widths), axis=1), 1.0)
    unknown = ringing * share
    across = unknown[:, None] * np.minimum(strip.across(driven), 1.0)
    dephasing = share[:, None] * strip.dephasing(driven)
    best, cheapest = _Following(0, WIDEST, 0.0, float(unknown.sum()), 1.0), np.inf
    if best.missed <= wanted:
        return best
    for modes in range(1, _followable(strip) + 1):
        others = float(np.sum(unknown[modes:] + np.sum(across[:modes, modes:], axis=0)))
        late = dephasing[:modes, modes:].sum(axis=1)
        for width in _widths(strip.pace[:modes]):
            elements = int(np.sum(np.ceil(widths / width)))
            work = _work(elements, modes)
            if elements > MOST_ELEMENTS or work > MOST_FOLLOWING:
                continue
            own = (elements * phase_error(strip.pace[:modes] * width) + late) * closing[:modes]
            phase = float(np.sum(ringing[:modes] * np.minimum(own, 1.0)))
            good = phase + others <= wanted
            if (good and work < cheapest) or (cheapest == np.inf and phase + others < best.missed):
                best = _Following(modes, width, phase, others, float(closing[:modes].max()))
                cheapest = work if good else np.inf
    return best


def _followable(strip: StripModes) -> int:
    """The slower half of the modes: of the others the paces are not known well enough."""
    return strip.pace.size // 2 + 1


def _widths(pace: Array) -> Array:
    """Of elements that follow the fastest of these modes, or one nearly as fast: the others have mass, and no more."""
    return np.minimum((np.array(_STEPS) / pace[-_LAST_FOLLOWED:, None]).ravel(), 0.5 * WIDEST)


def _refined(strip: StripModes, found: Motion, following: _Following, wanted: float) -> tuple[Motion, float]:
    """All modes on elements fine enough for what no mode's own motion asks for, and the error of that."""
    error, enough = np.inf, max(wanted, 0.25 * following.missed)
    rest = _rest(strip, found, following.modes)
    while error > enough:
        # All of them: a narrow one, where the force has its peak, may hold the error as well as a wide one.
        edges = np.sort(np.concatenate([found.edges, 0.5 * (found.edges[:-1] + found.edges[1:])]))
        if error < np.inf and _work(edges.size, strip.pace.size) > MOST_WORK:
            break
        found = strip.solve(strip.driven(edges), strip.pace.size)
        coarse, rest = rest, _rest(strip, found, following.modes)
        error = _SMOOTH * strip.change(coarse, rest)
    return found, error


def _followed(strip: StripModes, base: Motion, following: _Following) -> Motion:
    """The motion with the modes that are to be followed solved for anew."""
    rest, edges = _rest(strip, base, following.modes), split(base.edges, following.width)
    fine = strip.solve(strip.driven(edges), following.modes)
    others = interpolate(rest.edges, rest.amplitudes, points(edges)).T.reshape(fine.amplitudes.shape)
    return replace(fine, amplitudes=fine.amplitudes + others)


def _rest(strip: StripModes, found: Motion, modes: int) -> Motion:
    """What is left of a motion without that of so many of the slowest modes alone."""
    if not modes:
        return found
    alone = strip.solve(strip.driven(found.edges), modes)
    return replace(found, amplitudes=found.amplitudes - alone.amplitudes)
