"""Forms without JavaScript, and the live endpoints."""

from __future__ import annotations

import html
import re

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.jobs.errors import Busy
from app.store.faults import FaultKind, StoreFault
from app.submission import Service
from app.web.forms.tree import form_of

JOBS = [(kind.slug, str(mode)) for kind in KINDS.values() for mode in kind.jobs]
HOSTILE = '"><script>alert(1)</script>\u202e\U0001f4a3'


def texts_of(slug: str, mode: str) -> dict[str, str]:
    kind, texts = KINDS[slug], {}
    form_of(kind, Mode(mode)).take(kind.example(Mode(mode)), texts)
    return texts


def inputs(page: str) -> dict[str, str]:
    """The text inputs as a browser would send them."""
    found = re.findall(r'<input id="([^"]+)" name="[^"]+" value="([^"]*)"', page)
    return {html.unescape(name): html.unescape(value) for name, value in found}


@pytest.mark.parametrize(("slug", "mode"), JOBS)
def test_each_form_starts_with_its_example_and_a_drawing(client, slug, mode):
    page = client.get(f"/designs/{slug}?mode={mode}")
    shown, texts = inputs(page.text), texts_of(slug, mode)
    assert shown
    assert {name: texts.get(name, "") for name in shown} == shown
    assert "<svg" in page.text
    assert len(page.content) < 100_000
    assert "style=" not in page.text
    described = " ".join(re.findall(r'aria-describedby="([^"]+)"', page.text)).split()
    assert set(described) <= set(re.findall(r' id="([^"]+)"', page.text))


def test_a_submitted_form_is_a_run_under_its_name(client):
    fields = texts_of("pin-profile", "check") | {"name": HOSTILE}
    answer = client.post("/designs/pin-profile?mode=check", data=fields, follow_redirects=False)
    assert answer.status_code == 303
    page = client.get(answer.headers["location"])
    assert html.escape(HOSTILE, quote=False)[:20] in page.text.replace("&#34;", '"')
    assert "<script>alert" not in page.text


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("load.schmidt.delta", "1.5"),
        ("dimensions.l_mm", "50"),
        ("mechanism.speed_hz", "fast"),
        ("piston.diameter_mm", ""),
    ],
)
def test_an_error_is_shown_at_its_field_and_input_is_kept(client, field, text):
    fields = {**texts_of("flexible-rod", "check"), field: text, "name": HOSTILE, "load.constant.back_pressure_mpa": "7"}
    answer = client.post("/designs/flexible-rod?mode=check", data=fields)
    assert answer.status_code == 422
    words = re.search(rf'id="{re.escape(field)}-error">([^<]+)<', answer.text)
    assert words
    assert f'<a href="#{field}">' in answer.text
    shown = inputs(answer.text)
    assert shown == {name: fields.get(name, "") for name in shown}
    assert HOSTILE not in answer.text


@pytest.mark.parametrize(
    ("error", "wait_s", "words"),
    [
        (Busy("no worker came free within 30 s", 7.0), "7", "no worker came free"),
        (StoreFault(FaultKind.BUSY), "5", "the database is locked or does not answer in time; nothing was stored"),
    ],
)
def test_a_form_that_cannot_be_answered_now_is_shown_again_with_the_reason(client, monkeypatch, error, wait_s, words):
    async def fail(*_given):
        raise error

    monkeypatch.setattr(Service, "submit_within", fail)
    fields = texts_of("pin-profile", "check") | {"name": "typed before"}
    answer = client.post("/designs/pin-profile?mode=check", data=fields)
    assert answer.status_code == 503 and answer.headers["retry-after"] == wait_s
    assert answer.headers["content-type"].startswith("text/html")
    assert words in answer.text and inputs(answer.text)["name"] == "typed before"


def test_control_and_bidirectional_characters_are_removed_from_names(client, check_request):
    answer = client.post("/api/v1/checks/flexible-rod", json=check_request | {"name": "a\x1b[31m\x07\u202eb\u2066c"})
    assert answer.json()["name"] == "a[31mbc"


def test_switching_modes_keeps_common_fields(client):
    fields = texts_of("flexible-rod", "check") | {"mechanism.speed_hz": "33", "load": "constant"}
    del fields["load.constant.constant_pressure_mpa"]
    page = client.post("/designs/flexible-rod?mode=design&was=check", data=fields).text
    assert inputs(page)["mechanism.speed_hz"] == "33"
    assert inputs(page)["bounds.b_mm.1"] == "9"
    assert re.search(r'name="load" value="constant"[^>]* checked', page)


def test_a_form_is_prefilled_from_a_run(client):
    fields = texts_of("flexible-rod", "check") | {"dimensions.h_mm": "0.5", "name": "first"}
    run = client.post("/designs/flexible-rod?mode=check", data=fields, follow_redirects=False).headers["location"][6:]
    assert inputs(client.get(f"/designs/flexible-rod?mode=check&from={run}").text)["dimensions.h_mm"] == "0.5"
    assert inputs(client.get(f"/designs/flexible-rod?mode=design&from={run}").text)["name"] == "first"
    assert client.get(f"/designs/pin-profile?mode=check&from={run}").status_code == 409
    assert client.get("/designs/pin-profile?mode=check&from=none").status_code == 404


def test_a_load_from_a_run_is_chosen_in_the_form(client):
    posted = client.post("/designs/crank-dynamics?mode=analysis", data=texts_of("crank-dynamics", "analysis"))
    run = str(posted.url).rpartition("/")[2]
    page = client.get(f"/designs/pin-profile?mode=design&load_run={run}&instant=gas_force_max").text
    assert re.search(rf'<option translate="no" value="{run}" selected>', page)
    assert '<option value="gas_force_max" selected>' in page
    fields = texts_of("pin-profile", "design") | {"load": "run", "load.run.run_id": run}
    fields["load.run.instant"] = "gas_force_max"
    assert client.post("/designs/pin-profile?mode=design", data=fields, follow_redirects=False).status_code == 303


def test_the_live_drawing_follows_the_form_and_reports_errors(client):
    fields = texts_of("flexible-rod", "check") | {"dimensions.l_mm": "31,5"}
    told = client.post("/designs/flexible-rod/drawing?mode=check", data=fields).json()
    assert "l 31.5" in told["svg"]
    assert 'data-for="dimensions.l_mm"' in told["svg"]
    assert told["faults"] == {}
    told = client.post("/designs/flexible-rod/drawing?mode=check", data=fields | {"piston.diameter_mm": "wide"}).json()
    assert told["svg"] == ""
    assert list(told["faults"]) == ["piston.diameter_mm"]


def test_live_answers_are_not_stored(client):
    before = len(client.get("/api/v1/runs").json()["items"])
    fields = texts_of("pin-profile", "check")
    answer = client.post("/designs/pin-profile/answer?mode=check", data=fields)
    assert "It holds" in answer.text
    answer = client.post("/designs/pin-profile/answer?mode=check", data=fields | {"load.load.force_n": "30000"})
    assert "It does not hold" in answer.text
    assert client.post("/designs/pin-profile/answer?mode=check", data=fields | {"bore_mm": "99"}).status_code == 422
    assert client.post("/designs/pin-profile/answer?mode=design", data=fields).status_code == 409
    assert len(client.get("/api/v1/runs").json()["items"]) == before


def test_live_figures_of_an_engine_are_those_of_all_its_cylinders(client):
    fields = texts_of("crank-dynamics", "analysis")
    assert int(fields["engine.cylinders"]) == 4
    run = client.post("/api/v1/analyses/crank-dynamics", json=KINDS["crank-dynamics"].example(Mode.ANALYSIS)).json()
    shown = client.post("/designs/crank-dynamics/answer?mode=analysis", data=fields).text
    assert f"{run['result']['engine']['indicated_power_w']:.6g}" in shown
    assert f"{run['result']['indicated_power_w']:.6g}" not in shown


def test_a_form_offers_no_more_time_than_the_service_gives(client):
    longest = client.app.state.service.solve_budget_s
    page = client.get("/designs/flexible-rod?mode=design").text
    assert f"0.001 … {longest:g}; empty: as long as the service allows" in page


def test_an_infeasible_design_explains_itself(client):
    fields = texts_of("flexible-rod", "design") | {"requirements.min_fatigue_safety": "5"}
    page = client.post("/designs/flexible-rod?mode=design", data=fields)
    assert "Why there is no answer" in page.text


def test_an_oversized_form_is_refused(client):
    fields = texts_of("flexible-rod", "check") | {"load.table.points": "1 1\n" * 400_000}
    assert client.post("/designs/flexible-rod?mode=check", data=fields).status_code == 413


def test_a_bushing_is_called_so(client):
    """On its form, also while one types, on the run's page, and in its report and drawing."""
    first = client.get("/designs/pin-profile?mode=check").text
    assert "<title>Piston pin: " in first
    form = client.get("/designs/pin-profile?mode=check&example=a bushing").text
    assert "<title>Bushing: " in form and '<span id="the-title">Bushing</span>' in form
    kind = KINDS["pin-profile"]
    texts: dict[str, str] = {}
    form_of(kind, Mode.CHECK).take(kind.others(Mode.CHECK)["a bushing"], texts)
    drawn = client.post("/designs/pin-profile/drawing?mode=check", data=texts).json()
    assert drawn["title"] == "Bushing"
    place = client.post("/designs/pin-profile?mode=check", data=texts, follow_redirects=False).headers["location"]
    assert re.search(r'class="about">.*?</span> Bushing ·', client.get(place).text)
    exports = f"/api/v1{place}/exports"
    assert "Bushing · Check" in client.get(f"{exports}/html").text
    assert "\nBushing\n" in client.get(f"{exports}/dxf").text.replace("\r", "")
