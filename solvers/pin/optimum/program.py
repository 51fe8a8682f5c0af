"""The design as a program at stations, in a measure u of the material that is left of the section there.

    minimise  sum s_i u_i   subject to  l_i <= u_i,  sum s_i (B_i f(u_i) + S_i g(u_i)) <= limit

with s_i the quadrature shares (they add up to 1) and f, g the section's bending and shear flexibility. What u is
follows from which diameter is sought: u = 1 - (d/D)^2 <= 1 of a pin, whose outer diameter D is given, u = (D^2 -
d^2)/l^2 of a bushing, whose bore d is given. Either way nothing depends on the unit or the size of the part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces
from solvers.pin.optimum.found import Found
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import ShearFlexibility
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weighed:
    """u at the stations that is lightest at a price of the deflection, that price (the deflection's multiplier, per
    relative deflection; 0: no limit binds, inf: only the solid section keeps it), and the rounds it took."""

    solidity: Array
    multiplier: float
    rounds: int


class Sought(Protocol):
    """Which diameter is sought, and what follows from that. Walls are D - d, relative to D or in metres; u, walls and
    sizes (the diameter sought [m]) are arrays (n,)."""

    name: str
    kappa: float

    def constraints(self, scene: Scene, criterion: Criterion, forces: Sequence[InternalForces]) -> Any:
        """Every strength constraint of every load case at stations."""

    def floor(self, scene: Scene, limits: Limits) -> float:
        """The least wall that the limits on wall, ovalization and hoop stress allow; not finite where none does."""

    def least_walls(self, constraints: Any, floor: float, stations: int) -> Array:
        """The least walls that no constraint and not the floor undercuts; NaN where even the solid section fails."""

    def fitted(self, walls: Array, length: float) -> Sought:
        """The same with its unit of length settled, where that needs the walls."""

    def stiffness(self, scene: Scene) -> tuple[float, float]:
        """What M m [N m^2] and Q q [N] are divided by to be B and S per length [1]: E I and G A of f = g = 1."""

    def uses(self, constraints: Any, walls: Array) -> Array:
        """How much of the strength the criterion and the shear allowable use, (2, n)."""

    def densities(self, u: Array, bending: Array, shear: Array, law: ShearFlexibility) -> Array:
        """B f(u) + S g(u); inf where something must be held by nothing."""

    def solidity_of(self, walls: Array) -> Array:
        """u of walls."""

    def wall_of(self, u: Array) -> Array:
        """Walls of u."""

    def walls(self, program: Program, u: Array) -> Array:
        """Walls of u at a program's stations, to the digits that the constraints give them."""

    def sizes(self, walls: Array) -> Array:
        """The diameter sought [m]."""

    def diameters(self, sizes: Array) -> tuple[Array, Array]:
        """Bores and outer diameters [m]."""

    def pair(self, size: float) -> tuple[float, float]:
        """Bore and outer diameter [m] of one size."""

    def thinnest(self, sizes: Array) -> float:
        """Of several sizes the one that leaves the thinnest wall."""

    def thickness(self, wall: Array | float) -> Array | float:
        """D - d [m] of walls."""

    def over_ring_stress(self, scene: Scene, allowable: float, walls: Array) -> tuple[NDArray[np.bool_], str]:
        """At which stations the ring's greatest hoop stress is beyond what is allowed, and of which sizes, in words."""

    def with_wall(self, size: float, share: float) -> float:
        """The size, kept from leaving a wall thinner than this share of the radius."""

    def mass_unit(self, scene: Scene) -> float:
        """Mass [kg] of u = 1 all along."""

    def mass_of(self, scene: Scene, x: Array, sizes: Array) -> float:
        """Mass [kg] of sizes that are straight between places x [m]."""

    def points(self, sizes: Array) -> Array:
        """D - d [m] at points of a given profile."""

    def relative(self, points: Array) -> Array:
        """Walls of D - d [m]."""

    def dual_bound(self, program: Program, low: Array, multiplier: float, u: Array, monotone: bool) -> float:
        """A lower bound, proven at any multiplier, of the volume above ``low`` that keeps the deflection limit; with
        ``monotone`` u does not fall toward the middle."""

    def growth(self, thickest: float) -> float:
        """How much u changes with D - d [1/m] at most, up to a thickest one [m]."""

    def coupled(self, program: Program, low: Array, monotone: bool, gap: float) -> Found | None:
        """The lightest under a slope limit that meets a deflection limit."""


@dataclass(frozen=True)
class Program:
    """One discretised problem; arrays of shape (n,).

    ``forces`` are those of the part's own load, ``constraints`` those of strength at the stations, ``floor`` the least
    wall the limits allow, ``lower`` the least u that all of these allow (NaN: not even the solid section), ``bending``
    and ``shear`` the deflection's coefficients B and S in metres, ``law`` how sections shear, ``limit`` the greatest
    deflection (None: none), ``anchor`` the station index at which the second half begins (n where one half stands for
    both).
    """

    scene: Scene
    limits: Limits
    criterion: Criterion
    physics: Physics
    stations: Stations
    sought: Sought
    forces: InternalForces
    constraints: Any
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
        """Mass [kg] of u = 1 all along."""
        return self.sought.mass_unit(self.scene)

    def volume(self, u: Array) -> float:
        """Mass over ``mass_unit``."""
        return float(self.share @ u)

    def densities(self, u: Array) -> Array:
        """The deflection's density at every station [m]."""
        return self.sought.densities(u, self.bending, self.shear, self.law)

    def deflection(self, u: Array) -> float:
        """Deflection of the middle [m]; inf where something must be held by nothing."""
        return float(self.share @ self.densities(u))

    def uses(self, walls: Array) -> Array:
        """How much of the strength the criterion and the shear allowable use, (2, n)."""
        return self.sought.uses(self.constraints, walls)


def refined(program: Program, excess: Array, values: Array) -> Stations:
    """The program's stations with the panels cut whose doubt of ``values`` exceeds what is allowed, (n/NODES,) times
    (see ``Stations.refined``); two halves alike."""
    if program.scene.symmetric:
        return program.stations.refined(excess, values)
    return program.stations.halved(np.maximum(excess, excess[::-1]) > 1.0)


def folded(program: Program) -> Program:
    """The program of a part whose two halves are alike: each station must meet the demands of both."""
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
    """Values of one half at the stations of the whole program."""
    return half if program.anchor == program.lower.size else np.concatenate([half, half[::-1]])


def rising(values: Array, anchor: int) -> Array:
    """The least values above the given ones that rise from both ends toward the anchor."""
    first = np.maximum.accumulate(values[:anchor])
    second = np.maximum.accumulate(values[anchor:][::-1])[::-1]
    return np.concatenate([first, second])
