"""The minimum cost at one frequency ratio, against a simplex method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from solvers.rod.optimum.search.at_ratio import PENALTY, AtRatio
from solvers.rod.optimum.sqp import Program

REACH = 0.2


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("fixed", [(), (0,), (0, 2)], ids=["all free", "width held", "thickness alone"])
def test_the_grid_closes_in_on_the_linear_programme(seed, fixed):
    rng = np.random.default_rng(seed)
    here, slopes = rng.uniform(-0.05, 0.02, 8), rng.normal(0.0, 1.0, (8, 3))
    x, slope = rng.normal(size=3), rng.normal(size=3)
    box = x[:, None] + np.array([-1.0, 1.0]) * rng.uniform(0.02, 0.1, (3, 1))
    for v in fixed:
        box[v] = x[v]
    p = Program(
        ((0, 1.0), (1, 0.3)), np.array([2, 3]), np.array([0.0, 0.01]), 0.7, np.arange(4, 8), rng.uniform(-0.02, 0.02, 4)
    )
    # So that some step within the bounds makes the change.
    change = float(slope @ (0.1 * (box[:, 1] - x) * rng.uniform(-1.0, 1.0, 3)))
    least = AtRatio.of(p, box, slope)
    at, cost = least(here, slopes, x, change, REACH)

    # Unknowns: the step, the greatest of the rows that count so, what limits are missed by.
    inward = np.hstack([least.tangents, np.zeros((len(least.tangents), 2))])
    exact = linprog(
        np.concatenate([slopes[0] + 0.3 * slopes[1], [0.7, PENALTY]]),
        A_ub=np.vstack([
            np.hstack([slopes[p.limited], np.zeros((4, 1)), -np.ones((4, 1))]),
            np.hstack([slopes[p.max_rows], -np.ones((2, 1)), np.zeros((2, 1))]),
            inward, -inward,
        ]),
        b_ub=np.concatenate([
            p.limit - here[p.limited], p.max_offset - here[p.max_rows], np.full(2 * len(inward), REACH),
        ]),
        A_eq=np.append(slope * ~np.isin(range(3), fixed), [0.0, 0.0])[None], b_eq=[change],
        bounds=[*zip(box[:, 0] - x, box[:, 1] - x, strict=True), (None, None), (0.0, None)],
    )  # fmt: skip
    assert exact.status == 0
    assert cost == pytest.approx(exact.fun + here[0] + 0.3 * here[1], abs=1e-3)
    assert slope @ (at - x) == pytest.approx(change, abs=1e-4)
    assert np.all((box[:, 0] <= at) & (at <= box[:, 1]))


def test_sizes_that_do_not_change_the_ratio_have_no_programme():
    box = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    empty = Program((), np.empty(0, int), np.empty(0), 0.0, np.empty(0, int), np.empty(0))
    assert AtRatio.of(empty, box, np.array([0.0, 1.0, -2.0])) is None
