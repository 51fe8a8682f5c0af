"""Peaks of strips under tabulated pressures, whose curvature jumps at every point of the table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.rod_problems import problem
from solvers import rod
from solvers.fatigue import serensen
from solvers.rod.optimum.core.cycle import core_cycle
from solvers.rod.optimum.peak_positions import severities_along
from solvers.rod.optimum.peaks import RequiredResults, distance_to_corners
from solvers.rod.rows import SIDE, STRESS, UTILISATION
from solvers.rod.scene import Dimensions
from tests.solvers.rod.machines import PAPER

MM = 1e-3
STEEP = rod.TableLoad(
    tuple(np.radians([101.365, 105.477, 128.026, 144.325, 148.445, 167.516, 186.709, 221.234, 228.389, 355.586])),
    (33351.0, 43679.0, 34598.0, 42830.0, 18169.0, 21878.0, 35227.0, 50213.0, 43459.0, 31152.0),
)
"""Between two of its points, 0.07 rad apart, the pressure falls by more than half."""
CORE = rod.EffectSelection(
    exclude=frozenset({"shear", "friction_feedback", "large_displacement", "rod_inertia", "reciprocating_inertia"})
)


def tabulated(seed, points):
    """A realistic problem whose pressures are known at some angles."""
    asked = problem(seed)
    angle = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False) + 0.01 * seed
    load = rod.TableLoad(tuple(angle), tuple(asked.scene.load.pressure(angle)))
    return replace(asked, scene=replace(asked.scene, load=load))


def test_reactions_peak_where_a_dense_search_finds_them():
    asked = problem(5)
    scene = replace(asked.scene, load=STEEP)
    cycle = core_cycle(scene, serensen(scene.material), 0.0)
    strip = Dimensions(6.3 * MM, 0.7 * MM, 17.0 * MM)
    dense = np.linspace(0.0, 2.0 * np.pi, 400_000, endpoint=False)
    values = cycle.strip(strip).reactions(dense)
    required = RequiredResults(False, True, False)
    peaks = cycle.peaks(strip, required)
    for row in values:
        assert np.min(np.abs(peaks.reactions - dense[row.argmax()])) < 2e-5
    rows = cycle.rows_near(peaks, required).values(np.log([strip.b, strip.h, strip.l]))
    assert rows[SIDE] == pytest.approx(np.log(values[0].max()), abs=1e-8)


@pytest.mark.parametrize(("seed", "points"), [(14, 36), (39, 72)])
def test_designs_under_tables_are_proven_to_the_accuracy(seed, points):
    """Parabolas through angles on both sides of a table's point missed peaks, and proofs ended at 7e-6 and 1e-5."""
    found = rod.design(tabulated(seed, points), CORE)
    assert found.accuracy.met
    assert found.value.check is not None


@pytest.mark.parametrize("rod_length", [45.5 * MM, 120.0 * MM, 240.0 * MM, 900.0 * MM])
def test_stress_peaks_of_a_short_strip_are_found_next_to_the_head(rod_length):
    """On a long rod bending is greatest at the head or a few hundredths of the strip beside it."""
    asked = rod.RodProblem(
        replace(PAPER, mechanism=replace(PAPER.mechanism, rod_length=rod_length)),
        rod.Bounds((4.0 * MM, 9.0 * MM), (0.2 * MM, 1.0 * MM), (8.0 * MM, 26.0 * MM)),
        rod.Requirements(2.65, 1.8),
        rod.OBJECTIVES["mass"],
    )
    for d in (Dimensions(4.0 * MM, 0.31 * MM, 8.0 * MM), Dimensions(8.0 * MM, 0.6 * MM, 20.0 * MM)):
        cycle = core_cycle(asked.scene, serensen(asked.scene.material), 0.0)
        required = RequiredResults(True, False, False)
        values = cycle.rows_near(cycle.peaks(d, required), required).values(np.log([d.b, d.h, d.l]))
        stresses = rod.check(asked.scene, d, CORE, accuracy=1e-8).value.stresses
        assert values[UTILISATION] == pytest.approx(-np.log(stresses.fatigue_safety), abs=1e-6)
        assert values[STRESS] == pytest.approx(np.log(stresses.max_stress), abs=1e-6)
    found = rod.design(asked, CORE)
    assert found.accuracy.met and found.certificate.gap <= 1e-6


@pytest.mark.parametrize("strip", [(4.687, 0.162, 13.725), (2.915, 0.1452, 18.387)])
def test_a_peak_right_beside_the_head_is_located(strip):
    """Sections that were cut off at the head, at unequal distances, located it a thousandth of the length beside."""
    scene = problem(18).scene
    cycle, d = core_cycle(scene, serensen(scene.material), 0.0), Dimensions(*(MM * size for size in strip))
    peaks = cycle.peaks(d, RequiredResults(False, False, False))
    sections = np.linspace(0.05, 0.0, 5001)
    utilisation = severities_along(cycle.strip(d).stresses(peaks.angles, sections), *cycle.diagram, False).max(axis=0)
    beside_head = sections[utilisation.argmax()]
    assert 0.001 < beside_head < 0.04
    assert np.min(np.abs(peaks.sections - beside_head)) < 2e-5


def test_the_nearest_corner_is_found_across_the_ends_of_a_revolution():
    """Corners in any order, also beyond a revolution."""
    turn, angles, corners = 2.0 * np.pi, np.linspace(-3.0, 9.0, 200), np.array([6.2, 0.3, 2.0, 7.1, -1.0])
    expected = [min(abs(a - c - k * turn) for c in corners for k in range(-3, 4)) for a in angles]
    assert distance_to_corners(angles, corners) == pytest.approx(expected, abs=1e-12)
    assert np.isinf(distance_to_corners(angles, np.empty(0))).all()
