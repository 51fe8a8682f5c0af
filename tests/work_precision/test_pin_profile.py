"""The free bore's tiers on midpoints solve the same program as scipy does on them."""

from __future__ import annotations

import pytest

from bench.work_precision.pin_profile import _by_brentq, _by_cones, _by_multiplier, _on_midpoints, cases


@pytest.mark.parametrize("tier", [_by_multiplier, _by_cones])
def test_tiers_on_midpoints_agree_with_brentq(tier):
    for case in cases(2):
        assert _on_midpoints(tier, 50, case) == pytest.approx(_by_brentq(50, case), rel=1e-6)
