"""A pressure that jumps at the dead centres excites the same ringing as a steep rise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from app.designs.flexible_rod.request import CheckRequest, DesignRequest
from oracles.dense.rod_effects import RodModel
from oracles.dense.rod_vibration import periodic_motion
from solvers import rod
from solvers.effects import EffectSelection
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.cycle.state import MOMENT, SIDE, states_of
from solvers.rod.vibration import periodic_motion as motions
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import Excitation

DIAGRAM = {
    "kind": "indicator",
    "clearance_volume_cm3": 2.0,
    "strokes": [
        {"volume_cm3": [2.0, 2.25, 2.55, 2.942], "pressure_mpa": [2.4, 2.1, 1.8, 1.55]},
        {"volume_cm3": [2.942, 2.55, 2.25, 2.0], "pressure_mpa": [1.5, 1.7, 2.0, 2.3]},
    ],
}
MOVED = frozenset({"beam_column", "friction", "rod_inertia"})
SELECTION = EffectSelection(MOVED, frozenset(effect.name for effect in rod.EFFECTS) - MOVED)
RISE = 4e-4
"""Half-width [rad] of the steep rise that stands for a jump; the first mode turns by a hundredth of a radian in it."""


def request(kind: type, **parts: object) -> object:
    body = {
        "mechanism": {"crank_radius_mm": 1.5, "rod_length_mm": 45.5, "speed_hz": 50},
        "piston": {"diameter_mm": 20, "skirt_length_mm": 27, "friction_coefficient": 0.15},
        "load": DIAGRAM,
        "material": {
            "elastic_modulus_gpa": 210,
            "fatigue_limit_mpa": 480,
            "fatigue_reduction": 1.15,
            "mean_stress_sensitivity": 0.12,
            "yield_strength_mpa": 1200,
            "density_kg_m3": 7850,
        },
    }
    return kind.model_validate(body | parts)


def steep(load: rod.IndicatorLoad) -> rod.TableLoad:
    """The same pressures in a table, the jumps being steep rises."""
    away = np.concatenate([[RISE], np.geomspace(2e-3, 0.1, 30), np.linspace(0.12, 0.5 * math.pi, 60)])
    angle = np.sort(np.concatenate([c + side * away for c in (0.0, math.pi) for side in (-1.0, 1.0)]) % (2.0 * math.pi))
    angle = angle[np.append(np.diff(angle) > 1e-6, True)]
    return rod.TableLoad(tuple(angle.tolist()), tuple(load.pressure(angle).tolist()), load.reference_pressure())


def test_a_jump_is_a_steep_rise():
    asked = request(CheckRequest, dimensions={"b_mm": 9, "h_mm": 0.46, "l_mm": 23})
    scene, strip = asked.scene(), asked.strip()
    found = rod.check(scene, strip, SELECTION, accuracy=1e-6)
    rising = rod.check(rod.Scene(scene.mechanism, scene.piston, steep(scene.load), scene.material), strip, SELECTION)
    assert found.accuracy.met
    for read in ("fatigue_safety", "side_force_max", "friction_power"):
        value, expected = (getattr(outcome.value.stresses, read) for outcome in (found, rising))
        assert value == pytest.approx(expected, rel=1e-3), read
    quasi_static = rod.check(
        scene, strip, EffectSelection(MOVED - {"rod_inertia"}, SELECTION.exclude | {"rod_inertia"})
    )
    # Ringing changes the result by ten times the admissible difference of the two.
    assert abs(quasi_static.value.stresses.fatigue_safety / found.value.stresses.fatigue_safety - 1.0) > 1e-2


@dataclass(frozen=True)
class UnderADiagram(RodModel):
    """The dense oracle's strip under a diagram's pressure, with elements that end at its points and jumps."""

    def gas_force(self, angle):
        return -(self.scene.load.pressure(angle) - self.scene.load.reference_pressure()) * self.scene.piston.area

    def force_corners(self):
        return np.unique(np.mod(self.scene.load.sharp_angles(), 2.0 * math.pi))

    def greatest_reactions(self, functions, elements):
        """The greatest side force [N] and clamp moment [N m] of the moving strip."""
        motion = periodic_motion(self, functions=functions, elements=elements)
        curvature, rate = motion.at_clamp(np.linspace(0.0, 2.0 * math.pi, 100_001))
        return self.stiffness * np.array([np.abs(rate).max(), np.abs(curvature).max()])


def test_the_motion_behind_a_jump_is_that_of_a_galerkin_method_on_a_fine_mesh():
    """Radau collocation in time of the whole strip in polynomials, without modes or a quasi-static part."""
    asked = request(CheckRequest, dimensions={"b_mm": 9, "h_mm": 0.46, "l_mm": 23})
    outcome = rod.check(asked.scene(), asked.strip(), SELECTION, accuracy=1e-6)
    found = np.array([outcome.value.stresses.side_force_max, outcome.value.stresses.clamp_moment_max])
    dense = UnderADiagram(asked.scene(), asked.strip())
    coarse, fine = dense.greatest_reactions(8, 200), dense.greatest_reactions(12, 400)
    own = np.abs(coarse / fine - 1.0)
    assert np.all(own < 1e-5)
    assert np.all(np.abs(found / fine - 1.0) < own)
    assert np.all(np.abs(found / fine - 1.0) < outcome.accuracy.estimated)
    assert outcome.accuracy.met


@pytest.mark.parametrize("loss", [0.0, 0.003, 0.01])
def test_the_error_of_greatest_values_from_omitted_ringing_is_estimated(monkeypatch, loss):
    """Behind the diagram's jumps, with fewer than seven ringing modes."""
    asked = request(CheckRequest, dimensions={"b_mm": 9, "h_mm": 0.46, "l_mm": 23})
    excitation = Excitation.of(Cycle(asked.scene(), asked.strip(), Composition(couples=True)), 1e-10)
    equation = StripEquation.of(excitation.strip, excitation.inertia, excitation.mean, 20, loss)
    angles = np.linspace(0.0, 2.0 * math.pi, 20_001)
    states = states_of(excitation.drive, excitation.strip, angles)
    quasi_static = np.stack([states[MOMENT], -states[SIDE]]) / excitation.strip.stiffness
    read = np.concatenate([equation.basis.values(np.zeros(1), order) for order in (2, 3)])

    def greatest(most):
        monkeypatch.setattr(motions, "MOST_RINGING", most)
        found = motions.motion(equation, excitation, 1, 3.0, 1e-9)
        assert found.ringing.modes == most
        return np.abs(read @ found.at(angles) + quasi_static).max(axis=1), found.errors.omitted

    whole, _ = greatest(7)
    for most in range(4):
        fewer, omitted = greatest(most)
        off = np.abs(fewer / whole - 1.0).max()
        assert off < omitted < 100.0 * off


def test_a_strip_with_ringing_behind_a_jump_is_designed():
    asked = request(
        DesignRequest,
        requirements={"min_fatigue_safety": 2.65, "min_stability_safety": 1.8},
        bounds={"b_mm": [4, 9], "h_mm": [0.2, 1.0], "l_mm": [8, 26]},
        objective="mass",
    ).problem()
    outcome = rod.design(asked)
    strip = outcome.value.check.dimensions
    assert asked.requirements.met_by(rod.check(asked.scene, strip).value)
    # A strip that is known to be admissible.
    assert outcome.value.check.mass < 0.7 * 7850.0 * 9e-3 * 0.46e-3 * 23e-3
