"""Friction fed back into the axial force, against a bracketing solver at every angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from oracles.textbook import rod_beam_column
from solvers import rod
from solvers.errors import InvalidInput
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.cycle.state import LATERAL, MOMENT, ROWS, SIDE, fill_states, friction_corners, greatest_share
from solvers.rod.load.axial_force import axial_force
from solvers.rod.strip.buckling import critical_force
from solvers.rod.strip.stiffness import bending_stiffness
from tests.solvers.rod.machines import CORE, PAPER, STRIP, bent, random_machine

ANGLES = np.linspace(0.0, 2 * np.pi, 25)


@pytest.mark.parametrize("coefficient", [0.05, 0.15, 0.8])
def test_the_loop_is_closed_at_every_angle(coefficient):
    scene = replace(PAPER, piston=replace(PAPER.piston, friction_coefficient=coefficient))
    plain = Cycle(scene, STRIP, Composition(couples=True)).axial_force(ANGLES)
    closed = Cycle(scene, STRIP, Composition(couples=True, feedback=True)).axial_force(ANGLES)
    for angle, before, found in zip(ANGLES, plain, closed, strict=True):
        lateral = scene.mechanism.crank_radius * np.sin(angle)

        def residual(total, before=before, lateral=lateral):
            shape = bent(scene, STRIP, np.array([total]), np.array([lateral]))
            side, moment = float(shape.side_force()[0]), float(shape.clamp_moment()[0])
            # int |T/Lp + 12 M s/Lp^3| ds by its pieces, without the guide's closed form.
            skirt = scene.piston.skirt_length
            s = np.linspace(-skirt / 2, skirt / 2, 2)
            q = side / skirt + 12 * moment * s / skirt**3
            if q[0] * q[1] >= 0:
                wall = abs(q.sum()) * skirt / 2
            else:
                wall = skirt * (q[0] ** 2 + q[1] ** 2) / (2 * (abs(q[0]) + abs(q[1])))
            return total - before - np.sign(lateral) * coefficient * 4 / np.pi * wall

        assert found == pytest.approx(brentq(residual, before - 100, before + 100, xtol=1e-13), abs=1e-9)


def test_friction_opposes_the_piston():
    plain = Cycle(PAPER, STRIP, Composition(couples=True)).axial_force(ANGLES)
    closed = Cycle(PAPER, STRIP, Composition(couples=True, feedback=True)).axial_force(ANGLES)
    down = np.sin(ANGLES) > 1e-9
    up = np.sin(ANGLES) < -1e-9
    assert np.all(closed[down] > plain[down])
    assert np.all(closed[up] < plain[up])


PUSHED = replace(
    PAPER,
    mechanism=rod.Mechanism(crank_radius=6e-3, rod_length=60e-3, speed=10.0),
    piston=replace(PAPER.piston, diameter=10e-3),
    load=rod.ConstantLoad(0.8e6),
)
"""A steady load of some two thirds of what its strip can bear."""
THIN = rod.Dimensions(b=7e-3, h=0.4e-3, l=30e-3)
FED_BACK = rod.EffectSelection(
    include=frozenset({"beam_column", "friction", "friction_feedback"}),
    exclude=frozenset({"reciprocating_inertia", "rod_inertia", "large_displacement", "shear"}),
)


def critical():
    length = PUSHED.mechanism.rod_length
    return critical_force(PUSHED.material.elastic_modulus, THIN.b, THIN.h, THIN.l, length)


def friction_of(scene, strip, total, lateral):
    """The friction force [N] at axial forces."""
    total, stiffness = np.atleast_1d(total), bending_stiffness(scene, strip)
    shape = rod_beam_column.solve(total / stiffness, strip.l, scene.mechanism.rod_length)
    side, couple = np.abs(shape.clamp_shear), 6.0 * np.abs(shape.clamp_curvature) / scene.piston.skirt_length
    wall = np.where(couple > side, 0.5 * (couple + side**2 / couple), side) * stiffness * abs(lateral)
    return scene.piston.friction_coefficient * 4.0 / np.pi * wall


def first_solution(coefficient, angle):
    """On the way up, by marching from the gas force to buckling and bisection; None where there is none."""
    lateral = PUSHED.mechanism.crank_radius * np.sin(angle)
    scene = replace(PUSHED, piston=replace(PUSHED.piston, friction_coefficient=coefficient))
    plain = float(Cycle(scene, THIN, Composition(couples=True)).axial_force(np.array([angle]))[0])

    def residual(total):
        return total - plain + friction_of(scene, THIN, total, lateral)

    path = np.linspace(plain, -critical() * (1 - 1e-6), 20001)
    passed = np.flatnonzero(residual(path) < 0)
    if not passed.size:
        return None
    return brentq(lambda x: float(residual(x)[0]), path[passed[0] - 1], path[passed[0]], xtol=1e-12)


def test_friction_is_followed_up_to_where_it_buckles_the_strip():
    """Beside the coefficient at which the two solutions meet and vanish."""
    angles = np.linspace(np.pi, 2 * np.pi, 13)[1:-1]
    low, high = 0.0, 2.0
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if any(first_solution(middle, a) is None for a in angles) else (middle, high)
    assert 0.01 < low < 1.0
    for coefficient in (0.5 * low, 0.9 * low, 0.99 * low, 0.9999 * low):
        scene = replace(PUSHED, piston=replace(PUSHED.piston, friction_coefficient=coefficient))
        found = Cycle(scene, THIN, Composition(couples=True, feedback=True)).axial_force(angles)
        assert found == pytest.approx([first_solution(coefficient, a) for a in angles], rel=1e-10)
    scene = replace(PUSHED, piston=replace(PUSHED.piston, friction_coefficient=1.001 * high))
    found = Cycle(scene, THIN, Composition(couples=True, feedback=True)).axial_force(angles)
    assert found.min() < -critical()


@pytest.mark.parametrize("coefficient", [0.01, 0.2, 1.0])
@pytest.mark.parametrize("share", [0.9, 0.999, 1.0 - 1e-6])
def test_friction_relieves_a_strip_pushed_to_its_critical_load(coefficient, share):
    """On its way down, by bisection above the critical load; every angle starts from its neighbour or from afar."""
    piston = replace(PUSHED.piston, friction_coefficient=coefficient)
    scene = replace(PUSHED, piston=piston, load=rod.ConstantLoad(share * critical() / piston.area))
    cycle = Cycle(scene, THIN, Composition(couples=True, feedback=True))
    angles, pole = np.linspace(0.0, np.pi, 201)[2:-2], -critical()
    plain = cycle.without_corrections().scene.load.pressure(angles) * -piston.area

    def residual(total, force, lateral):
        return float(total - force - friction_of(scene, THIN, total, lateral)[0])

    strokes = scene.mechanism.crank_radius * np.sin(angles)
    exact = [
        brentq(residual, pole * (1 - 1e-13), 0.0, args=each, xtol=1e-13, rtol=1e-14)
        for each in zip(plain, strokes, strict=True)
    ]
    assert cycle.axial_force(angles) == pytest.approx(exact, rel=1e-10)
    afar = np.concatenate([cycle.axial_force(np.array([angle])) for angle in angles])
    assert afar == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("coefficient", [0.01, 0.2, 1.0])
@pytest.mark.parametrize("share", [1.0 + 1e-6, 1.02, 1.9])
def test_friction_does_not_hold_a_strip_that_buckles_without_it(coefficient, share):
    """Some of the angles used to be held, up to all but a few of a thousand, as the secants happened to go."""
    piston = replace(PUSHED.piston, friction_coefficient=coefficient)
    scene = replace(PUSHED, piston=piston, load=rod.ConstantLoad(share * critical() / piston.area))
    cycle = Cycle(scene, THIN, Composition(couples=True, feedback=True))
    assert cycle.axial_force(np.linspace(0.01, np.pi - 0.01, 1001)) == pytest.approx(-2.0 * critical())
    value = rod.check(scene, THIN, FED_BACK).value
    assert value.stability_safety == pytest.approx(1.0 / share, rel=1e-12) and value.stresses is None


@pytest.mark.parametrize("coefficient", [1.0, 5.0])
def test_where_friction_buckles_the_strip_there_are_no_stresses(coefficient):
    scene = replace(PUSHED, piston=replace(PUSHED.piston, friction_coefficient=coefficient))
    value = rod.check(scene, THIN, FED_BACK).value
    assert value.stresses is None and value.stability_safety < 1.0
    assert value.axial_force_min == pytest.approx(-critical() / value.stability_safety, rel=1e-14)
    assert any("friction" in warning for warning in value.warnings)
    # With this share of all forces the strip is at its boundary.
    for share, stable in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
        part = share * value.stability_safety
        piston = replace(scene.piston, friction_coefficient=part * coefficient)
        scaled = replace(scene, piston=piston, load=rod.ConstantLoad(part * 0.8e6))
        assert (rod.check(scaled, THIN, FED_BACK).value.stresses is not None) is stable


@pytest.mark.parametrize("accuracy", [1e-1, 1e-4])
@pytest.mark.parametrize("seed", [30, 290, 552, 556])
def test_the_worst_angle_of_a_strip_buckled_by_friction_lies_between_samples(seed, accuracy):
    """Where two panels meet, the angle was refined to one side only, and of several low ones only the lowest."""
    rng = np.random.default_rng([seed, 3])
    scene, strip = random_machine(rng, (1.01, 1.3))
    scene = replace(scene, piston=replace(scene.piston, friction_coefficient=rng.uniform(0.1, 0.6)))
    found = rod.check(scene, strip, FED_BACK, accuracy=accuracy).value
    assert found.stresses is None and rod.check(scene, strip, CORE).value.stresses is not None
    cycle = Cycle(scene, strip, Composition(couples=True, feedback=True))
    least = np.inf
    for angle in np.linspace(np.pi, 2.0 * np.pi, 2001)[1:-1]:
        pushed = cycle.strip.friction * cycle.drive.crank_radius * np.sin(angle)
        force = axial_force(cycle.drive, angle)
        least = min(least, greatest_share(cycle.strip, force, pushed, found.critical_force, np.inf)[0])
    assert least * (1.0 - 1e-5) <= found.stability_safety <= least * (1.0 + 1e-12)


@pytest.mark.parametrize("skirt", [1e-4, 2.7e-5])
def test_steep_friction_of_a_short_skirt_is_no_buckling(skirt):
    """It was taken for such: the first step towards the solution led beyond the critical force."""
    scene = replace(PAPER, piston=replace(PAPER.piston, skirt_length=skirt))
    angles = np.linspace(0.0, 2 * np.pi, 101)
    cycle = Cycle(scene, STRIP, Composition(couples=True, feedback=True))
    plain = Cycle(scene, STRIP, Composition(couples=True)).axial_force(angles)
    found, lateral = cycle.axial_force(angles), scene.mechanism.crank_radius * np.sin(angles)
    friction = [friction_of(scene, STRIP, *each)[0] for each in zip(found, lateral, strict=True)]
    assert found == pytest.approx(plain + np.sign(lateral) * friction, rel=1e-6, abs=1e-6)
    assert rod.check(scene, STRIP, FED_BACK).value.stresses is not None


def test_beyond_buckling_forces_are_those_without_friction():
    slender = replace(THIN, h=0.3e-3)
    plain, closed = (rod.check(PUSHED, slender, effects).value for effects in (CORE, FED_BACK))
    assert plain.stability_safety < 1
    assert (closed.stability_safety, closed.axial_force_min, closed.axial_force_max) == (
        plain.stability_safety, plain.axial_force_min, plain.axial_force_max,
    )  # fmt: skip


@pytest.mark.parametrize("offset", [0.0, 2e-3])
def test_contact_switches_between_one_wall_and_both_at_the_corners(offset):
    """Where 6 |M|/Lp = |T| for the moment about the middle of the skirt, against Brent's method on the states."""
    scene = replace(PAPER, piston=replace(PAPER.piston, clamp_offset=offset))
    cycle = Cycle(scene, STRIP, Composition(couples=True, feedback=True))
    grid = np.linspace(0.0, 2.0 * np.pi, 129)

    def switched(angle):
        states = np.empty((ROWS, 1))
        fill_states(cycle.drive, cycle.strip, np.array([angle]), states)
        side, lateral = states[SIDE, 0], states[LATERAL, 0]
        couple = 6.0 / scene.piston.skirt_length * abs(states[MOMENT, 0] + side * offset)
        return (couple - abs(side)) / abs(lateral)

    found = friction_corners(cycle.drive, cycle.strip, grid)
    assert found.size
    for angle in found:
        assert brentq(switched, angle - 1e-3, angle + 1e-3, xtol=1e-15) == pytest.approx(angle, abs=1e-11)


@pytest.mark.parametrize("evaluate", ["check", "design"])
def test_a_piston_that_jams_is_refused(evaluate):
    """A taut strip pushes the piston sideways by P r sin(phi)/L, and the walls carry 6 e/Lp times as much: with
    mu = 1 and the clamp far outside of the skirt friction grows by more than the force P itself."""
    e, skirt = 4.0e-3, 3.0e-3
    scene = replace(
        PAPER,
        mechanism=rod.Mechanism(crank_radius=0.9e-3, rod_length=2.8e-3, speed=4.0),
        piston=rod.Piston(3e-3, skirt, reciprocating_mass=2.8, clamp_offset=e, friction_coefficient=1.0),
    )
    assert 0.9 / 2.8 * 6 * e / skirt > 2
    with pytest.raises(InvalidInput) as refused:
        if evaluate == "check":
            rod.check(scene, rod.Dimensions(0.8, 0.2e-3, 2.8e-3))
        else:
            bounds = rod.Bounds((1e-3, 1.0), (1e-4, 5e-4), (1e-3, 2.8e-3))
            rod.design(rod.RodProblem(scene, bounds, rod.Requirements(1.2, 1.5), rod.OBJECTIVES["mass"]))
    assert refused.value.field == "piston.friction_coefficient"
