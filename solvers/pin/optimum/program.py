"""The design as a discretised program at stations, in a measure u of the section's material.

    minimise  sum s_i u_i   subject to  l_i <= u_i,  sum s_i (B_i f(u_i) + S_i g(u_i)) <= limit

with s_i the quadrature weights (summing to 1) and f, g the section's bending and shear flexibility. u depends on
which diameter is sought (``solvers.pin.optimum.design_variable``). The formulation is independent of the units and the
size of the part.

Every form of ``solvers.pin.shapes`` has ``find(program, gap)``: the lightest profile on the program's stations, whose
``lower`` contains no NaN, with its bound within ``gap`` if the form can achieve that; None if even the solid pin
exceeds the deflection limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.effects import Physics
from solvers.pin.load.macaulay import InternalForces
from solvers.pin.optimum.design_variable import DesignVariable, design_variable_of
from solvers.pin.scene import Limits, Scene
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import Flexibility, cowper, densities
from solvers.pin.section.strength import StrengthConstraint, strength_constraints
from solvers.pin.stations.lobatto_panels import Stations


@dataclass(frozen=True)
class Program:
    """A discretised problem; arrays of shape (n,).

    ``moment`` and ``shear_force`` are the magnitudes of the part's own load, ``constraints`` the strength constraints
    at the stations, ``floor`` the minimum wall under the limits, ``lower`` the resulting lower bound of u (NaN: even
    the solid section fails), ``bending`` and ``shear`` the deflection coefficients B and S in metres, ``limit`` the
    maximum deflection (None: none), ``initial`` an initial guess of u, interpolated from a solution on other stations
    (None: none).
    """

    scene: Scene
    limits: Limits
    criterion: Criterion
    physics: Physics
    stations: Stations
    variable: DesignVariable
    moment: Array
    shear_force: Array
    constraints: tuple[StrengthConstraint, ...]
    floor: float
    lower: Array
    bending: Array
    shear: Array
    limit: float | None
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


def assemble(scene: Scene, limits: Limits, criterion: Criterion, physics: Physics, stations: Stations) -> Program:
    """Assemble the program at these stations; ``lower`` is NaN where even the solid section fails."""
    length, variable = scene.geometry.length, design_variable_of(scene)
    floor = variable.floor(scene, limits)
    own = scene.own_forces(stations.x, stations.side)
    constraints = constraints_at(scene, criterion, stations.x, stations.side)
    walls = variable.least_walls(constraints, floor, stations.x.size)
    variable = variable.rescaled(float(walls.max()), length)
    return Program(
        scene, limits, criterion, physics, stations, variable, own[0], own[1], constraints, floor,
        variable.solidity_of(walls), *coefficients(scene, physics, variable, own), limits.max_deflection,
    )  # fmt: skip


def coefficients(scene: Scene, physics: Physics, variable: DesignVariable, own: Array) -> tuple[Array, Array]:
    """Return the deflection coefficients B and S [m] at stations with the part's own resultants (4, n)."""
    (bending, shearing), length = variable.stiffness(scene), scene.geometry.length
    return own[2] * (length / bending), own[3] * (length / shearing if physics.shear_deflection else 0.0)


def constraints_at(scene: Scene, criterion: Criterion, x: Array, side: Array) -> tuple[StrengthConstraint, ...]:
    """Return the strength constraints of all load cases at stations x with ``side`` as in ``Stations``."""
    forces = [InternalForces(*scene.own_forces(x, side)[:2]), *scene.further_forces(x, side)]
    return strength_constraints(criterion, forces, design_variable_of(scene).unit_diameter, scene.material)


def least_walls_at(scene: Scene, criterion: Criterion, floor: float, x: Array) -> Array:
    """Return the minimum walls at positions x."""
    return design_variable_of(scene).least_walls(constraints_at(scene, criterion, x, x), floor, x.size)


@dataclass(frozen=True)
class Evaluation:
    """Walls at a program's stations with their strength utilisations, (2, n), and deflection."""

    program: Program
    walls: Array

    @cached_property
    def utilisations(self) -> Array:
        return self.program.utilisations(self.walls)

    @cached_property
    def density(self) -> Array:
        return self.program.densities(self.program.variable.solidity_of(self.walls))

    @cached_property
    def deflection(self) -> float:
        """Deflection of the middle [m]; inf where a loaded section has no wall."""
        return float(self.program.weight @ self.density)

    @property
    def deflection_error(self) -> Array:
        """Error estimate of the deflection's quadrature per panel, relative."""
        found = self.program.stations.error_estimate(self.density)
        return found / self.deflection if 0.0 < self.deflection < np.inf else np.zeros_like(found)


@dataclass(frozen=True)
class ShapeResult:
    """Lightest profile of a form.

    solidity        u at the program's stations
    volume          mass relative to the solid pin, exact for the shape
    proof           function that computes a proven lower bound of the volume over this form on these stations
    corners         (position [m], diameter [m]) vertices of a piecewise linear shape; None: given by the stations
    error_estimate  of the volume, per panel: quadrature error, or missed extrema between stations
    """

    solidity: Array
    volume: float
    proof: Callable[[], float]
    method: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    corners: tuple[tuple[float, float], ...] | None = None
    error_estimate: Array | None = None

    @cached_property
    def bound(self) -> float:
        """Lower bound of the volume, computed on first access, usually only on the final stations."""
        return min(float(self.proof()), self.volume)
