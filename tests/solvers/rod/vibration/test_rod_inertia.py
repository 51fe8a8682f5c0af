"""The vibrating strip against finite elements in space and global collocation in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.campaign.scenes import scene_of
from oracles.dense.rod_effects import RodModel
from oracles.dense.rod_vibration import periodic_motion
from solvers import rod
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.effects import EFFECTS
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.steady_response import RodInertia
from tests.solvers.rod.finite_elements import vibration
from tests.solvers.rod.machines import PAPER, STRIP, natural_frequency

ANGLES = 2 * np.pi * np.arange(40) / 40
"""Enough for the harmonics of a smooth force; the reference omits far higher ones, which may meet a resonance."""
STATIONS = np.linspace(0.0, STRIP.l, 41)
STILL, MOVING = Composition(couples=True), Composition(couples=True, corrections=(RodInertia(),))


def departure(scene):
    """Deflection beyond the quasi-static one, (stations, angles)."""
    quasi_static, vibrating = (Cycle(scene, STRIP, c).at(ANGLES).deflection(STATIONS) for c in (STILL, MOVING))
    return vibrating - quasi_static


def at_speed(speed):
    return replace(PAPER, mechanism=replace(PAPER.mechanism, speed=speed))


@pytest.mark.parametrize("speed", [50.0, 400.0, 900.0])
def test_matches_an_independent_beam(speed):
    scene = at_speed(speed)
    force = Cycle(scene, STRIP, STILL).axial_force(ANGLES)
    reference = vibration(scene, STRIP, ANGLES, force)
    assert departure(scene) == pytest.approx(reference, abs=1e-3 * np.abs(reference).max())


def test_grows_with_the_square_of_the_speed_when_slow():
    slow, fast = (np.abs(departure(at_speed(f))).max() for f in (1.0, 2.0))
    assert fast / slow == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("harmonic", [2, 3])
def test_is_amplified_where_a_harmonic_meets_the_natural_frequency(harmonic):
    mean = float(Cycle(PAPER, STRIP, STILL).axial_force(ANGLES).mean())
    resonance = natural_frequency(PAPER, STRIP, mean) / harmonic
    near = max(np.abs(departure(at_speed(resonance * f))).max() for f in (0.99, 0.995, 1.0, 1.005, 1.01))
    aside = min(np.abs(departure(at_speed(resonance * f))).max() for f in (0.9, 1.1))
    assert near > 3 * aside


def collocated(scene, strip, harmonics, nodes):
    """The whole motion at once, not split into quasi-static and dynamic parts: Chebyshev points along
    the strip, even angles.

    (V''(0), V'''(0)) at the angles from the partial differential equation and its four conditions as they stand.
    """
    count, l, e = 2 * harmonics + 1, strip.l, scene.mechanism.rod_length - strip.l
    angles = 2 * np.pi * np.arange(count) / count
    x = np.cos(np.pi * np.arange(nodes) / (nodes - 1))
    weight = np.where((np.arange(nodes) % (nodes - 1)) == 0, 2.0, 1.0) * (-1.0) ** np.arange(nodes)
    first = np.outer(weight, 1 / weight) / (x[:, None] - x[None, :] + np.eye(nodes))
    first = -(first - np.diag(first.sum(axis=1))) * 2 / l
    # The points run from the clamp (x = 1) to the head. The unknown is V'' there, of which V' and V are integrals.
    integral = np.zeros((nodes, nodes))
    integral[1:, 1:] = np.linalg.inv(first[1:, 1:])
    d = [integral @ integral, integral, np.eye(nodes), first, first @ first]
    steps = np.arange(count)[:, None] - np.arange(count)[None, :]
    turned = np.fft.ifft(-(np.fft.fftfreq(count, 1 / count) ** 2))[steps % count].real
    stiffness = scene.material.elastic_modulus * strip.b * strip.h**3 / 12
    inertia = scene.material.density * strip.b * strip.h * scene.mechanism.angular_speed**2
    force = Cycle(scene, strip, STILL).axial_force(angles)
    matrix = np.kron(np.eye(count), stiffness * d[4]) - np.kron(np.diag(force), d[2])
    matrix += inertia * np.kron(turned, d[0])
    right = np.zeros((count, nodes))
    conditions = (d[0][-1] + e * d[1][-1], l**2 * (d[2][-1] + e * d[3][-1]))
    for row, condition in zip((nodes - 2, nodes - 1), conditions, strict=True):
        matrix[row::nodes] = np.kron(np.eye(count), stiffness * condition[None, :] / l**4)
    right[:, nodes - 2] = stiffness / l**4 * scene.mechanism.crank_radius * np.sin(angles)
    found = np.linalg.solve(matrix, right.ravel()).reshape(count, nodes)
    return angles, found @ d[2][0], found @ d[3][0]


@pytest.mark.parametrize(
    ("speed", "delta", "harmonics", "nodes"),
    [(50.0, 0.25, 60, 14), (400.0, 0.25, 40, 18), (900.0, 0.1, 40, 18), (160.0, 0.02, 40, 18)],
)
def test_the_truncation_is_smaller_than_its_estimate(speed, delta, harmonics, nodes):
    """At 50 Hz the strip's own frequency sweeps the harmonics from the tenth to the fortieth as the force changes."""
    scene = replace(at_speed(speed), load=rod.SchmidtLoad(1.4e6, delta, 1.16))
    angles, curvature, shear = collocated(scene, STRIP, harmonics, nodes)
    stiffness, shear = bending_stiffness(scene, STRIP), -bending_stiffness(scene, STRIP) * shear
    for tolerance in (1e-4, 1e-6, 1e-8):
        vibrating = Cycle(scene, STRIP, MOVING, tolerance)
        shape, doubt = vibrating.at(angles), vibrating.refinement_error
        assert doubt <= tolerance
        # Fourth derivatives by collocation cost the reference six of its sixteen digits.
        error = max(doubt, 1e-9)
        assert shape.clamp_moment() / stiffness == pytest.approx(curvature, abs=error * np.abs(curvature).max())
        assert shape.side_force() == pytest.approx(shear, abs=error * np.abs(shear).max())


@pytest.mark.parametrize(("speed", "delta", "harmonics", "nodes"), [(50.0, 0.25, 60, 14), (400.0, 0.25, 40, 18)])
def test_the_dense_model_of_the_motion_is_the_collocated_one(speed, delta, harmonics, nodes):
    """Reference of the benchmarks: Galerkin's method and Radau's points against Chebyshev's points and harmonics."""
    scene = replace(at_speed(speed), load=rod.SchmidtLoad(1.4e6, delta, 1.16))
    angles, curvature, shear = collocated(scene, STRIP, harmonics, nodes)
    found = RodModel(scene, STRIP, frozenset({"rod_inertia"})).motion.at_clamp(angles)
    for mine, expected in zip(found, (curvature, shear), strict=True):
        assert mine == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_a_check_estimates_its_truncation_error():
    """A table's curve has jumps of its second derivative, behind which every mode rings."""
    table = rod.TableLoad((0.0, 1.0, 3.0, 5.0), (1.0e6, 1.3e6, 1.1e6, 1.2e6))
    active = frozenset({"beam_column", "rod_inertia"})
    effects = rod.EffectSelection(active, frozenset(effect.name for effect in EFFECTS) - active)
    for load, reached in ((PAPER.load, True), (table, False)):
        outcome = rod.check(replace(at_speed(400.0), load=load), STRIP, effects, accuracy=1e-8)
        assert outcome.accuracy.met == reached
    finer = Cycle(replace(at_speed(400.0), load=table), STRIP, MOVING)
    assert 0.0 < finer.refinement_error < 1e-3


@pytest.mark.parametrize("points", [360, 720, 1440])
def test_a_table_of_a_smooth_pressure_is_nearly_as_good_as_the_pressure(points):
    """Many small jumps of the curve's second derivative, some next to the corners of friction."""
    angles = 2 * np.pi * np.arange(points) / points
    table = rod.TableLoad(tuple(angles), tuple(PAPER.load.pressure(angles)))
    vibrating = rod.EffectSelection(frozenset({"rod_inertia"}))
    outcome = rod.check(replace(PAPER, load=table), STRIP, vibrating, accuracy=1e-6)
    smooth = rod.check(PAPER, STRIP, vibrating, accuracy=1e-6).value
    assert outcome.accuracy.estimated < 1e-4
    assert outcome.value.stresses.fatigue_safety == pytest.approx(smooth.stresses.fatigue_safety, rel=1e-3)


def test_beyond_buckling_nothing_vibrates(monkeypatch):
    def refuse(*arguments):
        raise AssertionError("the vibration of a buckled strip was computed")

    monkeypatch.setattr(RodInertia, "prepare", refuse)
    value = rod.check(PAPER, rod.Dimensions(9e-3, 0.3e-3, 23e-3), rod.ALL).value
    assert value.stability_safety < 1 and value.stresses is None


@pytest.mark.parametrize(("speed", "loss"), [(50.0, 0.01), (400.0, 0.05), ("resonance", 0.01)])
def test_damped_motions_are_those_of_the_dense_model(speed, loss):
    """Galerkin's method on the whole motion, at a resonance of the first mode too, where it is not finite undamped."""
    if speed == "resonance":
        mean = float(Cycle(PAPER, STRIP, STILL).axial_force(2 * np.pi * np.arange(256) / 256).mean())
        speed = natural_frequency(PAPER, STRIP, mean) / 5
    scene = at_speed(speed)
    scene = replace(scene, material=replace(scene.material, loss_factor=loss))
    vibrating = Cycle(scene, STRIP, MOVING, 1e-8)
    shape, error = vibrating.at(ANGLES), vibrating.refinement_error
    assert error <= 1e-8
    model = RodModel(scene, STRIP, frozenset({"rod_inertia"}))
    # Modal damping is not a differential operator: polynomials along the strip converge algebraically, and the
    # estimate extrapolated from the last of them may be exceeded by half.
    error *= 1.5
    curvature, shear = periodic_motion(model, functions=32).at_clamp(ANGLES)
    stiffness = bending_stiffness(scene, STRIP)
    assert shape.clamp_moment() / stiffness == pytest.approx(curvature, abs=(error + 1e-9) * np.abs(curvature).max())
    assert -shape.side_force() / stiffness == pytest.approx(shear, abs=(error + 1e-9) * np.abs(shear).max())


@pytest.mark.parametrize("seed", [330730, 343767, 350342, 354653])
def test_the_estimate_covers_a_smooth_force_whose_harmonic_meets_a_natural_frequency(seed):
    """Damping limits what a mode gains per revolution; at a harmonic of the speed it is three to four times as much."""
    scene = scene_of("flexible-rod", seed).request()
    exact, found = (rod.check(scene.scene(), scene.strip(), accuracy=accuracy) for accuracy in (1e-8, 1e-2))
    error = abs(found.value.stresses.side_force_max / exact.value.stresses.side_force_max - 1.0)
    assert error <= found.accuracy.estimated <= 1e-2
