"""Shear flexibility against Timoshenko's equations solved as a boundary-value problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from oracles.textbook import rod_beam_column
from solvers import rod
from solvers.rod.strip.shear import critical_coupling_with_shear
from solvers.rod.strip.stiffness import bending_stiffness, shear_stiffness
from tests.solvers.rod.machines import PAPER, STRIP, bent

STUBBY = rod.Dimensions(b=9e-3, h=3e-3, l=8e-3)
LATERAL = 1e-4


def timoshenko(force, coupled=1.0):
    """psi, psi', V and Q of EI psi'' = P V' + Q with V'(1 + P/kGA) = psi - Q/kGA."""
    stiffness, shear = bending_stiffness(PAPER, STUBBY), shear_stiffness(PAPER, STUBBY)
    e, P = PAPER.mechanism.rod_length - STUBBY.l, force * coupled

    def equations(z, y, p):
        slope = (y[0] - p[0] / shear) / (1.0 + P / shear)
        return np.vstack([y[1], (P * slope + p[0]) / stiffness, slope])

    def ends(a, b, p):
        return np.array([a[0], a[2], b[2] + e * b[0] - LATERAL, stiffness * b[1] + e * (P * b[0] + p[0])])

    mesh = np.linspace(0.0, STUBBY.l, 41)
    return solve_bvp(equations, ends, mesh, np.zeros((3, 41)), p=[-1.0], tol=1e-11, max_nodes=50_000)


@pytest.mark.parametrize("force", [-3000.0, 0.0, 5000.0])
@pytest.mark.parametrize("couples", [True, False])
def test_bends_as_timoshenkos_equations_say(force, couples):
    reference = timoshenko(force, float(couples))
    shape = bent(PAPER, STUBBY, np.array([force]), np.array([LATERAL]), couples, shears=True)
    z = np.linspace(0.0, STUBBY.l, 7)
    assert reference.success
    assert shape.curvature(z)[:, 0] == pytest.approx(reference.sol(z)[1], rel=1e-7)
    assert shape.deflection(z)[:, 0] == pytest.approx(reference.sol(z)[2], rel=1e-7, abs=1e-13)
    assert shape.side_force()[0] == pytest.approx(-reference.p[0], rel=1e-7)


def test_a_thin_strip_bends_as_if_rigid_in_shear():
    thin = rod.Dimensions(b=9e-3, h=1e-6, l=23e-3)
    force, lateral = np.array([1e-9, -1e-9]), np.array([1e-3, 1e-3])
    sheared = bent(PAPER, thin, force, lateral, shears=True).curvature([0.0, 0.01])
    assert sheared == pytest.approx(bent(PAPER, thin, force, lateral).curvature([0.0, 0.01]), rel=1e-7)


def test_shear_lowers_the_critical_load_by_its_share():
    """Engesser: 1/P_s = 1/P_cr + 1/kGA holds exactly for a column hinged at both ends, here for beta -> 0."""
    length, rod_length, compliance = 1e-6, 1.0, 1e-14
    rigid = (np.pi / length) ** 2
    assert -critical_coupling_with_shear(length, rod_length, compliance) == pytest.approx(
        rigid / (1 + compliance * rigid), rel=1e-4
    )


def test_without_compliance_the_critical_load_is_the_beam_columns():
    root = critical_coupling_with_shear(STRIP.l, PAPER.mechanism.rod_length, 0.0)
    assert abs(rod_beam_column.solve(root, STRIP.l, PAPER.mechanism.rod_length).determinant[0]) < 1e-18
