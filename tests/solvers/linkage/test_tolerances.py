"""Closure: recognised in any unit, and what missing it does, against the raw triangles at 60 digits."""

from __future__ import annotations

import math

import mpmath as mp
import pytest

from solvers.linkage import LARGEST_BASE, LARGEST_COUPLER, Lengths, of_lengths
from solvers.linkage.mechanism.change_point import KINDS, Gain, plain_ratios
from solvers.linkage.mechanism.closure import nearest_kind, restitution_error, rotates_fully, window
from solvers.linkage.mechanism.kinematics import FourBar, of_family


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1.0, 1e6])
@pytest.mark.parametrize(
    ("lengths", "kind"),
    [
        ((0.04, 0.03, 0.11, 0.1), "largest_coupler"),
        ((0.11, 0.03, 0.1, 0.04), "largest_base"),
        ((0.04, 0.03, 0.1, 0.11), "largest_rocker"),
        ((2, 1, 4, 3), "largest_coupler"),
        ((2, 1, 3, 4), "largest_rocker"),
        ((4, 1, 3, 2), "largest_base"),
        ((0.3, 0.1, 0.7, 0.5), "largest_coupler"),
    ],
)
def test_decimal_lengths_close_in_any_unit(unit, lengths, kind):
    found, closure = nearest_kind(*(unit * length for length in lengths))
    assert closure.closes
    assert found.name == kind


def test_a_parallelogram_is_taken_as_the_kind_preferred():
    lengths = Lengths(0.2, 0.1, 0.2, 0.1)
    assert of_lengths(lengths).bar.kind is LARGEST_COUPLER
    assert of_lengths(lengths, LARGEST_BASE).bar.kind is LARGEST_BASE
    assert of_lengths(lengths, LARGEST_BASE).closure.closes


def missed(kind: str, miss: mp.mpf) -> tuple[tuple[mp.mpf, ...], FourBar]:
    """Ratios of a mechanism whose coupler is off, so that the closure surplus is ``miss``."""
    exact = of_family(KINDS[kind], 0.2, KINDS[kind].parameter_limit(Gain(0.2)) * 1.4).ratios
    base, rocker = mp.mpf(float(exact.base)), mp.mpf(float(exact.rocker))
    coupler = {
        "largest_coupler": base + rocker - 1 - miss,
        "largest_rocker": 1 + rocker - base + miss,
        "largest_base": 1 + base - rocker + miss,
    }[kind]
    return (base, coupler, rocker), FourBar(KINDS[kind], plain_ratios(float(base), float(coupler), float(rocker)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("exponent", range(1, 13))
def test_windows_are_those_of_the_triangles(kind, exponent):
    with mp.workdps(60):
        for sign in (1, -1):
            miss = sign * mp.mpf(2) ** (-3 * exponent)
            (base, coupler, rocker), bar = missed(kind, miss)
            found = window(bar, float(miss))
            assert found.blocked == (sign < 0)
            if sign < 0:
                # The crank stops where coupler and rocker lie on one line with the pin.
                apart = coupler + rocker if kind == "largest_base" else abs(coupler - rocker)
                cosine = (base**2 + 1 - apart**2) / (2 * base)
                exact = mp.acos(-cosine if kind == "largest_base" else cosine)
                assert found.angle == pytest.approx(float(exact), rel=1e-9)
            else:
                # The rocker turns back where crank and coupler lie on one line.
                apart = coupler + 1 if kind == "largest_coupler" else coupler - 1
                cosine = (base**2 + rocker**2 - apart**2) / (2 * base * rocker)
                exact = mp.acos(-cosine if kind == "largest_coupler" else cosine)
                assert found.short_stop == pytest.approx(float(exact), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_to_first_order_the_window_goes_with_the_root_of_the_miss(kind):
    bar = of_family(KINDS[kind], 0.2, KINDS[kind].parameter_limit(Gain(0.2)) * 1.4)
    reach, miss = float(bar.kind.pin_to_pivot(bar.ratios)), 1e-10
    angle = math.sqrt(2 * miss * reach / float(bar.ratios.base))
    assert window(bar, -miss).angle == pytest.approx(angle, rel=1e-9)
    assert window(bar, miss).short_stop == pytest.approx(math.sqrt(bar.gain**2 - 1) * angle / reach, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("restitution", [0.05, 0.3, 0.8])
def test_restitution_moves_with_the_lengths(kind, restitution):
    """The greatest change of R_k over all lengths within the tolerance that still close, by linear programming."""
    from scipy.optimize import linprog

    bar = of_family(KINDS[kind], restitution, KINDS[kind].parameter_limit(Gain(restitution)) * 1.4)
    crank, tolerance = mp.mpf("0.1"), 1e-5
    lengths = [crank * mp.mpf(float(x)) for x in (bar.ratios.base, 1.0, bar.ratios.coupler, bar.ratios.rocker)]
    closing = {"largest_coupler": (1, -1, -1, 1), "largest_rocker": (1, -1, 1, -1), "largest_base": (1, 1, -1, -1)}

    def made_for(base, crank, coupler, rocker):
        g = mp.sqrt(base * coupler / (crank * rocker))
        return (g - 1) / (g + 1)

    with mp.workdps(50):
        step = mp.mpf(10) ** -25
        moved = [made_for(*(x + step * (i == k) for k, x in enumerate(lengths))) for i in range(4)]
        slopes = [float((each / made_for(*lengths) - 1) / step) for each in moved]
    worst = linprog([-slope for slope in slopes], A_eq=[closing[kind]], b_eq=[0], bounds=[(-1, 1)] * 4)
    assert restitution_error(bar, 0.1, tolerance) == pytest.approx(-worst.fun * tolerance, rel=1e-9)


@pytest.mark.parametrize(
    ("lengths", "turns"),
    [((4, 1, 3.01, 2), True), ((4, 1, 2.99, 2), False), ((2, 1, 4, 3.01), True), ((2, 1, 4, 2.99), False),
     ((1, 2, 1.4, 1.4), False), ((1, 2, 2.2, 2.2), True), ((3, 3, 3, 3), True)],
)  # fmt: skip
def test_whether_the_crank_turns(lengths, turns):
    assert rotates_fully(*lengths) == turns


def test_auto_keeps_the_angle_that_a_tolerance_may_block():
    """Some 0.02 mm in each length change the restitution by little, but may block the crank over degrees."""
    from solvers import linkage

    scene = linkage.Scene(linkage.Restitution(0.3, 0.3), 25.0, 5.0, 2.0, length_tolerance=2e-5)
    mechanism = linkage.of_ratio(scene, LARGEST_BASE, 3.17356675)
    found = linkage.check(scene, mechanism).value
    crank = mechanism.crank
    deficit, base = 4 * 2e-5 / crank, 3.17356675
    # The crank stops where coupler and rocker, too short together, are stretched.
    reach = (base + 1) - deficit
    stops = math.acos(-(base**2 + 1 - reach**2) / (2 * base))
    assert found.restitution_error < 2e-3
    assert found.tolerance_window.blocked and found.tolerance_window.angle == pytest.approx(stops, rel=1e-9)
    coarse = linkage.check(scene, mechanism, effect_tolerance=0.2).value
    assert coarse.tolerance_window is None
