"""The pin's design as a program in u = 1 - (d/D)^2 at stations: least u, weights, and the deflection's coefficients.

    minimise  sum s_i u_i   subject to  l_i <= u_i <= 1,  sum s_i (B_i/v(u_i) + S_i phi(u_i)) <= 1

with s_i the quadrature shares (they add up to 1), so that the objective is the mass over that of the solid pin, and the
deflection over its limit: nothing depends on the unit or the size of the pin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import InternalForces, forces_at
from solvers.pin.ring import ovalization
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.demand import Demand, least_wall, section_demands, shear_demand, uses
from solvers.pin.section.flexibility import (
    ShearFlexibility,
    cowper,
    deflection_terms,
    flexibility_values,
    product,
)
from solvers.pin.section.variables import solidity_of, wall_of
from solvers.pin.stations.lobatto_panels import NODES, Stations

Array = NDArray[np.float64]
Folded = TypeVar("Folded")
"""The pin's program or another with ``stations``, ``lower``, ``bending``, ``shear`` and ``anchor``."""
_NEARLY_SOLID = 0.99
"""Of u above this the root of 1 - u has lost a digit."""


@dataclass(frozen=True)
class Program:
    """One discretised design problem; arrays of shape (n,).

    ``demands`` are the strength demands at the stations, ``lower`` the least u that strength, wall and ring allow,
    ``bending`` and ``shear`` the deflection's coefficients in metres, ``limit`` the greatest deflection (None: none),
    ``anchor`` the station index at which the second half begins (n for a pin whose half stands for both).
    """

    scene: Scene
    limits: Limits
    criterion: Criterion
    physics: Physics
    stations: Stations
    demands: tuple[Demand, ...]
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

    def volume(self, solidity: Array) -> float:
        """Mass over the mass of the solid pin."""
        return float(self.share @ solidity)

    def deflection(self, solidity: Array) -> float:
        """Deflection of the middle [m]; inf where something must be held by nothing."""
        bend, shear = flexibility_values(solidity, self.law)
        return float(self.share @ (product(self.bending, bend) + product(self.shear, shear)))

    def uses(self, wall: Array) -> Array:
        """How much of the strength the criterion and the shear allowable use, (2, n): see ``demand.uses``."""
        return uses(self.demands, wall)

    @property
    def solid_mass(self) -> float:
        g = self.scene.geometry
        return self.scene.material.density * g.area * g.length


def refined(program: Program, which: NDArray[np.bool_]) -> Stations:
    """The program's stations with some panels halved, in both halves alike."""
    return program.stations.halved(which if program.scene.symmetric else which | which[::-1])


def folded(program: Folded) -> Folded:
    """The program of a pin or a bushing whose two halves are alike: each station must meet the demands of both."""
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


def least_walls_at(scene: Scene, criterion: Criterion, floor: float, x: Array) -> Array:
    """The least relative wall at any places x of the first half, for a pin whose halves are alike."""
    ahead = least_wall(demands_at(scene, criterion, x, x), floor, x.size)
    if scene.symmetric:
        return ahead
    behind = scene.geometry.length - x
    return np.maximum(ahead, least_wall(demands_at(scene, criterion, behind, behind), floor, x.size))


def demands_at(
    scene: Scene, criterion: Criterion, x: Array, side: Array, rest: Array | float = 0.0
) -> tuple[Demand, ...]:
    """Every strength demand of every load case at stations; ``rest`` as in ``forces_at``."""
    found: list[Demand] = []
    for case in scene.cases:
        forces = forces_at(case, x, side, rest)
        found += strength_demands(scene, criterion, forces)
    return tuple(found)


def strength_demands(scene: Scene, criterion: Criterion, forces: InternalForces) -> tuple[Demand, ...]:
    """The criterion's demands and that of the separate shear allowable."""
    diameter, material = scene.geometry.outer_diameter, scene.material
    law = criterion.law(material)
    return section_demands(criterion, forces, diameter, material) + shear_demand(forces, diameter, material, law)


def wall_floor(scene: Scene, limits: Limits) -> float:
    """The least relative wall that the limits on wall, ovalization and hoop stress allow; NaN where not even a solid
    pin keeps them. Raises InvalidInput for a wall beyond the radius."""
    g, m = scene.geometry, scene.material
    floor = 2.0 * limits.min_wall / g.outer_diameter
    if floor > 1.0:
        raise InvalidInput("limits.min_wall", "is more than the pin's radius", "at most half the outer diameter")
    if scene.force == 0:
        return floor
    of_pin = scene.force, g.outer_diameter, g.length, m.elastic_modulus, m.poisson
    for limit, greatest in (
        (limits.max_ovalization, ovalization.greatest_ratio),
        (limits.max_ring_stress, ovalization.ratio_within_stress),
    ):
        ratio = None if limit is None else greatest(limit, *of_pin)
        if ratio is not None:
            floor = max(floor, 1.0 - ratio)
        elif limit is not None:
            return math.nan
    return floor


def assemble(
    scene: Scene,
    limits: Limits,
    criterion: Criterion,
    physics: Physics,
    stations: Stations,
    law: ShearFlexibility | None = None,
) -> Program:
    """The program at these stations; ``lower`` is NaN where even the solid section is too weak.

    ``law`` is how sections shear, Cowper's unless another is given.
    """
    g, m = scene.geometry, scene.material
    demands = demands_at(scene, criterion, stations.x, stations.side, stations.rest)
    floor = wall_floor(scene, limits)
    wall = least_wall(demands, floor, stations.x.size)
    forces = forces_at(scene.cases[0], stations.x, stations.side, stations.rest)
    unit_moment, unit_shear = scene.reference.unit_load(stations.x, stations.rest)
    # A station on an end of the span lies inside only if its panel does.
    inside = (stations.side >= scene.reference.left) & (stations.side < scene.reference.right)
    bending, shear = deflection_terms(
        forces.moment[0], forces.shear[0], unit_moment, unit_shear,
        m.elastic_modulus, m.shear_modulus, g.inertia, g.area,
    )  # fmt: skip
    bending = np.where(inside, np.maximum(bending, 0.0), 0.0) * g.length
    shear = np.where(inside, np.maximum(shear, 0.0), 0.0) * g.length
    if not physics.shear_deflection:
        shear = np.zeros_like(shear)
    middle = 0.5 * g.length
    anchor = stations.x.size if scene.symmetric else int(np.searchsorted(stations.side, middle, side="left"))
    return Program(
        scene, limits, criterion, physics, stations, demands, floor, solidity_of(wall), bending, shear,
        law or cowper(m.poisson), limits.max_deflection, anchor,
    )  # fmt: skip


def bore_of(program: Program, solidity: Array) -> Array:
    """The bore d = D (1 - w) [m] of u."""
    return program.scene.geometry.outer_diameter * (1.0 - wall_of(solidity))


def walls_of(program: Program, solidity: Array) -> Array:
    """The relative wall w of u at every station of a whole program.

    u = 1 - (d/D)^2 does not know a bore below 1e-8 of the diameter. Where it is the least that some station may have,
    w is that station's, first of all its own, as it was found there.
    """
    found, near = wall_of(solidity), np.flatnonzero(solidity > _NEARLY_SOLID)
    if not near.size:
        return found
    demands = [replace(demand, bending=demand.bending[near], shear=demand.shear[near]) for demand in program.demands]
    least = least_wall(demands, program.floor, near.size)
    rising = np.sort(least)
    lower, own, wanted = solidity_of(rising), solidity_of(least), solidity[near]
    like = np.searchsorted(lower, wanted, side="right") - 1
    like = np.where((like >= 0) & (lower[like] == wanted), rising[like], found[near])
    found[near] = np.where(own == wanted, least, like)
    return found
