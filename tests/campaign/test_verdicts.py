"""Verdicts on designs of random problems, compared with the campaign's own evaluation of their limits."""

from __future__ import annotations

import numpy as np
import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from bench.campaign import linkage_designs, pin_designs
from solvers.verdict import MAX_SLACK

PROBLEMS = {"pin-profile": pin_designs.problem, "impact-linkage": linkage_designs.problem}
STRENGTH = ("equivalent_stress_max_mpa", "shear_stress_max_mpa")


@pytest.mark.parametrize(("slug", "seed"), [("pin-profile", k) for k in range(24)] + [("impact-linkage", 1)])
def test_a_design_meets_its_limits_at_any_accuracy(slug, seed):
    """Active limits must not fail by rounding; criteria that were not requested may fail, and are reported."""
    rng = np.random.default_rng(seed)
    problem, job = PROBLEMS[slug](rng), KINDS[slug].jobs[Mode.DESIGN]
    body = {**problem.body, "accuracy": float(rng.choice([1e-1, 1e-3, 1e-6, 1e-9]))}
    if slug == "pin-profile" and seed % 3 and "max_ring_stress_mpa" not in body.get("limits", {}):
        stress = body["material"]["allowable_stress_mpa"] * 10 ** rng.uniform(-0.3, 0.5)
        body["limits"] = {**body.get("limits", {}), "max_ring_stress_mpa": float(stress)}
    answer = job.run(job.request.model_validate(body))
    if answer.status == "infeasible":
        assert answer.verdict is None
        return
    verdict = answer.verdict
    assert all(c["holds"] for c in verdict["criteria"] if c["asked"] or c["name"] in STRENGTH)
    assert problem.broken(answer.result) <= MAX_SLACK
    assert verdict["holds"] is all(c["holds"] for c in verdict["criteria"])
    for criterion in verdict["criteria"]:
        assert criterion["margin"] is None or (criterion["margin"] >= 0.0) is criterion["holds"]


@pytest.mark.parametrize("seed", range(12))
def test_verdicts_on_changed_pins_agree_with_the_campaign(seed):
    """With walls thickened or thinned, strength and limits hold by both evaluations or by neither."""
    rng = np.random.default_rng(100 + seed)
    problem, kind = pin_designs.problem(rng), KINDS["pin-profile"]
    answer = kind.jobs[Mode.DESIGN].run(kind.jobs[Mode.DESIGN].request.model_validate(problem.body))
    if answer.status == "infeasible":
        return
    given = problem.given(answer)
    if given is None:  # a free form is defined by its stations
        return
    job, bare, seen = kind.jobs[Mode.CHECK], problem.body.get("bore_mm"), set()
    for factor in (0.9, 0.999, 1.001, 1.05):
        points = [
            _thicker(point, factor, problem.body["geometry"].get("outer_diameter_mm"), bare)
            for point in given["profile"]
        ]
        checked = job.run(job.request.model_validate({**given, "profile": points}))
        mine = all(c["holds"] for c in checked.verdict["criteria"] if c["asked"] or c["name"] in STRENGTH)
        assert mine is (problem.broken(checked.result) <= 1e-6), factor
        seen.add(mine)
    assert False in seen


def _thicker(point: dict, factor: float, outer: float | None, bore: float | None) -> dict:
    if "bore_mm" in point:
        return {**point, "bore_mm": max(outer - (outer - point["bore_mm"]) * factor, 0.0)}
    return {**point, "outer_diameter_mm": bore + (point["outer_diameter_mm"] - bore) * factor}
