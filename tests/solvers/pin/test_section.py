"""The wall of a section against 50-digit arithmetic; criteria against plain formulas."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from oracles.textbook.pin_bore_iteration import factor, iterate
from solvers import pin
from solvers.pin.load.macaulay import InternalForces
from solvers.pin.optimum.design_variable import DesignVariable
from solvers.pin.section.criteria import ZHURAVSKY, ShearLaw, saint_venant
from solvers.pin.section.least_wall import least_wall
from solvers.pin.section.strength import StrengthConstraint, strength_constraints, utilisations
from tests.solvers.pin.pins import GEOMETRY, PAPER, STEEL, VAZ, exact_wall, numbers, relative, vaz


def paper_walls(m, q):
    m, q = np.atleast_1d(np.asarray(m, dtype=float)), np.atleast_1d(np.asarray(q, dtype=float))
    return least_wall([StrengthConstraint(m, q, 0.0, 0.0, ShearLaw(3.0, -3.0, 1.0))], 0.0, m.size)


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99, 0.9999])
@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.2, math.pi / 2])
def test_walls_keep_their_digits(size, angle):
    m, q = size * math.cos(angle), size * math.sin(angle)
    exact = exact_wall(m, q)
    # The root's own condition: how much an error of F moves it.
    slope = float(4 * (1 - exact) ** 3) + q * q / size
    allowed = 8e-16 * (1 + size / (slope * float(exact)))
    assert relative(paper_walls(m, q)[0], exact) <= allowed


def test_a_wall_of_a_millionth_of_the_diameter():
    """At x = 1e-7 m the bore form loses all but five digits; the wall form loses none."""
    x = 1e-7
    exact = exact_wall(*numbers(VAZ, x))
    found = 1.0 - pin.free_sizes(VAZ, PAPER, VAZ.force, np.array([x]))[0] / GEOMETRY.outer_diameter
    direct = paper_walls(*(float(v) for v in numbers(VAZ, x)))[0]
    assert relative(direct, exact) < 1e-15
    assert relative(found, exact) < 1.0  # through the bore only a glimpse is left
    assert float(exact) < 1e-9


@pytest.mark.parametrize("x", [1e-6, 1e-3, 10e-3, 20e-3, 24e-3, 24.7e-3, 25e-3, 30e-3, 39e-3, 40e-3])
@pytest.mark.parametrize("force", [15e-6, 15.0, 15e3, 18.98e3])
def test_walls_along_the_pin(x, force):
    exact = exact_wall(*numbers(vaz(force), x))
    found = paper_walls(*(float(v) for v in numbers(vaz(force), x)))[0]
    tolerance = 1e-11 if force > 18e3 else 1e-14
    assert relative(found, exact) < tolerance


def test_no_load_needs_no_wall_and_too_much_has_none():
    assert paper_walls(0.0, 0.0)[0] == 0.0
    assert np.isnan(paper_walls(0.8, 0.7)[0])
    assert paper_walls(1.0, 0.0)[0] == 1.0
    assert paper_walls(1e-300, 1e-300)[0] > 0.0


def test_limits_that_meet_to_a_billionth():
    """Of two constraints whose walls differ by 1e-9, the larger wall applies."""
    low, high = paper_walls(0.3, 0.2)[0], paper_walls(0.3 * (1 + 1e-9), 0.2 * (1 + 1e-9))[0]
    assert 0 < high - low < 1e-9


def test_walls_rise_with_the_load():
    size = np.linspace(1e-6, 0.999, 500)
    assert np.all(np.diff(paper_walls(0.6 * size, 0.6 * size)) > 0)


def test_walls_of_materials_keep_their_digits():
    for wall in (1e-15, 1e-8, 0.3, 1.0):
        with mp.workdps(50):
            u = 1 - (1 - mp.mpf(wall)) ** 2
            assert relative(DesignVariable(-1.0, 1.0, 1.0).wall_of(np.array([float(u)]))[0], mp.mpf(wall)) < 4e-16


def forces(moment=0.0, shear=0.0, axial=0.0, torque=0.0):
    return InternalForces(np.array([moment]), np.array([shear]), axial, torque)


def stress_of(criterion, d, **loads):
    wall = np.array([1.0 - d / GEOMETRY.outer_diameter])
    demands = strength_constraints(pin.CRITERIA[criterion], [forces(**loads)], GEOMETRY.outer_diameter, STEEL)
    return STEEL.allowable_stress * float(utilisations(demands, 1.0 - wall, wall).max())


def test_stresses_are_the_textbooks():
    D, d = GEOMETRY.outer_diameter, 14e-3
    sigma = 32 * 100.0 * D / (math.pi * (D**4 - d**4))
    tau = 16 * 7e3 * (D * D + D * d + d * d) / (3 * math.pi * (D**4 - d**4))
    nu = STEEL.poisson
    elastic = 4 * 7e3 * ((3 + 2 * nu) * D**2 + (1 + 2 * nu) * d**2) / (math.pi * (1 + nu) * (D**4 - d**4))
    twist = 16 * 30.0 * D / (math.pi * (D**4 - d**4))
    pull = 4e3 * 4 / (math.pi * (D * D - d * d))
    both = {"moment": 100.0, "shear": 7e3}
    assert stress_of("tresca_paper", d, **both) == pytest.approx(math.hypot(sigma, 2 * tau), rel=1e-14)
    assert stress_of("von_mises", d, **both) == pytest.approx(math.hypot(sigma, math.sqrt(3) * tau), rel=1e-14)
    assert stress_of("fibre", d, **both) == pytest.approx(max(sigma, 2 * tau), rel=1e-14)
    assert stress_of("saint_venant", d, **both) == pytest.approx(max(sigma, 2 * elastic), rel=1e-14)
    assert stress_of("tresca_paper", d, torque=30.0) == pytest.approx(2 * twist, rel=1e-14)
    assert stress_of("tresca_paper", d, axial=-4e3) == pytest.approx(pull, rel=1e-14)
    assert stress_of("tresca_paper", d, moment=100.0, axial=4e3, torque=30.0, shear=7e3) == pytest.approx(
        math.hypot(sigma + pull, 2 * (tau + twist)), rel=1e-14
    )


def test_the_elastic_shear_is_a_fifth_above_zhuravskys():
    w = 1 - 0.65
    laws = [law.c0 + w * (law.c1 + w * law.c2) for law in (saint_venant(0.3), ZHURAVSKY)]
    assert laws[0] / laws[1] == pytest.approx(1.19, abs=0.005)
    thin = [law.c0 for law in (saint_venant(0.3), ZHURAVSKY)]
    assert thin[0] == pytest.approx(thin[1], rel=1e-14)


def test_the_papers_iteration_settles_on_less_than_half_of_what_can_be_carried():
    rng = np.random.default_rng(0)
    m, q = rng.random((2, 4000))
    carried = m * m + q * q <= 1
    m, q = m[carried], q[carried]
    ratio = 1 - paper_walls(m, q)
    wild = np.array([abs(factor(*args)) >= 1 for args in zip(m, q, ratio, strict=True)])
    assert wild.mean() == pytest.approx(0.53, abs=0.02)
    for a, b, r, diverges in list(zip(m, q, ratio, wild, strict=True))[:300]:
        answer = iterate(a, b, start=min(r * (1 + 1e-3), 1.0), tolerance=1e-10)
        if diverges and abs(factor(a, b, r)) > 1.01:
            assert answer is None
        elif not diverges and answer is not None:
            assert answer.ratio == pytest.approx(r, abs=1e-6)


def test_for_this_pin_the_papers_iteration_ends_at_17_kn():
    def worst(force):
        x = np.linspace(1e-3, 40e-3, 400)
        values = [[float(v) for v in numbers(vaz(force), p, 20)] for p in x]
        m, q = np.array(values).T
        ratio = 1 - paper_walls(m, q)
        return max(abs(factor(*args)) for args in zip(m, q, ratio, strict=True))

    assert worst(17.05e3) < 1 < worst(17.2e3)


def test_a_wall_does_not_depend_on_its_neighbours():
    """Stations that ask for nothing, next to nothing, nearly all, and too much, in blocks and alone."""
    rng = np.random.default_rng(3)
    size = np.concatenate([10 ** rng.uniform(-12, 0, 600), [0.0, 1e-300, 1e-160, 1e-139, 1.0 - 1e-13, 1.0, 1.5]])
    rng.shuffle(size)
    angle = rng.uniform(0.0, 0.5 * math.pi, size.size)
    m, q = size * np.cos(angle), size * np.sin(angle)
    together = paper_walls(m, q)
    alone = np.array([paper_walls(*pair)[0] for pair in zip(m, q, strict=True)])
    # A block steps on until its last station has settled, which moves a heavy one by what rounding makes of its F.
    assert together == pytest.approx(alone, rel=1e-14, abs=0, nan_ok=True)
    assert np.array_equal(np.isnan(together), m * m + q * q > 1.0)


@pytest.mark.parametrize("share", [1e-9, 1e-4, 0.1, 0.7])
def test_axial_force_and_torque_all_along_in_fifty_digits(share):
    """v = F(w) with F from the forces as they stand, by bisection."""
    m, q = share * np.array([0.0, 0.3, 0.9, 0.2]), share * np.array([0.0, 0.5, 0.1, 0.1])
    n, t = 0.2 * share, 0.15 * share
    law = saint_venant(0.3)
    found = least_wall([StrengthConstraint(m, q / law.c0, n, t, law)], 0.0, m.size)
    for k in range(m.size):
        with mp.workdps(50):
            low, high = mp.mpf(0), mp.mpf(1)
            for _ in range(170):
                w = (low + high) / 2
                b = 1 - w
                p = mp.mpf(m[k]) + mp.mpf(n) * (1 + b * b)
                r = mp.mpf(q[k] / law.c0) * (law.c0 + law.c1 * w + law.c2 * w * w) + mp.mpf(t)
                low, high = (low, w) if 1 - b**4 > mp.sqrt(p * p + r * r) else (w, high)
            assert relative(found[k], high) < 2e-15


def test_a_floor_that_does_not_exist_is_no_wall():
    none = least_wall([StrengthConstraint(np.array([0.1]), np.array([0.1]), 0.0, 0.0, ZHURAVSKY)], math.nan, 1)
    assert np.isnan(none[0])
