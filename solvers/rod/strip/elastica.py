"""Large displacement, to second order in V/l: the first correction of the elastica to the small-displacement strip.

Exact equilibrium of the inextensible strip, s along its axis, theta its inclination, y its offset:

    EI theta'' = P sin(theta) + Q cos(theta),  y' = sin(theta),  theta(0) = y(0) = 0
    y(l) + e sin(theta(l)) = s,  EI theta'(l) + e (P sin(theta(l)) + Q cos(theta(l))) = 0

With theta = theta_1 + theta_3, Q = Q_1 + Q_3 ordered by powers of the stroke, theta_1 = V' of the linear theory,

    EI theta_3'' - P theta_3 - Q_3 = -P theta_1^3/6 - Q_1 theta_1^2/2

a linear problem per crank angle, solved by Chebyshev collocation: the matrices differ in P alone, so the QZ form of one
pencil (C. B. Moler, G. W. Stewart, 1973) solves them all. The force along the tangent becomes
N = P (1 - theta_1^2/2) - Q_1 theta_1. What is left out is of fourth order, (V/l)^4. The axial force P(phi) stays as
the loads give it, from the kinematics of the rigid rod. Validity: sqrt(q) l below about 60 (thinner boundary layers at
the clamp are not resolved). Source: R. Frisch-Fay, Flexible Bars (1962), for the elastica; the expansion is our own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from solvers.numerics.jit import kernel
from solvers.rod.cycle.composition import Array, Cycle, Shape, bending_stiffness

_LEAST_NODES, _MORE_NODES, _MOST_NODES = 20, 8, 100


def _points(nodes: int) -> Array:
    """Chebyshev points on [0, 1] in rising order."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(nodes) / (nodes - 1))


@dataclass(frozen=True)
class CorrectedShape:
    """The linear shape and its third-order correction, the latter as Chebyshev series over the strip."""

    linear: Shape
    length: float
    stiffness: float
    turn: Array
    rise: Array
    shear: Array

    def _at(self, stations: ArrayLike, coefficients: Array) -> Array:
        at = 2.0 * np.atleast_1d(np.asarray(stations, dtype=float)) / self.length - 1.0
        return chebyshev.chebval(at, coefficients).T

    def curvature(self, stations: ArrayLike) -> Array:
        return self.linear.curvature(stations) + self._at(stations, chebyshev.chebder(self.turn) * (2.0 / self.length))

    def slope(self, stations: ArrayLike) -> Array:
        return self.linear.slope(stations) + self._at(stations, self.turn)

    def deflection(self, stations: ArrayLike) -> Array:
        return self.linear.deflection(stations) + self._at(
            stations, chebyshev.chebint(self.rise, lbnd=-1.0) * (0.5 * self.length)
        )

    def axial_force(self, stations: ArrayLike) -> Array:
        turn = self.linear.slope(stations)
        return self.linear.axial_force(stations) * (1.0 - 0.5 * turn**2) + self.linear.side_force() * turn

    def side_force(self) -> Array:
        return self.linear.side_force() - self.stiffness * self.shear

    def clamp_moment(self) -> Array:
        return self.linear.clamp_moment() + self.stiffness * (self.curvature([0.0]) - self.linear.curvature([0.0]))[0]


@dataclass(frozen=True)
class LargeDisplacement:
    """Adds the third-order correction to whatever linear shape it is given."""

    def prepare(self, cycle: Cycle) -> ElasticaExpansion:
        return ElasticaExpansion(
            stiffness=bending_stiffness(cycle.scene, cycle.dimensions),
            length=cycle.dimensions.l,
            head=cycle.scene.mechanism.rod_length - cycle.dimensions.l,
            couples=cycle.composition.beam.couples,
        )


@dataclass(frozen=True)
class ElasticaExpansion:
    """The expansion for one strip: EI, free length l, head length e, and whether the axial force bends it.

    Its errors are those of the collocation, which are not felt within its validity.
    """

    stiffness: float
    length: float
    head: float
    couples: float
    error: float = 0.0
    lasting_error: float = 0.0

    def refine(self, angle: Array, force: Array, stroke: Array, shape: Shape) -> Shape:
        stiffness, l, head = self.stiffness, self.length, self.head / self.length
        q = force * (self.couples * l * l / stiffness)
        decay = float(np.sqrt(np.max(np.maximum(q, 0.0))))
        nodes = min(_MOST_NODES, _LEAST_NODES + _MORE_NODES * math.ceil(1.5 * decay / _MORE_NODES))
        turn = shape.slope(_points(nodes) * l).T
        shear = shape.side_force() * (-l * l / stiffness)
        cubic, square = turn**3 / 6.0, turn**2 / 2.0
        bent = -q[:, None] * cubic - shear[:, None] * square
        right = np.zeros((angle.size, nodes + 2))
        right[:, :nodes] = bent
        right[:, nodes] = -head * bent[:, -1]
        right[:, nodes + 1] = cubic @ _integration(nodes) + head * cubic[:, -1]
        pencil = _pencil(nodes, head)
        solution = (_back_substituted(pencil.fixed, pencil.growing, q, right @ pencil.left) @ pencil.right).real
        series = _to_series(nodes)
        turn_series, rise_series = series @ solution[:, :nodes].T, series @ (solution[:, :nodes] - cubic).T
        return CorrectedShape(shape, l, stiffness, turn_series, rise_series, solution[:, nodes] / l**2)


@dataclass(frozen=True)
class _Pencil:
    """The collocated equations, fixed - q l^2 growing, both made triangular at once: one factorisation for all angles.

    Rows of right sides times ``left`` are those of the triangular systems, whose solutions times ``right`` are theta_3
    at the nodes and Q_3 l^2/EI.
    """

    fixed: NDArray[np.complex128]
    growing: NDArray[np.complex128]
    left: NDArray[np.complex128]
    right: NDArray[np.complex128]


@lru_cache(maxsize=64)
def _pencil(nodes: int, head: float) -> _Pencil:
    """In lengths of the strip, with a head of this length.

    Unknowns are theta_3'' at the nodes, theta_3'(0) and Q_3: integrals of a series keep the digits that its derivatives
    lose.
    """
    from scipy.linalg import qz

    zeta = _points(nodes)
    series = chebyshev.chebint(_to_series(nodes), lbnd=-1.0, scl=0.5)
    points = 2.0 * zeta - 1.0
    bend = np.column_stack([chebyshev.chebval(points, series).T, np.ones(nodes), np.zeros(nodes)])
    turn = chebyshev.chebval(points, chebyshev.chebint(series, lbnd=-1.0, scl=0.5)).T
    turn = np.column_stack([turn, zeta, np.zeros(nodes)])
    fixed, growing = np.eye(nodes + 2), np.zeros((nodes + 2, nodes + 2))
    fixed[:nodes, -1], growing[:nodes] = -1.0, turn
    fixed[nodes], growing[nodes] = bend[-1], -head * turn[-1]
    fixed[nodes, -1] = head
    fixed[nodes + 1] = _integration(nodes) @ turn + head * turn[-1]
    upper, other, left, right = qz(fixed, growing, output="complex")
    wanted = np.vstack([turn, np.eye(nodes + 2)[-1]]) @ right
    return _Pencil(np.ascontiguousarray(upper), np.ascontiguousarray(other), left.conj(), wanted.T.copy())


@kernel
def _back_substituted(
    fixed: NDArray[np.complex128], growing: NDArray[np.complex128], q: Array, right: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """The solutions x of (fixed - q_i growing) x = right_i, both matrices upper triangular: (angles, unknowns)."""
    count, size = right.shape
    out = np.empty_like(right)
    for i in range(count):
        for k in range(size - 1, -1, -1):
            total = right[i, k]
            for j in range(k + 1, size):
                total -= (fixed[k, j] - q[i] * growing[k, j]) * out[i, j]
            out[i, k] = total / (fixed[k, k] - q[i] * growing[k, k])
    return out


@lru_cache(maxsize=8)
def _to_series(nodes: int) -> Array:
    """Values at the Chebyshev points to coefficients."""
    x = 2.0 * _points(nodes) - 1.0
    return np.linalg.inv(chebyshev.chebvander(x, nodes - 1))


@lru_cache(maxsize=8)
def _integration(nodes: int) -> Array:
    """Clenshaw-Curtis weights on [0, 1]."""
    k = np.arange(nodes)
    moments = np.where(k % 2 == 0, 1.0 / (1.0 - np.where(k % 2 == 0, k, 0) ** 2.0), 0.0)
    return moments @ _to_series(nodes)
