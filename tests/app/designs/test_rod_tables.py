"""Tables of pressures as a rod's load: a point that closes the turn."""

from __future__ import annotations

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from solvers.errors import InvalidInput

ROD = KINDS["flexible-rod"].jobs[Mode.CHECK]
ANGLES, PRESSURES = [20.5, 60.0, 120.0, 180.0, 240.0, 300.0], [2.0, 2.3, 1.9, 1.5, 1.4, 1.6]


def load(angles, pressures):
    table = {"kind": "table", "angle_deg": angles, "pressure_mpa": pressures}
    return ROD.request.model_validate({**KINDS["flexible-rod"].example(Mode.CHECK), "load": table}).scene().load


def test_the_first_point_may_come_again_after_a_turn():
    assert load([*ANGLES, 380.5], [*PRESSURES, 2.0]) == load(ANGLES, PRESSURES)


@pytest.mark.parametrize(("angle", "pressure"), [(380.5, 2.1), (381.0, 2.0), (740.5, 2.0)])
def test_another_point_after_a_turn_is_refused(angle, pressure):
    with pytest.raises(InvalidInput, match="full turn after the first"):
        load([*ANGLES, angle], [*PRESSURES, pressure])


@pytest.mark.parametrize("gap", [1e-300, 1e-12])
def test_points_that_are_one_are_refused_at_the_second(gap):
    with pytest.raises(InvalidInput, match="does not follow") as refusal:
        load([0.0, gap, *ANGLES[1:]], [2.0, *PRESSURES])
    assert refusal.value.field == "load.angle.1"
