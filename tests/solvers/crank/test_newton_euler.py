"""All forces of a cycle against the rod as a rigid body: Newton's and Euler's equations solved at every angle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from solvers import crank
from solvers.effects import ALL
from tests.solvers.crank.machines import CAR, CYLINDER, MASSES, car, cooler

ANGLES = 2048
"""Per turn: derivatives of the positions are those of their Fourier series."""

SHORT = crank.RodMass(0.055, 0.6, 0.03, 2e-3)
SCENES = {
    "car": car(),
    "cooler": cooler(),
    "offset": cooler(mechanism=crank.Mechanism(0.0015, 0.0455, 50.0, 0.004)),
    "offset the other way": cooler(mechanism=crank.Mechanism(0.015, 0.0455, 150.0, -0.025)),
    "short rod": car(mechanism=replace(CAR, rod_length=0.055), masses=replace(MASSES, rod=SHORT)),
    "two rods": car(masses=replace(MASSES, rods_per_pin=2)),
    "no masses": car(masses=crank.Masses(0.0, crank.RodMass(0.14, 0.0, 0.05), crank.CrankThrow())),
    "vacuum": car(cylinder=replace(CYLINDER, crankcase_pressure=-1e6)),
}


def derivatives(values):
    """First and second derivative of a periodic function."""
    order = np.fft.fftfreq(values.size, 1.0 / values.size)
    harmonics = np.fft.fft(values)
    harmonics[np.abs(harmonics) < 1e-15 * np.abs(harmonics).max()] = 0.0
    return np.fft.ifft(1j * order * harmonics).real, np.fft.ifft(-(order**2) * harmonics).real


def by_newton_and_euler(scene, gas):
    """Rows of ``Forces``, by name, at the angles of a cycle, from the force of the gas [N] there.

    The cylinder stands upright above the shaft, x points to where the crank turns from the top.
    """
    m, masses, omega = scene.mechanism, scene.masses, scene.mechanism.angular_speed
    rod, turns = masses.rod, scene.cylinder.strokes // 2
    phi = 2.0 * math.pi * np.arange(ANGLES) / ANGLES
    across = (m.crank_radius * np.sin(phi) - m.offset) / m.rod_length
    height = m.crank_radius * np.cos(phi) + m.rod_length * np.sqrt(1.0 - across**2)
    lift = derivatives(height)[1] * omega**2
    # The rod points from the wrist pin to the crank pin: (sin beta, -cos beta).
    along = np.array([across, -np.sqrt(1.0 - across**2)])
    turned = derivatives(np.arcsin(across))[1] * omega**2
    phi, lift, turned = (np.tile(each, turns) for each in (phi, lift, turned))
    centre = rod.cg_from_pin * np.array([derivatives(each)[1] for each in along]) * omega**2
    along, centre = np.tile(along, turns), np.tile(centre, turns) + np.array([0.0 * lift, lift])
    # Force of the wrist pin on the rod: upright from the piston, sidewards from the rod's moment of momentum.
    a, b = rod.cg_from_pin, rod.length - rod.cg_from_pin
    inertia = rod.mass * a * b if rod.inertia is None else rod.inertia
    upright = -gas - masses.piston * lift
    moments = inertia * turned + a * along[0] * upright
    moments -= b * (along[0] * (rod.mass * centre[1] - upright) - along[1] * rod.mass * centre[0])
    wrist = np.array([moments / (along[1] * rod.length), upright])
    # Forces on the crank pin and, with everything that turns, on the bearings.
    pin, out = wrist - rod.mass * centre, np.array([np.sin(phi), np.cos(phi)])
    forward = np.array([out[1], -out[0]])
    tip = m.crank_radius * omega**2
    big_end, others = (
        rod.at_crank_pin * tip,
        masses.throw.at_crank_pin(m.crank_radius) + (masses.rods_per_pin - 1) * rod.at_crank_pin,
    )
    tangential, outward = (pin * forward).sum(axis=0), (pin * out).sum(axis=0)
    small_end = wrist - rod.at_wrist_pin * np.array([0.0 * lift, lift])
    return {
        "gas": gas,
        "inertia": (masses.piston + rod.at_wrist_pin) * lift,
        "rod": (small_end * along).sum(axis=0),
        "side": wrist[0],
        "tangential": tangential,
        "radial": big_end - outward,
        "torque": tangential * m.crank_radius,
        "wrist_pin_load": np.hypot(*wrist),
        "crank_pin_load": np.hypot(*pin),
        "main_bearing_load": np.hypot(tangential, outward + others * tip),
    }


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_forces_are_those_of_the_rigid_bodies(scene):
    found = crank.analyse(scene, ALL, series_angles=ANGLES * scene.cylinder.strokes // 2).value
    own = by_newton_and_euler(scene, found.series.gas)
    for name, exact in own.items():
        scale = max(np.abs(exact).max(), 1e-300)
        assert getattr(found.series, name) == pytest.approx(exact, rel=0.0, abs=1e-9 * scale), name


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_worst_instants_and_the_work_are_those_of_the_rigid_bodies(scene):
    found = crank.analyse(scene, ALL, series_angles=ANGLES * scene.cylinder.strokes // 2).value
    own = by_newton_and_euler(scene, found.series.gas)
    rod = own["rod"]
    most = {"rod_compression_max": rod, "rod_tension_max": -rod, "side_force_max": np.abs(own["side"])}
    most |= {f"{name}_max": own[name] for name in ("wrist_pin_load", "crank_pin_load", "main_bearing_load")}
    for worst in found.worst[1:]:
        scale = np.abs(rod).max()
        assert -1e-9 * scale < worst.force - most[worst.name].max() < 2e-4 * scale, worst.name
    torque, step = own["torque"], 2.0 * math.pi / ANGLES
    size = np.abs(torque).max() * scene.cylinder.period
    # The sum over steps misses half of one at every jump of the pressure.
    assert found.torque_mean * scene.cylinder.period == pytest.approx(torque.sum() * step, abs=1e-4 * size)
    work = np.cumsum(torque - torque.mean()) * step
    assert found.speed_fluctuation.work_fluctuation == pytest.approx(np.ptp(work), abs=1e-4 * size)
