"""Run pages, run list and comparisons."""

from __future__ import annotations

import copy
import html
import json
import math
import re
import time
from dataclasses import replace

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.faults import FaultKind, StoreFault
from app.store.record import new_run_id
from app.submission import Service
from app.web.comparison import _pairs, difference
from app.words.shaping import sentences

HTML = {"accept": "text/html"}


def made(client, path: str, body: dict) -> dict:
    answer = client.post(f"/api/v1/{path}", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()


def example(kind: str, mode: Mode, **changes: object) -> dict:
    return {**KINDS[kind].example(mode), **changes}


def ended(client, at: str) -> dict:
    deadline = time.monotonic() + 60
    while (run := client.get(f"/api/v1{at}").json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return run


@pytest.fixture(scope="session")  # as the service is: tests of this module need not follow each other
def pins(client) -> list[dict]:
    force = (15000.0, 12000.0, 9000.0)
    return [
        made(client, "checks/pin-profile", example("pin-profile", Mode.CHECK, name=f"Listed {n}", load={"force_n": f}))
        for n, f in enumerate(force)
    ]


def listed(page: str, pins: list[dict]) -> list[int]:
    """The pins listed on a page, in order."""
    places = {n: page.find(f'href="/runs/{pin["id"]}"') for n, pin in enumerate(pins)}
    return sorted((n for n, at in places.items() if at >= 0), key=places.__getitem__)


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        ("text=lIsTeD", [2, 1, 0]),
        ("text=listed&order=oldest", [0, 1, 2]),
        ("text=listed&order=name", [0, 1, 2]),
        ("text=Listed 1&kind=pin-profile&mode=check&holds=true&status=succeeded", [1]),
        ("text=listed&holds=false", []),
        ("text=listed&since=2020-01-01&until=2120-01-01", [2, 1, 0]),
        ("text=listed&until=2020-01-01", []),
        ("text=%25", []),
    ],
)
def test_the_list_is_filtered_and_sorted(client, pins, query, expected):
    page = client.get(f"/runs?{query}")
    assert page.status_code == 200
    assert listed(page.text, pins) == expected


def test_pagination_in_every_order(client, pins):
    for order in ("newest", "oldest", "name", "least", "greatest"):
        seen, cursor = [], None
        while True:
            query = {"order": order, "limit": 2, "text": "Listed"} | ({"cursor": cursor} if cursor else {})
            answer = client.get("/api/v1/runs", params=query).json()
            seen += [item["id"] for item in answer["items"]]
            cursor = answer["next_cursor"]
            if cursor is None:
                break
        assert sorted(seen) == sorted(pin["id"] for pin in pins), order
        figures = [pin["figure"]["value"] for run in seen for pin in pins if pin["id"] == run]
        assert order not in ("least", "greatest") or figures == sorted(figures, reverse=order == "greatest")


def test_an_invalid_filter_is_reported_at_its_field(client):
    page = client.get("/runs?status=done&since=yesterday")
    assert page.status_code == 422
    assert 'id="filter-status-error"' in page.text
    assert 'id="filter-since-error"' in page.text
    assert client.get("/api/v1/runs?status=done").status_code == 422


def test_the_key_figure_is_in_every_row(client, pins):
    mass = pins[0]["result"]["mass_g"]
    assert pins[0]["figure"] == {"name": "mass_g", "value": mass}
    assert f"{mass:.4g} g" in client.get("/runs?text=Listed 0").text


def test_small_and_large_differences_are_written_as_figures_are_elsewhere():
    assert difference(1e-4, 9.1e-5) == "-9e-6 (-9 %)"


def test_two_runs_are_compared(client, pins):
    page = client.get(f"/runs/compare?a={pins[0]['id']}&b={pins[2]['id']}").text
    assert "15000 N" in page and "9000 N" in page
    assert "(-40 %)" in page
    assert page.count('class="verdict holds"') == 2
    assert (
        "None: both have the same inputs" in client.get(f"/runs/compare?run={pins[0]['id']}&run={pins[0]['id']}").text
    )


def rows(page: str) -> dict[str, list[str]]:
    """The rows of the page's tables by their heading: the texts of their cells."""
    found = re.findall(r'<th scope="row"[^>]*>([^<]*)</th>((?:<td[^>]*>[^<]*</td>)+)', page)
    return {heading: re.findall(r"<td[^>]*>([^<]*)</td>", cells) for heading, cells in found}


def compared(client, path: str, a: dict, b: dict) -> str:
    ids = [made(client, path, each)["id"] for each in (a, b)]
    return client.get(f"/runs/compare?a={ids[0]}&b={ids[1]}").text


def test_a_comparison_names_the_points_of_a_table_that_differ(client):
    title = "one cylinder of two strokes, pressures from a table"
    spec = copy.deepcopy(KINDS["crank-dynamics"].others(Mode.ANALYSIS)[title])
    other = copy.deepcopy(spec)
    pressures = other["pressure"]["pressure_mpa"]
    middle = len(pressures) // 2
    pressures[middle] *= 1.5
    page = compared(client, "analyses/crank-dynamics", spec, other)
    told = [f"value {middle + 1}: {each['pressure']['pressure_mpa'][middle]:.10g} MPa" for each in (spec, other)]
    assert rows(page)["pressure"] == told


def test_a_comparison_has_criteria_of_one_label_apart(client):
    spec = KINDS["impact-linkage"].others(Mode.CHECK)["four lengths"]
    page = compared(client, "checks/impact-linkage", spec, {**spec, "impact_speed_m_s": 4.0})
    criteria = page[page.index("<h2>Criteria") :]
    assert criteria.count(">speed of the blow<") == 2 and "(4 m/s), does not hold" in criteria


def test_a_criterion_asked_for_in_one_run_is_compared_with_the_same_in_the_other(client):
    spec = example("pin-profile", Mode.CHECK)
    page = compared(client, "checks/pin-profile", spec, {**spec, "limits": {"max_ring_stress_mpa": 100.0}})
    criteria = page[page.index("<h2>Criteria") : page.index("<h2>Results")]
    assert criteria.count(">hoop stress of the ring<") == 1
    assert "(at most 150 MPa)" in criteria and "(at most 100 MPa)" in criteria
    assert "not judged" not in criteria
    assert "small end (contact pressures), MPa" in page


def test_every_criterion_has_its_row_where_one_quantity_is_judged_twice():
    asked = {"name": "min_fatigue_safety", "label": "fatigue safety", "sense": "at_least"}
    basic = {**asked, "name": "fatigue_safety"}
    bound = {**basic, "name": "other", "sense": "at_most"}
    assert list(_pairs([asked, basic], [basic, bound])) == [(asked, None), (basic, basic), (None, bound)]
    assert list(_pairs([asked], [basic])) == [(asked, basic)] and list(_pairs([basic], [asked])) == [(basic, asked)]


def test_choices_are_worded_in_a_comparison_as_on_the_page_of_a_run(client):
    spec = example("flexible-rod", Mode.CHECK)
    thicker = {**spec, "dimensions": {**spec["dimensions"], "h_mm": 0.5}}
    a, b = (made(client, "checks/flexible-rod", each)["id"] for each in (spec, thicker))
    for page in (f"/runs/{a}", f"/runs/compare?a={a}&b={b}"):
        row = re.search(r"fibre that governs.*?</tr>", client.get(page).text, re.DOTALL)
        assert row and "inner, −h/2" in row[0], page


def test_runs_of_different_kinds_are_not_compared(client, pins):
    other = made(client, "checks/impact-linkage", example("impact-linkage", Mode.CHECK))
    assert client.get(f"/runs/compare?a={pins[0]['id']}&b={other['id']}").status_code == 422
    assert client.get(f"/runs/compare?a={pins[0]['id']}&b=none").status_code == 404
    alone = client.get(f"/runs/compare?a={pins[0]['id']}")
    assert f"/runs/compare?a={pins[0]['id']}&amp;b={pins[1]['id']}" in alone.text


def test_a_run_page_shows_inputs_and_active_constraints(client, design_request, monkeypatch):
    run = made(client, "designs/flexible-rod", design_request)
    page = client.get(f"/runs/{run['id']}").text
    assert page.index('class="verdict') < page.index("<h2>Pictures")
    sensitivity = {item["name"]: item["sensitivity"] for item in run["result"]["active_constraints"]}
    assert (
        f"The fatigue safety required</strong>: 1 % less saves {sensitivity['min_fatigue_safety']:.2g} % mass" in page
    )
    assert f"The greatest width allowed</strong>: 1 % more saves {-sensitivity['b_upper']:.2g} % mass" in page
    assert '<dt title="revolutions per second">Speed</dt><dd>50 Hz</dd>' in page
    for plot in run["links"]["plots"].values():
        picture = client.get(plot)
        assert picture.status_code == 200 and "@media screen and (prefers-color-scheme:dark)" in picture.text, plot

    # Redesign from stock sizes, compared with the unrestricted design.
    sent = {"sizes": "0.4 0,42 0.45", "width": "0.5", "length": "0,5"}
    # The form was shown in Russian; in English, chosen in another tab since, this is a list of two.
    russian = {"sizes": "0,45", "shown_in.metric": "ru"}
    answer = client.post(f"/runs/{run['id']}/stock", data=sent | russian, follow_redirects=False)
    assert answer.status_code == 303
    rounded = ended(client, f"/runs/{answer.headers['location'].rpartition('b=')[2]}")
    assert rounded["spec"]["stock_h_mm"] == [0.45]
    assert rounded["result"]["mass_g"] > run["result"]["mass_g"]
    more = 100.0 * (rounded["result"]["mass_g"] / run["result"]["mass_g"] - 1.0)
    assert f"{more:+.3g} %" in client.get(answer.headers["location"]).text
    # What is wrong is told at its field, with everything as entered.
    wrong = {"sizes": ["thick", "5", "", "1,400 0.5"], "width": ["1 furlong", "5000"]}
    for field, text in [(name, entry) for name in wrong for entry in wrong[name]]:
        again = client.post(f"/runs/{run['id']}/stock", data=sent | {field: text}, headers=HTML)
        assert again.status_code == 422 and f'id="stock-{field}-error">' in again.text, text
        assert f">{text}</textarea>" in again.text or f'value="{text}" aria-invalid="true"' in again.text
    again = client.post(f"/runs/{run['id']}/stock", data=sent | {"sizes": "0.4, 0.5 mm"}, follow_redirects=False)
    rounded = ended(client, f"/runs/{again.headers['location'].rpartition('b=')[2]}")
    assert rounded["spec"]["stock_h_mm"] == [0.4, 0.5]
    # The address of the page with messages is that of the run, for changes of language.
    assert client.get(f"/runs/{run['id']}/stock", follow_redirects=False).headers["location"] == f"/runs/{run['id']}"

    async def locked(*_given):
        raise StoreFault(FaultKind.BUSY)

    monkeypatch.setattr(Service, "submit_within", locked)
    again = client.post(f"/runs/{run['id']}/stock", data=sent, headers=HTML)
    assert again.status_code == 503 and again.headers["retry-after"] == "5"
    assert "the database is locked" in again.text and ">0.4 0,42 0.45</textarea>" in again.text


def test_a_comparison_says_why_a_run_failed(client):
    spec = example("flexible-rod", Mode.DESIGN)
    ids = [made(client, "checks/flexible-rod", example("flexible-rod", Mode.CHECK))["id"]]
    answer = client.post(
        "/api/v1/designs/flexible-rod", json={**spec, "stock_h_mm": [5.0]}, headers={"prefer": "respond-async"}
    )
    ids.append(ended(client, answer.headers["location"].removeprefix("/api/v1"))["id"])
    page = client.get(f"/runs/compare?a={ids[0]}&b={ids[1]}").text
    assert "<code>stock_h_mm</code> <span>has no thickness within the bounds" in page


def test_an_effect_is_switched_into_a_new_run(client, pins):
    at = f"/runs/{pins[0]['id']}/effects"
    answer = client.post(at, data={"name": "shear_deflection", "state": "off"}, follow_redirects=False)
    assert answer.status_code == 303
    run = client.get(f"/api/v1{answer.headers['location']}").json()
    assert run["spec"]["effects"] == {"include": [], "exclude": ["shear_deflection"]}
    assert {e["name"]: e["state"] for e in run["effects"]}["shear_deflection"] == "skipped"
    back = client.post(f"/runs/{run['id']}/effects", data={"name": "shear_deflection", "state": "on"})
    assert "active" in back.text
    assert client.post(at, data={"name": "no_such", "state": "on"}).status_code == 422
    assert client.post(at, data={"name": "shear_deflection", "state": "maybe"}).status_code == 422


@pytest.mark.parametrize(
    ("path", "spec", "switch", "marked"),
    [
        (
            "checks/impact-linkage",
            example("impact-linkage", Mode.CHECK, drive=None, effects="auto"),
            {"name": "impact_dynamics", "state": "on"},
            "drive",
        ),
        (
            "checks/pin-profile",
            example("pin-profile", Mode.CHECK, limits={"max_ovalization_um": 500.0}),
            {"name": "ovalization", "state": "off"},
            "limits.max_ovalization_um",
        ),
    ],
    ids=["data missing", "needed by a limit"],
)
def test_an_effect_that_cannot_be_switched_leads_to_the_form(client, path, spec, switch, marked):
    run = made(client, path, spec)
    before = client.get("/api/v1/runs").json()["items"][0]["id"]
    answer = client.post(f"/runs/{run['id']}/effects", data=switch, headers=HTML)
    assert answer.status_code == 422
    assert f'<a href="#{marked}">' in answer.text and 'id="the-form"' in answer.text
    assert client.get("/api/v1/runs").json()["items"][0]["id"] == before
    assert client.get(f"/runs/{run['id']}/effects").url.path == f"/runs/{run['id']}"


def test_no_thickness_to_round_to_is_told_as_a_count(client, design_request):
    run = made(client, "designs/flexible-rod", design_request)
    page = client.post(f"/runs/{run['id']}/stock", data={"sizes": " ", "width": "0.5", "length": "0.5"}).text
    assert "has too few values (allowed: no fewer than 1)" in page


def test_a_running_run_is_cancelled_once(client):
    study = {"spec": example("impact-linkage", Mode.DESIGN), "study_budget_s": 60.0}
    answer = client.post("/api/v1/accuracy/impact-linkage", json=study, headers={"prefer": "respond-async"})
    at = answer.headers["location"]
    cancelled = client.delete(at)
    assert cancelled.status_code == 200
    assert cancelled.json()["status"] == "cancelled"
    again = client.delete(at)
    assert again.status_code == 409
    assert "cancelled" in again.json()["detail"]
    # The worker is free again, and the cancelled status is not overwritten.
    made(client, "checks/pin-profile", example("pin-profile", Mode.CHECK, name="after the end of another"))
    assert client.get(at).json()["status"] == "cancelled"
    assert client.delete("/api/v1/runs/none").status_code == 404


def test_missing_resources_give_a_page_or_problem_details(client):
    page = client.get("/no/such/page", headers=HTML)
    assert page.status_code == 404
    assert "<h1>Not Found</h1>" in page.text and "There is no page at this address." in page.text
    assert "default-src 'self'" in page.headers["content-security-policy"]
    assert client.get("/no/such/page").headers["content-type"] == "application/problem+json"
    at_api = client.get("/api/v1/runs/none", headers=HTML)
    assert at_api.headers["content-type"] == "application/problem+json"


def test_an_internal_error_is_a_page(client, monkeypatch):
    async def broken(*_):
        raise RuntimeError("the disk is gone")

    monkeypatch.setattr(type(client.app.state.service.store), "list_runs", broken)
    page = client.get("/", headers=HTML)
    assert page.status_code == 500
    assert "<h1>Something went wrong</h1>" in page.text and "disk" not in page.text


def test_text_is_compressed_and_the_icon_is_there(client, pins):
    assert client.get("/runs", headers={"accept-encoding": "gzip"}).headers["content-encoding"] == "gzip"
    for refused in ("gzip;q=0", "br, GZIP; q=0.00, *;q=0"):
        assert "content-encoding" not in client.get("/runs", headers={"accept-encoding": refused}).headers
    icon = client.get("/static/favicon.svg")
    assert icon.headers["content-type"] == "image/svg+xml"
    assert 'href="/static/favicon.svg"' in client.get("/").text


def test_pages_load_no_third_party_assets(client, pins):
    for path in ("/", "/docs", "/runs", f"/runs/{pins[0]['id']}"):
        page = client.get(path)
        assert page.status_code == 200
        fetched = page.text.replace('xmlns="http://www.w3.org/2000/svg"', "")
        assert not [part for part in fetched.split('"') if part.startswith(("http:", "https:", "//"))], path
        assert "<style" not in page.text and " style=" not in page.text, path
    reference = client.get("/docs").text
    for path in client.get("/openapi.json").json()["paths"]:
        assert path in reference
    assert "mechanism.crank_radius_mm" in reference


def test_a_worst_instant_becomes_the_load_of_a_pin(client):
    run = made(client, "analyses/crank-dynamics", example("crank-dynamics", Mode.ANALYSIS))
    page = client.get(f"/runs/{run['id']}").text
    link = f"/designs/pin-profile?mode=design&amp;load_run={run['id']}&amp;instant=wrist_pin_load_max"
    assert link in page
    form = client.get(link.replace("&amp;", "&")).text
    assert run["id"] in form and "wrist_pin_load_max" in form


def test_animations_respect_reduced_motion(client):
    run = made(client, "checks/impact-linkage", example("impact-linkage", Mode.CHECK))
    at = run["links"]["plots"]["mechanism"]
    assert "<animate" in client.get(at).text
    assert "<animate" not in client.get(f"{at}?still=true").text
    assert f'srcset="{at}?language=en&amp;units=metric&amp;still=true"' in client.get(f"/runs/{run['id']}").text


def test_a_design_run_draws_its_result(client, design_request):
    run = client.post("/api/v1/designs/flexible-rod", json=design_request).json()
    page = client.get(f"/runs/{run['id']}").text
    drawing = page[page.index('<figure class="drawing"') : page.index("</figure>")]
    assert f"l {run['result']['dimensions']['l_mm']:.4g}" in drawing
    assert "≤" not in drawing


def test_inch_units_are_displayed(client, pins):
    run = pins[0]
    path = f"/runs/{run['id']}"
    metric = client.get(path).text
    chosen = client.get(f"/units/inch?back={path}", follow_redirects=False)
    assert chosen.status_code == 303 and chosen.headers["location"] == path
    assert chosen.cookies["units"] == "inch"
    client.cookies.clear()
    inch = {"cookie": "units=inch"}
    page = client.get(path, headers=inch).text
    asked = client.get(f"/designs/pin-profile?mode=check&from={run['id']}", headers=inch).text
    outer = run["spec"]["geometry"]["outer_diameter_mm"]
    assert f"<dd>{outer / 25.4:.6g} in</dd>" in page and f"<dd>{outer:.10g} mm</dd>" in metric
    criterion = next(item for item in run["verdict"]["criteria"] if item["unit"] == "MPa")
    assert f"{criterion['reached'] / 6.894757293168361e-3:.0f} psi" in page
    assert f"{criterion['reached']:.4g} MPa" in metric
    assert f"ø {outer / 25.4:.5g}" in page and "inches, to scale" in page
    assert f'value="{outer / 25.4:.12g}'[:17] in asked
    pictures = [html.unescape(address) for address in re.findall(r'<img src="([^"]+)"', page)]
    drawn = "".join(client.get(address).text for address in pictures)
    assert (
        "stress, psi<" in drawn
        and "x, in<" in drawn
        and f">{run['result']['profile'][-1]['x_mm'] / 25.4:.5g}<" in drawn
    )
    assert not re.search(r"\b(mm|MPa|µm)<", drawn)
    assert client.get(f"/api/v1{path}").json()["spec"]["geometry"]["outer_diameter_mm"] == outer
    assert client.get("/units/cubits").status_code == 404
    assert client.get("/units/inch?back=//elsewhere", follow_redirects=False).headers["location"] == "/"
    client.cookies.clear()


def test_figures_and_their_units_are_of_one_system(client):
    """Whatever pages were rendered before."""
    run = made(client, "checks/pin-profile", example("pin-profile", Mode.CHECK))
    length = run["result"]["profile"][-1]["x_mm"]
    for chosen, unit, size in (("metric", "mm", 1.0), ("inch", "in", 25.4), ("metric", "mm", 1.0)):
        page = client.get(f"/runs/{run['id']}", headers={"cookie": f"units={chosen}"}).text
        assert f'<th scope="col">x, {unit}</th>' in page
        assert f'<th scope="row">{length / size:.5g}</th>' in page


def test_pin_sensitivities_are_loaded_after_the_page(client):
    """A bore of one diameter under bending alone: (d/D)^4 = 1 - W/sigma, and the mass scales with 1 - (d/D)^2."""
    request = example("pin-profile", Mode.DESIGN, criterion="fibre", form={"kind": "constant"}, limits={})
    run = made(client, "designs/pin-profile", request)
    assert f'data-worth="/runs/{run["id"]}/worth"' in client.get(f"/runs/{run['id']}").text
    squared = (run["result"]["bore_mid_mm"] / request["geometry"]["outer_diameter_mm"]) ** 2
    used = 1.0 - squared**2
    looser = (1.0 - math.sqrt(1.0 - used / 1.01)) / (1.0 - squared)
    share = -math.log(looser) / math.log(1.01)
    told = client.get(f"/runs/{run['id']}/worth").text
    assert f"Equivalent stress of bending and shear allowed</strong>: 1 % more saves {share:.2g} % mass" in told


def test_a_criterion_that_fails_was_no_limit_of_the_design(client):
    run = made(client, "designs/pin-profile", example("pin-profile", Mode.DESIGN, limits={"min_wall_mm": 2.0}))
    ring = next(c for c in run["verdict"]["criteria"] if c["name"] == "ovalization_stress_max_mpa")
    assert not ring["holds"]
    named = [item["name"] for item in sentences(run)]
    assert named == ["equivalent stress of bending and shear", "wall at its thinnest"]


def test_linkage_sensitivities(client):
    """All lengths scale with the minimum link, and so does the enclosing pipe."""
    title = "the least pipe around it"
    run = made(client, "designs/impact-linkage", KINDS["impact-linkage"].others(Mode.DESIGN)[title])
    assert run["result"]["active_limits"] == ["min_link_mm"]
    told = client.get(f"/runs/{run['id']}/worth").text
    share = float(re.search(r"Shortest link required</strong>: 1 % less saves ([\d.]+) % enclosing radius", told)[1])
    assert 0.0 < share <= 1.0


def test_the_page_of_a_run_from_before_answers_said_whether_their_accuracy_was_met(client, pins) -> None:
    store = client.app.state.service.store
    record = client.portal.call(store.get, pins[0]["id"])
    told = {name: value for name, value in json.loads(record.accuracy).items() if name != "met"}
    run = replace(record, id=new_run_id(), accuracy=json.dumps(told).encode(), name="Before verdicts", verdict=None)
    client.portal.call(store.put, run, None)
    assert '<strong class="yes">met</strong>' in client.get(f"/runs/{run.id}", headers=HTML).text
    assert "accuracy not met" not in client.get("/runs?text=Before verdicts", headers=HTML).text
