"""Shear flexibility and its envelope; the ring against its thin limit and against equilibrium."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_bvp

from solvers import pin
from solvers.pin.ring import ovalization
from solvers.pin.section.flexibility import (
    chord_decrease,
    cowper,
    curvatures,
    envelope_line_start,
    flexibilities,
    inflection,
    slopes,
)
from tests.solvers.pin.pins import flexibility_values

FORCE, DIAMETER, LENGTH, MODULUS, POISSON = 15e3, 21.99e-3, 80e-3, 210e9, 0.3
PIN = (FORCE, DIAMETER, LENGTH)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_shear_flexibility_is_cowpers_coefficient(poisson):
    m = np.linspace(0.01, 0.99, 50)
    k = 6 * (1 + poisson) * (1 + m**2) ** 2 / ((7 + 6 * poisson) * (1 + m**2) ** 2 + (20 + 12 * poisson) * m**2)
    u = 1 - m**2
    assert flexibility_values(u, cowper(poisson))[1] == pytest.approx(1 / (k * u), rel=1e-12)
    solid = 6 * (1 + poisson) / (7 + 6 * poisson)
    assert flexibilities(1.0, cowper(poisson))[1] == pytest.approx(1 / solid, rel=1e-15)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_shear_is_convex_up_to_its_inflection_and_its_third_derivative_negative(poisson):
    law, u = cowper(poisson), np.linspace(0.05, 1.0, 4001)
    curvature = np.diff(flexibility_values(u, law)[1], 2)
    turns = u[1:-1][np.argmax(curvature < 0)]
    assert inflection(poisson) == pytest.approx(turns, abs=5e-4)
    assert np.all(np.diff(curvature) < 0)
    assert np.all(np.diff(1 / (u * (2 - u)), 3) < 0)


def test_derivatives_are_those_of_the_function():
    law = cowper(POISSON)
    for u in (0.1, 0.5, 0.89, 0.95, 0.999):
        h = 1e-6
        for of, derivative in ((flexibilities, slopes), (slopes, curvatures)):
            for own, above, below in zip(derivative(u, law), of(u + h, law), of(u - h, law), strict=True):
                assert own == pytest.approx((above - below) / (2 * h), rel=1e-6, abs=1e-6)
        for bend in (0.0, 0.7):
            fall = bend / (u * (2 - u)) + flexibilities(u, law)[1] - bend - flexibilities(1.0, law)[1]
            assert chord_decrease(u, bend, 1.0, law) == pytest.approx(fall / (1 - u), rel=1e-9)


@pytest.mark.parametrize("bend", [0.0, 0.2, 1.0, 1.8, 5.0])
def test_the_envelopes_line_touches_and_stays_below(bend):
    law = cowper(POISSON)

    def g(u):
        bent, sheared = flexibility_values(u, law)
        return bend * bent + sheared

    start = envelope_line_start(bend, 1.0, law)
    u = np.linspace(0.3, 1.0, 7001)
    if start == 1.0:
        assert np.all(np.diff(g(u), 2) > -1e-12)
        return
    low, high = g(np.array([start]))[0], g(np.array([1.0]))[0]
    line = low + (high - low) / (1 - start) * (u - start)
    assert np.all(g(u) - line > -1e-12)
    h = 1e-6
    ends = g(np.array([start - h, start + h]))
    assert (ends[1] - ends[0]) / (2 * h) == pytest.approx((high - low) / (1 - start), rel=1e-6)


def test_the_thick_ring_tends_to_the_thin_one():
    """0.09 is the thin ring's 8/(9 pi^2), rounded; the mean radius is its radius."""
    for ratio in (0.99, 0.999, 0.9999):
        thin = 8 / (9 * np.pi**2) * FORCE / (MODULUS * LENGTH) * ((1 + ratio) / (1 - ratio)) ** 3
        # The load's n-th harmonic has 1/(n^2 - 1), the ring's stiffness against it (n^2 - 1)^2; n = 2 makes 1/27.
        more = sum(27 / (n * n - 1) ** 3 for n in range(4, 40, 2))
        thick = ovalization.thick_ring(*PIN, ratio, MODULUS, POISSON).ovalization
        assert thick == pytest.approx(thin * (1 + more), rel=3 * (1 - ratio) + 1e-3)


@pytest.mark.parametrize("ratio", [0.3, 0.7, 0.9])
@pytest.mark.parametrize("k", [0, 1, 4])
def test_the_thick_rings_harmonics_solve_the_equations_of_elasticity(ratio, k):
    """A boundary-value problem in the displacements u cos(n t), v sin(n t) and the stresses they make, E = 1."""
    n, nu = 2.0 * (k + 1), POISSON

    def rates(r, y):
        u, v, radial, shear = y
        hoop = (u + n * v) / r + nu * radial
        return np.stack(
            [
                (1 - nu * nu) * radial - nu * (u + n * v) / r,
                2 * (1 + nu) * shear + (v + n * u) / r,
                (hoop - radial - n * shear) / r,
                (n * hoop - 2 * shear) / r,
            ]
        )

    def ends(inner, outer):
        return np.array([inner[2], inner[3], outer[2] - 1.0, outer[3]])

    r = np.linspace(ratio, 1.0, 200)
    found = solve_bvp(rates, ends, r, np.ones((4, r.size)), tol=1e-9, max_nodes=20_000)
    u, v, radial, _ = found.sol(np.array([1.0, ratio]))
    outer, inner, moved = ovalization._harmonic_remainder(
        n, ratio, -np.log(ratio), np.sinh(np.log(1 / ratio)) + np.log(ratio)
    )
    assert (1.0 + outer, -inner) == pytest.approx((u + n * v) / np.array([1.0, ratio]) + nu * radial, rel=1e-6)
    assert (2.0 * n - (1.0 - nu)) / (n * n - 1.0) + moved == pytest.approx(u[0], rel=1e-6)


def michell(ratio: float, terms: int) -> list[mp.mpf]:
    """Hoop stresses at the four points over the greatest pressure and the growth over 2 R p/E, by Michell's series.

    The four constants of every harmonic come from the tractions of both surfaces, with 60 digits; beyond the last
    harmonic, where the inner surface no longer counts, those of a solid disk's surface are summed on.
    """
    a, nu = mp.mpf(ratio), mp.mpf(POISSON)
    hoop = -2 / mp.pi / (1 - a * a)
    side = [hoop * (1 + a * a), 2 * hoop]
    top, growth = list(side), side[0] + nu * 2 / mp.pi
    for n in range(2, 2 * terms + 1, 2):
        powers, surfaces = (n, n + 2, -n, 2 - n), (mp.mpf(1), a)
        sizes = [[r**n, r ** (n + 2), (a / r) ** n, a**n * r ** (2 - n)] for r in surfaces]
        rows = []
        for r, values in zip(surfaces, sizes, strict=True):
            rows.append([(p - n * n) * f / r**2 for p, f in zip(powers, values, strict=True)])
            rows.append([n * (p - 1) * f / r**2 for p, f in zip(powers, values, strict=True)])
        constants = list(mp.lu_solve(mp.matrix(rows), mp.matrix([1, 0, 0, 0])))
        amplitude, sign = 4 / (mp.pi * (n * n - 1)), (-1) ** (n // 2)
        for k, (r, values) in enumerate(zip(surfaces, sizes, strict=True)):
            found = sum(p * (p - 1) * f * c for p, f, c in zip(powers, values, constants, strict=True)) / r**2
            side[k] += amplitude * found
            top[k] += amplitude * sign * found
        shifts = [(mp.mpf(p - n * n) / (p - 1) - nu * p) * c for p, c in zip(powers, constants, strict=True)]
        growth += amplitude * sum(s * f for s, f in zip(shifts, sizes[0], strict=True))

    # Sums from k = terms + 1 on, by the zeta and digamma functions of partial fractions of 1/(2 k - 1), 1/(2 k + 1).
    k = terms + mp.mpf(1)
    squares = mp.zeta(2, k - 0.5), mp.zeta(2, k + 0.5)
    plain = 1 / (2 * (2 * k - 1))
    # (-1)^k/(4 k^2 - 1) over pairs of k, each sum over every other k.
    quarters = [mp.digamma(x / 2) for x in (k - 0.5, k + 0.5, k + 1.5)]
    turned = (-1) ** (terms + 1) * (quarters[1] - quarters[0] - quarters[2] + quarters[1]) / 8
    side[0] += 4 / mp.pi * plain
    top[0] += 4 / mp.pi * turned
    growth += 4 / mp.pi * (squares[0] - squares[1]) / 8
    growth -= 4 / mp.pi * (1 - nu) * ((squares[0] + squares[1]) / 16 - plain / 2)
    return [*side, *top, growth]


@pytest.mark.parametrize(("ratio", "terms"), [(0.3, 24), (0.8, 90), (0.9, 180)])
def test_the_thick_ring_is_michells_series_to_its_last_digits(ratio, terms):
    found = ovalization.thick_ring(np.pi, 2.0, 2.0 * POISSON, ratio, 1.0 / POISSON, POISSON)
    pressure = 2.0 * np.pi / (np.pi * 2.0 * POISSON)
    told = [*found[1:5], found.ovalization / (2.0 * POISSON)]
    with mp.workdps(60):
        exact = [float(value) for value in michell(ratio, terms)]
    assert np.array(told) / pressure == pytest.approx(exact, rel=1e-14)


def test_the_thick_ring_stays_one_curve_toward_no_wall_at_all():
    """The growth times the cube of the wall has no steps where harmonics are added or sums are truncated."""
    walls = np.geomspace(1e-6, 1e-2, 200)
    scaled = [
        ovalization.thick_ring(*PIN, 1.0 - w, MODULUS, POISSON).ovalization * w**3 / (2.0 - w) ** 3 for w in walls
    ]
    assert np.all(np.abs(np.diff(scaled, 2)) < 1e-4 * scaled[0])
    # The wall of 1 - w is known to 1e-16/w, its cube to three times that.
    bend = 8 / (9 * np.pi**2) * FORCE / (MODULUS * LENGTH) * sum(27 / (n * n - 1) ** 3 for n in range(2, 400, 2))
    assert scaled[0] == pytest.approx(bend, rel=1e-5)


def test_the_ring_grows_with_the_bore_everywhere():
    ratios = np.concatenate([np.linspace(0.0, 0.8, 81), np.linspace(0.8001, 0.999, 200)])
    growth = [ovalization.ring(*PIN, r, MODULUS, POISSON).ovalization for r in ratios]
    assert np.all(np.diff(growth) > 0)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_no_figure_of_the_ring_jumps_and_none_is_less_than_the_elastic_rings(poisson):
    """The textbook's formula ended at 0.8 with 31.6 um, where the elastic ring has 58.2."""
    ratios = np.linspace(0.3, 0.95, 13_001)
    rings = [ovalization.ring(*PIN, r, MODULUS, poisson) for r in ratios]
    elastic = [ovalization.thick_ring(*PIN, r, MODULUS, poisson) for r in ratios]
    growth, even = (np.array([found.ovalization for found in some]) for some in (rings, elastic))
    assert np.all(np.diff(growth) > 0)
    assert np.all(np.diff(growth) < 5e-3 * growth[:-1])
    assert np.all(growth >= even)
    for point in ("outer_side", "inner_side", "outer_top", "inner_top"):
        own = np.array([getattr(found, point) for found in rings])
        assert np.all(np.abs(np.diff(own)) < 5e-3 * np.abs(own).max())
    greatest = np.array([found.greatest for found in rings])
    assert np.all(np.diff(greatest) > 0)
    assert np.all(greatest >= [found.greatest for found in elastic])
    # Where the formula begins and ends to be the more.
    first = ovalization.classical(*PIN, 0.65, MODULUS)
    assert ovalization.ring(*PIN, 0.65, MODULUS, poisson) == first
    assert ovalization.classical(*PIN, 0.8, MODULUS).ovalization < even[np.searchsorted(ratios, 0.8)]


def test_the_load_factors_zero_is_no_way_out():
    """The textbook's formula falls beyond 0.814 and ends at 0 at 0.864: no limit may be met there."""
    assert abs(ovalization.load_factor(0.8641588834)) < 1e-8
    for limit in (1e-6, 1e-5, 3e-5, 4e-5, 1e-4, 1e-2):
        ratio = ovalization.greatest_ratio(limit, *PIN, MODULUS, POISSON)
        assert ovalization.ring(*PIN, ratio, MODULUS, POISSON).ovalization <= limit
        assert ovalization.ring(*PIN, ratio * (1 + 1e-9) + 1e-9, MODULUS, POISSON).ovalization > limit
    assert ovalization.greatest_ratio(1e-9, *PIN, MODULUS, POISSON) is None


def test_the_ratio_at_a_stress_is_where_the_stress_is():
    for stress in (80e6, 150e6, 155e6, 200e6, 500e6):
        ratio = ovalization.ratio_within_stress(stress, *PIN, MODULUS, POISSON)
        assert ovalization.ring(*PIN, ratio, MODULUS, POISSON).greatest == pytest.approx(stress, rel=1e-12)


def hoop(ratios, bore=None):
    """The greatest hoop stress of every ring, of one outer diameter or around one bore."""
    diameters = [DIAMETER if bore is None else bore / ratio for ratio in ratios]
    rings = [ovalization.ring(FORCE, d, LENGTH, r, MODULUS, POISSON) for d, r in zip(diameters, ratios, strict=True)]
    return np.array([found.greatest for found in rings])


@pytest.mark.parametrize("bore", [None, 14e-3])
def test_the_hoop_stress_rises_with_the_bore_and_around_it(bore):
    assert np.all(np.diff(hoop(np.linspace(0.3, 0.9999, 3000), bore)) > 0)


@pytest.mark.parametrize("ends", [(0.5, 0.799), (0.79, 0.6), (0.77, 0.8), (0.4, 0.76), (0.5, 0.85), (0.9, 0.81)])
def test_no_ring_along_a_pin_or_a_bushing_is_stressed_more_than_told(ends):
    """The reported ring has the largest values of all rings along the part."""
    ratios = np.linspace(*ends, 2001)
    scene = pin.Scene(
        pin.Geometry(DIAMETER, 24e-3, 30e-3, 1e-3), FORCE, pin.PinMaterial(150e6, MODULUS, POISSON, 7850.0)
    )
    tapered = pin.Profile((0.0, 0.5 * LENGTH), tuple(DIAMETER * r for r in ends))
    told = pin.check(scene, tapered, effects=pin.ALL).value.ring
    assert told.stress_max == pytest.approx(hoop(ratios).max(), rel=1e-5)
    widest = ovalization.ring(*PIN, max(ends), MODULUS, POISSON)
    assert told.ovalization_max == pytest.approx(widest.ovalization, rel=1e-12)
    around = pin.Scene(pin.BushingGeometry(14e-3, 24e-3, 30e-3, 1e-3), FORCE, scene.material)
    outside = pin.Profile((0.0, 0.5 * LENGTH), tuple(14e-3 / r for r in ends))
    assert pin.check(around, outside, effects=pin.ALL).value.ring.stress_max == pytest.approx(
        hoop(ratios, 14e-3).max(), rel=1e-5
    )
