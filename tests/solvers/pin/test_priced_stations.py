"""Many stations' lightest walls at a price, against a search through all walls by the textbook's flexibilities."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.pin.optimum.lagrangian import Segments, minimise_stations, solid_thresholds
from solvers.pin.optimum.station_minimum import minimiser
from solvers.pin.section.flexibility import cowper

COUNT = 700


def flexibilities(u, law):
    """1/v and phi of shape (n,), from the tube's formulas."""
    return 1 / (u * (2 - u)), law.a / u + law.b * (1 - u) / (u * (2 - u) ** 2)


def costs(u, price, bend, shear, law):
    one, other = flexibilities(u, law)
    return u + price * (bend * one + shear * other)


def by_search(price, low, bend, shear, law):
    """Golden section between the best of 400 walls' neighbours, the solid section among them: where the cost is concave
    it is least at an end, elsewhere it is convex between two neighbours."""
    grid = np.linspace(0.0, 1.0, 401)[:, None]
    walls = np.where(low > 0.01, low + (1 - low) * grid, low ** (1 - grid))
    walls[-1] = 1.0
    best = np.argmin(costs(walls, price, bend, shear, law), axis=0)
    at = np.arange(low.size)
    left, right = walls[np.maximum(best - 1, 0), at], walls[np.minimum(best + 1, 400), at]
    ends = np.stack([walls[best, at], left, right])
    for _ in range(90):
        p, q = right - 0.618034 * (right - left), left + 0.618034 * (right - left)
        lower = costs(p, price, bend, shear, law) < costs(q, price, bend, shear, law)
        left, right = np.where(lower, left, p), np.where(lower, q, right)
    ends = np.concatenate([ends, [0.5 * (left + right)]])
    return ends[np.argmin(costs(ends, price, bend, shear, law), axis=0), at]


def stations(seed):
    """Stations that bend, shear, or do both, with walls that hold or do not; two of three thinner than a thousandth."""
    rng = np.random.default_rng(seed)
    bend, shear = 10 ** rng.uniform(-6, 2, (2, COUNT))
    bend[::7], shear[1::7] = 0.0, 0.0
    low = np.where(rng.random(COUNT) < 0.3, rng.random(COUNT), 10 ** rng.uniform(-9, -3, COUNT))
    return bend, shear, low, rng.random(COUNT)


def answered(price, share, low, bend, shear, law, u):
    segments = Segments(share, bend, shear, law)
    return minimise_stations(price, segments, low, solid_thresholds(segments, low), False, 1e-8, u)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("price", [1e-9, 1e-3, 0.1, 0.5, 1.0, 30.0, 1e6])
def test_every_station_costs_least(price, poisson):
    """From nothing, from the answer of a price far away, and each station alone from anywhere."""
    law = cowper(poisson)
    bend, shear, low, share = stations(int(price * 1e9) % 1000)
    # Many stations next to where they turn solid.
    shear[2::5] = 10 ** np.random.default_rng(7).uniform(-1, 1, shear[2::5].size) / price
    least = costs(by_search(price, low, bend, shear, law), price, bend, shear, law)
    for before in (None, 0.01 * price, 100.0 * price):
        u = low.copy()
        if before is not None:
            answered(before, share, low, bend, shear, law, u)
        for _ in range(2):
            total, _ = answered(price, share, low, bend, shear, law, u)
        assert np.all((low <= u) & (u <= 1.0))
        assert np.all(costs(u, price, bend, shear, law) <= least * (1 + 1e-9))
        one, other = flexibilities(u, law)
        assert total == pytest.approx(share @ (bend * one + shear * other), rel=1e-9)
    for start in (0.0, 0.5, 1.0):
        alone = [minimiser(price, 1.0, *numbers, start, law) for numbers in zip(bend, shear, low, strict=True)]
        assert np.all(costs(np.array(alone), price, bend, shear, law) <= least * (1 + 1e-9))


def test_stations_that_shear_jump_to_the_solid_section_and_none_lies_between():
    law = cowper(0.3)
    low, shear = np.full(2000, 1e-3), np.geomspace(0.05, 5.0, 2000)
    u = low.copy()
    answered(1.0, np.ones(2000), low, np.zeros(2000), shear, law, u)
    first = int(np.argmax(u == 1.0))
    assert first > 0 and np.all(u[first:] == 1.0) and u[first - 1] < 0.9
    assert np.all(np.diff(u) >= 0.0)


def test_the_deflection_falls_with_the_price_as_its_derivative_says():
    law = cowper(0.3)
    bend, shear, low, share = stations(5)
    bend = np.maximum(bend, shear)

    def at(price):
        u = low.copy()
        return answered(price, share, low, bend, shear, law, u)

    for price in (1e-4, 1e-2, 1.0):
        h = 1e-5 * price
        slope = (at(price + h)[0] - at(price - h)[0]) / (2 * h)
        assert at(price)[1] == pytest.approx(slope, rel=1e-3)
