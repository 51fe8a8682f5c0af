"""What a rod's accuracy study is judged by: nothing that an effect unknown to the reference may have changed."""

from __future__ import annotations

import pytest

from app.designs.flexible_rod.reference import check_reference
from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS
from solvers import rod
from solvers.watch import Watch

ROD = KINDS["flexible-rod"]
CORE = ("reciprocating_inertia", "beam_column", "friction")


def told(check_request, *effects: str) -> set[str]:
    """The results that the reference tells of a check in which these effects ran."""
    request = ROD.jobs[Mode.CHECK].request.model_validate(check_request)
    manifest = [{"name": name, "state": "active"} for name in effects]
    found = check_reference(request, Answer("succeeded", {}, manifest, None, {}))
    return set() if found is None else set(found.results(Watch(60.0)))


def test_the_core_is_known_in_every_result(check_request):
    assert told(check_request, *CORE) == set(ROD.judged(Mode.CHECK))


def test_an_effect_that_nobody_listed_is_judged_by_no_reference(check_request):
    assert told(check_request, *CORE, "made_up") == set()


@pytest.mark.parametrize("effect", [effect.name for effect in rod.EFFECTS if effect.name not in CORE])
def test_of_effects_beyond_the_core_only_what_they_leave_alone_is_told(check_request, effect):
    """What is told is the same with the effect and without it."""
    names = ROD.judged(Mode.CHECK)
    without, given = (
        ROD.jobs[Mode.CHECK].run(ROD.jobs[Mode.CHECK].request.model_validate({**check_request, "effects": choice}))
        for choice in (
            {"include": list(CORE), "exclude": [e.name for e in rod.EFFECTS if e.name not in CORE]},
            {"include": [*CORE, effect], "exclude": [e.name for e in rod.EFFECTS if e.name not in (*CORE, effect)]},
        )
    )
    known = told(check_request, *CORE, effect)
    for name in names:
        same = given.result[name] == pytest.approx(without.result[name], rel=1e-9)
        assert same or name not in known, name
    assert known
