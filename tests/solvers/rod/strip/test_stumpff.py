"""Stumpff functions against 50-digit arithmetic."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from oracles.textbook.stumpff import SERIES_LIMIT, stumpff, stumpff_scaled

EPS = 2.0**-52


def exact(t: float) -> list[mp.mpf]:
    """c0 … c3 at 50 digits, from the definition's closed forms, from its series near zero."""
    t = mp.mpf(t)
    if abs(t) < mp.mpf("1e-3"):
        return [mp.fsum((-t) ** j / mp.factorial(2 * j + k) for j in range(16)) for k in range(4)]
    x = mp.sqrt(t)
    return [mp.re(v) for v in (mp.cos(x), mp.sin(x) / x, (1 - mp.cos(x)) / t, (x - mp.sin(x)) / x**3)]


def worst_error(points: np.ndarray, function=stumpff, scale=lambda t: mp.mpf(1)) -> float:
    """Greatest error in units of eps max(1, kappa) over the points and the four functions."""
    computed, worst = function(points), 0.0
    with mp.workdps(50):
        for i, t in enumerate(points):
            values = exact(float(t))
            for k in range(4):
                if t == 0:
                    kappa = mp.mpf(0)
                elif k == 0:
                    kappa = abs(t * values[1] / 2 / values[0])
                else:
                    kappa = abs((values[k - 1] - k * values[k]) / 2 / values[k])
                got = mp.mpf(float(getattr(computed, f"c{k}")[i]))
                worst = max(worst, float(abs(got / (values[k] * scale(t)) - 1) / EPS / max(1, kappa)))
    return worst


def test_within_eight_eps_over_the_whole_range():
    rng = np.random.default_rng(1)
    points = np.concatenate(
        [
            -(10.0 ** rng.uniform(-12, 4, 500)),
            10.0 ** rng.uniform(-12, np.log10(30), 500),
            rng.uniform(-1e4, 30, 250),
        ]
    )
    assert points.size == 1250
    assert worst_error(points) <= 8


@pytest.mark.parametrize("switch", [SERIES_LIMIT, -SERIES_LIMIT, 0.0])
def test_within_four_eps_on_both_sides_of_every_switch(switch):
    up = [switch]
    down = [switch]
    for _ in range(200):
        up.append(float(np.nextafter(up[-1], np.inf)))
        down.append(float(np.nextafter(down[-1], -np.inf)))
    assert worst_error(np.array(up + down)) <= 4


def test_scaled_functions_are_finite_and_right_in_the_strongest_tension():
    points = -(10.0 ** np.random.default_rng(2).uniform(-6, 6, 300))
    assert worst_error(points, stumpff_scaled, lambda t: mp.exp(-mp.sqrt(-mp.mpf(float(t))))) <= 8
    assert all(np.isfinite(v).all() for v in vars(stumpff_scaled(np.array([-1e300, -1e9]))).values())
