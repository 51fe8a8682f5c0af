"""Validation of materials, and the catalogue."""

from __future__ import annotations

import dataclasses
import math

import pytest

from solvers.errors import InvalidInput
from solvers.materials import CATALOGUE, Material

STEEL = Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0, 0.3, 1400e6)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("elastic_modulus", 0.0), ("elastic_modulus", math.inf), ("fatigue_limit", -1.0), ("fatigue_reduction", 0.9),
        ("fatigue_reduction", math.nan), ("mean_stress_sensitivity", 1.0), ("mean_stress_sensitivity", math.nan),
        ("yield_strength", 0.0), ("density", math.nan), ("poisson", 0.5), ("ultimate_strength", 1100e6),
        ("ultimate_strength", math.nan), ("ultimate_strength", math.inf),
    ],
)  # fmt: skip
def test_a_property_out_of_range_is_named(name, value):
    with pytest.raises(InvalidInput) as caught:
        dataclasses.replace(STEEL, **{name: value})
    assert caught.value.field == f"material.{name}"


def test_shear_modulus_of_an_isotropic_solid():
    assert STEEL.shear_modulus == pytest.approx(210e9 / 2.6)


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_catalogue_holds_steels(name):
    material = CATALOGUE[name]
    assert 180e9 <= material.elastic_modulus <= 215e9
    assert 7700 <= material.density <= 8100
    assert material.fatigue_limit < material.yield_strength
