"""Many stations' lightest walls at a price, against bisection on the slope of the textbook's flexibilities."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.pin.convex_stations import all_lightest, lightest
from solvers.pin.flexibility import convex_cowper

COUNT = 700
TIGHT = 1e-8


def flexibilities(u, law):
    """1/v and phi of shape (n,), from the tube's formulas; phi straight from the knee on."""

    def phi(at):
        return law.a / at + law.b * (1 - at) / (at * (2 - at) ** 2)

    knee, h = law.knee, 1e-6
    tangent = (phi(knee + h) - phi(knee - h)) / (2 * h)
    return 1 / (u * (2 - u)), np.where(u > knee, phi(knee) + tangent * (u - knee), phi(np.minimum(u, knee)))


def falls(u, law):
    """Their slopes with the sign turned, by the quotient rule on the same formulas."""
    at = np.minimum(u, law.knee)
    below, slope_below = at * (2 - at) ** 2, (2 - at) ** 2 - 2 * at * (2 - at)
    shear = law.a / at**2 + law.b * (below + (1 - at) * slope_below) / below**2
    return (2 - 2 * u) / (u * (2 - u)) ** 2, shear


def by_bisection(price, low, bend, shear, law):
    left, right = low.copy(), np.ones_like(low)
    for _ in range(200):
        u = 0.5 * (left + right)
        one, other = falls(u, law)
        more = price * (bend * one + shear * other) > 1.0
        left, right = np.where(more, u, left), np.where(more, right, u)
    return right


def stations(seed):
    """Stations that bend, shear, or do both, with walls that hold or do not; two of three thinner than a thousandth."""
    rng = np.random.default_rng(seed)
    bend, shear = 10 ** rng.uniform(-6, 2, (2, COUNT))
    bend[::7], shear[1::7] = 0.0, 0.0
    low = np.where(rng.random(COUNT) < 0.3, rng.random(COUNT), 10 ** rng.uniform(-9, -3, COUNT))
    return bend, shear, low, rng.random(COUNT)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("price", [1e-9, 1e-3, 0.1, 1.0, 30.0, 1e6])
def test_every_station_costs_least(price, poisson):
    """From nothing and from the answer of a price far away; blocks, a part of one, and each station alone."""
    law = convex_cowper(poisson)
    bend, shear, low, share = stations(int(price * 1e9) % 1000)
    exact = by_bisection(price, low, bend, shear, law)
    one, other = flexibilities(exact, law)
    least = exact + price * (bend * one + shear * other)
    for before in (None, 0.01 * price, 100.0 * price):
        u = low.copy()
        if before is not None:
            all_lightest(before, share, low, bend, shear, law.a, law.b, law.knee, u, True, TIGHT)
        # A station that only shears settles slowly at the knee; a second round starts where the first one ended.
        for cold in (before is None, False):
            total, _ = all_lightest(price, share, low, bend, shear, law.a, law.b, law.knee, u, cold, TIGHT)
        assert np.all((low <= u) & (u <= 1.0))
        one, other = flexibilities(u, law)
        assert np.all(u + price * (bend * one + shear * other) <= least * (1 + 1e-9))
        assert total == pytest.approx(share @ (bend * one + shear * other), rel=1e-9)
        firm = bend > 1e-3 * shear
        assert u[firm] == pytest.approx(exact[firm], rel=1e-12, abs=0)
    for start in (0.0, 0.5, 1.0):
        alone = [
            lightest(1.0 / price, *numbers, start, law.a, law.b, law.knee)
            for numbers in zip(low, bend, shear, strict=True)
        ]
        assert np.array(alone)[firm] == pytest.approx(exact[firm], rel=1e-12, abs=0)


def test_the_deflection_falls_with_the_price_as_its_derivative_says():
    law = convex_cowper(0.3)
    bend, shear, low, share = stations(5)
    bend = np.maximum(bend, shear)

    def at(price):
        u = low.copy()
        return all_lightest(price, share, low, bend, shear, law.a, law.b, law.knee, u, True, TIGHT)

    for price in (1e-4, 1e-2, 1.0):
        h = 1e-5 * price
        slope = (at(price + h)[0] - at(price - h)[0]) / (2 * h)
        assert at(price)[1] == pytest.approx(slope, rel=1e-3)
