"""Verdicts over HTTP, on pages and on the command line: consistent, shown first, and never positive for a failing
part."""

from __future__ import annotations

import json
import re
import time

import pytest
from typer.testing import CliRunner

from app.cli import app
from app.designs.kind import Mode
from app.designs.registry import KINDS

RODS, PINS = "/api/v1/checks/flexible-rod", "/api/v1/designs/pin-profile"
GOOD = 'class="verdict holds"'


@pytest.fixture
def buckled(check_request):
    return {**check_request, "name": "too thin", "dimensions": {"b_mm": 9, "h_mm": 0.1, "l_mm": 23}}


@pytest.fixture
def three_steps():
    example = KINDS["pin-profile"].example(Mode.DESIGN)
    return {**example, "limits": {"min_wall_mm": 0}, "form": {"kind": "stepped", "steps": 3}}


def answered(client, path, request):
    answer = client.post(path, json=request)
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_the_verdict_comes_before_everything_long(client, check_request):
    text = client.post(RODS, json={**check_request, "name": "read from the top"}).text
    places = [text.index(f'"{part}":') for part in ("id", "verdict", "spec", "result", "links")]
    assert places == sorted(places)


def test_a_run_carries_its_verdict_and_the_listing_whether_it_holds(client, check_request, buckled):
    good, bad = (answered(client, RODS, {**r, "name": "judged"}) for r in (check_request, buckled))
    assert (good["holds"], bad["holds"]) == (True, False)
    assert (good["verdict"]["holds"], bad["verdict"]["holds"]) == (True, False)
    assert client.get(good["links"]["self"]).json() == good

    def listed(**wanted):
        page = client.get("/api/v1/runs", params={"name": "judged", **wanted}).json()
        return {run["id"]: run["holds"] for run in page["items"]}

    assert listed() == {good["id"]: True, bad["id"]: False}
    assert listed(holds="true") == {good["id"]: True}
    assert listed(holds="false") == {bad["id"]: False}
    assert client.get("/api/v1/runs", params={"holds": "perhaps"}).status_code == 422


def test_links_resolve(client, check_request):
    cases = [
        answered(client, RODS, check_request),
        answered(client, "/api/v1/checks/impact-linkage", KINDS["impact-linkage"].example(Mode.CHECK)),
        answered(client, "/api/v1/analyses/crank-masses", KINDS["crank-masses"].example(Mode.ANALYSIS)),
    ]
    for run in cases:
        links = run["links"]
        assert "json" in links["exports"]
        for url in (links["self"], links["page"], *links["plots"].values(), links["exports"]["json"]):
            assert client.get(url).status_code == 200, url
    assert [sorted(run["links"]["plots"]) for run in cases] == [
        ["effects", "forces-over-angle", "stability-map", "stress-along-strip", "stresses-over-angle"],
        ["effects", "loads", "mechanism", "transfer"],
        [],
    ]  # fmt: skip
    assert cases[2]["verdict"] is None and cases[2]["holds"] is None


def test_a_run_answered_later_has_its_verdict_too(client, three_steps):
    answer = client.post(PINS, json=three_steps, headers={"Prefer": "respond-async"})
    queued = answer.json()
    assert (queued["verdict"], queued["holds"], queued["links"]["plots"]) == (None, None, {})
    end = time.monotonic() + 60
    while (run := client.get(answer.headers["location"]).json())["status"] in ("queued", "running"):
        assert time.monotonic() < end
        time.sleep(0.05)
    assert run["holds"] is run["verdict"]["holds"] is False
    again = answered(client, PINS, three_steps)
    assert again["cached"] and again["verdict"] == run["verdict"]


def test_a_study_has_none(client, check_request):
    study = answered(client, "/api/v1/accuracy/flexible-rod", {"spec": check_request, "study_budget_s": 0.5})
    assert (study["verdict"], study["holds"]) == (None, None)


def page_of(client, run):
    return client.get(run["links"]["page"]).text


def test_the_verdict_is_the_first_thing_on_a_page(client, check_request):
    run = answered(client, RODS, check_request)
    page = page_of(client, run)
    assert GOOD in page
    assert page.index(run["verdict"]["summary"]) < min(page.index(x) for x in ("succeeded", "<h2>", "<figure"))
    for item in run["verdict"]["criteria"]:
        assert f'aria-label="{item["label"]}: ' in page


@pytest.mark.parametrize("case", ["buckled", "three_steps"])
def test_a_failing_part_is_never_shown_as_passing(client, request, case):
    body = {**request.getfixturevalue(case), "name": f"red {case}"}
    run = answered(client, RODS if case == "buckled" else PINS, body)
    assert run["status"] == "succeeded"
    page = page_of(client, run)
    assert GOOD not in page and 'class="verdict fails"' in page
    assert run["verdict"]["summary"] in page
    row = next(row for row in re.findall(r"<tr>.*?</tr>", client.get("/runs").text, re.DOTALL) if run["id"] in row)
    assert '<span class="no">does not hold</span>' in row and 'class="yes"' not in row
    # the solve's status has no colour of its own
    style = client.get("/static/style.css").text
    assert ".status.succeeded" not in style


def test_a_pass_with_missed_accuracy_is_not_shown_as_passing(client, check_request):
    run = answered(client, RODS, {**check_request, "accuracy": 1e-12, "effects": "all"})
    assert run["verdict"]["holds"] and run["accuracy"]["met"] is False
    page = page_of(client, run)
    assert GOOD not in page and 'class="verdict doubtful"' in page
    assert "The accuracy asked for is not met" in page
    row = next(row for row in re.findall(r"<tr>.*?</tr>", client.get("/runs").text, re.DOTALL) if run["id"] in row)
    assert "accuracy not met" in row and 'class="yes"' not in row


def test_an_infeasible_design_says_so_first(client, three_steps):
    run = answered(client, PINS, {**three_steps, "load": {"force_n": 20000}})
    assert (run["status"], run["verdict"], run["holds"]) == ("infeasible", None, None)
    page = page_of(client, run)
    assert page.index("No design meets all requirements") < page.index("infeasible")
    assert '<th scope="row">force</th>' in page


@pytest.mark.parametrize(("thickness", "code", "first"), [(0.46, 0, "It holds."), (0.1, 4, "It does not hold:")])
def test_the_command_line_shows_the_verdict_first_and_as_exit_code(tmp_path, check_request, thickness, code, first):
    check_request["dimensions"]["h_mm"] = thickness
    file = tmp_path / "request.json"
    file.write_text(json.dumps(check_request))
    options = ["--database-url", f"sqlite:///{tmp_path}/runs.sqlite3"]
    told = CliRunner().invoke(app, ["check", "flexible-rod", str(file), *options])
    assert (told.exit_code, told.output.startswith(first)) == (code, True), told.output
    assert "stability_safety" in told.output
