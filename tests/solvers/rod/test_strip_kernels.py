"""The compiled strip and the one in numpy, written apart, agree to the last places."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.textbook import rod_beam_column
from solvers.rod.strip import beam_column

LENGTH, ROD = 23e-3, 45.5e-3


@pytest.mark.parametrize(("sign", "low", "high"), [(-1, -14, 0.99), (1, -14, -1), (1, -1, 0.7), (1, 0.7, 6)])
def test_constants_and_deflection_agree(sign, low, high):
    scaled = sign * np.append(10 ** np.random.default_rng(3).uniform(low, high, 300), 4.0 if sign > 0 else 1.0)
    q = scaled / LENGTH**2
    constants = rod_beam_column.solve(q, LENGTH, ROD)
    assert constants.stable
    clamp, shear, head, determinant = beam_column.solve(q, LENGTH, ROD)
    for found, expected in (
        (clamp, constants.clamp_curvature), (shear, constants.clamp_shear), (determinant, constants.determinant)
    ):  # fmt: skip
        assert found == pytest.approx(expected, rel=4e-15)
    z = np.linspace(0.0, LENGTH, 25)
    expected = rod_beam_column.deflection(constants, z)
    found = beam_column.deflection(q, LENGTH, clamp, shear, head, z)
    assert np.all(np.abs(found - expected) <= 1e-14 * np.abs(expected).max(axis=0))


def test_no_load_is_no_special_case():
    q = np.array([-1e-300, 0.0, 1e-300])
    clamp, shear, head, _ = beam_column.solve(q, LENGTH, ROD)
    found = beam_column.deflection(q, LENGTH, clamp, shear, head, np.array([0.5 * LENGTH, LENGTH]))
    assert np.all(np.ptp(found, axis=1) <= 1e-15 * found.max())
