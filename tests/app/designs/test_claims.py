"""Claims of certificates: complete, naming active effects and requested limits."""

from __future__ import annotations

import json
import math

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.designs.schema import CertificateResult

DESIGNED = [slug for slug, kind in KINDS.items() if Mode.DESIGN in kind.jobs]
SAID = ("method", "proven", "physics", "form", "range", "estimated")


def designed(slug, **changed):
    job = KINDS[slug].jobs[Mode.DESIGN]
    answer = job.run(job.request.model_validate_json(json.dumps({**KINDS[slug].example(Mode.DESIGN), **changed})))
    return answer.status, answer.result


def certificate_of(slug, **changed):
    return designed(slug, **changed)[1]["certificate"]


@pytest.mark.parametrize("slug", DESIGNED)
def test_a_claim_is_complete_and_matches_the_schema(slug):
    told = certificate_of(slug)
    assert all(told[name] for name in SAID if name != "estimated")
    assert CertificateResult.model_validate({name: told[name] for name in CertificateResult.model_fields})
    schema = KINDS[slug].jobs[Mode.DESIGN].result.model_json_schema()
    assert all(name in json.dumps(schema) for name in SAID)


PIN = KINDS["pin-profile"].example(Mode.DESIGN)


@pytest.mark.parametrize(
    ("form", "words"),
    [
        ({"kind": "free"}, "any bore, halves alike or not"),
        ({"kind": "drillable"}, "does not widen"),
        ({"kind": "stepped", "steps": 2}, "number of steps"),
        ({"kind": "double_cone"}, "narrowing or widening"),
    ],
)
def test_a_pin_names_its_form_and_what_limits_ask_for(form, words):
    plain = certificate_of("pin-profile", form=form, limits={"min_wall_mm": 1.0})
    assert words in plain["form"]
    assert "deflection" not in plain["physics"]
    limited = certificate_of("pin-profile", form=form, limits={"max_deflection_um": 30.0}, effects="all")
    assert "deflection by bending and shear" in limited["physics"]
    assert limited["lower_bound_g"] == limited["bound"]


def test_a_bushings_claim_is_about_its_outer_diameter():
    geometry = {k: v for k, v in PIN["geometry"].items() if k != "outer_diameter_mm"}
    told = certificate_of(
        "pin-profile", variable="outer", bore_mm=10.0, geometry=geometry, form={"kind": "free"}, limits={}
    )
    assert told["form"] == "any outside" and "bushing" in told["proven"]


def test_infeasibility_of_a_pin_is_proven():
    status, result = designed("pin-profile", load={"force_n": 1e6})
    assert status == "infeasible"
    assert result["certificate"]["bound"] is None and "solid" in result["certificate"]["proven"]


def test_a_linkage_names_its_types_and_how_far_they_were_searched():
    told = certificate_of("impact-linkage", types=["largest_base"])
    assert "largest base" in told["form"] and "largest coupler" not in told["form"]
    assert "without end" in told["range"]


def test_a_rod_with_effects_beyond_the_core_proves_the_core_alone():
    told = certificate_of("flexible-rod", effects="all", accuracy=1e-3)
    assert "the core's, without" in told["physics"] and "the core's bound" in told["proven"]
    assert any("local optimum" in text for text in told["estimated"])
    core = {"include": ["beam_column"], "exclude": [e.name for e in KINDS["flexible-rod"].known_effects]}
    core["exclude"].remove("beam_column")
    plain = certificate_of("flexible-rod", effects=core, accuracy=1e-3)
    assert "better" in plain["proven"] and "check's own" in plain["physics"]


def test_a_gap_is_of_the_mass_that_is_told():
    status, result = designed("pin-profile", form={"kind": "stepped", "steps": 2})
    gap = result["mass_g"] / result["certificate"]["lower_bound_g"] - 1.0
    assert status == "succeeded" and math.isclose(gap, result["certificate"]["gap"], abs_tol=1e-12)
