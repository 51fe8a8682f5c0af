"""Accuracy studies of every kind: references, proofs, progress."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.designs.accuracy import study_job
from app.designs.kind import Answer, Mode
from app.designs.pictures.work_precision import work_precision
from app.designs.registry import KINDS, example_of, job_of, modes_of

CORE = {
    "include": ["beam_column", "friction"],
    "exclude": ["reciprocating_inertia", "rod_inertia", "large_displacement", "shear", "friction_feedback"],
}
BLOW = {"include": ["envelope"], "exclude": ["impact_dynamics", "coupler_elasticity", "tolerances"]}
PAPERS_PIN = {"limits": {"min_wall_mm": 0}, "form": {"kind": "free"}}
BUDGET = 60.0
"""Time limit of a reference on a loaded machine."""


def studied(slug: str, mode: Mode, **changes: object) -> Answer:
    kind = KINDS[slug]
    job = job_of(kind, Mode.ACCURACY)
    spec = {**kind.example(mode), **changes}
    return job.solve(job.request.model_validate({"spec": spec, "study_budget_s": BUDGET}))


@pytest.fixture
def few_runs(monkeypatch):
    """One round of the ladder is enough here."""
    from app.designs import accuracy
    from solvers.accuracy import Plan

    monkeypatch.setattr(accuracy, "Plan", lambda **times: Plan(ladder=(1e-2, 1e-6, 1e-12), runs=1, **times))
    monkeypatch.setattr(accuracy, "_EFFECTS_SHARE", 1e-6)


@pytest.mark.usefixtures("few_runs")
@pytest.mark.parametrize(
    ("slug", "mode", "changes", "own"),
    [
        ("flexible-rod", Mode.CHECK, {"effects": CORE}, set()),
        ("flexible-rod", Mode.CHECK, {"effects": CORE, "fatigue_criterion": "fkm"}, set()),
        ("pin-profile", Mode.CHECK, {}, set(KINDS["pin-profile"].given_results)),
        ("pin-profile", Mode.DESIGN, PAPERS_PIN, set()),
        ("impact-linkage", Mode.CHECK, {"effects": BLOW}, {"enclosing_radius_mm"}),
        ("crank-dynamics", Mode.ANALYSIS, {}, set()),
    ],
)
def test_main_results_have_independent_references(slug, mode, changes, own):
    answer = studied(slug, mode, **changes)
    assert answer.status == "succeeded"
    result = answer.result
    assert result["reference"].startswith("in arbitrary precision")
    assert "given up" not in result["reference"]
    assert [level["accuracy"] for level in result["levels"]] == [1e-2, 1e-6, 1e-12]
    assert own == {word.strip(" ,") for word in result["reference"].partition("; ")[2].partition(":")[0].split()}
    tightest = result["levels"][-1]
    # A hundred times tighter than the tightest rung, in every result that judges it.
    assert all(error < 1e-12 for error in tightest["errors"].values())
    for level in result["levels"]:
        assert level["error"] <= level["accuracy"]
    if not own:
        assert result["reference_accuracy"] <= 1e-14


@pytest.mark.usefixtures("few_runs")
@pytest.mark.parametrize(
    ("slug", "mode", "name", "changes"),
    [
        ("flexible-rod", Mode.CHECK, "side_force_max_n", {"effects": CORE}),
        ("pin-profile", Mode.DESIGN, "mass_g", PAPERS_PIN),
        ("impact-linkage", Mode.CHECK, "peak_torque_nm", {"effects": BLOW}),
        ("crank-dynamics", Mode.ANALYSIS, "work_fluctuation_j", {}),
    ],
)
def test_a_consistently_wrong_solver_is_detected(slug, mode, name, changes):
    kind = KINDS[slug]
    right = kind.jobs[mode]

    def wrong(request: object) -> Answer:
        answer = right.run(request)
        return answer._replace(result={**answer.result, name: answer.result[name] * (1 + 3e-7)})

    job = study_job(replace(kind, jobs={mode: replace(right, run=wrong)}))
    spec = {**kind.example(mode), **changes}
    found = job.solve(job.request.model_validate({"spec": spec, "study_budget_s": BUDGET})).result
    loosest, *others = found["levels"]
    assert loosest["errors"][name] < loosest["accuracy"] == 1e-2
    for level in others:
        assert level["errors"][name] == pytest.approx(3e-7, rel=0.2)
    assert found["levels"][-1]["error"] > 1e-7


@pytest.mark.usefixtures("few_runs")
def test_effects_beyond_the_reference_are_judged_by_the_solver():
    effects = {"include": ["large_displacement", "shear"], "exclude": ["friction_feedback", "rod_inertia"]}
    found = studied("flexible-rod", Mode.CHECK, effects=effects).result
    told, _, own = found["reference"].partition("; ")
    assert told.startswith("in arbitrary precision")
    assert "fatigue_safety" in own and "critical_force_n" in own and "mass_g" not in own
    assert own.endswith("the same case solved to 1e-08")
    # The tightest level is judged by independent results, or not at all.
    assert set(found["levels"][-1]["errors"]) == {
        "mass_g",
        "axial_force_min_n",
        "axial_force_max_n",
        "natural_frequency_hz",
    }


@pytest.mark.usefixtures("few_runs")
def test_a_design_study_reports_gaps_and_the_cheapest_proof():
    found = studied("impact-linkage", Mode.DESIGN).result
    gaps = [level["proven_gap"] for level in found["levels"]]
    # The proof goes exactly as far as the requested accuracy.
    assert gaps[0] == pytest.approx(1e-2) and gaps[1] == pytest.approx(1e-6)
    assert found["certified"]["proven_gap"] == pytest.approx(1e-6)
    assert found["certified"]["settings"]["gap"] == pytest.approx(1e-6)
    assert studied("pin-profile", Mode.CHECK).result["certified"] is None


def test_progress_covers_all_solutions():
    kind = KINDS["pin-profile"]
    job, heard = job_of(kind, Mode.ACCURACY), []
    job.solve(job.request.model_validate(example_of(kind, Mode.ACCURACY)), heard.append)
    assert [p.done for p in heard] == sorted(p.done for p in heard)
    assert all(p.done <= p.of for p in heard)
    said = list(dict.fromkeys(p.doing for p in heard))
    assert said == [
        "the tightest solution",
        "an independent reference",
        "solving at different accuracies",
        "each effect turned on or off",
    ]


@pytest.mark.usefixtures("few_runs")
def test_a_failed_level_is_a_gap_in_the_plot():
    answer = studied("pin-profile", Mode.DESIGN, **PAPERS_PIN)
    levels = [{**level, "time_median_s": 10.0**i} for i, level in enumerate(answer.result["levels"])]

    def picture(shown: list[dict]) -> str:
        return work_precision({"result": {**answer.result, "levels": shown}, "accuracy": answer.accuracy})

    whole, holed = picture(levels), picture([levels[0], {**levels[1], "error": None}, levels[2]])
    assert whole.count("<circle") == 3 and holed.count("<circle") == 2
    assert "proven to 2e-12" in whole
    assert "≤ 1e-12" in picture([*levels[:2], {**levels[2], "at_most": True}])
    # Names of levels that lie together are one.
    assert "1e-6 … 1e-12" in picture([levels[0], *({**levels[1], "accuracy": a} for a in (1e-6, 1e-12))])


def test_effects_that_add_results_are_distinguished():
    kind = KINDS["pin-profile"]
    job = job_of(kind, Mode.ACCURACY)
    asked = job.request.model_validate({**example_of(kind, Mode.ACCURACY), "study_budget_s": 2.0})
    costs = {cost["name"]: cost for cost in job.run(asked).result["effect_costs"]}
    assert costs["shear_deflection"]["change"] > 0.1 and costs["shear_deflection"]["brings"] == []
    assert costs["contact_pressure"]["brings"] == ["contact_pressures_mpa.small_end", "contact_pressures_mpa.boss_peak"]
    assert set(costs["ovalization"]["brings"]) == set(kind.given_results)
    assert costs["ovalization"]["change"] == costs["contact_pressure"]["change"] == 0.0


def test_quantities_with_a_flat_objective_are_not_judged():
    kind = KINDS["pin-profile"]
    assert "ovalization_um" in kind.judged(Mode.CHECK)
    assert "ovalization_um" not in kind.judged(Mode.DESIGN)


def test_a_rod_design_is_judged_by_what_does_not_jump():
    """In the example's optimum two sections govern fatigue equally, with stress amplitudes that differ by 5 %."""
    kind = KINDS["flexible-rod"]
    job = kind.jobs[Mode.DESIGN]

    def judged(accuracy):
        request = job.request.model_validate({**kind.example(Mode.DESIGN), "accuracy": accuracy})
        return kind.judged_values(job.run(request).result, Mode.DESIGN)

    exact = judged(1e-8)
    for accuracy in (1e-3, 1e-4):
        assert judged(accuracy) == pytest.approx(exact, rel=5.0 * accuracy)


def test_a_closed_form_has_nothing_to_study():
    assert modes_of(KINDS["crank-masses"]) == (Mode.ANALYSIS,)


def _asked():
    for kind in KINDS.values():
        for mode in modes_of(kind):
            if mode is not Mode.ACCURACY:
                yield pytest.param(kind, mode, {}, id=f"{kind.slug} {mode}")
    bushing = {"variable": "outer", "limits": {}}
    yield pytest.param(KINDS["pin-profile"], Mode.CHECK, bushing, id="a bushing's check")


@pytest.mark.parametrize(("kind", "mode", "changes"), list(_asked()))
def test_what_is_studied_stays_what_it_is_when_every_field_is_written_down(kind, mode, changes):
    """As it goes to a worker and into the store."""
    if Mode.ACCURACY not in modes_of(kind):
        return
    request = job_of(kind, Mode.ACCURACY).request
    asked = request.model_validate({"spec": kind.example(mode) | changes})
    assert isinstance(asked.spec, job_of(kind, mode).request)
    assert request.model_validate_json(asked.model_dump_json()) == asked


def test_an_infeasible_case_is_answered_with_the_accuracy_asked_for():
    kind = KINDS["flexible-rod"]
    example = kind.example(Mode.DESIGN)
    hard = {"requirements": {**example["requirements"], "min_fatigue_safety": 9.0}, "effects": CORE}
    answer = studied("flexible-rod", Mode.DESIGN, **hard)
    job = job_of(kind, Mode.DESIGN)
    alone = job.solve(job.request.model_validate({**example, **hard}))
    assert answer.status == alone.status == "infeasible"
    assert (answer.accuracy, answer.result) == (alone.accuracy, alone.result)
    assert answer.accuracy["requested"] == 1e-6 and answer.accuracy["met"] and not answer.result["warnings"]
