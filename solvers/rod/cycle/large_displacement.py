"""Large displacement, to second order in V/l: the first correction of the elastica to the small-displacement strip.

Exact equilibrium of the inextensible strip, s along its axis, theta its inclination, y its offset:

    EI theta'' = P sin(theta) + Q cos(theta),  y' = sin(theta),  theta(0) = y(0) = 0
    y(l) + e sin(theta(l)) = s,  EI theta'(l) + e (P sin(theta(l)) + Q cos(theta(l))) = 0

With theta = theta_1 + theta_3, Q = Q_1 + Q_3 ordered by powers of the lateral displacement s, and theta_1 = V' of the
linear theory,

    EI theta_3'' - P theta_3 - Q_3 = -P theta_1^3/6 - Q_1 theta_1^2/2

a linear problem per crank angle, solved in Legendre polynomials (``strip.elastica_kernels``). The tangential force
becomes N = P (1 - theta_1^2/2) - Q_1 theta_1. The truncation error is of fourth order, (V/l)^4. The axial force P(phi)
is unchanged, from the kinematics of the rigid rod. Validity: sqrt(q) l below about 70; thinner boundary layers at the
clamp are not resolved.

Source: R. Frisch-Fay, Flexible Bars (1962), for the elastica; the expansion is our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import grid
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SIDE, SOFTENING, Strip
from solvers.rod.strip.elastica_kernels import Collocation, collocation, nodes_for, scratch, third_order
from solvers.rod.strip.shape import bend_at
from solvers.rod.strip.shear import slope_of

_ANGLES = grid(64)


@dataclass(frozen=True)
class LargeDisplacement:
    """Correction that adds the third order of the slope to any linear shape."""

    def prepare(self, cycle: Cycle) -> ElasticaExpansion:
        strip = cycle.strip
        q = strip.couples * cycle.axial_force(_ANGLES) * strip.length**2 / strip.stiffness
        return ElasticaExpansion(strip, nodes_for(float(q.min()), float(q.max())))

    def neighbours(self, found: ElasticaExpansion, cycles: Sequence[Cycle]) -> list[ElasticaExpansion]:
        """Prepare each strip separately, as the expansion has no adaptive resolution."""
        return [self.prepare(cycle) for cycle in cycles]


@dataclass(frozen=True)
class ElasticaExpansion:
    """The expansion for one strip. Its numerical error is that of the collocation, negligible within its validity."""

    strip: Strip
    nodes: int
    error: float = 0.0
    lasting_error: float = 0.0
    inclines = True
    highest_frequency = 0.0
    ringing = None

    @property
    def without_ringing(self) -> ElasticaExpansion:
        return self

    @property
    def terms(self) -> int:
        return self.nodes + 2

    def add(self, states: Array, curvature_series: Array, deflection_series: Array) -> tuple[Array, Array]:
        side, moment = np.empty(states.shape[1]), np.empty(states.shape[1])
        add_third_order(states, self.strip, collocation(self.nodes), curvature_series, deflection_series, side, moment)
        return side, moment


@kernel
def add_third_order(
    states: Array, strip: Strip, tables: Collocation, curvature_series: Array, deflection_series: Array, side: Array,
    moment: Array,
) -> None:  # fmt: skip
    """Kernel of ``ElasticaExpansion.add``."""
    n, l, head = tables.nodes.size - 1, strip.length, strip.rod_length - strip.length
    per_force = l * l / strip.stiffness
    slope, workspace, curvature, deflection = np.empty(n + 1), scratch(n), np.empty(n + 2), np.empty(n + 2)
    for i in range(states.shape[1]):
        for k in range(n + 1):
            z = tables.nodes[k] * l
            _, psi, _ = bend_at(states[COUPLING, i], states[CLAMP, i], states[SHEAR, i], states[HEAD, i], l, z)
            slope[k] = slope_of(psi, states[SOFTENING, i], strip.compliance, states[SHEAR, i])
        q = strip.couples * states[FORCE, i] * per_force
        third_side, third_clamp = third_order(
            q, -states[SIDE, i] * per_force, head / l, slope, tables, workspace, curvature, deflection
        )
        for k in range(n + 2):
            curvature_series[k, i] += curvature[k] / l
            deflection_series[k, i] += deflection[k] * l
        side[i], moment[i] = -third_side / per_force, strip.stiffness / l * third_clamp
