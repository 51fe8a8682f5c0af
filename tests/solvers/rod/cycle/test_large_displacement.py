"""The second order of V/l against the exact elastica, solved as a boundary-value problem."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import mpmath
import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.integrate import solve_bvp

from oracles.textbook import rod_beam_column
from oracles.textbook.rod_beam_column import solve
from solvers.rod.cycle.bent_strip import BentStrip
from solvers.rod.cycle.large_displacement import ElasticaExpansion
from solvers.rod.cycle.state import FORCE
from solvers.rod.strip.buckling import critical_phase
from solvers.rod.strip.elastica_kernels import collocation, nodes_for, scratch, third_order
from solvers.rod.strip.stiffness import bending_stiffness
from tests.solvers.rod.machines import PAPER, STRIP, bent

E = PAPER.mechanism.rod_length - STRIP.l
EI = bending_stiffness(PAPER, STRIP)
STATIONS = np.linspace(0.0, STRIP.l, 7)


@dataclass(frozen=True)
class Elastica:
    """theta, theta', y at stations by ``sol``, and Q/EI in ``p``."""

    scaled: object
    p: np.ndarray

    def sol(self, stations):
        turn, bend, rise = self.scaled.sol(np.asarray(stations) / STRIP.l)
        return np.array([turn, bend / STRIP.l, rise * STRIP.l])


@lru_cache
def elastica(force, lateral):
    """The exact strip, solved in lengths of the strip.

    In metres solve_bvp's tolerance for Newton's method, which goes with the mesh's step, lies at rounding level, and
    the last bit of the start decides whether it converges.
    """
    l = STRIP.l
    q, e, s = force / EI * l**2, E / l, lateral / l

    def equations(x, y, p):
        return np.vstack([y[1], q * np.sin(y[0]) + p[0] * np.cos(y[0]), np.sin(y[0])])

    def ends(a, b, p):
        turn = b[0]
        moment = b[1] + e * (q * np.sin(turn) + p[0] * np.cos(turn))
        return np.array([a[0], a[2], b[2] + e * np.sin(turn) - s, moment])

    mesh = np.linspace(0.0, 1.0, 81)
    linear = bent(PAPER, STRIP, np.array([force]), np.array([lateral]))
    start = np.stack(
        [linear.slope(mesh * l)[:, 0], linear.curvature(mesh * l)[:, 0] * l, linear.deflection(mesh * l)[:, 0] / l]
    )
    guess = -linear.side_force() / EI * l**2
    found = solve_bvp(equations, ends, mesh, start, p=guess, tol=1e-9, max_nodes=50_000)
    assert found.success
    return Elastica(found, found.p / l**2)


def corrected_of(linear):
    """The strip with its correction."""
    q = linear.states[FORCE] * STRIP.l**2 / EI
    expansion = ElasticaExpansion(linear.strip, nodes_for(float(q.min()), float(q.max())))
    bent, sunk = np.zeros((expansion.terms, q.size)), np.zeros((expansion.terms, q.size))
    return BentStrip(linear.strip, linear.states, bent, sunk, *expansion.add(linear.states, bent, sunk), True)


def errors(force, lateral):
    """Relative errors of the linear and of the corrected shape: (curvature, side force) each."""
    exact = elastica(force, lateral)
    forces, strokes = np.array([force]), np.array([lateral])
    linear = bent(PAPER, STRIP, forces, strokes)
    corrected = corrected_of(linear)
    curvature, side = exact.sol(STATIONS)[1], -EI * exact.p[0]
    scale = np.abs(curvature).max()
    return [
        (np.abs(s.curvature(STATIONS)[:, 0] - curvature).max() / scale, abs(s.side_force()[0] / side - 1))
        for s in (linear, corrected)
    ]


@pytest.mark.parametrize("force", [-160.0, -30.0, 120.0, 3000.0])
def test_what_is_left_is_of_fourth_order(force):
    """Twice the lateral displacement: four times the linear theory's error, sixteen times the corrected one's."""
    (linear, _), (corrected, _) = errors(force, 1.5e-3)
    (linear_twice, _), (corrected_twice, _) = errors(force, 3e-3)
    assert linear_twice / linear == pytest.approx(4.0, rel=0.25)
    assert corrected_twice / corrected == pytest.approx(16.0, rel=0.35)


@pytest.mark.parametrize("force", [-160.0, 120.0])
def test_the_papers_lateral_is_met_closely(force):
    linear, corrected = errors(force, 1.5e-3)
    assert max(corrected) < 1e-4
    assert corrected[0] < 0.05 * linear[0]
    assert corrected[1] < 0.1 * linear[1]


def test_the_force_along_the_strip_follows_its_tangent():
    exact = elastica(-160.0, 1.5e-3)
    linear = bent(PAPER, STRIP, np.array([-160.0]), np.array([1.5e-3]))
    shape = corrected_of(linear)
    theta = exact.sol(STATIONS)[0]
    along = -160.0 * np.cos(theta) - EI * exact.p[0] * np.sin(theta)
    stresses = shape.fibre_stresses(STATIONS)
    assert STRIP.b * STRIP.h * stresses.mean(axis=0)[:, 0] == pytest.approx(along, rel=2e-4)


def by_power_series(q, head, lateral, terms):
    """V'''(0), Q_3, theta_3' and the offset's correction at four stations, in lengths of the strip, many digits."""
    with mpmath.workdps(150):
        q, head, lateral = mpmath.mpf(q), mpmath.mpf(head), mpmath.mpf(lateral)

        def solved(start, constant, right):
            """theta'' = q theta + constant + right with theta(0) = 0, theta'(0) = start, as a power series."""
            out = [mpmath.mpf(0), mpmath.mpf(start)]
            for j in range(terms - 2):
                out.append((q * out[j] + right[j] + (constant if j == 0 else 0)) / ((j + 1) * (j + 2)))
            return out

        def product(a, b):
            return [mpmath.fdot(a[: j + 1], b[j::-1]) for j in range(terms)]

        def value(series, at):
            return mpmath.fsum(c * at**j for j, c in enumerate(series))

        def rate(series, at):
            return mpmath.fsum(j * c * at ** (j - 1) for j, c in enumerate(series) if j)

        def integral(series, at):
            return mpmath.fsum(c * at ** (j + 1) / (j + 1) for j, c in enumerate(series))

        def ends(turn, less, right, constant):
            """Offset and moment of the pin; ``less`` is what the offset's rate is short of the turn."""
            rise = [a - b for a, b in zip(turn, less, strict=True)]
            bend = q * value(turn, 1) + constant + value(right, 1)
            return integral(rise, 1) + head * value(rise, 1), rate(turn, 1) + head * bend

        zero = [mpmath.mpf(0)] * terms
        matrix = mpmath.matrix([ends(solved(1, 0, zero), zero, zero, 0), ends(solved(0, 1, zero), zero, zero, 1)]).T
        clamp, shear = mpmath.lu_solve(matrix, mpmath.matrix([lateral, 0]))
        turn = solved(clamp, shear, zero)
        square = product(turn, turn)
        cubic = [c / 6 for c in product(square, turn)]
        right = [-q * a - shear * b / 2 for a, b in zip(cubic, square, strict=True)]
        offset, moment = ends(solved(0, 0, right), cubic, right, 0)
        third = mpmath.lu_solve(matrix, mpmath.matrix([-offset, -moment]))
        turn = solved(*third, right)
        rise = [a - b for a, b in zip(turn, cubic, strict=True)]
        stations = [mpmath.mpf(x) for x in (0, 0.125, 0.5, 1)]
        curvature = np.array([float(rate(turn, z)) for z in stations])
        return float(shear), float(third[1]), curvature, np.array([float(integral(rise, z)) for z in stations])


@pytest.mark.parametrize(
    ("q", "head", "terms"),
    [("near buckling", 0.0, 80), ("near buckling", 2.0, 80), (-5.0, 0.1, 80), (0.0, 1.0, 20), (1e-7, 1.0, 40),
     (4.1, 6.0, 80), (60.0, 1.0, 140), (900.0, 1.0, 420)],
)  # fmt: skip
def test_the_correction_is_that_of_its_equations(q, head, terms):
    if q == "near buckling":
        q = -0.97 * critical_phase(1.0 / (1.0 + head)) ** 2
    shear, side, curvature, rise = by_power_series(q, head, 0.1, terms)
    constants, tables = solve([q], 1.0, 1.0 + head), collocation(nodes_for(q, q))
    slope = np.ascontiguousarray(0.1 * rod_beam_column.slope(constants, tables.nodes)[:, 0])
    bend, offset, room = np.empty(slope.size + 1), np.empty(slope.size + 1), scratch(slope.size - 1)
    found, clamp = third_order(q, shear, head, slope, tables, room, bend, offset)
    at = legendre.legvander(2.0 * np.array([0.0, 0.125, 0.5, 1.0]) - 1.0, bend.size - 1)
    assert at @ bend == pytest.approx(curvature, abs=1e-12 * np.abs(curvature).max())
    assert clamp == pytest.approx(curvature[0], rel=1e-12)
    assert found == pytest.approx(side, rel=1e-12)
    assert at @ offset == pytest.approx(rise, abs=1e-12 * np.abs(rise).max())


@pytest.mark.parametrize("q", [2000.0, 4900.0])
def test_very_strong_tension_has_nodes_enough(q):
    """Layers of a seventieth of the strip; many more nodes change nothing."""
    head, found = E / STRIP.l, []
    constants = solve([q], 1.0, 1.0 + head)
    for nodes in (nodes_for(q, q), 240):
        tables = collocation(nodes)
        slope = np.ascontiguousarray(0.05 * rod_beam_column.slope(constants, tables.nodes)[:, 0])
        shear, series = 0.05 * float(constants.clamp_shear[0]), np.empty((2, slope.size + 1))
        found.append(third_order(q, shear, head, slope, tables, scratch(slope.size - 1), *series))
    assert found[0] == pytest.approx(found[1], rel=1e-10)
