"""Large displacement, to second order in V/l: the first correction of the elastica to the small-displacement strip.

Exact equilibrium of the inextensible strip, s along its axis, theta its inclination, y its offset:

    EI theta'' = P sin(theta) + Q cos(theta),  y' = sin(theta),  theta(0) = y(0) = 0
    y(l) + e sin(theta(l)) = s,  EI theta'(l) + e (P sin(theta(l)) + Q cos(theta(l))) = 0

With theta = theta_1 + theta_3, Q = Q_1 + Q_3 ordered by powers of the stroke, theta_1 = V' of the linear theory,

    EI theta_3'' - P theta_3 - Q_3 = -P theta_1^3/6 - Q_1 theta_1^2/2

a linear problem per crank angle, solved by Chebyshev collocation. The force along the tangent becomes
N = P (1 - theta_1^2/2) - Q_1 theta_1. What is left out is of fourth order, (V/l)^4. The axial force P(phi) stays as
the loads give it, from the kinematics of the rigid rod. Validity: sqrt(q) l below about 60 (thinner boundary layers at
the clamp are not resolved). Source: R. Frisch-Fay, Flexible Bars (1962), for the elastica; the expansion is our own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from solvers.rod.cycle import Array, Cycle, Shape, bending_stiffness

_LEAST_NODES = 20
_MOST_NODES = 96


@lru_cache(maxsize=8)
def _collocation(nodes: int) -> tuple[Array, Array]:
    """Chebyshev points on [0, 1] in rising order and the differentiation matrix on them."""
    x = -np.cos(np.pi * np.arange(nodes) / (nodes - 1))
    weight = np.where((np.arange(nodes) == 0) | (np.arange(nodes) == nodes - 1), 2.0, 1.0) * (-1.0) ** np.arange(nodes)
    difference = x[:, None] - x[None, :] + np.eye(nodes)
    matrix = np.outer(weight, 1.0 / weight) / difference
    matrix -= np.diag(matrix.sum(axis=1))
    return 0.5 * (x + 1.0), 2.0 * matrix


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
        stiffness, l, e = self.stiffness, self.length, self.head
        q = force / stiffness * self.couples
        decay = float(np.sqrt(np.max(np.maximum(q, 0.0))) * l)
        nodes = int(min(_MOST_NODES, _LEAST_NODES + 1.5 * decay))
        zeta, D = _collocation(nodes)
        D = D / l
        turn = shape.slope(zeta * l).T
        shear = -shape.side_force() / stiffness
        # Unknowns: theta_3 at the nodes and Q_3/EI; one system an angle.
        matrix = np.zeros((angle.size, nodes + 1, nodes + 1))
        right = np.zeros((angle.size, nodes + 1))
        matrix[:, :nodes, :nodes] = D @ D - q[:, None, None] * np.eye(nodes)
        matrix[:, :nodes, nodes] = -1.0
        cubic, square = turn**3 / 6.0, turn**2 / 2.0
        right[:, :nodes] = -q[:, None] * cubic - shear[:, None] * square
        matrix[:, 0, :] = 0.0
        matrix[:, 0, 0] = 1.0
        right[:, 0] = 0.0
        matrix[:, nodes - 1, :nodes] = D[-1]
        matrix[:, nodes - 1, nodes - 1] += e * q
        matrix[:, nodes - 1, nodes] = e
        right[:, nodes - 1] = e * (q * cubic[:, -1] + shear * square[:, -1])
        weights = _integration(nodes) * l
        matrix[:, nodes, :nodes] = weights
        matrix[:, nodes, nodes - 1] += e
        right[:, nodes] = cubic @ weights + e * cubic[:, -1]
        solution = np.linalg.solve(matrix, right[..., None])[..., 0]
        series = _to_series(nodes)
        turn_series, rise_series = series @ solution[:, :nodes].T, series @ (solution[:, :nodes] - cubic).T
        return CorrectedShape(shape, l, stiffness, turn_series, rise_series, solution[:, nodes])


@lru_cache(maxsize=8)
def _to_series(nodes: int) -> Array:
    """Values at the Chebyshev points to coefficients."""
    x = 2.0 * _collocation(nodes)[0] - 1.0
    return np.linalg.inv(chebyshev.chebvander(x, nodes - 1))


@lru_cache(maxsize=8)
def _integration(nodes: int) -> Array:
    """Clenshaw-Curtis weights on [0, 1]."""
    k = np.arange(nodes)
    moments = np.where(k % 2 == 0, 1.0 / (1.0 - np.where(k % 2 == 0, k, 0) ** 2.0), 0.0)
    return moments @ _to_series(nodes)
