"""Friction fed back into the axial force, against a bracketing solver at every angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from solvers.rod.cycle import BeamColumn, Composition, Cycle
from solvers.rod.friction import FrictionFeedback
from tests.solvers.rod.machines import PAPER, STRIP

ANGLES = np.linspace(0.0, 2 * np.pi, 25)


@pytest.mark.parametrize("coefficient", [0.05, 0.15, 0.8])
def test_the_loop_is_closed_at_every_angle(coefficient):
    scene = replace(PAPER, piston=replace(PAPER.piston, friction_coefficient=coefficient))
    plain = Cycle(scene, STRIP, Composition(beam=BeamColumn())).axial_force(ANGLES)
    closed = Cycle(scene, STRIP, Composition(beam=BeamColumn(), feedback=FrictionFeedback())).axial_force(ANGLES)
    for angle, before, found in zip(ANGLES, plain, closed, strict=True):
        stroke = scene.mechanism.crank_radius * np.sin(angle)

        def residual(total, before=before, stroke=stroke):
            shape = BeamColumn().bend(scene, STRIP, np.array([total]), np.array([stroke]))
            side, moment = float(shape.side_force()[0]), float(shape.clamp_moment()[0])
            # int |T/Lp + 12 M s/Lp^3| ds by its pieces, without the guide's closed form.
            skirt = scene.piston.skirt_length
            s = np.linspace(-skirt / 2, skirt / 2, 2)
            q = side / skirt + 12 * moment * s / skirt**3
            if q[0] * q[1] >= 0:
                wall = abs(q.sum()) * skirt / 2
            else:
                wall = skirt * (q[0] ** 2 + q[1] ** 2) / (2 * (abs(q[0]) + abs(q[1])))
            return total - before - np.sign(stroke) * coefficient * 4 / np.pi * wall

        assert found == pytest.approx(brentq(residual, before - 100, before + 100, xtol=1e-13), abs=1e-9)


def test_friction_opposes_the_piston():
    plain = Cycle(PAPER, STRIP, Composition(beam=BeamColumn())).axial_force(ANGLES)
    closed = Cycle(PAPER, STRIP, Composition(beam=BeamColumn(), feedback=FrictionFeedback())).axial_force(ANGLES)
    down = np.sin(ANGLES) > 1e-9
    up = np.sin(ANGLES) < -1e-9
    assert np.all(closed[down] > plain[down])
    assert np.all(closed[up] < plain[up])
