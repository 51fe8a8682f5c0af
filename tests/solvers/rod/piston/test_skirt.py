"""The skirt's wall force against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from solvers.rod.piston.skirt import both_walls


def test_what_both_walls_carry_against_quadrature():
    rng = np.random.default_rng(7)
    for _ in range(50):
        side, moment, offset, skirt = rng.normal(), rng.normal() * 0.02, rng.normal() * 5e-3, 27e-3
        total = moment + side * offset
        zero = -side * skirt**2 / (12 * total)
        points = [zero] if abs(zero) < skirt / 2 else None
        integral = quad(
            lambda s, t=side, m=total, p=skirt: abs(t / p + 12 * m * s / p**3), -skirt / 2, skirt / 2, points=points
        )[0]
        assert both_walls(abs(side), 6.0 * abs(total) / skirt) == pytest.approx(integral, rel=1e-10)
