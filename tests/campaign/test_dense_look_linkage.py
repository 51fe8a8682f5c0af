"""Dense sampling of an impact linkage never finds values worse than a check reports; sampling needs no search.

Crank angles, box directions, circle centres and time steps under a motor are sampled on fine grids, so that a missed
peak is detected, though not to many digits.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from bench.campaign.scenes import scene_of
from solvers import linkage
from solvers.effects import EffectSelection
from solvers.linkage.loads.torque_and_pin_force import series
from solvers.linkage.steady_state.collocation import Machine, inertias, integrate_revolution, mesh
from solvers.linkage.steady_state.periodic_solution import rocker_inertia

ACCURACY = 1e-6
ANGLES, SWEPT, DIRECTIONS, CENTRES, PARTS = 20_000, 1_200, 721, 31, 64

BESIDE_A_QUARTER_TURN = 259, 3343, 4196, 6130, 6544, 7180, 9047
"""Scenes whose maximum torque or force occurs near a quarter turn before the blow."""


@pytest.mark.parametrize("seed", [*range(1000, 1040), *BESIDE_A_QUARTER_TURN])
def test_no_extremum_of_a_cycle_is_missed(seed):
    request = scene_of("impact-linkage", seed).request()
    scene, mechanism = request.mechanism()
    limits = request.limits.to_solver()
    wanted = {"envelope"} | ({"impact_dynamics"} if scene.drive else set())
    effects = EffectSelection(frozenset(wanted), automatic=False)
    outcome = linkage.check(scene, mechanism, limits, effects, accuracy=ACCURACY)
    told, slack = outcome.value, outcome.accuracy.estimated + 1e-12
    for name, worst in peaks_seen(scene, mechanism).items():
        assert getattr(told.strike.peaks, name) >= worst * (1.0 - slack), name
    # Joints sampled at discrete angles underestimate the swept area slightly.
    area, radius = sizes_seen(mechanism, limits.joint_radius)
    assert told.box.area <= area * (1.0 + 2e-5)
    assert told.enclosing_radius <= radius * (1.0 + 1e-3)
    if scene.drive:
        assert told.running.irregularity >= irregularity_seen(scene, mechanism, told.running) * (1.0 - slack - 1e-9)


def peaks_seen(scene, mechanism):
    """Maxima of |u31|, crank torque and pin force on a uniform grid, refined near the blow and opposite to it."""
    near = np.geomspace(1e-9, 1.0, 1_000)
    phi = np.concatenate(
        [np.linspace(0.0, 2.0 * math.pi, ANGLES), 2.0 * math.pi - near, math.pi - near, math.pi + near]
    )
    torque, force = series(mechanism.bar, mechanism.crank, scene.impact_energy, phi)
    back = np.where(phi > math.pi, np.minimum(phi - 2.0 * math.pi, -1e-300), phi)
    transfer = mechanism.bar.transfer(back)
    return {"torque": np.abs(torque).max(), "force": force.max(), "u31": np.abs(transfer).max()}


def sizes_seen(mechanism, pad):
    """Minimum box area over directions and minimum radius over centres, around the sampled joints."""
    bar, near = mechanism.bar, np.geomspace(1e-6, 1.0, 60)
    phi = np.concatenate([np.linspace(-math.pi, math.pi, SWEPT), near, -near, math.pi - near, near - math.pi])
    pivots = np.array([[0.0, bar.ratios.base], [0.0, 0.0]])
    points = mechanism.crank * np.hstack([*bar.joints(phi), pivots])
    along = np.linspace(0.0, 0.5 * math.pi, DIRECTIONS)
    width = np.ptp(np.stack([np.cos(along), np.sin(along)], axis=1) @ points, axis=1) + 2.0 * pad
    height = np.ptp(np.stack([-np.sin(along), np.cos(along)], axis=1) @ points, axis=1) + 2.0 * pad
    xs, ys = (np.linspace(row.min(), row.max(), CENTRES) for row in points)
    few = np.hstack([points[:, ::3], points[:, -2:]])
    reach = np.hypot(xs[:, None, None] - few[0], ys[None, :, None] - few[1]).max(axis=2)
    return (width * height).min(), reach.min() + pad


def irregularity_seen(scene, mechanism, running):
    """(Maximum - minimum)/mean crank speed [-] over many time steps of the reported revolution."""
    bar, drive = mechanism.bar, scene.drive
    rocker, tool = rocker_inertia(bar, scene), mechanism.crank * bar.ratios.rocker
    first = running.impact_speed / (bar.u31_end * tool) * (1.0 + running.jump)
    energy = 0.5 * (drive.crank_inertia + rocker * bar.u31_start**2) * first**2
    steps = mesh(bar.coefficients, PARTS)
    machine = Machine(bar.coefficients, drive.crank_inertia, rocker, drive.stall_torque, drive.slope)
    work, _ = integrate_revolution(inertias(machine, steps), steps, energy, machine)
    transfer = bar.transfer(np.append(steps[:, 0], -1e-300))
    speed = np.sqrt(2.0 * (energy + work) / (drive.crank_inertia + rocker * transfer**2))
    return np.ptp(speed) / (2.0 * math.pi * running.blow_frequency)
