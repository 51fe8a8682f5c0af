"""The strip's compiled states and shapes, held against the equations in arbitrary precision and Stumpff's functions."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from oracles.textbook import rod_beam_column
from solvers.rod.cycle import state
from solvers.rod.strip import beam_column, shape
from tests.solvers.rod.machines import bend_state

ROD = 2.0


def exact(q, l, compliance):
    """psi' at the clamp, its derivative over m, and psi' at the head per unit lateral displacement, by 50 digits."""
    with mp.workdps(50):
        q, l, g = mp.mpf(q), mp.mpf(l), mp.mpf(compliance)
        e, m = mp.mpf(ROD) - l, 1 + g * q
        k = mp.sqrt(q / m)

        def turned(z):
            """psi and psi' of C = 1 and of D = 1."""
            return (
                (mp.sinh(k * z) / k if k else z, mp.cosh(k * z)),
                ((mp.cosh(k * z) - 1) / k**2 if k else z**2 / 2, mp.sinh(k * z) / k if k else z),
            )

        def sunk(z):
            """V of C = 1 and of D = 1."""
            first = (mp.cosh(k * z) - 1) / k**2 if k else z**2 / 2
            second = (mp.sinh(k * z) - k * z) / k**3 if k else z**3 / 6
            return first / m, second / m - g * z

        (psi_c, bent_c), (psi_d, bent_d) = turned(l)
        sunk_c, sunk_d = sunk(l)
        third_c, third_d = k**2 * psi_c, 1 + k**2 * psi_d
        # Pin: V(l) + e psi(l) = 1 and, with Q = EI m D, psi'(l) + e (q V'(l) + m D) = 0.
        slope_c, slope_d = psi_c / m, psi_d / m - g
        rows = mp.matrix(
            [[sunk_c + e * psi_c, sunk_d + e * psi_d], [bent_c + e * (q * psi_c), bent_d + e * (q * psi_d + m)]]
        )
        del third_c, third_d, slope_c, slope_d
        found = mp.lu_solve(rows, mp.matrix([1, 0]))
        return [mp.re(found[0]), mp.re(found[1]), mp.re(found[0] * bent_c + found[1] * bent_d)]


@pytest.mark.parametrize("compliance", [0.0, 1e-3])
@pytest.mark.parametrize("q", [-5.0, -0.5, -1e-9, 1e-12, 0.3, 1.1, 40.0, 3000.0])
def test_constants_by_fifty_digits(q, compliance):
    _, _, *found = beam_column.constants(q, 1.0, ROD, compliance)
    for value, expected in zip(found, exact(q, 1.0, compliance), strict=True):
        assert value == pytest.approx(float(expected), rel=2e-13)


def test_shapes_are_those_of_stumpffs_functions():
    q = np.concatenate([np.linspace(-9.0, 4.0, 60), np.geomspace(4.0001, 4e3, 60)])
    c = rod_beam_column.solve(q, 1.0, ROD)
    assert c.stable
    for z in (0.0, 0.1, 0.5, 0.77, 1.0):
        out = np.empty((3, q.size))
        shape.bend(q, c.clamp_curvature, c.clamp_shear, c.head_curvature, 1.0, z, *out)
        expected = (
            rod_beam_column.curvature(c, z)[0],
            rod_beam_column.slope(c, z)[0],
            rod_beam_column.deflection(c, z)[0],
        )
        for row, values in zip(out, expected, strict=True):
            assert row == pytest.approx(values, rel=1e-12, abs=1e-14 * np.abs(values).max())


def test_without_coupling_the_shape_is_a_cubic():
    """P bends nothing: V'' falls in a straight line from the clamp to the hinge beyond the head."""
    strip = state.Strip(2.0, 1.0, ROD, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1e9)
    states = np.empty((state.ROWS, 2))
    for i, force in enumerate((-7.0, 5.0)):
        bend_state(strip, force, 1.0, states, i)
    # Clamped at 0, hinged at L: M = M0 (1 - z/L), V(1) + V'(1) = 1.
    assert states[state.CLAMP] == pytest.approx(np.full(2, 1.0 / (1 / 2 - 1 / 12 + 1 - 1 / 4)), rel=1e-14)
    assert states[state.SHEAR] == pytest.approx(-states[state.CLAMP] / ROD, rel=1e-14)
