"""Whether the requested accuracy was met: reported for every kind, with a warning if not."""

from __future__ import annotations

import io
import math

import pytest
from rich.console import Console
from starlette.requests import Request

from app import printing
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.designs.schema import envelope
from app.web.rendering import templates
from solvers.outcome import Accuracy, Outcome, Status

MISSED = "the accuracy of 1e-6 is not met: the estimated error is 4e-5"


def answer(estimated: float, result: dict | None):
    return envelope(None, Outcome(Status.SUCCEEDED, None, (), Accuracy(1e-6, estimated)), result)


@pytest.mark.parametrize(("estimated", "met"), [(0.0, True), (1e-6, True), (1.1e-6, False), (math.nan, False)])
def test_an_accuracy_is_met_if_the_estimate_is_small_enough(estimated, met):
    assert Accuracy(1e-6, estimated).met is met


def test_a_missed_accuracy_is_the_first_warning():
    told = answer(4e-5, {"mass_g": 1.0, "warnings": ["something else"]})
    assert told.accuracy["met"] is False
    assert told.result == {"mass_g": 1.0, "warnings": [MISSED, "something else"]}


@pytest.mark.parametrize(
    ("estimated", "result"), [(1e-7, {"warnings": ["something else"]}), (4e-5, {"diagnosis": []}), (4e-5, None)]
)
def test_nothing_else_is_changed(estimated, result):
    assert answer(estimated, result).result == result


@pytest.mark.parametrize("slug", KINDS)
def test_every_kind_says_whether_its_accuracy_is_met(slug):
    kind = KINDS[slug]
    mode = Mode.CHECK if Mode.CHECK in kind.jobs else Mode.ANALYSIS
    job = kind.jobs[mode]
    told = job.run(job.request.model_validate({**kind.example(mode), "accuracy": 1e-2}))
    assert told.accuracy["met"] is (told.accuracy["estimated"] <= 1e-2)
    assert told.accuracy["met"] or "is not met" in told.result["warnings"][0]


def run(estimated: float) -> dict:
    found = answer(estimated, {"mass_g": 1.0, "warnings": []})
    return {
        "id": "r", "kind": "flexible-rod", "mode": "check", "status": "succeeded", "name": "", "cached": False,
        "created_at": "2026-01-31T12:00:00Z", "result": found.result, "problem": None, "effects": [],
        "accuracy": found.accuracy, "timing": {"total_s": 0.1}, "progress": None, "verdict": None,
        "spec": {}, "solver": {"name": "crankwright", "version": "1"}, "links": {"plots": {}, "exports": {}},
    }  # fmt: skip


@pytest.mark.parametrize(("estimated", "warned"), [(4e-5, True), (1e-7, False)])
def test_page_and_terminal_say_so(estimated, warned, monkeypatch):
    shown = run(estimated)
    request = Request({"type": "http", "path": "/runs/x", "query_string": b"", "headers": []})
    page = templates.get_template("run.html").render(
        request=request, run=shown, kind=KINDS["flexible-rod"], result=shown["result"], numbers={}, plots=[]
    )
    assert (MISSED[1:] in page) is warned
    assert ("not met" in page) is warned
    out = io.StringIO()
    monkeypatch.setattr(printing, "Console", lambda file: Console(file=out, width=200))
    printing.print_run(shown)
    assert (MISSED in out.getvalue()) is warned
    assert ("NOT MET" in out.getvalue()) is warned
