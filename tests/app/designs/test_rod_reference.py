"""The reference of a rod's accuracy study excludes results that unsupported effects may change."""

from __future__ import annotations

import pytest

from app.designs.flexible_rod.reference import check_reference
from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS
from solvers import rod
from solvers.watch import Watch

ROD = KINDS["flexible-rod"]
CORE = ("reciprocating_inertia", "beam_column", "friction")


def covered(check_request, *effects: str) -> set[str]:
    """Results covered by the reference for a check with these effects."""
    request = ROD.jobs[Mode.CHECK].request.model_validate(check_request)
    manifest = [{"name": name, "state": "active"} for name in effects]
    found = check_reference(request, Answer("succeeded", {}, manifest, None, {}))
    return set() if found is None else set(found.results(Watch(60.0)))


def test_the_core_is_known_in_every_result(check_request):
    assert covered(check_request, *CORE) == set(ROD.judged(Mode.CHECK))


def test_an_unlisted_effect_has_no_reference(check_request):
    assert covered(check_request, *CORE, "made_up") == set()


@pytest.mark.parametrize("effect", [effect.name for effect in rod.EFFECTS if effect.name not in CORE])
def test_only_results_unaffected_by_further_effects_are_covered(check_request, effect):
    """Covered results are the same with and without the effect, to the accuracy asked for."""
    names, exact = ROD.judged(Mode.CHECK), {**check_request, "accuracy": 1e-10}
    without, given = (
        ROD.jobs[Mode.CHECK].run(ROD.jobs[Mode.CHECK].request.model_validate({**exact, "effects": choice}))
        for choice in (
            {"include": list(CORE), "exclude": [e.name for e in rod.EFFECTS if e.name not in CORE]},
            {"include": [*CORE, effect], "exclude": [e.name for e in rod.EFFECTS if e.name not in (*CORE, effect)]},
        )
    )
    known = covered(check_request, *CORE, effect)
    for name in names:
        same = given.result[name] == pytest.approx(without.result[name], rel=1e-9)
        assert same or name not in known, name
    assert known
