"""The library's call and a request's answer give the same results, and the peers come near them."""

from __future__ import annotations

import pytest

from bench.work_precision.impact_linkage import JUDGED, _circles, _ours, _service, cases


def test_library_service_and_circles_agree():
    for case in cases(3):
        library = _ours(1e-6, case)
        assert tuple(library) == JUDGED
        assert library == pytest.approx(_service(1e-6, case), rel=1e-12)
        assert library == pytest.approx(_circles(720, case), rel=2e-2)
