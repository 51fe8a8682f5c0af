"""Many strips in one loop against single checks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from solvers import rod
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import fkm, gerber
from solvers.rod.cycle.composition import BEAM_COLUMN, PLAIN_BENDING, Composition
from solvers.rod.effects import choose_for, compose
from solvers.rod.load.axial_force import axial_forces, drive_of
from solvers.rod.strip.stiffness import SHEAR_FACTOR
from tests.solvers.rod.machines import PAPER, STRIP

SAME = 1e-12
NAMES = frozenset(effect.name for effect in rod.EFFECTS)


def only(*names):
    return EffectSelection(include=frozenset(names), exclude=NAMES - set(names))


def strips(count, seed=0):
    """About the paper's strip, some of them thicker than wide, some close to buckling."""
    rng = np.random.default_rng(seed)
    sizes = np.array([STRIP.b, STRIP.h, STRIP.l]) * rng.uniform(0.85, 1.4, (count, 3))
    sizes[:, 2] = np.minimum(sizes[:, 2], PAPER.mechanism.rod_length)
    return sizes


def alike(found, exact):
    """Whether two results agree, number by number."""
    if dataclasses.is_dataclass(exact):
        return all(alike(getattr(found, f.name), getattr(exact, f.name)) for f in dataclasses.fields(exact))
    if isinstance(exact, float):
        return math.isclose(found, exact, rel_tol=SAME)
    return found == exact


@pytest.mark.parametrize("names", [(), ("friction",), ("beam_column", "reciprocating_inertia"), ("shear", "friction")])
def test_a_table_holds_what_single_checks_tell(names):
    composition, sizes = compose(choose_for(PAPER, STRIP, only(*names))), strips(6)
    table = rod.check_strips(PAPER, sizes, composition, "friction" in names, threads=2)
    stands = np.flatnonzero(np.isfinite(table.utilisation)).tolist()
    assert stands
    for i in stands:
        exact = rod.check(PAPER, rod.Dimensions(*sizes[i]), only(*names))
        value, s = exact.value, exact.value.stresses
        told = {
            "utilisation": 1.0 / s.fatigue_safety,
            "stability": value.stability_safety,
            "greatest_stress": PAPER.material.yield_strength / s.yield_safety,
            "stress_amplitude": s.stress_amplitude,
            "stress_mean": s.stress_mean,
            "worst_section": s.worst_section,
            "side_force_max": s.side_force_max,
            "clamp_moment_max": s.clamp_moment_max,
            "deflection": s.deflection_ratio * sizes[i, 2],
            "critical_force": value.critical_force,
            "natural_frequency": value.natural_frequency,
            "mass": value.mass,
        }
        if "friction" in names:
            told |= {"contact_pressure_max": s.contact_pressure_max, "friction_power": s.friction_power}
        for name, wanted in told.items():
            assert getattr(table, name)[i] == pytest.approx(wanted, rel=SAME), name
        assert exact.accuracy.estimated / 2 < table.estimated[i] < exact.accuracy.estimated * 2


@pytest.mark.parametrize("criterion", [fkm, gerber])
def test_a_diagram_that_is_not_convex_is_read_along_the_strip(criterion):
    material = dataclasses.replace(PAPER.material, ultimate_strength=1.3 * PAPER.material.yield_strength)
    scene = dataclasses.replace(PAPER, material=material)
    case = rod.Case(scene, STRIP, only(), criterion=criterion(material))
    (found,) = rod.check_many([case])
    assert alike(found.value, case.evaluate().value)


def test_each_case_has_its_own_settings():
    long = rod.Dimensions(STRIP.b, STRIP.h, 2.0 * PAPER.mechanism.rod_length)
    thin = rod.Dimensions(STRIP.b, 0.5 * STRIP.h, STRIP.l)
    cases = [
        rod.Case(PAPER, STRIP, only("beam_column")),
        rod.Case(PAPER, long, only()),
        rod.Case(PAPER, STRIP, only("no_such_effect")),
        rod.Case(PAPER, thin, only("beam_column")),
        rod.Case(PAPER, STRIP, only("large_displacement", "beam_column"), accuracy=1e-4),
        rod.Case(PAPER, STRIP, only(), accuracy=1e-9),
    ]
    found = rod.check_many(cases)
    assert isinstance(found[1], InvalidInput)
    assert found[1].field == "dimensions.l"
    assert isinstance(found[2], InvalidInput)
    assert found[3].value.stresses is None
    for i in (0, 3, 4, 5):
        assert alike(found[i].value, cases[i].evaluate().value)
        assert found[i].accuracy.met


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInput, match="dimensions"):
        rod.check_strips(PAPER, [[9e-3, -1.0, 2e-2]], Composition())
    correction = compose(choose_for(PAPER, STRIP, only("large_displacement")))
    with pytest.raises(ValueError, match="corrections"):
        rod.check_strips(PAPER, strips(1), correction)


def test_the_axial_force_is_part_of_the_composition():
    plain, coupled = (rod.check_strips(PAPER, strips(3), Composition(beam=b)) for b in (PLAIN_BENDING, BEAM_COLUMN))
    assert (coupled.stress_amplitude != plain.stress_amplitude).all()
    np.testing.assert_allclose(coupled.critical_force, plain.critical_force, rtol=SAME)


@pytest.mark.parametrize("names", [("friction",), ("friction", "shear"), ("friction", "reciprocating_inertia")])
def test_a_strip_that_its_axial_force_does_not_bend_against_dense_sampling(names):
    composition, sizes = compose(choose_for(PAPER, STRIP, only(*names))), strips(4, seed=5)
    table = rod.check_strips(PAPER, sizes, composition, contact=True)
    m, piston, material = PAPER.mechanism, PAPER.piston, PAPER.material
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    stroke = m.crank_radius * np.sin(angle)
    force = axial_forces(drive_of(PAPER, piston.reciprocating_mass if "reciprocating_inertia" in names else 0.0), angle)
    seen = 0
    for i, (b, h, l) in enumerate(sizes.tolist()):
        if not math.isfinite(table.utilisation[i]):
            continue
        seen += 1
        stiffness, e, z = material.elastic_modulus * b * h**3 / 12.0, m.rod_length - l, np.linspace(0.0, l, 41)
        soft = stiffness / (SHEAR_FACTOR * material.shear_modulus * b * h) if "shear" in names else 0.0
        # psi' = C + D z, V' = psi - g D, V(l) + e psi(l) = 1 per unit stroke, and no moment at the crank pin.
        system = np.array([[0.5 * l**2 + e * l, l**3 / 6.0 + 0.5 * e * l**2 - soft * l], [1.0, m.rod_length]])
        bent, shear = np.linalg.solve(system, np.array([1.0, 0.0]))
        bending = np.multiply.outer(0.5 * material.elastic_modulus * h * (bent + shear * z), stroke)
        side, moment = stiffness * abs(shear) * m.crank_radius, stiffness * bent * m.crank_radius
        couple = 6.0 / piston.skirt_length * abs(moment - side * piston.clamp_offset)
        pressure = 4.0 / (math.pi * piston.diameter * piston.skirt_length) * (side + couple)
        sunk = (0.5 * bent * z**2 + shear * (z**3 / 6.0 - soft * z)) * m.crank_radius
        most = max(np.abs(force / (b * h) + fibre * bending).max() for fibre in (1.0, -1.0))
        assert table.greatest_stress[i] == pytest.approx(most, rel=1e-6)
        assert table.worst_section[i] == 0.0
        assert table.side_force_max[i] == pytest.approx(side, rel=1e-9)
        assert table.clamp_moment_max[i] == pytest.approx(moment, rel=1e-9)
        assert table.contact_pressure_max[i] == pytest.approx(pressure, rel=1e-9)
        assert table.deflection[i] == pytest.approx(np.abs(sunk).max(), rel=1e-9)
    assert seen
