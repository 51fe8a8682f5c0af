"""Natural frequency of the strip in place against its transcendental equation and against finite elements."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.linalg import eigh

from solvers import rod
from solvers.rod.strip.buckling import critical_coupling, critical_force
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.natural_frequencies import (
    FEW_POLYNOMIALS,
    FEW_POLYNOMIALS_ERROR,
    POLYNOMIALS,
    all_polynomials,
    frequency_under,
)
from tests.solvers.rod.finite_elements import matrices
from tests.solvers.rod.machines import CORE, PAPER, STRIP, natural_frequency

LENGTH = PAPER.mechanism.rod_length
LINE_MASS = PAPER.material.density * STRIP.b * STRIP.h


def characteristic(k, length):
    """Determinant of pin constraint and moment-free pin over cos - cosh and sin - sinh, P = 0."""
    x, e = k * length, LENGTH - length
    c, s, ch, sh = mpmath.cos(x), mpmath.sin(x), mpmath.cosh(x), mpmath.sinh(x)
    value, first = (c - ch, s - sh), (-s - sh, c - ch)
    second, third = (-c - ch, -s - sh), (s - sh, -c - ch)
    pin = [v + e * k * d for v, d in zip(value, first, strict=True)]
    moment = [v + e * k * d for v, d in zip(second, third, strict=True)]
    return pin[0] * moment[1] - pin[1] * moment[0]


@pytest.mark.parametrize("length", [5e-3, 23e-3, 45.5e-3])
def test_without_axial_force_it_solves_the_transcendental_equation(length):
    strip = rod.Dimensions(STRIP.b, STRIP.h, length)
    found = natural_frequency(PAPER, strip, 0.0)
    speed = math.sqrt(bending_stiffness(PAPER, strip) / LINE_MASS)
    with mpmath.workdps(30):
        root = mpmath.findroot(lambda k: characteristic(k, length), math.sqrt(2 * math.pi * found / speed))
        # The first one: no sign change below it.
        signs = {mpmath.sign(characteristic(root * j / 40, length)) for j in range(2, 40)}
    assert len(signs) == 1
    assert found == pytest.approx(float(root) ** 2 * speed / (2 * math.pi), rel=1e-9)


@pytest.mark.parametrize("force", [-250.0, -165.0, 128.0, 2000.0])
def test_under_axial_force_it_matches_finite_elements(force):
    bending, geometric, mass, free, _ = matrices(STRIP.l, LENGTH)
    stiffness = bending_stiffness(PAPER, STRIP) * bending + force * geometric
    square = eigh(free.T @ stiffness @ free, LINE_MASS * free.T @ mass @ free, eigvals_only=True)[0]
    assert natural_frequency(PAPER, STRIP, force) == pytest.approx(math.sqrt(square) / (2 * math.pi), rel=1e-6)


@pytest.mark.parametrize(
    "load",
    [
        PAPER.load,
        rod.SchmidtLoad(1.4e6, 0.25, 1.16, back_pressure=1.7e6),
        rod.TableLoad((0.3, 1.0, 1.4, 4.0), (1e6, 2.5e6, 1.1e6, 1.2e6), back_pressure=1.3e6),
    ],
    ids=["about no load", "pressed on the average", "table"],
)
def test_a_check_has_it_under_the_mean_of_the_axial_force(load):
    """The mean over time, not that of the extremes; the reciprocating mass's acceleration has none."""
    scene = replace(PAPER, load=load, piston=replace(PAPER.piston, reciprocating_mass=0.05))
    angle = 2.0 * math.pi * np.arange(3600) / 3600
    mean = -(load.pressure(angle).mean() - load.reference_pressure()) * scene.piston.area
    bending, geometric, mass, free, _ = matrices(STRIP.l, LENGTH)
    stiffness = bending_stiffness(PAPER, STRIP) * bending + mean * geometric
    square = eigh(free.T @ stiffness @ free, LINE_MASS * free.T @ mass @ free, eigvals_only=True)[0]
    effects = replace(
        CORE, exclude=CORE.exclude - {"reciprocating_inertia"}, include=CORE.include | {"reciprocating_inertia"}
    )
    found = rod.check(scene, STRIP, effects).value.natural_frequency
    assert found == pytest.approx(math.sqrt(square) / (2 * math.pi), rel=2e-6)


def test_it_vanishes_where_the_strip_buckles():
    critical = critical_force(PAPER.material.elastic_modulus, STRIP.b, STRIP.h, STRIP.l, LENGTH)
    still = natural_frequency(PAPER, STRIP, 0.0)
    assert natural_frequency(PAPER, STRIP, -critical * (1 - 1e-9)) < 1e-3 * still
    assert natural_frequency(PAPER, STRIP, -critical * 1.001) == 0.0


def test_the_error_of_few_polynomials_is_within_its_bound():
    rng = np.random.default_rng(4)
    for _ in range(120):
        rod_length = 1.0 + (rng.random() < 0.8) * 10 ** rng.uniform(-3.0, 1.0)
        critical = -critical_coupling(1.0, rod_length)
        remaining = 10 ** rng.uniform(-6.0, 0.0)
        force = rng.choice([critical * (remaining - 1.0), 10 ** rng.uniform(0.0, 4.5)])
        few, many = (
            frequency_under(all_polynomials(), 1.0, 1.0, 1.0, rod_length, force, n)
            for n in (FEW_POLYNOMIALS, POLYNOMIALS)
        )
        # Beyond the bound many polynomials have rounding errors of their own, amplified near buckling as well.
        bound = (FEW_POLYNOMIALS_ERROR + 1e-15) * critical / (critical + force)
        assert few == pytest.approx(many, rel=bound)
