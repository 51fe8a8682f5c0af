"""The steps of the proof, each on random boxes: what is said of a box holds for the strips sampled in it."""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest

from solvers import rod
from solvers.fatigue import gerber, serensen
from solvers.materials import Material
from solvers.rod.optimum.core.cycle import core_cycle
from solvers.rod.optimum.proof.bound_tightening import contract
from solvers.rod.optimum.proof.box_bounds import box_bound, fill_curvatures, workspace
from solvers.rod.optimum.proof.branch_and_bound import prove
from solvers.rod.optimum.proof.intervals import (
    BY_X,
    BY_Y,
    ERROR,
    HIGH,
    LOW,
    UNBOUNDED,
    VALUE,
    bending_over,
)
from solvers.rod.rows import POWER, PRESSURE, STABILITY, STRESS, UTILISATION
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.shape import bend_at
from tests.solvers.rod.machines import PAPER

certificate = importlib.import_module("solvers.rod.optimum.proof.outer_approximation")
STEEL = Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0, ultimate_strength=1400e6)
SLICE = np.array([4e-3, 9e-3, 0.2e-3, 1e-3])


def limited(fatigue, stability, stress=None, pressure=None, power=None):
    """Limits by rows from least safeties and greatest values."""
    most = {UTILISATION: 1 / fatigue, STABILITY: 1 / stability, STRESS: stress, PRESSURE: pressure, POWER: power}
    return {row: math.log(value) for row, value in most.items() if value is not None}


def relaxed(objective, criterion=None, limits=None):
    cycle = core_cycle(PAPER, criterion or serensen(PAPER.material), 0.0)
    samples = certificate.SamplePoints([*np.linspace(0, 2 * np.pi, 12, endpoint=False)], [1.0, 0.7, 0.4, 0.2])
    return certificate._relaxation(cycle, rod.OBJECTIVES[objective], limits or limited(2.3, 1.5), samples)


def random_box(rng):
    """A box of (ln tau, l) about strips of the reference problem."""
    size = 10.0 ** rng.uniform(-4, -0.2)
    x, y = rng.uniform(26.5, 29.5), math.log(rng.uniform(10e-3, 25e-3))
    rx, ry = size * rng.uniform(0, 1, 2)
    return x - rx, x + rx, math.exp(y - ry), min(math.exp(y + ry), 26e-3)


def strips(rng, box, count=60):
    x1, x2, l1, l2 = box
    inside = [(rng.uniform(x1, x2), math.exp(rng.uniform(math.log(l1), math.log(l2)))) for _ in range(count)]
    return [*inside, (x1, l1), (x1, l2), (x2, l1), (x2, l2)]


def best_at(p, x, l):
    point, curvatures = np.array([x, x, l, l]), workspace(p)
    fill_curvatures(p, point, curvatures)
    return box_bound(p, SLICE, point, curvatures, VALUE, VALUE)[0]


CASES = [
    ("mass", None, limited(2.3, 1.5)),
    ("mass", gerber(STEEL), limited(2.3, 1.5, stress=300e6)),
    ("fatigue_safety", None, limited(1.5, 1.5)),
    ("stability_safety", None, limited(2.3, 1.5)),
    ("side_force", None, limited(2.0, 1.5)),
    ("contact_pressure", None, limited(2.0, 1.5, power=0.4)),
    ("friction_power", None, limited(2.0, 1.5, stress=300e6, pressure=6e4)),
]


@pytest.mark.parametrize(("objective", "criterion", "limits"), CASES)
def test_no_strip_of_a_box_is_below_its_bound_or_lost_by_contraction(objective, criterion, limits):
    rng = np.random.default_rng(5)
    p = relaxed(objective, criterion, limits)
    curvatures, emptied, shrunk = workspace(p), 0, 0
    for _ in range(120):
        box = random_box(rng)
        values = [(best_at(p, x, l), x, l) for x, l in strips(rng, box)]
        finite = [v for v, _, _ in values if math.isfinite(v)]
        target = rng.choice(finite) if finite and rng.uniform() < 0.7 else math.inf
        kept = np.array(box)
        fill_curvatures(p, kept, curvatures)
        bound, _ = box_bound(p, SLICE, kept, curvatures, LOW, HIGH)
        assert all(v >= bound - 1e-11 * abs(bound) for v in finite)
        if bound == math.inf:
            continue
        if not contract(p, SLICE, kept, curvatures, target):
            emptied += 1
            assert not any(v < target - 1e-9 for v in finite)
            continue
        shrunk += kept[1] - kept[0] < 0.9 * (box[1] - box[0]) or math.log(kept[3] / kept[2]) < 0.9 * math.log(
            box[3] / box[2]
        )
        for v, x, l in values:
            if v < target - 1e-9:
                assert kept[0] - 1e-10 <= x <= kept[1] + 1e-10
                assert kept[2] * (1 - 1e-10) <= l <= kept[3] * (1 + 1e-10)
    assert shrunk + emptied > 3, "nothing was ever cut off"


@pytest.mark.parametrize("force", [-165.0, -40.0, -1e-9, 0.0, 60.0, 128.0, 2e4])
def test_bending_stays_within_its_ranges_and_near_its_planes(force):
    rng = np.random.default_rng(11)
    modulus, rod_length, eta = 210e9, 45.5e-3, np.array([1.0, 0.8, 0.5, 0.2, 0.0])
    over, narrow = np.empty((6, 5)), 0
    for _ in range(150):
        x1, x2, l1, l2 = random_box(rng)
        x, y = 0.5 * (x1 + x2), 0.5 * math.log(l1 * l2)
        tau, l = np.exp([x1, x, x2]), np.array([l1, math.exp(y), l2])
        bending_over(force, modulus, rod_length, tau, l, eta, over)
        narrow += over[ERROR].max() < UNBOUNDED
        for point, length in strips(rng, (x1, x2, l1, l2), 20):
            q = 12 * force * math.exp(point) / modulus
            coupling, _, clamped, shear, head = constants(q, length, rod_length, 0.0)
            if -q * length**2 >= 4.4934**2 or head < 0:
                continue
            out = np.array([bend_at(coupling, clamped, shear, head, length, (1.0 - s) * length)[0] for s in eta])
            size = np.abs(out).max()
            assert np.all(out >= over[LOW] - 1e-10 * size)
            assert np.all(out <= over[HIGH] + 1e-10 * size)
            assert clamped == pytest.approx(out[0], rel=1e-10)
            plane = over[VALUE] + over[BY_X] * (point - x) + over[BY_Y] * (math.log(length) - y)
            assert np.all(np.abs(out - plane) <= over[ERROR] + 1e-10 * size)
    assert narrow > 50


@pytest.mark.parametrize("force", [-165.0, 60.0, 128.0])
def test_the_error_of_a_plane_falls_with_the_square_of_the_box(force):
    eta, over, errors = np.array([1.0, 0.8, 0.5, 0.2, 0.0]), np.empty((6, 5)), []
    for r in (1e-2, 1e-3):
        tau, l = 3e12 * np.exp([-r, 0.0, r]), 15e-3 * np.exp([-r, 0.0, r])
        bending_over(force, 210e9, 45.5e-3, tau, l, eta, over)
        errors.append(over[ERROR].max())
    assert errors[1] < 0.02 * errors[0]


@pytest.mark.parametrize(("gap", "stride"), [(1e-3, certificate._COARSE_MEAN_STRIDE), (1e-6, 1)])
def test_a_proof_of_friction_power_leaves_no_better_strip_out(gap, stride):
    """It ends at an optimum that 4,000 random strips do not better by their mean over all angles."""
    cycle, limits = core_cycle(PAPER, serensen(PAPER.material), 0.0), limited(2.3, 1.5)
    samples = certificate.SamplePoints([*np.linspace(0, 2 * np.pi, 12, endpoint=False)], [1.0, 0.7, 0.4, 0.2])
    objective = rod.OBJECTIVES["friction_power"]
    p, exact = (certificate._relaxation(cycle, objective, limits, samples, n) for n in (stride, 1))
    bound, _, _, best = prove(p, SLICE[None], np.array([10e-3, 25e-3]), np.zeros(2), math.inf, gap, 20_000)
    assert best[0] - gap * (1.0 + 1e-9) <= bound <= best[0]
    rng = np.random.default_rng(7)
    x1, x2 = -math.log(SLICE[1] * SLICE[3] ** 3), -math.log(SLICE[0] * SLICE[2] ** 3)
    least = min(best_at(exact, rng.uniform(x1, x2), rng.uniform(10e-3, 25e-3)) for _ in range(4_000))
    assert least >= bound
