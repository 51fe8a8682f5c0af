"""A check compared with the dense model: errors are within their estimates, and estimates within the requested
accuracy."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from bench import rod_tables
from solvers import rod
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import goodman, serensen
from solvers.rod.cycle.composition import Composition, Cycle
from solvers.rod.linear_check import check_linear
from solvers.rod.load.axial_force import axial_forces, drive_of
from solvers.rod.strip.stiffness import SHEAR_FACTOR
from solvers.rod.vibration.steady_response import RodInertia
from tests.solvers.rod.brute_force import CoreModel, greatest
from tests.solvers.rod.machines import CORE, PAPER, STRIP, random_machine

REFERENCE_FLOOR = 3e-12
"""What the dense model itself is good for."""


def use(material):
    def severity(high, low):
        mean = max(0.5 * (high + low), 0.0)
        amplitude = 0.5 * (high - low)
        return (
            material.fatigue_reduction * amplitude + material.mean_stress_sensitivity * mean
        ) / material.fatigue_limit

    return severity


def reference(scene, dimensions):
    model = CoreModel(scene, dimensions)
    return {
        "fatigue_safety": 1 / model.worst(use(scene.material)),
        "yield_safety": scene.material.yield_strength / model.worst(lambda high, low: max(high, -low)),
        "axial_force_min": -greatest(lambda a: -model.force(a)),
        "axial_force_max": greatest(model.force),
        "side_force_max": greatest(lambda a: np.abs(model.side_force(a))),
        "clamp_moment_max": greatest(lambda a: np.abs(model.clamp_moment(a))),
        "contact_pressure_max": greatest(model.contact_pressure),
    }


def results(outcome):
    value = outcome.value
    return {**dataclasses.asdict(value), **dataclasses.asdict(value.stresses)}


@pytest.mark.parametrize("seed", range(8))
def test_errors_stay_within_estimates_and_estimates_within_the_wish(seed):
    rng = np.random.default_rng(seed)
    scene, dimensions = random_machine(rng, (1.02, 6.0))
    offset = scene.piston.skirt_length * rng.uniform(-0.4, 0.4)
    scene = dataclasses.replace(scene, piston=dataclasses.replace(scene.piston, clamp_offset=offset))
    exact = reference(scene, dimensions)
    for accuracy in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        outcome = rod.check(scene, dimensions, CORE, accuracy=accuracy)
        found = results(outcome)
        worst = max(abs(found[name] / value - 1) for name, value in exact.items())
        assert outcome.accuracy.estimated <= accuracy
        assert worst <= max(outcome.accuracy.estimated, REFERENCE_FLOOR)


@pytest.mark.parametrize("length", [18e-3, 20e-3, 23e-3, 26e-3])
def test_clamp_and_bulge_compete_honestly(length):
    """Near the summit of the safety the clamp and the bulge inside the span are nearly equal: both must be climbed.

    The bulge's peak stands between stations: samples alone would name the clamp although the bulge is worse.
    """

    def at_clamp(thickness):
        strip = rod.Dimensions(9e-3, thickness, length)
        return rod.check(PAPER, strip, CORE, accuracy=1e-8).value.stresses.worst_section == 0.0

    thin, thick = 0.40e-3, 0.50e-3
    assert at_clamp(thick) and not at_clamp(thin)
    for _ in range(30):
        middle = 0.5 * (thin + thick)
        thin, thick = (thin, middle) if at_clamp(middle) else (middle, thick)
    safeties = []
    for thickness in (thin * (1 - 1e-4), thin, thick, thick * (1 + 1e-4)):
        strip = rod.Dimensions(9e-3, thickness, length)
        found = rod.check(PAPER, strip, CORE, accuracy=1e-8).value.stresses.fatigue_safety
        assert found == pytest.approx(1 / CoreModel(PAPER, strip).worst(use(PAPER.material)), rel=1e-8)
        safeties.append(found)
    assert safeties[2] == pytest.approx(safeties[1], rel=1e-8)


@pytest.mark.parametrize("accuracy", [2e-3, 1.1e-4])
def test_a_peak_beside_the_head_is_climbed(accuracy):
    """The head is the highest station there and lower than the clamp, which the peak between stations exceeds."""
    scene = rod.Scene(
        rod.Mechanism(crank_radius=1.62043e-3, rod_length=47.1122e-3, speed=37.6996),
        rod.Piston(diameter=13.5079e-3, skirt_length=35.0346e-3, reciprocating_mass=0.107, friction_coefficient=0.15),
        rod.SchmidtLoad(p_min=1.670825e6, delta=0.312868, theta=3.882822),
        rod.Material(186.1703e9, 669.509e6, 1.10215, 0.170146, 1210.9156e6, 7264.3),
    )
    strip = rod.Dimensions(3.650566e-3, 0.3143663e-3, 6.722654e-3)
    outcome = rod.check(scene, strip, CORE, accuracy=accuracy)
    strength = CoreModel(scene, strip).worst(lambda high, low: max(high, -low))
    found, exact = outcome.value.stresses.yield_safety, scene.material.yield_strength / strength
    assert found == pytest.approx(exact, rel=outcome.accuracy.estimated)


def test_stress_beside_a_dead_centre_is_greatest_where_the_strip_bends_most():
    """The greatest compression comes a degree after top dead centre. At it the strip is straight and all sections are
    alike; the angles sampled beside it are further off."""
    strip = rod.Dimensions(17.8e-3, 3.2e-3, 73e-3)
    piston = dataclasses.replace(PAPER.piston, diameter=32e-3, clamp_offset=11e-3, friction_coefficient=0.0)
    machine = rod.Mechanism(crank_radius=0.09e-3, rod_length=121e-3, speed=0.5)
    scene = dataclasses.replace(PAPER, mechanism=machine, piston=piston, load=rod.SchmidtLoad(1.19e6, 0.902, 0.019))
    outcome = rod.check(scene, strip, CORE, accuracy=1e-8)
    exact = scene.material.yield_strength / CoreModel(scene, strip).worst(lambda high, low: max(high, -low))
    assert outcome.value.stresses.yield_safety == pytest.approx(exact, rel=1e-8)


def test_the_amplitude_inside_the_span_is_as_accurate_as_asked():
    """At an interior peak the amplitude changes with the place itself, not only to second order."""
    strip = rod.Dimensions(9e-3, 0.44e-3, 23e-3)
    tight = rod.check(PAPER, strip, CORE, accuracy=1e-10)
    assert 0.0 < tight.value.stresses.worst_section < strip.l
    for accuracy in (1e-4, 1e-6, 1e-8):
        loose = rod.check(PAPER, strip, CORE, accuracy=accuracy).value.stresses
        for name in ("stress_amplitude", "stress_mean"):
            scale = tight.value.stresses.stress_amplitude
            assert abs(getattr(loose, name) - getattr(tight.value.stresses, name)) <= accuracy * scale


def test_the_greatest_deflection_is_that_of_the_dense_model():
    model = CoreModel(PAPER, STRIP)
    stations = np.linspace(0.0, STRIP.l, 401)
    exact = max(greatest(lambda a, z=z: np.abs(model.deflection(z, a))) for z in stations[-40:])
    assert rod.check(PAPER, STRIP, CORE, accuracy=1e-8).value.stresses.deflection_ratio == pytest.approx(
        exact / STRIP.l, rel=1e-8
    )


@pytest.mark.parametrize(("seed", "margin"), [(15, 1e-6), (11, 1e-6), (3, 1e-5), (0, 1e-4)])
@pytest.mark.parametrize("accuracy", [1e-8, 1e-10])
def test_next_to_buckling_no_panels_are_spent_on_rounding_errors(seed, margin, accuracy):
    """There were 6,000 panels, 8 s, and errors up to 1: the stresses' rounding errors grow as 1/(1 - P/P_cr)."""
    rng = np.random.default_rng(seed)
    machines = [random_machine(rng, (1.0 + gap, 1.0 + gap)) for gap in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)]
    scene, dimensions = next(
        m for m, gap in zip(machines, (1e-2, 1e-3, 1e-4, 1e-5, 1e-6), strict=True) if gap == margin
    )
    found = rod.check(scene, dimensions, CORE, accuracy=accuracy)
    assert 1.0 < found.value.stability_safety < 1.0 + 2.0 * margin
    assert found.accuracy.settings["angles"] < 1000
    grown = np.finfo(float).eps / (found.value.stability_safety - 1.0)
    assert found.accuracy.estimated <= max(accuracy, 2e3 * grown)
    exact, error = reference(scene, dimensions), found.accuracy.estimated + 1e3 * grown + REFERENCE_FLOOR
    value = results(found)
    assert all(value[name] == pytest.approx(expected, rel=error) for name, expected in exact.items())


def test_beyond_buckling_there_are_no_stresses():
    value = rod.check(PAPER, rod.Dimensions(9e-3, 0.3e-3, 23e-3), CORE).value
    assert value.stability_safety < 1
    assert value.stresses is None
    assert any("buckles" in warning for warning in value.warnings)


def test_a_strip_on_edge_buckles_sideways():
    """b < h: the critical load is that of bending out of the crank's plane."""
    flat = rod.check(PAPER, rod.Dimensions(2e-3, 1e-3, 23e-3), CORE).value
    edge = rod.check(PAPER, rod.Dimensions(1e-3, 2e-3, 23e-3), CORE).value
    assert edge.buckles_sideways and not flat.buckles_sideways
    assert edge.critical_force == pytest.approx(flat.critical_force, rel=1e-14)


def test_a_strip_hardly_on_edge_buckles_in_the_plane_where_shear_softens_it():
    """Shear softens bending in the crank's plane only."""
    stubby = rod.Scene(rod.Mechanism(3e-3, 12e-3, 20.0), PAPER.piston, PAPER.load, PAPER.material)
    edge = rod.Dimensions(2.98e-3, 3e-3, 10e-3)
    rigid = rod.check(stubby, edge, rod.EffectSelection(exclude={"shear"})).value
    soft = rod.check(stubby, edge, rod.EffectSelection(include={"shear"})).value
    assert rigid.buckles_sideways and not soft.buckles_sideways
    assert soft.critical_force < 0.9 * rigid.critical_force


def test_without_a_load_only_the_lateral_strains_the_strip():
    scene = dataclasses.replace(PAPER, load=rod.ConstantLoad(0.0))
    value = rod.check(scene, STRIP, CORE).value
    assert value.stability_safety is None
    assert value.axial_force_max == 0.0
    exact = 1 / CoreModelWithoutLoad().utilisation(scene, STRIP)
    assert value.stresses.fatigue_safety == pytest.approx(exact, rel=1e-9)


class CoreModelWithoutLoad:
    """A cubic: V'' at the clamp for unit lateral displacement is 3 L/(L^3 - e^3), by the unit-load method."""

    def utilisation(self, scene, d):
        L = scene.mechanism.rod_length
        bend = 3 * L / (L**3 - (L - d.l) ** 3) * scene.mechanism.crank_radius
        amplitude = 0.5 * scene.material.elastic_modulus * d.h * bend
        return scene.material.fatigue_reduction * amplitude / scene.material.fatigue_limit


@pytest.mark.parametrize(
    "change",
    [
        lambda s: dataclasses.replace(s, load=rod.SchmidtLoad(1.0, 1 - 1e-9, 1.16)),
        lambda s: dataclasses.replace(s, load=rod.SchmidtLoad(1.4e6, 0.0, 0.0)),
        lambda s: dataclasses.replace(s, mechanism=rod.Mechanism(45.4e-3, 45.5e-3, 50.0)),
        lambda s: dataclasses.replace(s, load=rod.ConstantLoad(-3e9)),
    ],
)
@pytest.mark.parametrize("thickness", [2.3e-6, 0.46e-3, 20e-3])
def test_extremes_answer_with_finite_numbers_or_none(change, thickness):
    value = rod.check(change(PAPER), rod.Dimensions(9e-3, thickness, 23e-3), CORE, accuracy=1e-3).value
    numbers = {**dataclasses.asdict(value), **(dataclasses.asdict(value.stresses) if value.stresses else {})}
    for name, number in numbers.items():
        if isinstance(number, float):
            assert math.isfinite(number), name


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_a_machine_scaled_in_size_and_speed_has_the_same_safeties(size):
    """With all lengths multiplied by s, forces scale with s^2 and stresses are unchanged, without inertia."""
    m, p = PAPER.mechanism, PAPER.piston
    scene = dataclasses.replace(
        PAPER,
        mechanism=rod.Mechanism(m.crank_radius * size, m.rod_length * size, m.speed),
        piston=rod.Piston(p.diameter * size, p.skirt_length * size, friction_coefficient=p.friction_coefficient),
    )
    scaled = rod.check(scene, rod.Dimensions(STRIP.b * size, STRIP.h * size, STRIP.l * size), CORE).value
    plain = rod.check(PAPER, STRIP, CORE).value
    assert scaled.stability_safety == pytest.approx(plain.stability_safety, rel=1e-12)
    assert scaled.stresses.fatigue_safety == pytest.approx(plain.stresses.fatigue_safety, rel=1e-7)


def test_the_result_names_its_fatigue_convention():
    material = dataclasses.replace(PAPER.material, ultimate_strength=1400e6)
    scene = dataclasses.replace(PAPER, material=material)
    assert rod.check(scene, STRIP, CORE).value.criterion == serensen(material).name
    other = rod.check(scene, STRIP, CORE, criterion=goodman(material)).value
    assert other.criterion == "goodman"
    plain = rod.check(scene, STRIP, CORE).value.stresses
    assert other.stresses.fatigue_safety != plain.fatigue_safety


def test_without_friction_there_are_no_contact_results():
    core = EffectSelection(frozenset({"beam_column"}), CORE.exclude | {"friction"})
    with_friction, without = (rod.check(PAPER, STRIP, e).value.stresses for e in (CORE, core))
    assert without.contact_pressure_max is None and without.friction_power is None
    assert without.fatigue_safety == with_friction.fatigue_safety


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: rod.check(PAPER, rod.Dimensions(9e-3, 0.46e-3, 46e-3), CORE), "dimensions.l"),
        (lambda: rod.check(PAPER, STRIP, CORE, accuracy=1e-13), "accuracy"),
        (lambda: rod.check(PAPER, STRIP, CORE, accuracy=math.nan), "accuracy"),
        (lambda: rod.Dimensions(9e-3, 0.0, 23e-3), "dimensions.h"),
        (lambda: rod.Mechanism(45.5e-3, 45.5e-3, 50.0), "mechanism.crank_radius"),
    ],
)
def test_senseless_requests_name_their_field(call, field):
    with pytest.raises(InvalidInput) as caught:
        call()
    assert caught.value.field == field


@pytest.mark.parametrize("more", [set(), {"friction_feedback"}], ids=["core", "with friction that acts back"])
def test_estimates_are_honest_at_every_accuracy_and_loose_ones_take_no_more_angles(more):
    """Random machines against their own tightest checks."""
    rng, effects = np.random.default_rng(28), EffectSelection(CORE.include | more, CORE.exclude - more)
    for _ in range(8):
        scene, strip = random_machine(rng, (1.5, 6.0))
        tight = rod.check(scene, strip, effects, accuracy=1e-12)
        exact = main_results(tight)
        for accuracy in (1e-1, 1e-2, 1e-4, 1e-6, 1e-8):
            found = rod.check(scene, strip, effects, accuracy=accuracy)
            assert found.accuracy.met
            assert found.accuracy.settings["angles"] <= tight.accuracy.settings["angles"]
            promised = found.accuracy.estimated + tight.accuracy.estimated
            assert main_results(found) == pytest.approx(exact, rel=promised, abs=1e-300)


def main_results(outcome):
    stresses = outcome.value.stresses
    names = (
        "fatigue_safety", "yield_safety", "stress_amplitude", "side_force_max", "clamp_moment_max",
        "contact_pressure_max", "friction_power", "deflection_ratio",
    )  # fmt: skip
    return {name: getattr(stresses, name) for name in names}


@pytest.mark.parametrize("names", [("friction",), ("friction", "shear"), ("friction", "reciprocating_inertia")])
def test_a_strip_that_its_axial_force_does_not_bend_against_dense_sampling(names):
    rng = np.random.default_rng(5)
    sizes = np.array([STRIP.b, STRIP.h, STRIP.l]) * rng.uniform(0.85, 1.4, (4, 3))
    sizes[:, 2] = np.minimum(sizes[:, 2], PAPER.mechanism.rod_length)
    effects = rod.EffectSelection(frozenset(names), frozenset(effect.name for effect in rod.EFFECTS) - set(names))
    m, piston, material = PAPER.mechanism, PAPER.piston, PAPER.material
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    lateral = m.crank_radius * np.sin(angle)
    force = axial_forces(drive_of(PAPER, piston.reciprocating_mass if "reciprocating_inertia" in names else 0.0), angle)
    seen = 0
    for b, h, l in sizes.tolist():
        found = rod.check(PAPER, rod.Dimensions(b, h, l), effects).value.stresses
        if found is None:
            continue
        seen += 1
        stiffness, e, z = material.elastic_modulus * b * h**3 / 12.0, m.rod_length - l, np.linspace(0.0, l, 41)
        soft = stiffness / (SHEAR_FACTOR * material.shear_modulus * b * h) if "shear" in names else 0.0
        # psi' = C + D z, V' = psi - g D, V(l) + e psi(l) = 1, the lateral displacement, and no moment at the pin.
        system = np.array([[0.5 * l**2 + e * l, l**3 / 6.0 + 0.5 * e * l**2 - soft * l], [1.0, m.rod_length]])
        bent, shear = np.linalg.solve(system, np.array([1.0, 0.0]))
        bending = np.multiply.outer(0.5 * material.elastic_modulus * h * (bent + shear * z), lateral)
        side, moment = stiffness * abs(shear) * m.crank_radius, stiffness * bent * m.crank_radius
        couple = 6.0 / piston.skirt_length * abs(moment - side * piston.clamp_offset)
        pressure = 4.0 / (math.pi * piston.diameter * piston.skirt_length) * (side + couple)
        sunk = (0.5 * bent * z**2 + shear * (z**3 / 6.0 - soft * z)) * m.crank_radius
        most = max(np.abs(force / (b * h) + fibre * bending).max() for fibre in (1.0, -1.0))
        assert found.max_stress == pytest.approx(most, rel=1e-6)
        assert found.worst_section == 0.0
        assert found.side_force_max == pytest.approx(side, rel=1e-9)
        assert found.clamp_moment_max == pytest.approx(moment, rel=1e-9)
        assert found.contact_pressure_max == pytest.approx(pressure, rel=1e-9)
        assert found.deflection_ratio * l == pytest.approx(np.abs(sunk).max(), rel=1e-9)
    assert seen


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4, 1e-6])
def test_a_deflection_that_is_greatest_between_stations_is_found(accuracy):
    """The strip deflects most at 0.82 of its length at one crank angle, at its head at another, and less in between."""
    scene = rod.Scene(
        rod.Mechanism(0.30563e-3, 238.948e-3, 11.3776),
        rod.Piston(63.291e-3, 68.0938e-3, friction_coefficient=0.152),
        rod.SchmidtLoad(0.110809e6, 0.842007, 0.58453),
        rod.Material(210.537e9, 480e6, 1.15, 0.103625, 1200e6, 5558.06),
    )
    strip = rod.Dimensions(38.75806e-3, 1.337271e-3, 68.96278e-3)
    model = CoreModel(scene, strip)
    deflection = max(
        greatest(lambda a, z=z: np.abs(model.deflection(z, a))) for z in np.linspace(0.81, 0.83, 41) * strip.l
    )
    found = rod.check(scene, strip, CORE, accuracy=accuracy)
    assert found.accuracy.met
    # The grid of sections misses the greatest deflection by less than 3e-6.
    assert found.value.stresses.deflection_ratio == pytest.approx(deflection / strip.l, rel=accuracy + 3e-6)


@pytest.mark.parametrize("offset", [3.0, 1e3])
def test_a_clamp_far_from_the_skirt_under_automatic_effects(offset):
    """Friction then multiplies the axial force: in the estimate of influences an integer once overflowed."""
    scene = dataclasses.replace(PAPER, piston=dataclasses.replace(PAPER.piston, clamp_offset=offset))
    assert rod.check(scene, rod.Dimensions(9e-3, 0.46e-3, 23e-3)).accuracy.met


def test_beside_corrections_only_the_force_is_sampled():
    """Under noisy pressures with friction feedback, to the accuracy; stresses are sampled with the corrections."""
    problem = rod_tables.problem(8)
    strip = rod.Dimensions(*((low * high) ** 0.5 for low, high in dataclasses.astuple(problem.bounds)))
    parts = Composition(moves=True, couples=True, feedback=True)
    plain, corrected = (
        Cycle(problem.scene, strip, dataclasses.replace(parts, corrections=corrections), 1e-6)
        for corrections in ((), (RodInertia(),))
    )
    diagram, accuracy = serensen(problem.scene.material).diagram(), 1e-5
    whole, forces = (check_linear(cycle, diagram, False, accuracy) for cycle in (plain, corrected))
    force = plain.axial_force(np.linspace(0.0, 2.0 * math.pi, 200_000))
    assert forces.angles < 0.6 * whole.angles
    assert forces.error <= accuracy
    assert forces.compression == pytest.approx(-force.min(), rel=accuracy)
    assert forces.tension == pytest.approx(max(force.max(), 0.0), rel=accuracy)
