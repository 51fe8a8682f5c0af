"""The second order of V/l against the exact elastica, solved as a boundary-value problem."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from solvers.rod.cycle.composition import BeamColumn, bending_stiffness
from solvers.rod.strip.elastica import ElasticaExpansion
from tests.solvers.rod.machines import PAPER, STRIP

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
def elastica(force, stroke):
    """The exact strip, solved in lengths of the strip.

    In metres solve_bvp's tolerance for Newton's method, which goes with the mesh's step, lies at rounding level, and
    the last bit of the start decides whether it converges.
    """
    l = STRIP.l
    q, e, s = force / EI * l**2, E / l, stroke / l

    def equations(x, y, p):
        return np.vstack([y[1], q * np.sin(y[0]) + p[0] * np.cos(y[0]), np.sin(y[0])])

    def ends(a, b, p):
        turn = b[0]
        moment = b[1] + e * (q * np.sin(turn) + p[0] * np.cos(turn))
        return np.array([a[0], a[2], b[2] + e * np.sin(turn) - s, moment])

    mesh = np.linspace(0.0, 1.0, 81)
    linear = BeamColumn().bend(PAPER, STRIP, np.array([force]), np.array([stroke]))
    start = np.stack(
        [linear.slope(mesh * l)[:, 0], linear.curvature(mesh * l)[:, 0] * l, linear.deflection(mesh * l)[:, 0] / l]
    )
    guess = -linear.side_force() / EI * l**2
    found = solve_bvp(equations, ends, mesh, start, p=guess, tol=1e-9, max_nodes=50_000)
    assert found.success
    return Elastica(found, found.p / l**2)


def errors(force, stroke):
    """Relative errors of the linear and of the corrected shape: (curvature, side force) each."""
    exact = elastica(force, stroke)
    forces, strokes = np.array([force]), np.array([stroke])
    linear = BeamColumn().bend(PAPER, STRIP, forces, strokes)
    expansion = ElasticaExpansion(EI, STRIP.l, E, 1.0)
    corrected = expansion.refine(np.zeros(1), forces, strokes, linear)
    curvature, side = exact.sol(STATIONS)[1], -EI * exact.p[0]
    scale = np.abs(curvature).max()
    return [
        (np.abs(s.curvature(STATIONS)[:, 0] - curvature).max() / scale, abs(s.side_force()[0] / side - 1))
        for s in (linear, corrected)
    ]


@pytest.mark.parametrize("force", [-160.0, -30.0, 120.0, 3000.0])
def test_what_is_left_is_of_fourth_order(force):
    """Twice the stroke: four times the linear theory's error, sixteen times the corrected one's."""
    (linear, _), (corrected, _) = errors(force, 1.5e-3)
    (linear_twice, _), (corrected_twice, _) = errors(force, 3e-3)
    assert linear_twice / linear == pytest.approx(4.0, rel=0.25)
    assert corrected_twice / corrected == pytest.approx(16.0, rel=0.35)


@pytest.mark.parametrize("force", [-160.0, 120.0])
def test_the_papers_stroke_is_met_closely(force):
    linear, corrected = errors(force, 1.5e-3)
    assert max(corrected) < 1e-4
    assert corrected[0] < 0.05 * linear[0]
    assert corrected[1] < 0.1 * linear[1]


def test_the_force_along_the_strip_follows_its_tangent():
    exact = elastica(-160.0, 1.5e-3)
    linear = BeamColumn().bend(PAPER, STRIP, np.array([-160.0]), np.array([1.5e-3]))
    shape = ElasticaExpansion(EI, STRIP.l, E, 1.0).refine(np.zeros(1), np.array([-160.0]), np.array([1.5e-3]), linear)
    theta = exact.sol(STATIONS)[0]
    along = -160.0 * np.cos(theta) - EI * exact.p[0] * np.sin(theta)
    assert shape.axial_force(STATIONS)[:, 0] == pytest.approx(along, rel=2e-4)
