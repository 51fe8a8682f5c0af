"""Bulk evaluation gives each request its individual answer."""

from __future__ import annotations

import pytest

from app.designs import many
from app.designs.kind import Detail, Mode
from app.designs.registry import KINDS, job_of
from solvers import crank
from tests.app.designs.alike import differences

OWN = [(kind.slug, mode) for kind in KINDS.values() for mode in kind.jobs if mode is not Mode.DESIGN]


def told(answer, leave=()):
    """All of an answer but the time that it took and the estimate of its error."""
    result = answer.result and {name: value for name, value in answer.result.items() if name not in leave}
    accuracy = answer.accuracy and {**answer.accuracy, "estimated": None}
    return {
        "status": answer.status,
        "result": result,
        "effects": answer.effects,
        "accuracy": accuracy,
        "verdict": answer.verdict,
        "problem": answer.problem,
    }


@pytest.mark.parametrize(("slug", "mode"), OWN)
def test_each_request_is_answered_individually(slug, mode):
    job = job_of(KINDS[slug], mode)
    body = KINDS[slug].example(mode)
    loose = {**body, "accuracy": 1e-3}
    alone = [job.run(job.request.model_validate(one)) for one in (body, loose)]
    full = many.answer_many(slug, mode, [body, loose], Detail.FULL)
    short = many.answer_many(slug, mode, [body, loose], Detail.SCALARS)
    for many_full, many_short, one in zip(full, short, alone, strict=True):
        assert not differences(told(many_full), told(one))
        assert not differences(told(many_short), told(one, job.tables))


@pytest.mark.parametrize(("slug", "mode"), OWN)
def test_tables_name_results(slug, mode):
    job = job_of(KINDS[slug], mode)
    assert set(job.tables) <= set(job.result.model_fields)


def test_an_invalid_body_is_isolated():
    body = KINDS["flexible-rod"].example(Mode.CHECK)
    wrong = {**body, "accuracy": 5.0, "unheard": 1}
    clash = {**body, "dimensions": {**body["dimensions"], "l_mm": 1e5}}
    first, bad, contradicting, last = many.answer_many(
        "flexible-rod", Mode.CHECK, [body, wrong, clash, body], Detail.SCALARS
    )
    assert first.status == last.status == "succeeded"
    assert told(first) == told(last)
    assert bad.status == contradicting.status == "refused"
    assert {error["pointer"] for error in bad.problem["errors"]} == {"/accuracy", "/unheard"}
    assert bad.problem["status"] == 422
    assert [error["pointer"] for error in contradicting.problem["errors"]] == ["/dimensions/l_mm"]


def test_a_solver_refusal_is_isolated():
    body = KINDS["flexible-rod"].example(Mode.CHECK)
    unknown = {**body, "effects": {"include": ["no_such_effect"]}}
    bad, good = many.answer_many("flexible-rod", Mode.CHECK, [unknown, body], Detail.SCALARS)
    assert (bad.status, good.status) == ("refused", "succeeded")
    assert bad.problem["errors"][0]["pointer"].startswith("/effects")


def test_a_failing_solve_is_isolated(monkeypatch):
    example = KINDS["crank-masses"].example(Mode.ANALYSIS)
    honest, calls = crank.swing, []

    def poisoned(pendulum):
        calls.append(pendulum)
        if len(calls) == 1:
            raise RuntimeError("unforeseen")
        return honest(pendulum)

    monkeypatch.setattr(crank, "swing", poisoned)
    bad, good = many.answer_many("crank-masses", Mode.ANALYSIS, [example, example], Detail.SCALARS)
    assert (bad.status, good.status) == ("failed", "succeeded")
    assert bad.problem["status"] == 500
    assert "unforeseen" not in str(bad.problem)


def test_no_requests():
    assert many.answer_many("pin-profile", Mode.CHECK, [], Detail.SCALARS) == []
