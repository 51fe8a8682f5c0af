"""Progress of a linkage's Pareto front."""

from __future__ import annotations

from app.designs.kind import Mode
from app.designs.progress import Progress
from app.designs.registry import KINDS

JOB = KINDS["impact-linkage"].jobs[Mode.DESIGN]


def heard_of(**changed) -> list[Progress]:
    heard = []
    body = {**KINDS["impact-linkage"].example(Mode.DESIGN), **changed}
    answer = JOB.solve(JOB.request.model_validate(body), heard.append)
    assert answer.result == JOB.run(JOB.request.model_validate(body)).result
    return heard


def test_a_front_reports_every_point():
    heard = heard_of(front={"against": "longest_link", "points": 5})
    assert heard == [Progress(done, 5, "the front, point by point") for done in range(6)]


def test_a_design_without_a_front_reports_nothing():
    assert heard_of() == []
