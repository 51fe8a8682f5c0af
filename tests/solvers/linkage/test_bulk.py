"""Tables of many linkages against single checks."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import linkage
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from solvers.linkage.mechanism.change_point import Gain

SAME = 1e-12
PAD = 4e-3
ONLY_ENVELOPE = EffectSelection(include=frozenset({"envelope"}), automatic=False)


def drawn(kind, count, seed):
    """Restitutions from almost 0 to almost 1, free ratios from just above the minimum, cranks, energies."""
    rng = np.random.default_rng(seed)
    restitution = rng.choice([10 ** rng.uniform(-4, -2), 0.3, 0.6, 0.93], count) * rng.uniform(0.9, 1.0, count)
    least = np.array([kind.parameter_limit(Gain(r)) for r in restitution])
    parameter = least * (1.0 + 10 ** rng.uniform(-4.0, 1.0, count))
    return restitution, parameter, 10 ** rng.uniform(-2.0, -0.5, count), 10 ** rng.uniform(-1.0, 2.0, count)


@pytest.mark.parametrize("kind", linkage.KINDS.values(), ids=linkage.KINDS)
def test_a_table_holds_what_single_checks_tell(kind):
    restitution, parameter, crank, energy = drawn(kind, 12, 3)
    table = linkage.check_family(kind, restitution, parameter, crank, energy, PAD, threads=2)
    for i in range(parameter.size):
        r = linkage.Restitution(restitution[i], restitution[i])
        rocker = table.lengths[i, 3]
        scene = linkage.Scene(r, 10.0, 2.0, energy[i], tool_radius=rocker)
        exact = linkage.check(
            scene, linkage.of_ratio(scene, kind, parameter[i]), linkage.Limits(joint_radius=PAD), ONLY_ENVELOPE
        ).value
        strike, links = exact.strike, exact.mechanism.lengths
        told = {
            "lengths": (table.lengths[i], [links.base, links.crank, links.coupler, links.rocker]),
            "u31_start": (table.u31_start[i], strike.u31_start),
            "u31_end": (table.u31_end[i], strike.u31_end),
            "u31_max": (table.u31_max[i], strike.u31_max),
            "restitution": (table.restitution[i], strike.restitution),
            "swing": (table.swing[i], exact.mechanism.bar.swing),
            "angle": (table.transmission_angle[i], strike.transmission_angle),
            "torque": (table.torque[i], strike.peaks.torque),
            "force": (table.force[i], strike.peaks.force),
            "area": (table.box_area[i], exact.box.area),
            "radius": (table.enclosing_radius[i], exact.enclosing_radius),
        }
        for name, (found, wanted) in told.items():
            assert found == pytest.approx(wanted, rel=SAME), (i, name)


def test_threads_change_nothing():
    drawn_here = drawn(linkage.LARGEST_BASE, 9, 5)
    one, two = (linkage.check_family(linkage.LARGEST_BASE, *drawn_here, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.torque, two.torque)
    assert np.isnan(one.box_area).all()


def test_a_ratio_without_a_mechanism_is_refused():
    with pytest.raises(InvalidInput, match="lambda2"):
        linkage.check_family(linkage.LARGEST_ROCKER, 0.3, [5.0, 1.5], 0.1, 1.0)
