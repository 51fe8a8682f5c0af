"""The compiled envelope: through no load at all and at its own switches against high precision; many strips as one."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from oracles.dense import rod_stress_envelope

MODULUS, B, H, LENGTH, ROD = 210e9, 9e-3, 0.46e-3, 23e-3, 45.5e-3
STIFFNESS = MODULUS * B * H**3 / 12


def exact_curvature(force: float, length: float, steps: int) -> list[float]:
    """V'' per unit lateral displacement at the stations, from the four boundary conditions, at two hundred digits."""
    with mp.workdps(200):
        l, e = mp.mpf(length), mp.mpf(ROD) - mp.mpf(length)
        q = 12 * mp.mpf(force) / (mp.mpf(MODULUS) * mp.mpf(B) * mp.mpf(H) ** 3)
        if abs(q) < 1e-40:
            q = mp.mpf(10) ** -40
        k = mp.sqrt(q)
        cosh, sinh = (lambda z: mp.re(mp.cosh(k * z))), (lambda z: mp.re(mp.sinh(k * z) / k))
        # V = A (cosh - 1)/q + D (sinh - z)/q, V'' = A cosh + D sinh: V + e V' is one at the head, V'' + e V''' zero.
        rows = [
            [(cosh(l) - 1) / q + e * sinh(l), (sinh(l) - l) / q + e * (cosh(l) - 1) / q],
            [cosh(l) + e * q * sinh(l), sinh(l) + e * cosh(l)],
        ]
        a, d = mp.lu_solve(mp.matrix(rows), mp.matrix([1, 0]))
        return [float(a * cosh(l * j / steps) + d * sinh(l * j / steps)) for j in range(steps + 1)]


@pytest.mark.parametrize("steps", [12, 17, 24])
@pytest.mark.parametrize(
    "scaled",
    [
        0.0,
        1e-300,
        -1e-300,
        1e-16,
        -1e-16,
        1e-8,
        -1e-8,
        1e-3,
        -1e-3,
        1.0,
        -1.0,
        8.0,
        8.1,
        20.2,
        20.3,
        -8.0,
        -8.1,
        1e3,
        1e4,
    ],
)
def test_curvature_of_one_angle(scaled, steps):
    force = scaled * STIFFNESS / LENGTH**2
    high, low = np.empty((2, steps + 1)), np.empty((2, steps + 1))
    assert rod_stress_envelope.stress_envelope(np.full(1, force), np.ones(1), MODULUS, B, H, LENGTH, ROD, high, low)
    expected = np.array(exact_curvature(force, LENGTH, steps))
    bending = 0.5 * MODULUS * H * expected
    scale = np.abs(bending).max()
    for fibre, sign in enumerate((1, -1)):
        assert np.array_equal(high[fibre], low[fibre])
        assert np.abs(high[fibre] - force / (B * H) - sign * bending).max() <= 1e-14 * scale


@pytest.mark.parametrize("angles", [1, 3, 71, 72])
def test_many_strips_are_as_one(angles):
    rng = np.random.default_rng(8)
    force, lateral = rng.uniform(-165, 400, angles), rng.uniform(-1.5e-3, 1.5e-3, angles)
    designs = np.array([B, H, LENGTH]) * rng.uniform(0.5, 1.4, (40, 3))
    high, low = np.full((2, 40, 2, 25), np.nan)
    stands = rod_stress_envelope.stress_envelopes(force, lateral, MODULUS, designs, ROD, high, low)
    assert 0 < stands.sum() < 40 or angles < 71
    for n, (b, h, l) in enumerate(designs):
        one_high, one_low = np.full((2, 2, 25), np.nan)
        assert rod_stress_envelope.stress_envelope(force, lateral, MODULUS, b, h, l, ROD, one_high, one_low) == (
            stands[n] > 0
        )
        assert np.array_equal(one_high, high[n], equal_nan=True)
        assert np.array_equal(one_low, low[n], equal_nan=True)
        assert np.isfinite(one_high).all() == (stands[n] > 0)
