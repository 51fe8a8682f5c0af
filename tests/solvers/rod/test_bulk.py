"""Many checks at once against single ones."""

from __future__ import annotations

import dataclasses
import math

from solvers import rod
from solvers.effects import EffectSelection
from solvers.errors import InvalidInput
from tests.solvers.rod.machines import PAPER, STRIP

SAME = 1e-12
NAMES = frozenset(effect.name for effect in rod.EFFECTS)


def only(*names):
    return EffectSelection(include=frozenset(names), exclude=NAMES - set(names))


def alike(found, exact):
    """Whether two results agree, number by number."""
    if dataclasses.is_dataclass(exact):
        return all(alike(getattr(found, f.name), getattr(exact, f.name)) for f in dataclasses.fields(exact))
    if isinstance(exact, float):
        return math.isclose(found, exact, rel_tol=SAME)
    return found == exact


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
