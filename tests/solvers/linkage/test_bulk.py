"""Lists of linkages against single checks."""

from __future__ import annotations

from solvers import linkage
from tests.solvers.linkage.machines import BREAKER, CLEANER, CLEANER_LIMITS


def test_a_list_holds_what_single_checks_tell():
    cases = [
        linkage.Case(scene, linkage.of_ratio(scene, linkage.LARGEST_BASE, ratio), CLEANER_LIMITS)
        for scene, ratio in ((CLEANER, 3.2), (BREAKER, 2.5))
    ]
    wrong = cases[0]._replace(effect_tolerance=2.0)
    *found, refused = linkage.check_many([*cases, wrong])
    assert [outcome.value for outcome in found] == [linkage.check(*case).value for case in cases]
    assert refused.field == "effect_tolerance"
