"""Stepped bores under a deflection limit against random ones, the best of a dense search, and other forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from solvers import pin
from solvers.pin.stations import NODES
from tests.solvers.pin.pins import VAZ, grams, program

LIMIT = 11.22302193e-6


def designed(steps, limit=LIMIT):
    return pin.design(pin.PinProblem(VAZ, pin.Limits(max_deflection=limit), pin.Stepped(steps)), accuracy=1e-6)


@pytest.mark.parametrize("limit", [8.5e-6, LIMIT, 13e-6])
def test_two_steps_against_a_dense_search(limit):
    """Every break on the ends of panels, where quadrature is right, the outer wall by golden section, the inner one
    from the limit by a root finder."""
    p = program(uniform=1500)
    peaks, n = np.maximum.accumulate(p.lower), p.lower.size

    def volume(outer, cut):
        def soft(inner):
            return p.deflection(np.where(np.arange(n) < cut, outer, inner)) - limit

        floor = max(peaks[-1], outer)
        inner = floor if soft(floor) <= 0 else (brentq(soft, floor, 1.0) if soft(1.0) <= 0 else None)
        return np.inf if inner is None else p.volume(np.where(np.arange(n) < cut, outer, inner))

    def best_at(cut):
        low, high = float(peaks[cut - 1]), 1.0
        for _ in range(20):
            one, two = high - 0.618034 * (high - low), low + 0.618034 * (high - low)
            low, high = (low, two) if volume(one, cut) <= volume(two, cut) else (one, high)
        return min(volume(0.5 * (low + high), cut), volume(float(peaks[cut - 1]), cut))

    coarse = {cut: best_at(cut) for cut in range(4 * NODES, n, 8 * NODES)}
    centre = min(coarse, key=coarse.get)
    near = range(max(centre - 8 * NODES, NODES), min(centre + 8 * NODES, n - NODES) + 1, NODES)
    least = min(best_at(cut) for cut in near)
    outcome = designed(2, limit)
    mass = outcome.value.check.mass
    assert mass == pytest.approx(p.solid_mass * least, rel=1e-4)
    assert outcome.certificate.bound <= p.solid_mass * least


@pytest.mark.parametrize("steps", [2, 3, 4, 6])
def test_no_random_bore_of_the_form_undercuts_the_bound(steps):
    outcome = designed(steps)
    p = program(uniform=400)
    peaks, half = np.maximum.accumulate(p.lower), 0.04
    # Steps end where panels end, so that quadrature is right.
    middles = 0.5 * (p.stations.left + p.stations.right)
    corners = outcome.value.corners
    places = np.array([c[0] for c in corners[1 : 2 * steps : 2]])
    walls = 1 - (np.array([c[1] for c in corners[: 2 * steps : 2]]) / 21.99e-3) ** 2
    rng, least = np.random.default_rng(steps), np.inf
    for reach in np.repeat([1e-3, 1e-2, 0.1, 0.5], 400):
        breaks = np.sort(np.clip(places[:-1] + reach * half * rng.normal(size=steps - 1), 0, half))
        which = np.repeat(np.searchsorted(breaks, middles), NODES)
        u = np.clip(walls * (1 + reach * rng.normal(size=steps)), 0, 1)
        floors = [peaks[which <= k].max(initial=0.0) for k in range(steps)]
        bore = np.maximum.accumulate(np.maximum(u, floors))[which]
        # Toward the solid pin by one factor of all bores until the limit is kept.
        if p.deflection(bore) > LIMIT:
            part = brentq(lambda t, bore=bore: p.deflection(bore + t * (1 - bore)) - LIMIT * (1 - 1e-12), 0, 1)
            bore = bore + part * (1 - bore)
        least = min(least, p.volume(bore))
    assert outcome.certificate.bound <= p.solid_mass * least
    assert outcome.value.check.mass <= p.solid_mass * least * (1 + 1e-6)


def test_what_is_proven_and_how_forms_order():
    gaps = {1: 1e-6, 2: 2e-4, 3: 3e-4, 4: 2e-3, 6: 3e-2}
    found = {steps: designed(steps) for steps in gaps}
    for steps, gap in gaps.items():
        assert 0 <= found[steps].certificate.gap <= gap
        assert found[steps].value.check.deflection <= LIMIT * (1 + 1e-12)
    masses = [found[steps].value.check.mass * 1e3 for steps in gaps]
    assert np.all(np.diff(masses) < 0)
    assert masses[0] == pytest.approx(grams(VAZ, pin.Constant(), max_deflection=LIMIT), rel=1e-6)
    assert masses[-1] > grams(VAZ, pin.Free(drillable=True), max_deflection=LIMIT)
