"""A found curve as cubics: against the function that it was sampled from."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from solvers import pin
from solvers.pin.result import sections_of
from solvers.pin.shapes.contour import Contour, contour
from solvers.pin.stations.lobatto_panels import Stations
from tests.solvers.pin.pins import GEOMETRY, PAPER, STEEL, VAZ, vaz

LENGTH = 0.08
HALF = np.linspace(0.0, 0.5 * LENGTH, 9)


def smooth(x):
    return 0.012 + 0.004 * np.cos(90.0 * x) * np.exp(-20.0 * x)


def bent(x):
    """Flat, then a slope, from a panel's end on."""
    return 0.014 - 0.3 * np.maximum(x - 0.02, 0.0)


def stations(edges):
    return Stations(np.asarray(edges))


def at(pieces, x):
    """The diameter at each position, from the piece that spans it."""
    return np.array([next(p for p in pieces if p.start <= place <= p.end).at(np.array(place)) for place in x])


@pytest.mark.parametrize("shape", [smooth, bent])
def test_it_is_the_function_within_its_tolerance(shape):
    panels = stations(HALF)
    pieces = contour(panels, shape(panels.x), LENGTH).pieces
    x = np.linspace(0.0, LENGTH, 801)
    found, wanted = at(pieces, x), shape(np.minimum(x, LENGTH - x))
    assert np.abs(found - wanted).max() < 3e-7 * wanted.max()
    assert pieces[0].start == 0.0
    assert pieces[-1].end == pytest.approx(LENGTH, rel=1e-14)
    assert all(a.end == pytest.approx(b.start, rel=1e-13) for a, b in pairwise(pieces))


def test_straight_parts_are_one_piece_each():
    panels = stations(HALF)
    assert len(contour(panels, bent(panels.x), LENGTH).pieces) == 4
    assert len(contour(panels, np.full_like(panels.x, 0.01), LENGTH).pieces) == 2


def test_a_kink_within_a_narrow_panel_is_followed_from_node_to_node():
    edges = np.sort(np.append(HALF, [0.0201, 0.0201 + 2e-6]))
    panels = stations(edges)
    kink = 0.0201 + 0.7e-6

    def shape(x):
        return 0.014 - 0.3 * np.maximum(x - kink, 0.0)

    pieces = contour(panels, shape(panels.x), LENGTH).pieces
    x = np.linspace(0.0, 0.5 * LENGTH, 4001)
    assert np.abs(at(pieces, x) - shape(x)).max() < 1e-7


def test_a_step_stays_a_step():
    """Two values at one place, on either side of a panel's end."""
    panels = stations(HALF)
    step = HALF[4]
    values = np.where(panels.side >= step, 0.010, 0.014)
    pieces = contour(panels, values, LENGTH).pieces
    values = [value for p in pieces for value in (p.first, p.last)]
    assert values == pytest.approx([0.014, 0.014, 0.010, 0.010, 0.010, 0.010, 0.014, 0.014])
    assert pieces[0].end == pieces[1].start == pytest.approx(step)


def test_a_whole_bar_is_not_mirrored():
    panels = stations(np.linspace(0.0, LENGTH, 17))
    pieces = contour(panels, smooth(panels.x), LENGTH).pieces
    x = np.linspace(0.0, LENGTH, 401)
    assert np.abs(at(pieces, x) - smooth(x)).max() < 3e-7 * 0.016


@pytest.mark.parametrize("form", [pin.Free(), pin.Free(drillable=True)], ids=lambda form: form.name)
@pytest.mark.parametrize("slope", [0.1, 0.3, 0.5])
def test_about_kinks_there_are_no_waves(slope, form):
    found = pin.design(pin.PinProblem(VAZ, pin.Limits(min_wall=3e-3, max_slope=slope), form)).value
    for piece in found.contour:
        x = np.linspace(piece.start, piece.end, 41)
        diameters = piece.at(x)
        sizes = found.evaluation.program.variable.sizes(found.evaluation.walls)
        assert diameters.max() <= sizes.max() * (1 + 1e-9)
        assert np.abs(np.diff(diameters) / np.diff(x)).max() <= slope * (1 + 1e-6)


LIMITED = [{}, {"min_wall": 1.5e-3}, {"max_deflection": 12e-6}, {"max_slope": 0.3, "min_wall": 1e-3}]


@pytest.mark.parametrize("criterion", ["tresca_paper", "fibre"])
@pytest.mark.parametrize("limits", LIMITED, ids=lambda limits: "-".join(limits) or "none")
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_a_part_made_to_the_contour_or_to_the_points_meets_the_limits(limits, criterion, accuracy):
    """The textbook's stresses at dense samples of the cubics, and of straight lines between the points."""
    problem = pin.PinProblem(VAZ, pin.Limits(**limits), pin.Free(), pin.CRITERIA[criterion])
    found, length, D = pin.design(problem, accuracy=accuracy).value, VAZ.geometry.length, GEOMETRY.outer_diameter
    along = found.check.along
    cubics = [(np.linspace(p.start, p.end, 33), p.at(np.linspace(p.start, p.end, 33))) for p in found.contour]
    share = np.linspace(0.0, 1.0, 9)
    lines = [
        (a + share * (b - a), first + share * (last - first))
        for (a, b), (first, last) in zip(pairwise(along.x), pairwise(along.bore), strict=True)
        if b > a
    ]
    for pieces, tolerance in ((cubics, accuracy), (lines, max(accuracy, 1e-4))):
        x, d = (np.concatenate(values) for values in zip(*pieces, strict=True))
        # At the bare ends there is nothing to be stressed.
        x, d = x[(D - d) > 1e-6 * D], d[(D - d) > 1e-6 * D]
        y = np.minimum(x, length - x)
        moment, shear = VAZ.own_forces(y, y)[:2]
        bent = 32.0 * moment * D / (np.pi * (D - d) * (D + d) * (D * D + d * d))
        sheared = 16.0 * shear * (D * D + D * d + d * d) / (3.0 * np.pi * (D - d) * (D + d) * (D * D + d * d))
        stress = np.hypot(bent, 2.0 * sheared) if criterion == "tresca_paper" else np.maximum(bent, 2.0 * sheared)
        assert stress.max() <= STEEL.allowable_stress * (1.0 + tolerance)
        mean = sum(np.trapezoid(D * D - values * values, places) for places, values in pieces)
        assert mean * STEEL.density * np.pi / 4.0 == pytest.approx(found.check.mass, rel=max(10.0 * tolerance, 4e-4))


@pytest.mark.parametrize("form", [pin.Free(), pin.Free(drillable=True)], ids=lambda form: form.name)
def test_points_are_no_closer_than_they_need_be(form):
    """At the ends, where the wall is convex, short cubics next to one another are spanned by one chord."""
    outcome = pin.design(pin.PinProblem(VAZ, form=form))
    assert len(outcome.value.contour) > 100
    assert outcome.value.check.along.x.size < 90
    # Kinks are found in one pass.
    assert outcome.accuracy.settings["stations"] <= 450


@pytest.mark.parametrize("form", [pin.Free(), pin.Free(drillable=True)], ids=lambda form: form.name)
@pytest.mark.parametrize("force", [5e-3, 1e-20, 1e-60])
def test_walls_thinner_than_rounding_of_a_diameter_are_designed_like_others(force, form):
    """They took up to 15,000 stations and as many cubics, which no diameter with sixteen digits could meet."""
    outcome = pin.design(pin.PinProblem(vaz(force), form=form))
    assert outcome.accuracy.met
    assert outcome.accuracy.settings["stations"] < 500
    assert len(outcome.value.contour) < 200


@pytest.mark.parametrize("form", [pin.Free(), pin.Free(drillable=True)], ids=lambda form: form.name)
@pytest.mark.parametrize("force", [3e-8, 3e-10])
def test_a_slope_limit_that_nothing_reaches_changes_nothing(force, form):
    """The limit's rise along the part has more digits than such walls: 9,000 stations, and masses 1e-5 off."""
    free = pin.design(pin.PinProblem(vaz(force), form=form)).value.check.mass
    outcome = pin.design(pin.PinProblem(vaz(force), pin.Limits(max_slope=5e-3), form))
    assert outcome.accuracy.met
    assert outcome.accuracy.settings["stations"] < 200
    assert outcome.value.check.mass == pytest.approx(free, rel=1e-7)


def test_no_point_of_a_profile_lies_beyond_the_given_diameter():
    """Cubics, and rounding, may swing below a bore of zero and above the outer diameter."""
    D, half = GEOMETRY.outer_diameter, 0.5 * VAZ.geometry.length
    for size, slope in ((0.0, -1e-9), (D, 1e-9)):
        shape = partial(Contour, np.array([[0.0, half, size, size, slope, -slope]]), 2.0 * half)
        bore = sections_of(VAZ, PAPER, shape, half, 1e-6).bore
        assert bore.min() >= 0.0
        assert bore.max() <= D
