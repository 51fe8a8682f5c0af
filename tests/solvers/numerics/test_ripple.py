"""Ripple in addition to panels, compared with the explicit functions on a fine grid."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.numerics.panels import resolve, rule_of
from solvers.numerics.radau import radau
from solvers.numerics.ripple import amplitude_bounds, no_ripple, ripple_at
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.vibration.motion import amplitudes
from solvers.rod.vibration.ringing import FreeModes, ringing_of

TURN = 2 * np.pi
RULE = radau(10)


class Rippling:
    """A smooth wave, and modes that restart at two corners of the revolution; two parts, one with weight two."""

    weights = np.array([1.0, 2.0])

    def __init__(self, paces, sizes, seed):
        rng = np.random.default_rng(seed)
        self.paces, self.corners = np.array(paces), np.sort(rng.uniform(0.0, TURN, 2))
        self.start = np.array(sizes) * np.exp(1j * rng.uniform(0.0, TURN, (2, len(paces))))
        self.shift = rng.uniform(0.0, TURN)

    def smooth(self, x):
        return np.sin(x - self.shift) + 0.3 * np.cos(2 * x)

    def since(self, x):
        """Which corner was the last, and where it lies before or in the turn."""
        behind = (x - self.corners[:, None]) % TURN
        return behind.argmin(axis=0), x - behind.min(axis=0)

    def phase(self, x, corner):
        swing = np.sin(x) - np.sin(corner)
        return (1j * self.paces[:, None] + 0.05) * (x - corner + 0.2 * swing)

    def shape(self, x):
        """Of the two parts."""
        return np.stack([1.0 + 0.1 * np.cos(x) + 0.05j * np.sin(x), 0.2 - 0.1 * np.sin(x) + 0.0j])

    def ring(self, x):
        which, corner = self.since(x)
        grown = self.start[which].T * np.exp(self.phase(x, corner))
        return np.real(grown * (self.weights @ self.shape(x))).sum(axis=0)

    def ripple(self):
        first, second = self.corners
        edges = np.concatenate([np.linspace(first, second, 8), np.linspace(second, first + TURN, 9)[1:]])
        x = edges[:-1, None] + np.diff(edges)[:, None] * RULE.points
        corner = np.where(np.arange(15) < 7, first, second)
        grown = np.stack([self.phase(row, c) for row, c in zip(x, corner, strict=True)])
        start = self.start[(np.arange(15) >= 7).astype(int)] * np.exp(grown[:, :, 0])
        shape = np.array(len(self.paces) * [np.moveaxis(self.shape(x), 0, -1)])
        phase = np.ascontiguousarray(np.moveaxis(grown - grown[:, :, :1], 1, 0))
        whole, states = np.ones(phase.shape[:2], np.complex128), np.empty((15, 0, 0))
        free = FreeModes(edges, np.arange(15), shape, phase, whole, np.zeros(len(self.paces)), states, states)
        return ringing_of(free, np.eye(2), np.ascontiguousarray(start), RULE)


CASES = [((40.0,), (0.3,)), ((25.0, 90.0, 400.0), (1e-3, 1e-4, 1e-6)), ((130.0, 310.0, 900.0), (1e-5, 2e-8, 1e-8))]


@pytest.mark.parametrize(("paces", "sizes"), CASES)
def test_the_ripple_can_be_evaluated_at_any_angle(paces, sizes):
    given, angle = Rippling(paces, sizes, 1), np.linspace(-3.0, 9.0, 201)
    ripple = given.ripple()
    found = ripple_at(ripple, len(paces), given.weights[None, :], angle)[0]
    assert found == pytest.approx(given.ring(angle), abs=1e-8 * sum(sizes))
    parts = amplitudes(ripple.edges, np.zeros((15, RULE.points.size, 2)), RULE, ripple, angle)
    assert given.weights @ parts == pytest.approx(found, abs=1e-12 * sum(sizes))
    assert np.abs(found).max() < amplitude_bounds(ripple, given.weights).max(axis=0).sum() < 10 * sum(sizes)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize(("paces", "sizes"), CASES)
def test_the_greatest_value_is_found(paces, sizes, seed):
    """Against values so close that a parabola through three has the top; where they jump it does not lie."""
    given = Rippling(paces, sizes, seed)
    panels, rows, _ = resolve(lambda x: given.smooth(x)[None, :], np.linspace(0.0, TURN, 5), rule_of(16), 1, 1e-12, 100)
    ripple, x = given.ripple(), np.linspace(0.0, TURN, 200_001)
    reach = amplitude_bounds(ripple, given.weights)
    for sign in (1.0, -1.0):
        f = sign * (given.smooth(x) + given.ring(x))
        k = int(f.argmax())
        a, b, c = f[[k - 1, k, (k + 1) % f.size]]
        top = b + 0.125 * (c - a) ** 2 / (2 * b - a - c)
        for tolerance in (1e-3, 1e-6, 1e-10):
            value, error, angle = greatest_with_ripple(
                panels.edges, panels.rule, rows[0], sign, tolerance, ripple, given.weights, reach
            )
            assert value == pytest.approx(top, abs=tolerance + 1e-9)
            assert error <= tolerance + 1e-11
            there = sign * (given.smooth(angle) + given.ring(np.array([angle]))[0])
            assert there == pytest.approx(value, abs=tolerance)


def test_without_modes_it_is_the_smooth_part_that_is_greatest():
    given = Rippling((40.0,), (0.0,), 0)
    panels, rows, _ = resolve(lambda x: given.smooth(x)[None, :], np.linspace(0.0, TURN, 5), rule_of(16), 1, 1e-12, 100)
    none = no_ripple(2, RULE)
    reach = amplitude_bounds(none, given.weights)
    found = greatest_with_ripple(panels.edges, panels.rule, rows[0], 1.0, 1e-12, none, given.weights, reach)
    assert found[0] == pytest.approx(given.smooth(np.linspace(0.0, TURN, 100_001)).max(), abs=1e-8)
