"""The strip's own transverse inertia: its steady vibration, forced by the crank's lateral stroke.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0

V is split into the quasi-static shape, known in closed form, and a remainder d in the constrained basis of
``vibration``. In the modes of the mean force, which have unit stiffness and masses mu_n, let g be that force's shape
per unit stroke s, and mu_n c_n = int rho A omega^2 psi_n (V_static - s g) dz. Then a = c + d obeys

    mu_n a_n'' + a_n + swing sum_m G_nm (a_m - c_m) = c_n + s int rho A omega^2 psi_n g dz

without any derivative of the force: a is smooth enough where the force has corners, d has corners with it. It is
collocated in time (``steady_motion``) on elements between the corners, those that the load names and those of friction,
which bisection closes in on. Polynomials and elements are added until both leave less than the cycle's tolerance, or as
many as ``LADDER`` and ``MOST_WORK`` allow; what is left is the refinement's ``error``. A corner makes every mode of
the strip ring, the more weakly the higher it is; what elements cannot follow they damp. Near k omega = omega_1 the
remainder grows as it must. There is no damping, so exactly at a resonance the answer is not finite, and it is refused.
Validity: no parametric instability (k omega < omega_1 in every practical machine); the head's mass is not modelled.

Source: the outlook of T. A. Obolenskaya, A. S. Klochko (2014); J.-P. Berrut, L. N. Trefethen (2004) on interpolation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN, grid
from solvers.numerics.threads import one_thread
from solvers.rod.cycle import Array, Cycle, Shape, bending_stiffness
from solvers.rod.steady_motion import STAGES, nodes, steady_motion
from solvers.rod.vibration import StripBasis, strip_basis

LEAST_ERROR = 3e-11
"""Below it lies the rounding of V''' from many polynomials."""

LADDER = (8, 11, 14, 20, 28, 40)
FEWEST_ELEMENTS, MOST_ELEMENTS = 16, 256
MOST_WORK = 4_000_000
"""Of one resolution, as ``_work`` counts it: some tenths of a second."""

_NARROWEST = 1e-7 * TURN
_MOST_PIECES = 2000
_MEAN_SAMPLES = 256
_FOLLOWED, _DAMPED = 4.0, 20.0
_AHEAD, _SMOOTH = 4.0, 0.1
"""A step follows a mode over so many radians. Halving the steps resolves a mode or two more of those that corners make
ring; the rest, each weaker than the last, have less than so many times what these change."""
_ROUNDING = 1e-15
_RESONANT = 1e5
_UNKNOWN = 0.1


@dataclass(frozen=True)
class VibratingShape:
    """The quasi-static shape and the vibration beside it: ``amplitude`` holds d at the angles, (basis, angles)."""

    base: Shape
    basis: StripBasis
    stiffness: float
    amplitude: Array

    def _part(self, stations: ArrayLike, order: int) -> Array:
        return self.basis.values(np.atleast_1d(np.asarray(stations, dtype=float)), order) @ self.amplitude

    def curvature(self, stations: ArrayLike) -> Array:
        return self.base.curvature(stations) + self._part(stations, 2)

    def slope(self, stations: ArrayLike) -> Array:
        return self.base.slope(stations) + self._part(stations, 1)

    def deflection(self, stations: ArrayLike) -> Array:
        return self.base.deflection(stations) + self._part(stations, 0)

    def axial_force(self, stations: ArrayLike) -> Array:
        return self.base.axial_force(stations)

    def side_force(self) -> Array:
        return self.base.side_force() - self.stiffness * self._part([0.0], 3)[0]

    def clamp_moment(self) -> Array:
        return self.base.clamp_moment() + self.stiffness * self._part([0.0], 2)[0]


@dataclass(frozen=True)
class RodInertia:
    """Adds the steady vibration of the strip to whatever quasi-static shape it is given."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        with one_thread():
            return _vibration(cycle)


_POINTS = np.concatenate([[0.0], nodes()])
_WEIGHTS = 1.0 / np.prod(_POINTS[:, None] - _POINTS + np.eye(_POINTS.size), axis=1)
_BETWEEN = np.array([0.02, 0.3, 0.95])


@dataclass(frozen=True)
class SteadyVibration:
    """The remainder d of one cycle: a polynomial in every element, by its values at the first end and Radau's points.

    ``samples`` has shape (elements, 1 + stages, basis). ``error`` estimates what truncation leaves out, relative to the
    greatest bending; none of it is trusted to average out.
    """

    basis: StripBasis
    stiffness: float
    edges: Array
    samples: Array
    error: float
    lasting_error: float

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        return VibratingShape(shape, self.basis, self.stiffness, interpolate(self.edges, self.samples, angle))


def interpolate(edges: Array, samples: Array, angle: Array) -> Array:
    """Every angle's element's polynomial there, shape (basis, angles)."""
    return _interpolate(edges, samples, _POINTS, _WEIGHTS, np.ascontiguousarray(angle))


@kernel
def _interpolate(edges: Array, samples: Array, points: Array, weights: Array, angle: Array) -> Array:
    basis = samples.shape[2]
    out, row = np.zeros((basis, angle.size)), np.empty(basis)
    for i in range(angle.size):
        turns = angle[i] / (2.0 * math.pi)
        place = (turns - math.floor(turns)) * (2.0 * math.pi)
        k = min(np.searchsorted(edges, place, side="right"), edges.size - 1) - 1
        share = (place - edges[k]) / (edges[k + 1] - edges[k])
        total = 0.0
        row[:] = 0.0
        for m in range(points.size):
            away = share - points[m]
            if away == 0.0:
                total = 1.0
                row[:] = samples[k, m]
                break
            weight = weights[m] / away
            total += weight
            for j in range(basis):
                row[j] += weight * samples[k, m, j]
        for j in range(basis):
            out[j, i] = row[j] / total
    return out


def _points(edges: Array) -> Array:
    return (edges[:-1, None] + np.diff(edges)[:, None] * _POINTS).ravel()


@dataclass(frozen=True)
class _Motion:
    """d at the points of the elements: in the basis, and its V'' and V''' at the clamp, shape (elements, points, 2).

    ``whole`` holds the greatest V'' and V''' there with the quasi-static ones, ``amplification`` is that of closing the
    turn.
    """

    edges: Array
    samples: Array
    clamp: Array
    whole: Array
    amplification: float


@dataclass(frozen=True)
class _Strip:
    """The strip's equation in its modes under the mean force.

    ``modes`` takes amplitudes of the modes to those of the basis, ``projection`` V at the stations to int rho A omega^2
    psi_n V dz; ``unit`` is g at the stations.
    """

    cycle: Cycle
    basis: StripBasis
    stations: Array
    mean: float
    slowness: Array
    modes: Array
    coupling: Array
    projection: Array
    unit: Array

    @staticmethod
    def of(cycle: Cycle, polynomials: int, mean: float) -> _Strip:
        from scipy.linalg import LinAlgError, eigh

        scene, dimensions, beam = cycle.scene, cycle.dimensions, cycle.composition.beam
        basis = strip_basis(dimensions.l, scene.mechanism.rod_length, polynomials)
        inertia = scene.material.density * dimensions.b * dimensions.h * scene.mechanism.angular_speed**2
        system = bending_stiffness(scene, dimensions) * basis.bending + mean * beam.couples * basis.geometric
        try:
            slowness, modes = eigh(inertia * basis.mass, system)
        except LinAlgError:
            raise InvalidInput(
                "dimensions.h", "the strip buckles under the mean force of the cycle", "thicker"
            ) from None
        slowness, modes = slowness[::-1], modes[:, ::-1]
        stations, weights = basis.quadrature()
        return _Strip(
            cycle=cycle,
            basis=basis,
            stations=stations,
            mean=mean,
            slowness=slowness,
            modes=modes,
            coupling=modes.T @ basis.geometric @ modes * beam.couples,
            projection=inertia * (modes.T @ basis.values(stations, 0).T) * weights,
            unit=beam.bend(scene, dimensions, np.array([mean]), np.array([1.0])).deflection(stations)[:, 0],
        )

    @property
    def pace(self) -> Array:
        """The modes' natural frequencies [1/rad], the slowest first."""
        return 1.0 / np.sqrt(self.slowness)

    def solve(self, edges: Array, modes: int) -> _Motion:
        """d where as many of the slowest modes have mass; the others follow them without delay."""
        cycle, widths, part = self.cycle, np.diff(edges), slice(0, modes)
        angle = _points(edges)
        force, stroke = cycle.axial_force(angle), cycle.scene.mechanism.crank_radius * np.sin(angle)
        bent = cycle.composition.beam.bend(cycle.scene, cycle.dimensions, force, stroke)
        moved = self.projection[part] @ (bent.deflection(self.stations) - self.unit[:, None] * stroke)
        still, swing = (moved / self.slowness[part, None]).T, force - self.mean
        followed, held = self._condensed(swing, modes)
        right = np.einsum("pnm,pm->pn", held, still) + stroke[:, None] * (self.projection[part] @ self.unit)
        shape = (widths.size, 1 + STAGES, modes)
        stages = held.reshape(*shape, modes)[:, 1:], right.reshape(shape)[:, 1:]
        amplitude, amplification = steady_motion(widths, self.slowness[part], *stages)
        moving = amplitude - still.reshape(shape)
        found = moving @ self.modes[:, part].T
        if followed.size:
            others = np.einsum("pnm,pm->pn", followed, moving.reshape(-1, modes)) @ self.modes[:, modes:].T
            found += others.reshape(found.shape)
        clamp, stiffness = self.at_clamp(found), bending_stiffness(cycle.scene, cycle.dimensions)
        still_clamp = np.stack([bent.clamp_moment(), -bent.side_force()], axis=-1) / stiffness
        return _Motion(edges, found, clamp, np.abs(clamp.reshape(-1, 2) + still_clamp).max(axis=0), amplification)

    def _condensed(self, swing: Array, modes: int) -> tuple[Array, Array]:
        """What the other modes make of the slowest ones' amplitudes, and the stiffness that leaves to these."""
        rate, turned = np.linalg.eigh(self.coupling[modes:, modes:])
        across = turned.T @ self.coupling[modes:, :modes]
        yielding = swing[:, None] / (1.0 + swing[:, None] * rate)
        followed = -np.einsum("hk,pk,km->phm", turned, yielding, across, optimize=True)
        held = np.eye(modes) + swing[:, None, None] * self.coupling[:modes, :modes]
        held -= swing[:, None, None] * np.einsum("kn,pk,km->pnm", across, yielding, across, optimize=True)
        return followed, held

    def improve(self, found: _Motion, edges: Array, modes: int) -> tuple[_Motion, float]:
        """d with what finer elements change in as many of the slowest modes, and the greatest share of that change in
        V'' or V''' at the clamp, whichever suffers more."""
        fine, at = self.solve(edges, modes), _points(edges)
        if modes == self.pace.size:
            better, known = fine.samples, interpolate(found.edges, found.samples, at).T.reshape(fine.samples.shape)
        else:
            others = found.samples - self.solve(found.edges, modes).samples
            known = interpolate(found.edges, np.concatenate([others, found.samples], axis=2), at).T
            others, known = np.split(known.reshape(*fine.samples.shape[:2], -1), 2, axis=2)
            better = others + fine.samples
        change = float(np.max(np.abs(self.at_clamp(better - known)).max(axis=(0, 1)) / found.whole))
        return _Motion(edges, better, self.at_clamp(better), found.whole, fine.amplification), change

    def at_clamp(self, amplitude: Array) -> Array:
        """V'' and V''' there, along the last axis."""
        return np.stack([amplitude @ self.basis.values(np.zeros(1), order)[0] for order in (2, 3)], axis=-1)

    def tail(self, motion: _Motion) -> float:
        """What the last polynomials hold of V'' or V''' at the clamp, whichever suffers more; they also move others."""
        series = np.abs(motion.samples.reshape(-1, self.slowness.size) @ self.basis.combination.T).max(axis=0)
        last = slice(-(series.size // 8 + 2), None)
        shares = [np.sum(np.abs(self.basis.polynomials(0.0, order) * series)[last]) for order in (2, 3)]
        return 4.0 * float(np.max(shares / motion.whole))


def _vibration(cycle: Cycle) -> SteadyVibration:
    wanted = max(0.25 * cycle.tolerance, LEAST_ERROR)
    pieces, mean = _smooth_pieces(cycle, wanted), float(np.mean(cycle.axial_force(grid(_MEAN_SAMPLES))))
    strip, step = _Strip.of(cycle, LADDER[0], mean), 0
    rings = cycle.composition.feedback is not None or cycle.scene.load.sharp_angles().size > 0
    wide, follows = TURN / FEWEST_ELEMENTS, _FOLLOWED / strip.pace[0]
    if rings:
        wide = max(min(wide, follows), TURN / MOST_ELEMENTS)
    edges = _split(pieces, wide)
    found = strip.solve(edges, strip.pace.size)
    while strip.tail(found) > wanted and step + 1 < len(LADDER):
        if _work(edges.size, LADDER[step + 1]) > MOST_WORK:
            break
        step += 1
        strip = _Strip.of(cycle, LADDER[step], mean)
        found = strip.solve(edges, strip.pace.size)
    ahead, modes = math.inf, strip.pace.size
    # The first change must not be taken for all there is while a second mode, closer to a resonance, may ring unseen.
    while ahead > wanted or (rings and wide > 0.3 * follows):
        edges, wide = _finer(pieces, edges, wide), 0.5 * wide
        if ahead < math.inf and rings:
            # What the other modes do is known; none of them rings, as such steps damp them.
            modes = max(int(np.count_nonzero(wide * strip.pace < _DAMPED)), 2)
        if ahead < math.inf and _work(edges.size, modes) > MOST_WORK:
            break
        found, change = strip.improve(found, edges, modes)
        ahead = max((_AHEAD if rings else _SMOOTH) * change, _ROUNDING * found.amplification)
    if rings and wide > follows:
        ahead = max(ahead, float(np.max(np.abs(found.clamp).max(axis=(0, 1)) / found.whole)))
    error = ahead + strip.tail(found)
    if found.amplification > _RESONANT and not error < _UNKNOWN:
        raise InvalidInput(
            "mechanism.speed", "a harmonic of the speed meets a natural frequency of the strip", "another speed"
        )
    return SteadyVibration(
        strip.basis, bending_stiffness(cycle.scene, cycle.dimensions), found.edges, found.samples, error, error
    )


def _work(elements: int, modes: int) -> int:
    """Proportional to the time that so many elements take."""
    return elements * (modes + 6) ** 3


def _finer(pieces: Array, edges: Array, wide: float) -> Array:
    """The next elements: half as wide, those that corners made narrow only if there are no others."""
    finer = _split(pieces, 0.5 * wide)
    return finer if finer.size > edges.size else _split(edges, 0.75 * np.diff(edges))


def _split(edges: Array, wide: float | Array) -> Array:
    """The same edges, and more between them so that no element is wider."""
    widths = np.diff(edges)
    parts = np.maximum(np.ceil(widths / wide * (1.0 - 1e-9)), 1.0).astype(int)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    inner = (np.arange(first.size) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(edges[:-1], parts) + inner * np.repeat(widths, parts), edges[-1])


def _smooth_pieces(cycle: Cycle, wanted: float) -> Array:
    """Ends of pieces of the turn on which polynomials follow the axial force, or which no bisection improves."""
    corners = np.mod(cycle.corners(), TURN)
    corners = np.unique(np.concatenate([corners, [0.0, TURN]]))
    edges = _split(corners[np.diff(corners, prepend=-1.0) > _NARROWEST], TURN / FEWEST_ELEMENTS)
    edges[-1] = TURN
    at, basis = np.concatenate([_POINTS, _BETWEEN]), _WEIGHTS / (_BETWEEN[:, None] - _POINTS)
    basis /= basis.sum(axis=1, keepdims=True)
    left, right = edges[:-1], edges[1:]
    ends, largest = [edges], 0.0
    while left.size and sum(part.size for part in ends) < _MOST_PIECES:
        place = left[:, None] + (right - left)[:, None] * at
        force = cycle.axial_force(place.ravel()).reshape(place.shape)
        largest = max(largest, float(np.abs(force).max()))
        missed = np.abs(force[:, _POINTS.size :] - force[:, : _POINTS.size] @ basis.T).max(axis=1)
        rough = (missed > wanted * largest) & (right - left > 2.0 * _NARROWEST)
        left, right = left[rough], right[rough]
        middle = 0.5 * (left + right)
        ends.append(middle)
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return np.unique(np.concatenate(ends))
