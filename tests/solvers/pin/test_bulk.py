"""Many pins at once against single checks, and what closed forms must give."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from solvers import pin
from solvers.errors import InvalidInput
from solvers.pin.closed_form.stepped_bore import steps_of
from solvers.pin.load.piston_pin import deflection_integrals

SAME = 1e-12
STEEL = pin.PinMaterial(150e6, 2.1e11, 0.3, 7850.0)
SHEARED = dataclasses.replace(STEEL, allowable_shear=60e6)


def drawn(seed: int, count: int, steps: int):
    """Pins from short to long, with and without a gap, walls from thin to solid; the steps end anywhere."""
    rng = np.random.default_rng(seed)
    outer = rng.uniform(10e-3, 60e-3, count)
    boss, rod = (outer * 10 ** rng.uniform(-1.0, 1.0, count) for _ in range(2))
    gap = np.where(rng.random(count) < 0.3, 0.0, outer * 10 ** rng.uniform(-3.0, -0.5, count))
    half = boss + gap + 0.5 * rod
    ends = np.sort(rng.random((count, steps)), axis=1) * half[:, None]
    ends[:, -1] = half
    bores = outer[:, None] * rng.uniform(0.0, 0.97, (count, steps))
    return outer, boss, rod, gap, 10 ** rng.uniform(2.0, 5.0, count), ends, bores


def profile(ends, bores) -> pin.Profile:
    starts = [0.0, *ends[:-1]]
    x = [place for pair in zip(starts, ends, strict=True) for place in pair]
    return pin.Profile(tuple(x), tuple(np.repeat(bores, 2).tolist()))


@pytest.mark.parametrize("material", [STEEL, SHEARED], ids=["", "shear allowable"])
@pytest.mark.parametrize("criterion", pin.CRITERIA.values(), ids=pin.CRITERIA)
def test_a_table_holds_what_single_checks_tell(criterion, material):
    outer, boss, rod, gap, force, ends, bores = drawn(1, 8, 3)
    table = pin.check_bores(outer, boss, rod, gap, force, material, bores, ends, criterion, threads=2)
    for i in range(outer.size):
        scene = pin.Scene(pin.Geometry(outer[i], boss[i], rod[i], gap[i]), force[i], material)
        single = pin.check(scene, profile(ends[i], bores[i]), criterion, effects=pin.ALL).value
        for name in ("mass", "solid_mass", "deflection", "equivalent_stress_max", "strength_utilisation", "max_moment",
                     "max_shear", "least_wall", "force_limit"):  # fmt: skip
            assert getattr(table, name)[i] == pytest.approx(getattr(single, name), rel=SAME), (i, name)
        if material.allowable_shear is not None:
            assert table.shear_stress_max[i] == pytest.approx(single.shear_stress_max, rel=SAME)


def test_the_deflection_of_a_tube_is_that_of_its_closed_form():
    force, (a, b, gap), outer, bore = 15e3, (24e-3, 30e-3, 1e-3), 22e-3, 13e-3
    table = pin.check_bores([outer], a, b, gap, force, STEEL, [bore], shear_deflection=False)
    # A beam on the bosses' edges, by the moment-area method on a fine grid: an independent method.
    x = np.linspace(a, a + gap + 0.5 * b, 200_001)
    s = np.maximum(x - a - gap, 0.0)
    moment = force * a / 6.0 + 0.5 * force * (x - a) - 0.5 * force / b * s**2
    inertia = math.pi * (outer**4 - bore**4) / 64.0
    bent = 2.0 * np.trapezoid(moment * 0.5 * (x - a), x) / (STEEL.elastic_modulus * inertia)
    assert table.deflection[0] == pytest.approx(bent, rel=1e-9)


def test_what_a_solid_pin_bends_and_shears_is_what_its_check_says():
    scene = pin.Scene(pin.Geometry(22e-3, 24e-3, 30e-3, 1e-3), 15e3, STEEL)
    g, m = scene.geometry, scene.material
    bend, shear = deflection_integrals(scene.force, g.boss_length, g.small_end_length, g.gap)
    bent, sheared = bend / (m.elastic_modulus * g.inertia), shear / (m.shear_modulus * g.area)
    solid = pin.Profile((0.0,), (0.0,))
    without = pin.check(scene, solid, effects=pin.EffectSelection(exclude=frozenset({"shear_deflection"}))).value
    both = pin.check(scene, solid, effects=pin.ALL).value
    factor = (7.0 + 6.0 * STEEL.poisson) / (6.0 * (1.0 + STEEL.poisson))
    assert without.deflection == pytest.approx(bent, rel=SAME)
    assert both.deflection == pytest.approx(bent + factor * sheared, rel=SAME)


def case(rng: np.random.Generator) -> pin.Case:
    """One case, with whatever limits, now and then without a load or with a bore that is no step."""
    outer, boss, rod, gap, force, ends, bores = (v[0] for v in drawn(int(rng.integers(1 << 30)), 1, 3))
    shape = profile(ends, bores) if rng.random() < 0.8 else pin.Profile((0.0, ends[-1]), tuple(bores[:2].tolist()))
    limits = pin.Limits(
        min_wall=0.05 * outer if rng.random() < 0.3 else 0.0,
        max_deflection=10 ** rng.uniform(-6, -4) if rng.random() < 0.5 else None,
        max_ovalization=10 ** rng.uniform(-6, -4) if rng.random() < 0.3 else None,
        max_ring_stress=150e6 if rng.random() < 0.3 else None,
    )
    scene = pin.Scene(
        pin.Geometry(outer, boss, rod, gap),
        0.0 if rng.random() < 0.1 else force,
        SHEARED if rng.random() < 0.5 else STEEL,
    )
    return pin.Case(scene, shape, list(pin.CRITERIA.values())[rng.integers(4)], limits)


def flat(value: object, path: str = ""):
    """Every number and text of a check by its path, but for the places of a warning."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("sections", "messages", "lightest_constant", "capacity", "rings"):
                yield from flat(getattr(value, field.name), f"{path}.{field.name}")
        if isinstance(value, pin.PinCheck):
            yield from ((name, getattr(value, name)) for name in ("constant_mass", "force_limit"))
    else:
        yield path, value


def test_a_list_is_answered_as_single_checks_are():
    rng = np.random.default_rng(5)
    cases = [case(rng) for _ in range(24)]
    for own, many in zip(cases, pin.check_many(cases), strict=True):
        single = own.evaluate()
        assert many.accuracy.estimated <= single.accuracy.estimated
        assert [e.state for e in many.effects] == [e.state for e in single.effects]
        assert len(many.value.warnings) == len(single.value.warnings)
        told, wanted = (dict([*flat(found.value), *flat(found.value.ring, "ring")]) for found in (many, single))
        assert told.keys() == wanted.keys()
        for name, value in wanted.items():
            if name == ".worst_section":
                continue  # If two positions are equally utilised, rounding decides.
            assert told[name] == (pytest.approx(value, rel=SAME, abs=0.0) if isinstance(value, float) else value), name


def test_one_bad_case_spoils_no_other():
    good = case(np.random.default_rng(3))
    bad = good._replace(accuracy=1.0)
    first, second, third = pin.check_many([good, bad, good])
    assert isinstance(second, InvalidInput)
    assert first.value == third.value == pin.check_many([good])[0].value


def test_steps_of_a_profile():
    assert steps_of(pin.Profile((0.0,), (1.0,)), 10.0) == ((5.0,), (1.0,))
    assert steps_of(pin.Profile((0.0, 2.0, 2.0), (1.0, 1.0, 3.0)), 10.0) == ((2.0, 5.0), (1.0, 3.0))
    assert steps_of(pin.Profile((0.0, 2.0, 2.0, 5.0, 5.0), (1.0, 1.0, 3.0, 3.0, 9.0)), 10.0) == ((2.0, 5.0), (1.0, 3.0))
    assert steps_of(pin.Profile((0.0, 5.0), (1.0, 3.0)), 10.0) is None
    assert steps_of(pin.Profile((0.0, 2.0, 2.0, 10.0), (1.0, 1.0, 3.0, 3.0)), 10.0) is None


@pytest.mark.parametrize(
    ("changed", "named"),
    [({"outer_diameter": 0.0}, "outer_diameter"), ({"gap": -1e-3}, "gap"), ({"bores": [0.03]}, "bores"),
     ({"force": math.nan}, "force"), ({"bores": [[0.01, 0.012]]}, "ends")],
)  # fmt: skip
def test_what_makes_no_pin_is_refused(changed, named):
    plain = {"outer_diameter": 0.022, "boss_length": 0.024, "small_end_length": 0.03, "gap": 1e-3, "force": 15e3,
             "material": STEEL, "bores": [0.01]}  # fmt: skip
    with pytest.raises(InvalidInput, match=named):
        pin.check_bores(**{**plain, **changed})
