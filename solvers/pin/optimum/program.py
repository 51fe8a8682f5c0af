"""The design as a discretised program at stations, in a measure u of the section's material.

    minimise  sum s_i u_i   subject to  l_i <= u_i,  sum s_i (B_i f(u_i) + S_i g(u_i)) <= limit

with s_i the quadrature shares (summing to 1) and f, g the section's bending and shear flexibility. u depends on
which diameter is sought: u = 1 - (d/D)^2 <= 1 for a pin of given outer diameter D, u = (D^2 - d^2)/l^2 for a bushing
of given bore d. The formulation is independent of the units and the size of the part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.optimum.one_station import densities
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import ShearFlexibility
from solvers.pin.section.strength import StrengthConstraint
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weighed:
    """The solution at the stations, the deflection's multiplier, and the number of rounds.

    The multiplier is per relative deflection; 0: the limit is not binding, inf: only the solid section satisfies it.
    """

    solidity: Array
    multiplier: float
    rounds: int


class Sought(Protocol):
    """Which diameter is sought, and the quantities that depend on it; ``unit_diameter`` is that of the strength
    constraints, ``kappa`` that of the flexibilities.

    Walls are D - d, relative to D or in metres; u, walls and sizes (the sought diameter [m]) are arrays (n,).
    """

    @property
    def unit_diameter(self) -> float: ...

    @property
    def kappa(self) -> float: ...

    def floor(self, scene: Scene, limits: Limits) -> float:
        """Return the minimum wall under the limits on wall, ovalization and hoop stress; not finite if infeasible."""

    def least_walls(self, constraints: tuple[StrengthConstraint, ...], floor: float, stations: int) -> Array:
        """Return the minimum walls that satisfy all constraints and the floor; NaN where even the solid section
        fails."""

    def fitted(self, walls: Array, length: float) -> Sought:
        """Return a copy with its length unit set, if that depends on the walls."""

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        """Return E I [N m^2] and G A [N] of f = g = 1, the divisors of M m and Q q that give B and S per length [1]."""

    def uses(self, constraints: tuple[StrengthConstraint, ...], walls: Array) -> Array:
        """Return the strength utilisation of the criterion and of the shear allowable, (2, n)."""

    def solidity_of(self, walls: Array) -> Array:
        """u of walls."""

    def wall_of(self, u: Array) -> Array:
        """Walls of u."""

    def walls(self, program: Program, u: Array) -> Array:
        """Walls of u at a program's stations, to the precision of the constraints."""

    def sizes(self, walls: Array) -> Array:
        """Sought diameter [m] of walls."""

    def diameters(self, sizes: Array) -> tuple[Array, Array]:
        """Bores and outer diameters [m] of sizes."""

    def pair(self, size: float) -> tuple[float, float]:
        """Bore and outer diameter [m] of one size."""

    def thinnest(self, sizes: Array) -> float:
        """The size that leaves the thinnest wall."""

    def thickness(self, wall: Array | float) -> Array | float:
        """D - d [m] of walls."""

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        """Return the stations whose hoop stress exceeds the allowable, and a description of the sizes concerned."""

    def with_wall(self, size: float, share: float) -> float:
        """Limit the size to leave at least a wall of this share of the radius."""

    def mass_unit(self, scene: Scene) -> float:
        """Mass [kg] of a part with u = 1 throughout."""

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Mass [kg] of sizes that are linear between positions x [m]."""

    def points(self, sizes: Array) -> Array:
        """D - d [m] at points of a given profile."""

    def relative(self, points: Array) -> Array:
        """Walls of D - d [m]."""

    def growth(self, thickest: float) -> float:
        """Maximum derivative of u with respect to D - d [1/m], up to the thickest wall [m]."""


@dataclass(frozen=True)
class Program:
    """A discretised problem; arrays of shape (n,).

    ``forces`` are those of the part's own load, ``constraints`` the strength constraints at the stations, ``floor``
    the minimum wall under the limits, ``lower`` the resulting lower bound of u (NaN: even the solid section fails),
    ``bending`` and ``shear`` the deflection coefficients B and S in metres, ``law`` the shear flexibility, ``limit``
    the maximum deflection (None: none), ``anchor`` the index of the second half's first station (n if one half
    represents both).
    """

    scene: Scene
    limits: Limits
    criterion: Criterion
    physics: Physics
    stations: Stations
    sought: Sought
    forces: InternalForces
    constraints: tuple[StrengthConstraint, ...]
    floor: float
    lower: Array
    bending: Array
    shear: Array
    law: ShearFlexibility
    limit: float | None
    anchor: int

    @property
    def share(self) -> Array:
        return self.stations.share

    @property
    def mass_unit(self) -> float:
        """Mass [kg] of a part with u = 1 throughout."""
        return self.sought.mass_unit(self.scene)

    def volume(self, u: Array) -> float:
        """Mass relative to ``mass_unit``."""
        return float(self.share @ u)

    def densities(self, u: Array) -> Array:
        """Deflection density at every station [m]."""
        return densities(u, self.bending, self.shear, self.sought.kappa, self.law.a, self.law.b)

    def deflection(self, u: Array) -> float:
        """Deflection of the middle [m]; inf where a loaded section has no wall."""
        return float(self.share @ self.densities(u))

    def uses(self, walls: Array) -> Array:
        """Strength utilisation of the criterion and of the shear allowable, (2, n)."""
        return self.sought.uses(self.constraints, walls)


def refined(program: Program, excess: Array, values: Array) -> Stations:
    """Refine the panels whose error estimate for ``values`` exceeds the tolerance, symmetrically for two halves.

    ``excess`` (n/NODES,) is the ratio of estimate to tolerance (see ``Stations.refined``).
    """
    if program.scene.symmetric:
        return program.stations.refined(excess, values)
    return program.stations.halved(np.maximum(excess, excess[::-1]) > 1.0)


def folded(program: Program) -> Program:
    """Return the program of a symmetric part on one half: each station must satisfy the constraints of both halves."""
    half = program.anchor
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
    return half if program.anchor == program.lower.size else np.concatenate([half, half[::-1]])


def rising(values: Array, anchor: int) -> Array:
    """Return the least majorant that is non-decreasing from both ends toward the anchor."""
    first = np.maximum.accumulate(values[:anchor])
    second = np.maximum.accumulate(values[anchor:][::-1])[::-1]
    return np.concatenate([first, second])
