"""The compiled axial force against the load's own pressure and the kinematics in numpy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from solvers import rod
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.fatigue import serensen
from solvers.numerics import periodic
from solvers.rod.load import axial_force as drive
from solvers.rod.optimum.core.cycle import core_cycle
from tests.solvers.rod.machines import PAPER

TABLE = rod.TableLoad((0.3, 1.1, 2.0, 3.7, 5.9), (1.1e5, 2.4e5, 1.9e5, 0.6e5, 0.9e5))


@pytest.mark.parametrize(
    "load",
    [PAPER.load, rod.SchmidtLoad(2e5, 0.97, 4.0, 1e5), rod.ConstantLoad(-3e5), rod.ConstantLoad(3e5, 1e5), TABLE,
     dataclasses.replace(TABLE, back_pressure=1e5)],
)  # fmt: skip
@pytest.mark.parametrize("mass", [0.0, 0.2])
def test_the_force_is_that_of_gas_and_moving_mass(load, mass):
    scene = dataclasses.replace(PAPER, load=load)
    m = scene.mechanism
    angle = np.concatenate([np.random.default_rng(1).uniform(-7.0, 14.0, 400), TABLE.angle])
    expected = -(load.pressure(angle) - load.reference_pressure()) * scene.piston.area
    expected += mass * ExactMotion(m.crank_radius, m.rod_length).acceleration(angle) * m.angular_speed**2
    found = drive.axial_forces(drive.drive_of(scene, mass), angle)
    assert np.all(np.abs(found - expected) <= 2e-15 * np.abs(expected).max())


@pytest.mark.parametrize("load", [PAPER.load, rod.SchmidtLoad(2e5, 0.97, 6.28), TABLE])
def test_the_least_force_is_that_of_a_dense_grid(load):
    scene = dataclasses.replace(PAPER, load=load)
    driven, cycle = drive.drive_of(scene, 0.0), core_cycle(scene, serensen(scene.material), 0.0)
    least, where = -cycle.compression, cycle.peak_compression_angle
    near = where + np.linspace(-1e-3, 1e-3, 2001)
    dense = drive.axial_forces(driven, np.concatenate([periodic.grid(50_000), near]))
    assert least == pytest.approx(dense.min(), abs=1e-9 * np.abs(dense).max())
    assert least == pytest.approx(drive.axial_force(driven, where), rel=1e-12)
