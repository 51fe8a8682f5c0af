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


def test_effects_that_bring_results_are_told_from_those_that_change_some():
    kind = KINDS["pin-profile"]
    job = job_of(kind, Mode.ACCURACY)
    asked = job.request.model_validate({**example_of(kind, Mode.ACCURACY), "study_budget_s": 2.0})
    costs = {cost["name"]: cost for cost in job.run(asked).result["effect_costs"]}
    assert costs["shear_deflection"]["change"] > 0.1 and costs["shear_deflection"]["brings"] == []
    assert costs["contact_pressure"]["brings"] == ["contact_pressures_mpa.small_end", "contact_pressures_mpa.boss_peak"]
    assert set(costs["ovalization"]["brings"]) == set(kind.given_results)
    assert costs["ovalization"]["change"] == costs["contact_pressure"]["change"] == 0.0


def test_a_design_is_not_judged_by_what_its_objective_is_flat_in():
    kind = KINDS["pin-profile"]
    assert "ovalization_um" in kind.judged(Mode.CHECK)
    assert "ovalization_um" not in kind.judged(Mode.DESIGN)


def test_a_closed_form_has_nothing_to_study():
    assert modes_of(KINDS["crank-masses"]) == (Mode.ANALYSIS,)
