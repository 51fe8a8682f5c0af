"""The steps of the proof, each on random boxes: what is said of a box holds for the strips sampled in it."""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest

from solvers import rod
from solvers.fatigue import gerber, serensen
from solvers.materials import Material
from solvers.rod.optimum.core_cycle import core_cycle
from solvers.rod.optimum.proof.bound_tightening import contract
from solvers.rod.optimum.proof.box_bounds import box_bound, fill, point_value, workspace
from solvers.rod.optimum.proof.branch_and_bound import prove
from solvers.rod.optimum.proof.intervals import bending_ranges, clamp, curvature_and_stiffness
from solvers.rod.rows import POWER, PRESSURE, STABILITY, STRESS, UTILISATION
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
    view = certificate.View([*np.linspace(0, 2 * np.pi, 12, endpoint=False)], [1.0, 0.7, 0.4, 0.2])
    return certificate._relaxation(cycle, rod.OBJECTIVES[objective], limits or limited(2.3, 1.5), view)


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
    work = workspace(p)
    fill(p, np.full(3, math.exp(x)), np.full(3, l), work)
    return point_value(p, SLICE, x, l, work, 0.0)[0]


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
    work, kept, emptied, shrunk = workspace(p), np.empty(4), 0, 0
    for _ in range(120):
        box = random_box(rng)
        values = [(best_at(p, x, l), x, l) for x, l in strips(rng, box)]
        finite = [v for v, _, _ in values if math.isfinite(v)]
        target = rng.choice(finite) if finite and rng.uniform() < 0.7 else math.inf
        bound = box_bound(p, SLICE, *box, work, math.inf)
        assert all(v >= bound - 1e-11 * abs(bound) for v in finite)
        if bound == math.inf:
            continue
        if not contract(p, SLICE, *box, work, target, kept):
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
def test_bending_stays_within_its_ranges(force):
    rng = np.random.default_rng(11)
    modulus, rod_length, eta = 210e9, 45.5e-3, np.array([1.0, 0.8, 0.5, 0.2, 0.0])
    centre, low, high, slope = np.empty(5), np.empty(5), np.empty(5), np.empty((5, 4))
    out, up, down = np.empty(5), np.empty(5), np.empty(5)
    narrow = 0
    for _ in range(150):
        x1, x2, l1, l2 = random_box(rng)
        tau, l = np.exp([x1, 0.5 * (x1 + x2), x2]), np.array([l1, math.sqrt(l1 * l2), l2])
        bounded, *_ = bending_ranges(force, modulus, rod_length, tau, l, eta, centre, slope, low, high)
        narrow += bounded
        for x, length in strips(rng, (x1, x2, l1, l2), 20):
            q = 12 * force * math.exp(x) / modulus
            if -q * length**2 >= 4.4934**2:
                continue
            _, det = curvature_and_stiffness(q, length, rod_length, eta, out)
            if det <= 0:
                continue
            size = np.abs(out).max()
            assert np.all(out >= low - 1e-10 * size)
            assert np.all(out <= high + 1e-10 * size)
            assert clamp(q, length, rod_length)[0] == pytest.approx(out[0], rel=1e-10)
            if not bounded:
                continue
            for k, (dx, dy) in enumerate(((1e-5, 0.0), (0.0, 1e-5))):
                curvature_and_stiffness(q * math.exp(dx), length * math.exp(dy), rod_length, eta, up)
                curvature_and_stiffness(q * math.exp(-dx), length * math.exp(-dy), rod_length, eta, down)
                rate = (up - down) / 2e-5
                assert np.all(rate >= slope[:, 2 * k] - 1e-5 * size * 10)
                assert np.all(rate <= slope[:, 2 * k + 1] + 1e-5 * size * 10)
    assert narrow > 50 or force > 1e4


@pytest.mark.parametrize("gap", [1e-3, 1e-6])
def test_boxes_divided_after_a_look_at_few_angles_leave_no_better_strip_out(gap):
    """Both ways of dividing boxes end at one optimum, which 4,000 random strips do not better."""
    cycle, limits = core_cycle(PAPER, serensen(PAPER.material), 0.0), limited(2.3, 1.5)
    view = certificate.View([*np.linspace(0, 2 * np.pi, 12, endpoint=False)], [1.0, 0.7, 0.4, 0.2])
    few, all_ = (
        certificate._relaxation(cycle, rod.OBJECTIVES["friction_power"], limits, view, c) for c in (True, False)
    )
    work, ends = workspace(all_), []
    for quick in (few, all_):
        best = np.empty(5)
        bound, *_ = prove(
            all_, quick, SLICE[None], np.array([10e-3, 25e-3]), np.zeros(2), math.inf, gap, 20_000, work, 0.0, best
        )
        assert best[0] - gap * (1.0 + 1e-9) <= bound <= best[0]
        ends.append((bound, best[0]))
    assert max(bound for bound, _ in ends) <= min(best for _, best in ends)
    rng = np.random.default_rng(7)
    x1, x2 = -math.log(SLICE[1] * SLICE[3] ** 3), -math.log(SLICE[0] * SLICE[2] ** 3)
    least = min(best_at(all_, rng.uniform(x1, x2), rng.uniform(10e-3, 25e-3)) for _ in range(4_000))
    assert least >= max(bound for bound, _ in ends)
