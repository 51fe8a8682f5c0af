"""The design as a discretised program at stations, in a measure u of the section's material.

    minimise  sum s_i u_i   subject to  l_i <= u_i,  sum s_i (B_i f(u_i) + S_i g(u_i)) <= limit

with s_i the quadrature weights (summing to 1) and f, g the section's bending and shear flexibility. u depends on
which diameter is sought (``solvers.pin.optimum.design_variable``). The formulation is independent of the units and the
size of the part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.optimum.design_variable import DesignVariable
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import Flexibility, cowper, densities
from solvers.pin.section.strength import StrengthConstraint
from solvers.pin.stations.lobatto_panels import NODES, Stations


@dataclass(frozen=True)
class DualSolution:
    """Solution u at the stations, Lagrange multiplier of the deflection limit, and number of iterations.

    The multiplier refers to the relative deflection; 0: the limit is not binding, inf: only the solid section
    satisfies it.
    """

    solidity: Array
    multiplier: float
    iterations: int


@dataclass(frozen=True)
class Program:
    """A discretised problem; arrays of shape (n,).

    ``forces`` are those of the part's own load, ``constraints`` the strength constraints at the stations, ``floor``
    the minimum wall under the limits, ``lower`` the resulting lower bound of u (NaN: even the solid section fails),
    ``bending`` and ``shear`` the deflection coefficients B and S in metres, ``limit`` the maximum deflection (None:
    none), ``middle_index`` the index of the second half's first station (n if one half represents both), ``initial``
    an initial guess of u, interpolated from a solution on other stations (None: none).
    """

    scene: Scene
    limits: Limits
    criterion: Criterion
    physics: Physics
    stations: Stations
    variable: DesignVariable
    forces: InternalForces
    constraints: tuple[StrengthConstraint, ...]
    floor: float
    lower: Array
    bending: Array
    shear: Array
    limit: float | None
    middle_index: int
    initial: Array | None = None

    @property
    def law(self) -> Flexibility:
        """The law of the flexibilities."""
        return cowper(self.scene.material.poisson, self.variable.kappa)

    @property
    def weight(self) -> Array:
        return self.stations.weight

    @property
    def mass_unit(self) -> float:
        """Mass [kg] of a part with u = 1 throughout."""
        return self.variable.mass_unit(self.scene)

    def volume(self, u: Array) -> float:
        """Mass relative to ``mass_unit``."""
        return float(self.weight @ u)

    def densities(self, u: Array) -> Array:
        """Deflection density at every station [m]."""
        return densities(u, self.bending, self.shear, self.law)

    def deflection(self, u: Array) -> float:
        """Deflection of the middle [m]; inf where a loaded section has no wall."""
        return float(self.weight @ self.densities(u))

    def utilisations(self, walls: Array) -> Array:
        """Strength utilisation of the criterion and of the shear allowable, (2, n)."""
        return self.variable.utilisations(self.constraints, walls)


def refined(program: Program, excess: Array, values: Array) -> Stations:
    """Refine the panels whose error estimate for ``values`` exceeds the tolerance, symmetrically for two halves.

    ``excess`` (n/NODES,) is the ratio of estimate to tolerance (see ``Stations.refined``).
    """
    if program.scene.symmetric:
        return program.stations.refined(excess, values)
    return program.stations.halved(np.maximum(excess, excess[::-1]) > 1.0)


def folded(program: Program) -> Program:
    """Return the program of a symmetric part on one half: each station must satisfy the constraints of both halves."""
    half = program.middle_index
    if half == program.lower.size:
        return program

    def mean(values: Array) -> Array:
        return 0.5 * (values[:half] + values[half:][::-1])

    return replace(
        program,
        stations=program.stations.first(half // NODES),
        lower=np.maximum(program.lower[:half], program.lower[half:][::-1]),
        bending=mean(program.bending),
        shear=mean(program.shear),
    )


def unfolded(program: Program, half: Array) -> Array:
    """Expand values of one half to the stations of the whole program."""
    return half if program.middle_index == program.lower.size else np.concatenate([half, half[::-1]])


def monotone_majorant(values: Array, middle_index: int) -> Array:
    """Return the least majorant that is non-decreasing from both ends toward the middle, between stations
    ``middle_index`` - 1 and ``middle_index``."""
    first = np.maximum.accumulate(values[:middle_index])
    second = np.maximum.accumulate(values[middle_index:][::-1])[::-1]
    return np.concatenate([first, second])
