"""The bushing's design as a program in y = (D^2 - d^2)/l^2 at stations, l the bore (without one: a size of the load).

    minimise  sum s_i y_i   subject to  y_i >= l_i,  sum s_i (B_i f(y_i) + S_i g(y_i)) <= limit

f is the section's bending flexibility over 64/(E pi l^4), g its shear flexibility over 4/(G pi l^2)
(``solvers.pin.section.tube``), kappa = 1 with a bore and 0 without. Both are convex for every y > 0, so unlike the
pin's this program is convex as it stands. It has a feasible point for every finite load and every deflection limit:
more material always helps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.bushing.scene import BushingScene
from solvers.pin.bushing.section import Pull, least_gap, pulls_at, utilisation
from solvers.pin.effects import Physics
from solvers.pin.limits import Limits
from solvers.pin.load.internal_forces import forces_at
from solvers.pin.load.macaulay import breakpoints
from solvers.pin.ring import ovalization
from solvers.pin.section.criteria import ALLOWABLE_SHEAR, Criterion
from solvers.pin.section.flexibility import cowper
from solvers.pin.section.tube import bending, shearing
from solvers.pin.stations.lobatto_panels import Stations, first_stations, panel_edges

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BushingProgram:
    """One discretised problem; arrays of shape (n,).

    ``lower`` is the least y that strength, wall and ring allow, ``bending`` and ``shear`` the coefficients B and S [m],
    ``unit`` is l [m], ``anchor`` the index at which the second half begins (n where half a bushing stands for both).
    """

    scene: BushingScene
    limits: Limits
    criterion: Criterion
    stations: Stations
    pulls: tuple[Pull, ...]
    floor: float
    unit: float
    kappa: float
    lower: Array
    bending: Array
    shear: Array
    a: float
    b: float
    limit: float | None
    anchor: int

    @property
    def share(self) -> Array:
        return self.stations.share

    def volume(self, y: Array) -> float:
        """Mean of y: the mass is this times ``mass_unit``."""
        return float(self.share @ y)

    @property
    def mass_unit(self) -> float:
        return self.scene.material.density * math.pi / 4.0 * self.unit**2 * self.scene.geometry.length

    def densities(self, y: Array) -> Array:
        """The deflection's density at every station [m]; inf where something must be held by nothing."""
        return _densities(y, self.bending, self.shear, self.kappa, self.a, self.b)

    def deflection(self, y: Array) -> float:
        """Deflection of the middle [m]."""
        return float(self.share @ self.densities(y))

    def uses(self, gap: Array) -> Array:
        """Greatest G(t) of the criterion's demands and of the separate limit on the shear stress, (2, n): 1 where the
        strength is used up, inf without a wall."""
        out = np.zeros((2, gap.size))
        for pull in self.pulls:
            row = int(pull.name == ALLOWABLE_SHEAR)
            out[row] = np.maximum(out[row], utilisation(pull, self.scene.geometry.bore, gap))
        return out

    def gap_of(self, y: Array) -> Array:
        """t = D - d [m], without cancellation: z/(d + sqrt(d^2 + z)), z = y l^2."""
        z, d = y * self.unit**2, self.scene.geometry.bore
        with np.errstate(invalid="ignore"):
            return np.where(z > 0.0, z / (d + np.sqrt(d * d + z)), 0.0)

    def y_of(self, gap: Array) -> Array:
        """y = t (2d + t)/l^2."""
        return gap * (2.0 * self.scene.geometry.bore + gap) / self.unit**2


@kernel
def _densities(y: Array, bend: Array, shear: Array, kappa: float, a: float, b: float) -> Array:
    out = np.zeros_like(y)
    for i in range(y.size):
        if bend[i] == 0.0 and shear[i] == 0.0:
            continue
        out[i] = (
            np.inf if y[i] <= 0.0 else bend[i] * bending(y[i], kappa)[0] + shear[i] * shearing(y[i], kappa, a, b)[0]
        )
    return out


def opening_stations(scene: BushingScene, further: tuple[float, ...] = ()) -> Stations:
    """As for a pin: every place where a load begins, the middle, and the deflection's references."""
    length, r = scene.geometry.length, scene.reference
    places = {*breakpoints(scene.cases, length), r.left, r.right, *further}
    edges = panel_edges(places, length, scene.symmetric)
    return first_stations(edges, length * (0.5 if scene.symmetric else 1.0), dict(scene.geometry.places))


def gap_floor(scene: BushingScene, limits: Limits) -> float:
    """The least t = D - d [m] that the limits on wall, ovalization and hoop stress allow; inf where not even a solid
    bar is round enough (its ovalization does not depend on the diameter)."""
    g, m, floor = scene.geometry, scene.material, 2.0 * limits.min_wall
    if scene.force == 0:
        return floor
    if limits.max_ring_stress is not None:
        outer = ovalization.outer_within_stress(
            limits.max_ring_stress, scene.force, g.bore, g.length, m.elastic_modulus, m.poisson
        )
        floor = max(floor, outer - g.bore)
    if limits.max_ovalization is None:
        return floor
    ratio = ovalization.greatest_ratio(limits.max_ovalization, scene.force, 1.0, g.length, m.elastic_modulus, m.poisson)
    if ratio is None:
        return math.inf
    return max(floor, g.bore * (1.0 - ratio) / ratio) if ratio > 0.0 else (math.inf if g.bore > 0.0 else floor)


def assemble(
    scene: BushingScene, limits: Limits, criterion: Criterion, physics: Physics, stations: Stations
) -> BushingProgram:
    """The program at these stations."""
    g, m = scene.geometry, scene.material
    wanted = pulls_at(scene, criterion, stations.x, stations.side, stations.rest)
    floor = gap_floor(scene, limits)
    gap = np.full(stations.x.size, floor)
    for pull in wanted:
        gap = np.maximum(gap, least_gap(pull, g.bore))
    unit = g.bore or float(gap.max()) or g.length
    forces = forces_at(scene.cases[0], stations.x, stations.side, stations.rest)
    unit_moment, unit_shear = scene.reference.unit_load(stations.x, stations.rest)
    inside = (stations.side >= scene.reference.left) & (stations.side < scene.reference.right)
    bent = forces.moment[0] * unit_moment * 64.0 / (m.elastic_modulus * math.pi * unit**4)
    sheared = forces.shear[0] * unit_shear * 4.0 / (m.shear_modulus * math.pi * unit**2)
    law = cowper(m.poisson)
    middle = 0.5 * g.length
    zero = np.zeros_like(bent)
    return BushingProgram(
        scene, limits, criterion, stations, wanted, floor, unit, 1.0 if g.bore > 0.0 else 0.0,
        gap * (2.0 * g.bore + gap) / unit**2,
        np.where(inside, np.maximum(bent, 0.0), 0.0) * g.length,
        np.where(inside, np.maximum(sheared, 0.0), 0.0) * g.length if physics.shear_deflection else zero,
        law.a, law.b, limits.max_deflection,
        stations.x.size if scene.symmetric else int(np.searchsorted(stations.side, middle, side="left")),
    )  # fmt: skip


def refined(program: BushingProgram, which: NDArray[np.bool_]) -> Stations:
    """The program's stations with some panels halved, in both halves alike."""
    return program.stations.halved(which if program.scene.symmetric else which | which[::-1])
