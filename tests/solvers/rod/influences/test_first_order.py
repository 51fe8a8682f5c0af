"""Influences of effects: the kernels against closed forms and the check's own physics, the bounds against the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import legval

from solvers import rod
from solvers.rod.cycle.bent_strip import BentStrip
from solvers.rod.effects import EFFECTS, choose_for
from solvers.rod.influences.first_mode import first_mode_response
from solvers.rod.influences.inertia import NODES, _quasi_static
from solvers.rod.influences.main_results import (
    FRICTION_FEEDBACK,
    FRICTION_WORK,
    MAX_CLAMP_MOMENT,
    MAX_CONTACT_LOAD,
    MAX_SIDE_FORCE,
    MAX_STRESS,
    RECIPROCATING_MASS,
    UTILISATION,
)
from solvers.rod.influences.situation import Situation
from solvers.rod.strip.elastica_kernels import collocation
from tests.solvers.rod.machines import PAPER, STRIP, random_machine

NAMES = frozenset(effect.name for effect in EFFECTS)
MAIN = (
    "fatigue_safety", "yield_safety", "stress_amplitude", "side_force_max", "clamp_moment_max", "contact_pressure_max",
    "friction_power",
)  # fmt: skip


def table(degrees, megapascals):
    return rod.TableLoad(tuple(np.radians(degrees)), tuple(1e6 * np.array(megapascals)))


def checked(scene, strip, names, accuracy=1e-6):
    names = frozenset(names)
    return rod.check(scene, strip, rod.EffectSelection(include=names, exclude=NAMES - names), accuracy=accuracy)


def results(scene, strip, names, accuracy=1e-6):
    value = checked(scene, strip, names, accuracy).value
    found = {"stability": value.stability_safety, "least": value.axial_force_min, "most": value.axial_force_max}
    found |= {name: getattr(value.stresses, name) for name in MAIN}
    return {name: x for name, x in found.items() if x}


def change_without(scene, strip, name, accuracy=1e-6):
    exact, found = (results(scene, strip, names, accuracy) for names in (NAMES, NAMES - {name}))
    return max(abs(found[key] / x - 1.0) for key, x in exact.items())


def influence(scene, strip, name, excluded=frozenset()):
    (effect,) = (effect for effect in EFFECTS if effect.name == name)
    return effect.influence(Situation(scene, strip, excluded))


def test_main_results_are_the_checks():
    """Of the revolution with every effect in closed form, sampled at 64 angles and 9 sections."""
    results = Situation(PAPER, STRIP).revolution.results
    value = checked(PAPER, STRIP, NAMES - {"rod_inertia", "large_displacement"}).value
    s, per_force = value.stresses, 4.0 / (math.pi * PAPER.piston.diameter * PAPER.piston.skirt_length)
    assert results.critical == pytest.approx(value.critical_force, rel=1e-12)
    assert results.results[UTILISATION] == pytest.approx(1.0 / s.fatigue_safety, rel=2e-3)
    assert results.results[MAX_STRESS] == pytest.approx(1200e6 / s.yield_safety, rel=1e-2)
    assert results.results[MAX_SIDE_FORCE] == pytest.approx(s.side_force_max, rel=1e-3)
    assert results.results[MAX_CLAMP_MOMENT] == pytest.approx(s.clamp_moment_max, rel=1e-3)
    assert results.results[MAX_CONTACT_LOAD] * per_force == pytest.approx(s.contact_pressure_max, rel=1e-3)
    assert results.results[FRICTION_WORK] * PAPER.mechanism.angular_speed == pytest.approx(s.friction_power, rel=1e-3)


EVEN, NO_ENDS = 2.0 * np.pi / 256 * np.arange(256), np.zeros(256, bool)


@pytest.mark.parametrize("frequency", [0.4, 7.3, 33.3])
def test_response_of_a_mode_of_constant_frequency_to_a_harmonic(frequency):
    """a'' + W^2 a = 9 cos 3 phi is solved by 9/(W^2 - 9) cos 3 phi."""
    projection = np.cos(3.0 * EVEN)
    found, *_ = first_mode_response(EVEN, projection, np.full(256, frequency), NO_ENDS, 0.0, True)
    expected = 9.0 / (frequency**2 - 9.0) * projection
    # The phase after a revolution is shifted toward resonance by a few hundredths of a radian, more at high ones.
    assert found == pytest.approx(expected, abs=(0.02 + 0.002 * frequency) * np.abs(expected).max())


@pytest.mark.parametrize("loss", [0.01, 0.1])
def test_damping_bounds_a_resonance(loss):
    """a'' + eta W a' + W^2 a = W^2 cos W phi is solved by sin(W phi)/eta, here with W = 3."""
    found, amplitude, _ = first_mode_response(EVEN, np.cos(3.0 * EVEN), np.full(256, 3.0), NO_ENDS, loss, True)
    assert found == pytest.approx(np.sin(3.0 * EVEN) / loss, abs=0.02 / loss)
    assert amplitude == pytest.approx(np.full(256, 1.0 / loss), rel=0.5)


@pytest.mark.parametrize("loss", [0.0, 0.01])
@pytest.mark.parametrize("frequency", [5.3, 30.3, 101.3])
def test_ringing_after_a_jump_of_the_load_adds_up_over_revolutions_until_it_is_damped(frequency, loss):
    """If c drops by 1 at once and returns linearly, a + c''/W^2 has the amplitude 1/|1 - k exp(2 pi i W)| after the
    drop, where k = exp(-pi eta W) is its decay over a revolution."""
    width = 1e-5
    angle = np.sort(np.concatenate([2.0 * np.pi / 128 * np.arange(1, 128), 1.0 + width * np.arange(5) / 4]))
    since = np.mod(angle - 1.0, 2.0 * np.pi)
    inside = np.clip(since / width, 0.0, 1.0)
    projection = np.where(since <= width, inside**2 * (2.0 * inside - 3.0), since / (2.0 * np.pi) - 1.0)
    ends = (angle == 1.0) | (angle == 1.0 + width)
    _, amplitude, _ = first_mode_response(angle, projection, np.full(angle.size, frequency), ends, loss, False)
    expected = 1.0 / abs(1.0 - math.exp(-math.pi * loss * frequency) * np.exp(2j * np.pi * frequency))
    after = amplitude[np.searchsorted(angle, 1.0 + 2.0 * width)]
    assert 0.95 * expected <= after <= (1.08 + 0.002 * frequency) * expected


@pytest.mark.parametrize("name", ["shear", "friction_feedback", "large_displacement", "rod_inertia"])
def test_bounds_of_random_machines_hold_and_are_sharp(name):
    rng, ratios = np.random.default_rng(17), []
    for _ in range(6):
        scene, strip = random_machine(rng)
        truth = change_without(scene, strip, name)
        if 1e-5 < truth < 0.3:
            ratios.append(influence(scene, strip, name) / truth)
    assert len(ratios) >= 3
    assert min(ratios) >= 1.0
    assert np.median(ratios) <= 3.0


def test_bounds_of_the_papers_machine_are_close():
    """What the check finds when each effect is left out, of all."""
    for name in ("shear", "friction_feedback", "large_displacement", "rod_inertia"):
        truth = change_without(PAPER, STRIP, name)
        assert truth <= influence(PAPER, STRIP, name) <= 2.0 * truth, name


def test_the_papers_machine_calls_for_friction_that_acts_back_and_no_more():
    choice = choose_for(PAPER, STRIP, tolerance=1e-2)
    assert {effect.name for effect in choice.active} == {"beam_column", "friction_feedback", "friction"}


def test_what_is_not_there_has_no_influence():
    bare = replace(PAPER, piston=replace(PAPER.piston, friction_coefficient=0.0))
    assert influence(bare, STRIP, "reciprocating_inertia") == 0.0
    assert influence(bare, STRIP, "friction_feedback") == 0.0


def test_where_friction_buckles_the_strip_it_cannot_be_left_out():
    upward = rod.SchmidtLoad(1.4e6, 0.25, 2.0 * math.pi - 1.16)
    rough = replace(PAPER, load=upward, piston=replace(PAPER.piston, friction_coefficient=0.3))
    thin = replace(STRIP, h=0.38e-3)
    assert checked(rough, thin, NAMES - {"rod_inertia"}).value.stresses is None
    assert influence(rough, thin, "friction_feedback") == math.inf
    # It has no shape that could be corrected, unless friction is left out on request: then it stands.
    without = frozenset({"friction_feedback"})
    assert influence(rough, thin, "large_displacement") == influence(rough, thin, "rod_inertia") == 0.0
    assert 0.0 < influence(rough, thin, "large_displacement", without) < math.inf
    assert influence(rough, thin, "rod_inertia", without) > 0.0
    choice = choose_for(rough, thin, rod.EffectSelection(exclude=without), tolerance=1e-6)
    assert choice.has("large_displacement")
    assert not choose_for(rough, thin, tolerance=1e-6).has("large_displacement")


def test_nothing_corrects_a_strip_that_gas_buckles():
    thin = replace(STRIP, h=0.3e-3)
    assert influence(PAPER, thin, "large_displacement") == influence(PAPER, thin, "rod_inertia") == 0.0


def campaign_scene(load, lengths, piston, material, loss=0.0):
    """Scenes that a campaign found: crank, rod [mm], speed [Hz]; diameter, skirt, offset [mm], friction; E, density."""
    radius, length, speed = lengths
    diameter, skirt, offset, friction = piston
    modulus, density, sensitivity = material
    return rod.Scene(
        rod.Mechanism(radius * 1e-3, length * 1e-3, speed),
        rod.Piston(diameter * 1e-3, skirt * 1e-3, 0.0, offset * 1e-3, friction),
        load,
        rod.Material(modulus * 1e9, 480e6, 1.15, sensitivity, 1200e6, density, loss_factor=loss),
    )


STEEP = (
    campaign_scene(
        table([85.26, 216.78, 223.97, 225.63, 289.37, 327.39], [0.1168, 0.0815, 0.1012, 0.0784, 0.0918, 0.0573]),
        (0.82063, 27.221, 0.86906),
        (6.3323, 9.2724, 4.6384, 0.14468),
        (169.15, 7510.6, 0.00288),
    ),
    rod.Dimensions(3.10945e-3, 0.117868e-3, 14.22218e-3),
)
JUMP = (
    campaign_scene(
        table(
            [29.2333, 82.2698, 158.968, 186.379, 191.789, 310.084, 329.024],
            [1.51797, 1.71551, 1.54761, 1.79399, 0.832212, 1.92475, 1.1281],
        ),
        (0.0283086, 33.154, 34.8491),
        (9.7179, 20.6897, 0.0, 0.261463),
        (101.027, 2568.59, 0.388176),
    ),
    rod.Dimensions(3.00674e-3, 0.801517e-3, 11.1549e-3),
)

BRIEF = (
    campaign_scene(
        table(
            [74.24694, 75.71432, 81.1858, 81.97266, 87.52197, 113.1974, 165.863, 206.0724, 208.381, 247.858],
            [1.68246, 0.5909809, 0.6788735, 0.7120734, 1.288462, 1.477002, 0.914233, 1.540432, 1.408112, 1.617776],
        ),
        (0.006919153, 21.07082, 0.4126777),
        (11.04571, 10.2771, 0.0, 0.2262176),
        (121.2024, 6664.636, 0.0825717),
        loss=0.01,
    ),
    rod.Dimensions(4.75478e-3, 0.2337151e-3, 19.91831e-3),
)
"""Ringing that damping ends within a few degrees, between the uniform angles."""
PULLED = (
    campaign_scene(
        table(
            [47.76598, 114.8291, 285.1621, 327.4051, 331.9573, 343.149, 345.5727],
            [1.523891, 1.472764, 1.453959, 1.437954, 0.730703, 1.380549, 1.019259],
        ),
        (0.002013318, 11.61305, 31.76611),
        (6.784784, 13.05219, 0.0, 0.0),
        (91.99268, 5651.029, 0.1276379),
        loss=0.01,
    ),
    rod.Dimensions(3.80165e-3, 0.06753292e-3, 4.371571e-3),
)
"""A strip that rings where it is pulled, at 2.6 times the frequency of where it is pushed."""


@pytest.mark.parametrize(
    ("scene", "strip", "sharp"),
    [(*STEEP, 40.0), (*JUMP, 40.0), (*BRIEF, 150.0), (*PULLED, math.inf)],
    ids=["1.7 degrees", "5.4 degrees", "brief", "pulled"],
)
def test_a_steep_fall_calls_for_the_strips_inertia(scene, strip, sharp):
    """It sets the strip ringing, without damping for good: more than its accelerations alone would tell."""
    truth = change_without(scene, strip, "rod_inertia", accuracy=1e-5)
    assert truth <= influence(scene, strip, "rod_inertia") <= sharp * truth


STUBBY = (
    campaign_scene(
        rod.SchmidtLoad(2.848336e6, 0.8717111, 3.310972),
        (0.02768854, 167.07245, 2.996458),
        (66.196327, 69.939961, 60.517488, 0.0),
        (205.22667, 6051.8114, 0.04041163),
    ),
    rod.Dimensions(19.789531e-3, 3.70641017e-3, 38.0135580e-3),
)
NARROW = (
    campaign_scene(
        rod.SchmidtLoad(0.18067723e6, 0.9431031, 0.3033335),
        (0.11192354, 45.648404, 39.024118),
        (11.516553, 27.406539, 0.0, 0.0215587),
        (124.9568, 5268.9252, 0.3704121),
    ),
    rod.Dimensions(3.52764766e-3, 1.43865628e-3, 44.1279075e-3),
)
SLANTED = (
    campaign_scene(
        rod.SchmidtLoad(0.04188065e6, 0.8873258, 5.838887),
        (0.11835771, 78.92877951, 3.7139871),
        (57.26787, 120.23076, 35.143052, 0.06958329),
        (81.225924, 3138.02755, 0.05282628),
    ),
    rod.Dimensions(25.3333197e-3, 1.33283210e-3, 40.6518328e-3),
)
"""A side force that a narrow peak of the load makes, where a clamp moment is broad."""
KICKED = (
    campaign_scene(
        rod.SchmidtLoad(0.27237552e6, 0.93355693, 0.09511508),
        (15.56740048, 116.47804433, 6.72228951),
        (19.616196, 20.102427, 0.0, 0.24060727),
        (117.88012, 6039.06408, 0.09577592),
    ),
    rod.Dimensions(4.63850497e-3, 3.30682788e-3, 113.34315335e-3),
)
"""A mode so fast that even angles smear the corners that friction makes, behind which it rings."""


@pytest.mark.parametrize(
    ("scene", "strip", "sharp"),
    [(*STUBBY, 3.0), (*NARROW, 3.0), (*SLANTED, 3.0), (*KICKED, 40.0)],
    ids=["soft in shear, near buckling", "a narrow peak", "a narrow side force", "corners of friction"],
)
def test_the_strips_inertia_is_not_underrated(scene, strip, sharp):
    truth = change_without(scene, strip, "rod_inertia")
    assert truth <= influence(scene, strip, "rod_inertia") <= sharp * truth


CANCELLED = (
    campaign_scene(
        rod.ConstantLoad(13225.11),
        (0.7441239, 176.9641837, 146.3573517),
        (59.2118861, 142.2925746, 5.3874446, 0.2220337),
        (124.2149896, 5416.7740421, 0.1405912),
        loss=0.01,
    ),
    rod.Dimensions(15.3327005e-3, 0.811553975e-3, 48.7427685e-3),
)
"""The clamp moment is a twentieth of what it is without the strip's inertia."""
RESONANT = (
    campaign_scene(
        rod.SchmidtLoad(0.7305808528e6, 0.03830928640, 0.5780778393),
        (0.2632233263, 468.2574431, 53.2309883572),
        (90.5148382884, 105.9147050271, 45.2190778559, 0.0358157745),
        (136.1297069, 4402.7415240791, 0.1799500596),
        loss=0.01,
    ),
    rod.Dimensions(22.397751148e-3, 3.002310229e-3, 430.286489748e-3),
)


@pytest.mark.parametrize(
    ("scene", "strip", "sharp"), [(*CANCELLED, 20.0), (*RESONANT, math.inf)], ids=["cancelled", "resonant"]
)
def test_inertia_that_changes_everything_lets_other_effects_change_more(scene, strip, sharp):
    truth = change_without(scene, strip, "friction_feedback")
    assert 5.0 * Situation(scene, strip).uncorrected_changes[FRICTION_FEEDBACK].max() < truth
    assert truth <= influence(scene, strip, "friction_feedback") <= sharp * truth


TIED = (
    campaign_scene(
        table(
            [
                13.1784777, 36.052659, 40.6390255, 51.5546254, 62.2447795, 97.2226436, 115.806185, 128.868746,
                157.420267, 167.276093, 278.372736,
            ],
            [
                0.0749757377, 0.0506641505, 0.0482646828, 0.101297365, 0.0761159293, 0.0750702591, 0.10465713,
                0.083806758, 0.0710445132, 0.0880817195, 0.0362945658,
            ],
        ),
        (7.56997027, 76.3480777, 1.34496918),
        (15.3210369, 14.4792216, 0.0, 0.0),
        (184.699291, 4553.26888, 0.144707983),
        loss=0.01,
    ),
    rod.Dimensions(7.07266437e-3, 0.301197163e-3, 73.6739025e-3),
)  # fmt: skip
"""Large displacement and inertia each stress another place, and the same one together."""
POINTED = (
    campaign_scene(
        table(
            [6.75405396, 85.7996088, 99.8884536, 168.173938, 192.136545, 217.421479],
            [0.83151099, 1.62088451, 1.31408568, 1.81123468, 1.74505618, 1.83330768],
        ),
        (5.51639611, 312.677957, 1.45072575),
        (52.3193731, 95.1162785, 0.0, 0.143492759),
        (189.722916, 2670.81517, 0.338376033),
        loss=0.01,
    ),
    rod.Dimensions(9.16958972e-3, 4.84545557e-3, 160.713435e-3),
)
"""The contact is greatest at a point of the table, on whose one side the pressure curves five times as much."""
BENT = (
    campaign_scene(
        rod.ConstantLoad(124995.602),
        (22.0082804, 218.602182, 1.47871546),
        (116.896837, 181.833722, 0.0, 0.0),
        (233.144714, 2526.89996, 0.0468091292),
        loss=0.01,
    ),
    rod.Dimensions(31.6840978e-3, 1.75121868e-3, 195.265202e-3),
)
"""A strip at 95 % of its critical load, of whose clamp moment large displacement leaves half."""


@pytest.mark.parametrize(
    ("scene", "strip", "name"),
    [(*TIED, "rod_inertia"), (*TIED, "large_displacement"), (*TIED, "shear"), (*POINTED, "rod_inertia")],
    ids=["tied, inertia", "tied, large", "tied, shear", "pointed"],
)
def test_influences_include_changes_of_the_corrections(scene, strip, name):
    truth = change_without(scene, strip, name)
    assert truth <= influence(scene, strip, name) <= 3.0 * truth


def test_large_displacement_that_leaves_half_lets_other_effects_change_more():
    scene, strip = replace(BENT[0], piston=replace(BENT[0].piston, reciprocating_mass=0.0105671952)), BENT[1]
    truth = change_without(scene, strip, "reciprocating_inertia")
    assert 5.0 * Situation(scene, strip).uncorrected_changes[RECIPROCATING_MASS].max() < truth
    assert truth <= influence(scene, strip, "reciprocating_inertia") <= 2.0 * truth


@pytest.mark.parametrize(("scene", "strip"), [(PAPER, STRIP), STUBBY, BENT], ids=["paper", "soft in shear", "bent"])
def test_the_shape_that_inertia_follows_is_the_beam_columns_own(scene, strip):
    """Against its closed form (``cycle.bent_strip``), with shear."""
    revolution = Situation(scene, strip).revolution
    l, z = strip.l, np.linspace(0.0, strip.l, 9)
    head = (scene.mechanism.rod_length - l) / l
    found = _quasi_static(revolution.states, revolution.strip.compliance, l, head, collocation(NODES))
    _, _, expected = BentStrip.linear(revolution.strip, revolution.states)._linear(z)
    assert l * legval(2.0 * z / l - 1.0, found.T).T == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("points", [24, 72, 360])
def test_under_a_table_of_a_smooth_law_inertia_is_not_overestimated(points):
    """Every point of a table is a corner of the pressure; what corners excite has phases, and mostly cancels."""
    scene = replace(PAPER, material=replace(PAPER.material, loss_factor=0.01))
    angles = np.arange(points) * 2.0 * math.pi / points
    measured = replace(scene, load=rod.TableLoad(tuple(angles), tuple(scene.load.pressure(angles))))
    truth = change_without(measured, STRIP, "rod_inertia")
    assert truth <= influence(measured, STRIP, "rod_inertia") <= 4.5 * truth
