"""The polynomial of corrections near a strip, against strips solved directly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.rod_problems import problem
from solvers import rod
from solvers.effects import EffectSelection
from solvers.fatigue import serensen
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import choose_for
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.optimum.full_model.strip import dimensions_of, logarithms
from solvers.rod.optimum.peaks import RequiredResults
from solvers.rod.rows import BUCKLED, UTILISATION

EFFECTS = EffectSelection(
    frozenset({"beam_column", "friction_feedback", "rod_inertia", "friction"}),
    frozenset({"shear", "large_displacement", "reciprocating_inertia"}),
)


@pytest.fixture(scope="module")
def rows():
    """Rows of a strip between damped resonances, with corrections to second order."""
    reference = problem(40)
    strip = rod.Dimensions(0.0098, 0.00065, 0.0257)
    choice = choose_for(reference.scene, strip, EFFECTS, 1e-2)
    criterion = serensen(reference.scene.material)
    model = FullModel(reference.scene, choice, criterion, 1e-6, RequiredResults(False, False, False)).finer()
    return model.rows_near(model.peaks(strip), strip)


def test_the_polynomial_agrees_with_solved_corrections(rows):
    base, parts = logarithms(rows.base), rows.layout.parts(UTILISATION)
    corrections = rows.values(base) - rows.uncorrected_values(base)
    for direction in np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.5, -0.6]]]):
        x = base + 8e-4 * direction
        exact = rows.corrected_values(x)[parts]
        assert np.max(np.abs(rows.values(x)[parts] - exact)) < 5e-7
        if direction[1]:
            # Corrections constant in x are far off.
            assert np.max(np.abs((rows.uncorrected_values(x) + corrections)[parts] - exact)) > 2e-6


def test_a_stencil_covers_strips_close_to_its_centre(rows):
    model, near = rows.model, dimensions_of(logarithms(rows.base) + 5e-5, rows.model.scene)
    neighbour = model.rows_near(model.peaks(near), near)
    assert neighbour.stencil is rows.stencil
    x = logarithms(near)
    assert np.allclose(neighbour.values(x), neighbour.corrected_values(x), atol=1e-12)
    far = dimensions_of(logarithms(rows.base) + 5e-3, model.scene)
    assert model.rows_near(model.peaks(far), far).stencil is not rows.stencil


def test_neighbours_are_solved_at_the_resolution_of_the_centre(rows):
    """Solved simultaneously on elements that move with the corners, they are as accurate as each solved alone."""
    centre = rows.model.strip(rows.base).cycle
    strips = [
        dimensions_of(logarithms(rows.base) + shift * np.array([0.3, 1.0, -0.5]), rows.model.scene)
        for shift in (0.0, 1e-3, -0.03)
    ]
    angles = np.linspace(0.0, 2.0 * np.pi, 50)
    for k, neighbour in enumerate(centre.neighbours(strips)):
        found, own = centre.refinements[0], neighbour.refinements[0]
        assert own.motion.edges.size == found.motion.edges.size and own.terms == found.terms
        moment = neighbour.at(angles).clamp_moment()
        exact = Cycle(centre.scene, strips[k], rows.model.composition, 1e-9).at(angles).clamp_moment()
        assert np.max(np.abs(moment - exact)) < 3e-7 * np.max(np.abs(exact))
        if k == 0:
            assert np.allclose(moment, centre.at(angles).clamp_moment(), rtol=1e-10, atol=0.0)
        else:
            assert not np.array_equal(own.motion.edges, found.motion.edges)


def test_differences_are_as_good_at_a_rough_resolution(rows):
    """Errors of strips with one discretisation nearly cancel, even if each is a hundred times the tolerance."""
    model, base, parts = rows.model, logarithms(rows.base), rows.layout.parts(UTILISATION)
    coarse = model.coarser(1e-4)
    finer = model.finer(coarse)
    other = finer.rows_near(rows.peaks, rows.base)
    assert other.stencil.centre is coarse.strip(rows.base)
    assert coarse.strip(rows.base).cycle.tolerance > 50.0 * model.strip(rows.base).cycle.tolerance
    assert np.array_equal(other.values(base), rows.values(base))
    exact, found = rows.jacobian(base)[parts], other.jacobian(base)[parts]
    assert np.max(np.abs(found - exact)) < 1e-3 * np.max(np.abs(exact - rows.uncorrected_jacobian(base)[parts]))


def test_rough_checks_leave_out_a_friction_power_that_is_not_required(rows):
    """It takes a third of a check under measured pressures; the contact pressure stays."""
    model, d = rows.model, rows.base
    for required in (model.required._replace(reactions=True), model.required._replace(reactions=True, power=True)):
        full, rough = (each.check(d).value.stresses for each in (
            replace(model, required=required).at_accuracy(1e-4), replace(model, required=required).coarser(1e-4)
        ))  # fmt: skip
        assert rough.contact_pressure_max == pytest.approx(full.contact_pressure_max, rel=1e-4)
        if required.power:
            assert rough.friction_power == pytest.approx(full.friction_power, rel=1e-4)
        else:
            assert rough.friction_power is None and full.friction_power > 0.0


def test_a_strip_that_buckles_has_the_rows_of_buckling(rows):
    base = logarithms(rows.base)
    assert rows.uncorrected_values(base - np.array([0.0, 0.6, 0.0]))[UTILISATION] == BUCKLED
    assert rows.uncorrected_values(base)[UTILISATION] < BUCKLED


def test_with_discrete_sizes_other_directions_are_solved_only_if_required(rows):
    """The rows are the same."""
    model = replace(rows.model, free=(1,), _stencils=[])
    partial_rows = model.rows_near(model.peaks(rows.base), rows.base)
    base, parts = logarithms(rows.base), rows.layout.parts(UTILISATION)
    for shift, solved in (([0.0, 8e-4, 0.0], 3), ([4e-4, 8e-4, 0.0], 10)):
        x = base + np.array(shift)
        assert partial_rows.values(x)[parts] == pytest.approx(rows.values(x)[parts], abs=1e-6)
        assert len(partial_rows.stencil.solved) == solved


def test_a_discretisation_does_not_fit_another_number_of_corners(rows):
    """Without friction there are no corners."""
    centre = rows.model.strip(rows.base).cycle
    piston = replace(centre.scene.piston, friction_coefficient=0.0)
    assert replace(centre, scene=replace(centre.scene, piston=piston)).strip.friction == 0.0
    smooth = replace(centre, scene=replace(centre.scene, piston=piston))
    assert centre.refinements[0].excitation.corners.size
    assert centre.refinements[0].excitation.neighbour(smooth) is None
