"""The beam-column and the compiled envelope against its boundary-value problem at high precision."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from oracles.dense import rod_stress_envelope
from oracles.textbook import rod_beam_column
from solvers.rod.strip.buckling import critical_coupling, critical_phase

L = 45.5e-3
FRACTIONS = np.linspace(0.0, 1.0, 9)


def fundamental(k: int, q: mp.mpf, z: mp.mpf) -> mp.mpf:
    """S_k(z) = z^k c_k(-q z^2)."""
    t = -q * z * z
    if abs(t) < mp.mpf("1e-8"):
        return z**k * mp.fsum((-t) ** j / mp.factorial(2 * j + k) for j in range(9))
    x = mp.sqrt(t)
    value = (mp.cos(x), mp.sin(x) / x, (1 - mp.cos(x)) / t, (x - mp.sin(x)) / x**3)[k]
    return z**k * mp.re(value)


def exact(q: float, length: float, order: int) -> list[mp.mpf]:
    """V, V' or V'' at the stations from the two boundary conditions, solved as they stand, at ample precision."""
    with mp.workdps(60 + int(2 * abs(q) ** 0.5 * length)):
        qm, l, rod = mp.mpf(q), mp.mpf(length), mp.mpf(L)
        e = rod - l
        rows = mp.matrix(
            [
                [fundamental(2, qm, l) + e * fundamental(1, qm, l), fundamental(3, qm, l) + e * fundamental(2, qm, l)],
                [
                    fundamental(0, qm, l) + e * qm * fundamental(1, qm, l),
                    fundamental(1, qm, l) + e * fundamental(0, qm, l),
                ],
            ]
        )
        c, d = mp.lu_solve(rows, mp.matrix([1, 0]))
        k = 2 - order
        return [c * fundamental(k, qm, mp.mpf(z)) + d * fundamental(k + 1, qm, mp.mpf(z)) for z in FRACTIONS * length]


def cases(count: int, seed: int) -> list[tuple[float, float]]:
    """(q, l) through zero load, weak and strong, compression up to half of buckling."""
    rng, out = np.random.default_rng(seed), []
    for _ in range(count):
        length = L * rng.uniform(0.05, 1.0)
        kind = rng.integers(3)
        if kind == 0:
            q = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-24, 0) / length**2
        elif kind == 1:
            q = 10.0 ** rng.uniform(0, 4.5) / length**2
        else:
            q = rng.uniform(0.0, 0.5) * critical_coupling(length, L)
        out.append((float(q), float(length)))
    return out


@pytest.mark.parametrize(
    ("function", "order", "limit"),
    [(rod_beam_column.curvature, 2, 1e-14), (rod_beam_column.slope, 1, 1e-14), (rod_beam_column.deflection, 0, 1e-14)],
)
def test_shape_against_sixty_digits(function, order, limit):
    for q, length in cases(150, 4 + order):
        reference = exact(q, length, order)
        got = function(rod_beam_column.solve([q], length, L), FRACTIONS * length)[:, 0]
        scale = max(abs(v) for v in reference)
        assert max(abs(mp.mpf(float(g)) - r) for g, r in zip(got, reference, strict=True)) <= limit * scale, (q, length)


def test_nearness_to_buckling_costs_no_more_than_its_condition():
    length = 23e-3
    critical = critical_coupling(length, L)
    for margin in 10.0 ** -np.arange(1.0, 13.0):
        q = critical * (1 - margin)
        got = rod_beam_column.solve([q], length, L).clamp_curvature[0]
        reference = exact(q, length, 2)[0]
        assert abs(mp.mpf(float(got)) / reference - 1) <= 30 * 2.0**-52 / margin


def test_equilibrium_of_the_whole_rod():
    """C + L D + q s = 0: the pin carries no moment."""
    for q, length in cases(100, 9):
        c = rod_beam_column.solve([q], length, L)
        residual = c.clamp_curvature + L * c.clamp_shear + q
        assert abs(residual[0]) <= 1e-13 * (abs(c.clamp_curvature[0]) + abs(L * c.clamp_shear[0]) + abs(q))


def test_buckling_is_seen():
    length = 23e-3
    critical = critical_coupling(length, L)
    assert rod_beam_column.solve([critical * (1 - 1e-12)], length, L).stable
    assert not rod_beam_column.solve([critical * (1 + 1e-12)], length, L).stable


def test_critical_phase_against_forty_digits():
    with mp.workdps(40):
        for beta in np.random.default_rng(5).uniform(1e-6, 1.0, 100):
            found = critical_phase(beta)
            b = mp.mpf(float(beta))
            root = mp.findroot(lambda x, b=b: b**2 * (mp.sin(x) - x * mp.cos(x)) + (1 - b) * x**2 * mp.sin(x), found)
            assert abs(found / root - 1) <= 4 * 2.0**-52


def random_load(rng: np.random.Generator, length: float, b: float, h: float, modulus: float) -> tuple:
    stiffness = modulus * b * h**3 / 12
    angle = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    strongest = 10.0 ** rng.uniform(-6, 4) * stiffness / length**2
    weakest = 0.9 * rng.uniform() * stiffness * critical_coupling(length, L)
    force = 0.5 * (strongest + weakest) + 0.5 * (strongest - weakest) * np.sin(angle + rng.uniform(0, 6))
    return force, 1.5e-3 * np.sin(angle)


def test_compiled_envelope_equals_the_closed_form():
    rng = np.random.default_rng(6)
    for _ in range(60):
        length, b, h, modulus = L * rng.uniform(0.1, 1.0), 9e-3, 10 ** rng.uniform(-4, -2.7), 210e9
        force, lateral = random_load(rng, length, b, h, modulus)
        high, low = np.empty((2, 25)), np.empty((2, 25))
        assert rod_stress_envelope.stress_envelope(force, lateral, modulus, b, h, length, L, high, low)
        constants = rod_beam_column.solve(12 * force / (modulus * b * h**3), length, L)
        bending = 0.5 * modulus * h * rod_beam_column.curvature(constants, np.linspace(0, length, 25)) * lateral
        direct = force / (b * h)
        scale = np.abs(bending).max() + np.abs(direct).max()
        for fibre, sign in enumerate((1, -1)):
            stress = direct + sign * bending
            assert np.abs(high[fibre] - stress.max(axis=1)).max() <= 2e-14 * scale
            assert np.abs(low[fibre] - stress.min(axis=1)).max() <= 2e-14 * scale


def test_compiled_envelope_refuses_a_buckled_strip():
    force = np.full(8, -400.0)
    out = np.empty((2, 25))
    assert not rod_stress_envelope.stress_envelope(force, np.ones(8), 210e9, 9e-3, 0.46e-3, 23e-3, L, out, out.copy())
