"""Bulk evaluation agrees with single runs on random scenes, including hard ones."""

from __future__ import annotations

import pytest

from app.designs import many
from app.designs.kind import Detail, Mode
from app.designs.registry import KINDS
from bench.campaign.scenes import scene_of
from tests.app.designs.alike import differences

BULK = [(kind.slug, mode) for kind in KINDS.values() for mode, job in kind.jobs.items() if job.run_many is not None]
COUNT = 8


def selections(kind):
    """Automatic effects, none, and each one alone."""
    names = [effect.name for effect in kind.known_effects]
    yield "auto"
    yield {"exclude": names}
    for name in names:
        yield {"include": [name], "exclude": [other for other in names if other != name]}


def cases(slug, mode, count=COUNT):
    kind = KINDS[slug]
    for k, selection in enumerate(selections(kind)):
        for seed in range(100 * k, 100 * k + count):
            yield {**scene_of(slug, seed).body, "effects": selection}


@pytest.mark.parametrize(("slug", "mode"), BULK)
def test_bulk_agrees_with_single_runs(slug, mode):
    job = KINDS[slug].jobs[Mode(mode)]
    bodies = list(cases(slug, mode))
    found = many.answer_many(slug, mode, bodies, Detail.SCALARS)
    for body, answer in zip(bodies, found, strict=True):
        exact = many.without_tables(job, job.run(job.request.model_validate(body)), Detail.SCALARS)
        assert (answer.status, answer.problem) == (exact.status, exact.problem)
        assert not differences(answer.result, exact.result)
        assert not differences(answer.effects, exact.effects)
        if exact.accuracy is None:
            continue
        assert answer.accuracy["met"] == exact.accuracy["met"]
        assert not differences(answer.accuracy["settings"], exact.accuracy["settings"])
        if exact.verdict is None:
            assert answer.verdict is None
            continue
        assert [c["holds"] for c in answer.verdict["criteria"]] == [c["holds"] for c in exact.verdict["criteria"]]
        assert not differences(
            {c["name"]: (c["reached"], c["required"]) for c in answer.verdict["criteria"]},
            {c["name"]: (c["reached"], c["required"]) for c in exact.verdict["criteria"]},
        )
