"""Every rehearsal is answered; a refused one would compile nothing."""

from __future__ import annotations

import pytest

from app.designs.rehearsals import rehearsals


@pytest.mark.parametrize(("job", "request_"), [pytest.param(*case, id=str(n)) for n, case in enumerate(rehearsals())])
def test_every_rehearsal_is_answered(job, request_):
    assert job.run(request_).status in ("succeeded", "infeasible")
