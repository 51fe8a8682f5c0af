"""The polynomial of corrections near a strip, against strips solved anew."""

from __future__ import annotations

import numpy as np
import pytest

from bench.rod_problems import problem
from solvers import rod
from solvers.effects import EffectSelection
from solvers.fatigue import serensen
from solvers.rod.effects import choose_for, compose
from solvers.rod.optimum.full_model import FullModel
from solvers.rod.optimum.full_strip import dimensions_of, logarithms
from solvers.rod.optimum.peaks import Wanted
from solvers.rod.rows import UTILISATION

EFFECTS = EffectSelection(
    frozenset({"beam_column", "friction_feedback", "rod_inertia", "friction"}),
    frozenset({"shear", "large_displacement", "reciprocating_inertia"}),
)


@pytest.fixture(scope="module")
def rows():
    """Rows of a strip between damped resonances, with corrections to second order."""
    asked = problem(40)
    strip = rod.Dimensions(0.0098, 0.00065, 0.0257)
    composition = compose(choose_for(asked.scene, strip, EFFECTS, 1e-2))
    criterion = serensen(asked.scene.material)
    model = FullModel(asked.scene, composition, criterion, EFFECTS, 1e-2, 1e-6, Wanted(False, False, False)).finer()
    return model.following(model.peaks(strip), strip)


def test_what_corrections_add_is_followed(rows):
    home, parts = logarithms(rows.home), rows.layout.parts(UTILISATION)
    added = rows.taken_apart(home)[1]
    for direction in np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.5, -0.6]]]):
        x = home + 8e-4 * direction
        exact = rows.corrected_values(x)[parts]
        assert np.max(np.abs(rows.values(x)[parts] - exact)) < 5e-7
        if direction[1]:
            # Corrections as they are at home are far off.
            assert np.max(np.abs((rows.plain_values(x) + added)[parts] - exact)) > 2e-6


def test_a_stencil_serves_strips_close_to_its_centre(rows):
    model, near = rows.model, dimensions_of(logarithms(rows.home) + 5e-4, rows.model.scene)
    beside = model.following(model.peaks(near), near)
    assert beside.stencil is rows.stencil
    x = logarithms(near)
    assert np.allclose(beside.values(x), beside.corrected_values(x), atol=1e-12)
    far = dimensions_of(logarithms(rows.home) + 5e-3, model.scene)
    assert model.following(model.peaks(far), far).stencil is not rows.stencil


def test_neighbours_are_solved_at_the_resolution_of_the_centre(rows):
    centre = rows.model.strip(rows.home).cycle
    beside = centre.beside(dimensions_of(logarithms(rows.home) + 1e-3, rows.model.scene))
    assert beside.refinements[0].resolution == centre.refinements[0].resolution
