"""T. A. Obolenskaya, A. S. Klochko (2014): the flexible rod of a small cryogenic machine, 9 x 0.46 x 23 mm, n = 2.7."""

from __future__ import annotations

import pytest

from solvers import rod
from solvers.rod.strip.buckling import critical_parameter
from tests.solvers.rod.brute_force import CoreModel
from tests.solvers.rod.machines import CORE, PAPER, STRIP


def test_the_papers_strip_has_its_fatigue_safety():
    result = rod.check(PAPER, STRIP, CORE).value
    assert round(result.stresses.fatigue_safety, 1) == 2.7
    assert not result.warnings


@pytest.mark.parametrize(
    ("read", "printed"),
    [
        (lambda r: r.axial_force_min, "-165.2293"),
        (lambda r: r.axial_force_max, "127.9860"),
        (lambda r: r.critical_force, "313.754"),
        (lambda r: r.stability_safety, "1.89890"),
        (lambda r: r.stresses.stress_amplitude / 1e6, "147.008"),
        (lambda r: r.stresses.stress_mean / 1e6, "74.044"),
        (lambda r: r.stresses.fatigue_safety, "2.69747"),
        (lambda r: r.stresses.side_force_max, "5.67391"),
        (lambda r: r.stresses.clamp_moment_max, "0.060698"),
        (lambda r: r.stresses.contact_pressure_max / 1e6, "0.044506"),
        (lambda r: r.stresses.friction_power, "0.26748"),
        (lambda r: r.stresses.worst_section, "0.0"),
    ],
)
def test_reference_numbers_to_every_printed_digit(read, printed):
    digits = len(printed.split(".")[1])
    assert f"{read(rod.check(PAPER, STRIP, CORE, accuracy=1e-8).value):.{digits}f}" == printed


def _safety(hundredths, length):
    strip = rod.Dimensions(9e-3, hundredths * 1e-5, length * 1e-3)
    return rod.check(PAPER, strip, CORE).value.stresses.fatigue_safety


@pytest.mark.parametrize(("length", "best", "printed"), [(18, 41, "2.619"), (20, 43, "2.660"), (23, 46, "2.697")])
def test_the_papers_thickness_is_the_one_of_greatest_safety(length, best, printed):
    """At b = 9 mm, over whole hundredths, the safety peaks at the paper's own 0.46 mm for l = 23.

    Left of the summit the strip is governed by its bulge inside the span, right of it by the clamp. (The summit at
    l = 23 is 2.69747; the table of summits this follows prints it as 2.698, against its own 2.69747.)
    """
    by_thickness = {h: _safety(h, length) for h in range(best - 3, best + 4)}
    assert max(by_thickness, key=by_thickness.get) == best
    assert f"{by_thickness[best]:.3f}" == printed


def test_the_summit_at_26_mm_differs_from_the_reference_table():
    """The reference table puts the summit at l = 26 mm at 0.49 mm with 2.710; this model does not reproduce that row.

    2.710 is the safety at 0.49 mm, but 0.48 mm has 2.728. The independent dense model says the same, so the row and
    not the solver is taken to be off by one hundredth.
    """
    assert f"{_safety(49, 26):.3f}" == "2.710"
    assert f"{_safety(48, 26):.3f}" == "2.728"
    by_thickness = {h: _safety(h, 26) for h in range(45, 53)}
    assert max(by_thickness, key=by_thickness.get) == 48

    def use(high, low):
        m = PAPER.material
        amplitude, mean = 0.5 * (high - low), max(0.5 * (high + low), 0.0)
        return (m.fatigue_reduction * amplitude + m.mean_stress_sensitivity * mean) / m.fatigue_limit

    for h in (48, 49):
        independent = 1 / CoreModel(PAPER, rod.Dimensions(9e-3, h * 1e-5, 26e-3)).worst(use)
        assert by_thickness[h] == pytest.approx(independent, rel=1e-7)


@pytest.mark.parametrize(
    ("ratio", "parameter"),
    [
        (0.1, 31.4512148), (0.2, 15.7867420), (0.3, 10.6049236), (0.4, 8.05526813), (0.5, 6.57201320),
        (23 / 45.5, 6.50921710), (0.6, 5.63897394), (0.7, 5.04272691), (0.8, 4.68640500), (0.9, 4.52228683),
        (1.0, 4.49340946),
    ],
)  # fmt: skip
def test_stability_map(ratio, parameter):
    """Fig. 2 of the paper: L sqrt(P_cr/EI) over l/L."""
    assert critical_parameter(ratio) == pytest.approx(parameter, rel=6e-9)
