"""Fatigue safety on the Haigh plane against textbook values and equations."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from solvers import rod
from solvers.errors import InvalidInput
from solvers.fatigue import CRITERIA, serensen, soderberg
from solvers.fatigue.kernels import GREATEST, Diagram, severities, utilisation_of, with_mean
from tests.solvers.rod.machines import PAPER, STRIP

MEGA = 1e6
STEEL = rod.Material(210e9, 480e6, 1.2, 0.25, 1200e6, 7850.0, 0.3, 1500e6)
KPSI = 6.894757e6


def utilisation(criterion, amplitude: float, mean: float) -> float:
    """1/n of one cycle."""
    return utilisation_of(mean + amplitude, mean - amplitude, *criterion.diagram())


def smooth(limit: float, sensitivity: float = 0.25, strength: float | None = None, yielding: float = 1200e6):
    """A material without notch, size and surface effects."""
    return rod.Material(210e9, limit, 1.0, sensitivity, yielding, 7850.0, 0.3, strength)


def test_serensen_gives_the_papers_safety():
    """The reference strip's worst cycle, amplitude 147.008 and mean 74.044 MPa: n = 2.69747."""
    n = 1.0 / utilisation(serensen(PAPER.material), 147.008 * MEGA, 74.044 * MEGA)
    assert n == pytest.approx(2.69747, rel=1e-5)


@pytest.mark.parametrize(("name", "safety"), [("gerber", 3.66), ("goodman", 3.02), ("soderberg", 2.88)])
def test_shigleys_bar_under_a_pulsating_load(name, safety):
    """AISI 1050 cold drawn, S_e = 33.9, S_ut = 100, S_y = 84 kpsi, sigma_a = sigma_m = 8.38 kpsi: Gerber n_f = 3.66.

    Goodman and Soderberg by 1/n = sigma_a/S_e + sigma_m/S_ut and + sigma_m/S_y with the same numbers.
    """
    bar = smooth(33.9 * KPSI, strength=100 * KPSI, yielding=84 * KPSI)
    found = 1.0 / utilisation(CRITERIA[name](bar), 8.38 * KPSI, 8.38 * KPSI)
    assert found == pytest.approx(safety, abs=0.006)


@pytest.mark.parametrize(("name", "reversed_stress"), [("goodman", 53.3), ("gerber", 42.7)])
def test_shigleys_completely_reversed_stress_of_equal_effect(name, reversed_stress):
    """sigma_max = 60, sigma_min = -20, S_ut = 80 kpsi: as harmful as 53.3 (Goodman) or 42.7 kpsi (Gerber) reversed."""
    limiting = smooth(reversed_stress * KPSI, strength=80 * KPSI, yielding=65 * KPSI)
    assert utilisation(CRITERIA[name](limiting), 40 * KPSI, 20 * KPSI) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    ("ratio", "factor"),
    [
        (-1.0, 1.0),
        (0.0, 1 / (1 + 0.3)),
        (0.25, (1 + 0.1) / (1.3 * (1 + 0.1 * 5 / 3))),
        (0.5, (3 + 0.3) / (3 * 1.3**2)),
        (0.8, (3 + 0.3) / (3 * 1.3**2)),
    ],
)
def test_fkms_mean_stress_factor(ratio, factor):
    """K_AK of the guideline for M = 0.3 at stress ratios of fields II, III and IV: the amplitude that is borne."""
    amplitude = 480 * MEGA * factor
    mean = amplitude * (1 + ratio) / (1 - ratio)
    assert utilisation(CRITERIA["fkm"](smooth(480e6, 0.3)), amplitude, mean) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("name", CRITERIA)
def test_the_utilisation_grows_in_proportion_along_a_ray_and_credits_no_compression(name):
    criterion = CRITERIA[name](STEEL)
    for amplitude, mean in ((100e6, 0.0), (100e6, 50e6), (20e6, 300e6), (100e6, -200e6), (0.0, 100e6)):
        used = utilisation(criterion, amplitude, mean)
        assert utilisation(criterion, 3 * amplitude, 3 * mean) == pytest.approx(3 * used, rel=1e-14)
    assert utilisation(criterion, 100e6, -200e6) == pytest.approx(1.2 * 100 / 480, rel=1e-12)


def test_the_order_of_the_criteria():
    """In tension Soderberg is stricter than Goodman, Goodman than Gerber; the notch factor counts in all."""
    rng = np.random.default_rng(2)
    for amplitude, mean in rng.uniform(1e6, 4e8, (200, 2)):
        used = [utilisation(CRITERIA[name](STEEL), amplitude, mean) for name in ("soderberg", "goodman", "gerber")]
        assert used == sorted(used, reverse=True)
        for criterion in CRITERIA.values():
            notched = criterion(dataclasses.replace(STEEL, fatigue_reduction=2.0))
            assert utilisation(notched, amplitude, mean) >= utilisation(criterion(STEEL), amplitude, mean)


@pytest.mark.parametrize("name", CRITERIA)
@pytest.mark.parametrize("left_out", [-3e8, 0.0, 2e8])
def test_cycles_may_come_without_a_mean_that_the_diagram_knows(name, left_out):
    diagram = CRITERIA[name](STEEL).diagram()
    for high, low in ((1e8, -5e7), (3e6, 1e6), (0.0, 0.0)):
        whole = utilisation_of(high + left_out, low + left_out, *diagram)
        assert utilisation_of(high, low, *with_mean(*diagram, left_out)) == pytest.approx(whole, rel=1e-12, abs=1e-15)


def test_the_greatest_magnitude_and_many_cycles_at_once():
    high, low = np.array([[3.0, -1.0], [0.0, 2.0]]), np.array([[-4.0, -2.0], [0.0, 1.0]])
    out = np.empty((2, 2))
    severities(high, low, *GREATEST, out)
    assert np.allclose(out, np.maximum(np.abs(high), np.abs(low)), rtol=1e-15)


@pytest.mark.parametrize("name", ["goodman", "gerber"])
def test_a_missing_ultimate_strength_is_reported(name):
    with pytest.raises(InvalidInput, match="ultimate_strength"):
        CRITERIA[name](smooth(480e6))


def test_a_criterion_is_whatever_gives_its_diagram():
    class Own:
        """Soderberg's line by another hand: 1/n = K sigma_a/sigma_-1 + max(sigma_m, 0)/sigma_y."""

        name = "own"

        def diagram(self) -> Diagram:
            m = PAPER.material
            alpha = m.fatigue_reduction / m.fatigue_limit
            return Diagram(np.array([[[alpha, 0.0, 0.0]], [[alpha, 1.0 / m.yield_strength, 0.0]]]), np.zeros(3))

    own, known = (rod.check(PAPER, STRIP, criterion=c).value for c in (Own(), soderberg(PAPER.material)))
    assert own.criterion == "own"
    assert own.stresses.fatigue_safety == pytest.approx(known.stresses.fatigue_safety, rel=1e-12)
