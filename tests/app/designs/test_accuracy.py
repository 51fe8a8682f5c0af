"""Accuracy studies of kinds that are analysed, not designed."""

from __future__ import annotations

from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of, job_of, modes_of


def test_an_analysis_can_be_studied():
    kind = KINDS["crank-dynamics"]
    job = job_of(kind, Mode.ACCURACY)
    asked = job.request.model_validate({**example_of(kind, Mode.ACCURACY), "study_budget_s": 0.1})
    answer = job.run(asked)
    assert answer.status == "succeeded"
    assert set(answer.result["levels"][0]["errors"]) == set(kind.main_results)
    for level in answer.result["levels"]:
        assert level["error"] <= level["accuracy"]


def test_a_closed_form_has_nothing_to_study():
    assert modes_of(KINDS["crank-masses"]) == (Mode.ANALYSIS,)
