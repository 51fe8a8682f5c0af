"""Pages of batches: submission by file or form, progress, map, cancellation."""

from __future__ import annotations

import html
import io
import json
import re
import time

import pyarrow
import pyarrow.parquet
import pytest
from starlette.testclient import TestClient

from app.batches.fields import numbers
from app.batches.service import BatchService
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.faults import FaultKind, StoreFault
from app.web import batch_pages
from app.web.batch_pages import _field_words, _value_words
from app.words.languages import speaking

SWEEP = {
    "kind": "pin-profile", "mode": "check", "field0": "load.force_n", "from0": "3000", "to0": "9000", "steps0": "4",
    "field1": "geometry.gap_mm", "from1": "1,0", "to1": "2", "steps1": "2", "combine": "grid", "name": "a <b> sweep",
}  # fmt: skip


def settled(client: TestClient, place: str) -> str:
    end = time.monotonic() + 60
    while "data-events" in (text := client.get(place).text):
        assert time.monotonic() < end
        assert '<noscript><meta http-equiv="refresh"' in text, "without scripts the page is loaded again"
        time.sleep(0.1)
    assert 'http-equiv="refresh"' not in text
    return text


def test_a_sweep_is_submitted_followed_and_mapped(client: TestClient) -> None:
    answer = client.post("/batches/sweep", data=SWEEP, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    place = answer.headers["location"]
    text = settled(client, place)
    assert "a &lt;b&gt; sweep" in text and "8</span> / 8" in text
    assert (
        json.loads(html.unescape(re.search(r'data-count="status" data-words="([^"]+)"', text)[1]))["ended"] == "ended"
    )
    told = client.get(f"{place}/map", params={"x": "load.force_n", "y": "mass_g", "colour": "holds"}).json()
    assert told["varied"] == ["load.force_n", "geometry.gap_mm"] and "deflection_um" in told["results"]
    assert [point[-3] for point in told["points"]] == [3000, 3000, 5000, 5000, 7000, 7000, 9000, 9000]
    assert client.get(f"/runs/{told['points'][0][1]}").status_code == 200
    batch_id = place.removeprefix("/batches/")
    listed = client.get("/runs", params={"batch_id": batch_id}).text
    assert listed.count('<th scope="row">') == 8
    assert "a &lt;b&gt; sweep" in client.get("/batches").text


def test_the_next_page_keeps_what_is_chosen(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_pages, "_PAGE_SIZE", 1)
    for _ in range(2):
        assert client.post("/batches/sweep", data=SWEEP | {"steps0": "1"}, follow_redirects=False).status_code == 303
    text = client.get("/batches?kind=flexible-rod&mode=check").text
    following = client.get(html.unescape(re.search(r'href="([^"]+)" rel="next"', text)[1])).text
    assert '<option value="flexible-rod" selected>' in following and '<option value="check" selected>' in following


@pytest.mark.parametrize(("switch", "cookie"), [("language=uk", "language=uk"), ("units=inch", "units=inch")])
def test_a_sweep_survives_another_language_and_other_units(client: TestClient, switch: str, cookie: str) -> None:
    page = client.get("/batches?kind=pin-profile&mode=check").text
    buttons = [html.unescape(address) for address in re.findall(r'formaction="([^"]+)"', page)]
    (address,) = [address for address in buttons if address.endswith(switch)]
    typed = SWEEP | {"log1": "1", "combine": "zip", "samples": "many"}
    try:
        answer = client.post(address, data=typed)
    finally:
        client.cookies.clear()
    assert answer.status_code == 200 and cookie in answer.headers["set-cookie"]
    shown = dict(re.findall(r'name="(\w+)"[^>]* value="([^"]*)"', answer.text))
    assert {name: html.unescape(shown[name]) for name in typed if name not in ("log1", "combine")} == {
        name: text for name, text in typed.items() if name not in ("log1", "combine")
    }
    assert 'name="log1" value="1" checked' in answer.text and '<option value="zip" selected>' in answer.text


@pytest.mark.parametrize("place", ["/batches", "/designs/pin-profile", "/designs/crank-masses"])
def test_the_first_button_of_a_form_sends_it(client: TestClient, place: str) -> None:
    """Enter in a field presses it."""
    (first, *others) = re.findall(r'<button form="the-form"[^>]*>', client.get(place).text)
    assert "formaction" not in first and all("formaction" in other for other in others) and others


def test_many_varied_fields_are_requested_at_once(client: TestClient) -> None:
    more = {"steps0": "2", "field2": "geometry.boss_length_mm", "from2": "20", "to2": "24", "steps2": "2"}
    place = client.post("/batches/sweep", data=SWEEP | more, follow_redirects=False).headers["location"]
    assert 'id="beside"' in settled(client, place)
    fields = ["load.force_n", "geometry.gap_mm", "geometry.boss_length_mm", "mass_g"]
    told = client.get(f"{place}/map", params={"x": fields[0], "colour": "holds", "beside": ",".join(fields)}).json()
    assert told["varied"] == fields[:3] and told["fields"][-4:] == ["holds", *fields[1:]]
    assert len(told["points"]) == 8 and all(isinstance(value, float | int) for value in told["points"][0][-3:])


def test_items_without_an_answer_say_why(client: TestClient) -> None:
    """Those whose requirements cannot be met, and those that are no request."""
    example = KINDS["pin-profile"].example(Mode.DESIGN)
    lines = [
        json.dumps({**example, "load": load}) for load in ({"force_n": 1e6}, {"force_n": "much"}, {"force_n": 9e3})
    ]
    file = {"cases": ("night.ndjson", "\n".join(lines).encode(), "application/x-ndjson")}
    data = {"kind": "pin-profile", "mode": "design"}
    answer = client.post("/batches/upload", data=data, files=file, follow_redirects=False)
    place = answer.headers["location"]
    text = settled(client, place)
    rows = re.findall(r"</td><td>(\w+)</td><td><a href=\"(/runs/[^\"]+)\">(\d+)</a></td>", text)
    assert [(row[0], row[2]) for row in rows] == [("infeasible", "1"), ("refused", "2")]
    assert [client.get(row[1]).status_code for row in rows] == [200, 200]
    refused = client.get(rows[1][1]).text
    assert "<li><code>load.force_n</code>" in refused and "Accuracy and time" not in refused
    assert "<code>load.force_n</code>" in text and "Why there is no answer" not in text
    assert re.search(r"required 1000000 N, attainable beside the others \d+ N\.", text)
    results = f"/api/v1{place}/results"
    told = [json.loads(line) for line in client.get(results).text.splitlines()]
    assert told[0]["diagnosis"].startswith("force_n: required 1000000, attainable ") and told[0]["problem"] is None
    assert [row["diagnosis"] for row in told[1:]] == [None, None] and "/load/force_n" in told[1]["problem"]
    assert told[0]["diagnosis"] in client.get(results, params={"format": "csv", "status": "infeasible"}).text
    assert list(told[0])[-2:] == ["diagnosis", "problem"]


def test_a_map_begins_with_what_differs(client: TestClient) -> None:
    """The template of a table has a column for every field, most of which are left alone."""
    header, first = client.get("/batches/table?kind=pin-profile&mode=check").text.splitlines()
    table = "\n".join([header, *(first.replace("15000", str(force)) for force in (9000, 9000, 12000))])
    data = {"kind": "pin-profile", "mode": "check"}
    file = {"cases": ("cases.csv", table.encode(), "text/csv")}
    place = client.post("/batches/upload", data=data, files=file, follow_redirects=False).headers["location"]
    settled(client, place)
    told = client.get(f"{place}/map").json()
    assert told["varied"] == ["load.force_n"] and "geometry.gap_mm" in told["results"]


@pytest.mark.parametrize("code", ["en", "ru"])
def test_columns_keep_their_names_in_messages(client: TestClient, code: str) -> None:
    """A file's author has to write them."""
    file = {"cases": ("a.csv", b"load.forc_n,geometry.gap_mm\n1,2\n", "text/csv")}
    data = {"kind": "pin-profile", "mode": "check"}
    answer = client.post("/batches/upload", data=data, files=file, headers={"accept-language": code})
    assert answer.status_code == 422
    assert "<code>load.forc_n</code>" in answer.text
    assert "load.force_n?" in answer.text and "geometry.outer_diameter_mm" in answer.text


def test_a_table_in_another_encoding_is_told_so(client: TestClient) -> None:
    file = {"cases": ("a.csv", "load.force_n\n1\n".encode("utf-16"), "text/csv")}
    answer = client.post("/batches/upload", data={"kind": "pin-profile", "mode": "check"}, files=file)
    assert answer.status_code == 422 and "a table saved as CSV in UTF-8" in answer.text


def test_a_parquet_file_is_accepted(client: TestClient) -> None:
    example = KINDS["crank-masses"].example(Mode.ANALYSIS)
    cells = {name: [value] * 3 for name, value in example.items() if not isinstance(value, dict)}
    file = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(cells), file)
    for content, status in ((file.getvalue(), 303), (b"no parquet", 400)):
        answer = client.post(
            "/batches/upload",
            data={"kind": "crank-masses", "mode": "analysis"},
            files={"cases": ("night.parquet", content, "application/octet-stream")},
            follow_redirects=False,
        )
        assert answer.status_code == status, answer.text
        if status == 303:
            place = "/api/v1" + answer.headers["location"]
            settled(client, answer.headers["location"])
            assert client.get(place).json()["items"]["succeeded"] == 3


def test_the_csv_template_is_accepted(client: TestClient) -> None:
    for kind, mode in (("pin-profile", "check"), ("flexible-rod", "design"), ("crank-masses", "analysis")):
        table = client.get("/batches/table", params={"kind": kind, "mode": mode})
        answer = client.post(
            "/batches/upload",
            data={"kind": kind, "mode": mode},
            files={"cases": ("night.csv", table.content, "text/csv")},
            follow_redirects=False,
        )
        assert answer.status_code == 303, answer.text
        batch = client.get("/api/v1" + answer.headers["location"])
        settled(client, answer.headers["location"])
        assert client.get("/api/v1" + answer.headers["location"]).json()["items"]["refused"] == 0
        assert batch.json()["name"] == "night.csv"


@pytest.mark.parametrize(
    "change", [{"field0": "nonsense"}, {"steps0": "many"}, {"from0": "1,500"}, {"to0": "nan"}, {"kind": "x"}]
)
def test_an_invalid_form_reports_the_reason(client: TestClient, change: dict[str, str]) -> None:
    answer = client.post("/batches/sweep", data={**SWEEP, **change}, follow_redirects=False)
    if change == {"kind": "x"}:  # the first kind there is takes its place
        assert answer.status_code in (303, 422)
    else:
        assert answer.status_code == 422 and 'role="alert"' in answer.text


@pytest.mark.parametrize(
    ("change", "field", "label"),
    [
        ({"to0": "1x"}, "to0", "Field 1, To"),
        ({"steps0": "many"}, "steps0", "Field 1, Steps"),
        ({"from1": "1", "field1": "no_such_mm", "to1": "2", "steps1": "2"}, "field1", "Field 2"),
        ({"combine": "sobol", "samples": "few"}, "samples", "Number of samples, instead of steps"),
        ({"combine": "zip"}, "field0", "Field 1"),
        ({"field0": " ", "field1": ""}, "field0", "Field 1"),
        ({"field1": "load.force_n"}, "field0", "Field 1"),
        ({"run": "nothing"}, "run", "Run to vary, by its id; empty: the example"),
    ],
)
def test_a_wrong_entry_of_a_sweep_is_shown_at_its_field(
    client: TestClient, change: dict[str, str], field: str, label: str
) -> None:
    page = client.post("/batches/sweep", data={**SWEEP, **change}).text
    assert f'<a href="#{field}">{label}</a>' in page and "vary." not in page
    (shown,) = re.findall(rf'<input id="{field}"[^>]*>', page)
    assert 'aria-invalid="true"' in shown and f'aria-describedby="{field}-error"' in shown
    assert page.count("aria-invalid") == 1 and 'autofocus id="the-faults"' in page


def test_a_sweep_that_cannot_be_stored_now_is_shown_again(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    async def locked(*_given: object) -> bytes:
        raise StoreFault(FaultKind.BUSY)

    monkeypatch.setattr(BatchService, "take_sweep", locked)
    answer = client.post("/batches/sweep", data=SWEEP)
    assert answer.status_code == 503 and answer.headers["retry-after"] == "5"
    assert "the database is locked" in answer.text.lower() and 'value="load.force_n"' in answer.text


def test_a_sweep_is_told_what_would_be_accepted(client: TestClient) -> None:
    page = client.post("/batches/sweep", data={**SWEEP, "field0": "nothing"}).text
    assert "such as geometry.outer_diameter_mm" in page
    design = client.post("/api/v1/designs/pin-profile", json=KINDS["pin-profile"].example(Mode.DESIGN)).json()
    page = client.post("/batches/sweep", data={**SWEEP, "run": design["id"]}).text
    assert "is no run of this kind and mode" in page and f'value="{design["id"]}"' in page


def test_a_page_of_an_unknown_batch_says_so_in_the_language_of_the_page(client: TestClient) -> None:
    for language, title in (("en", "No such batch"), ("ru", "Нет такого пакета"), ("uk", "Немає такого пакета")):
        headers = {"Accept": "text/html", "Accept-Language": language}
        page = client.get("/batches/nothing", headers=headers)
        assert page.status_code == 404 and f"<h1>{title}</h1>" in page.text


def test_every_kind_has_variable_fields() -> None:
    for kind in KINDS.values():
        for mode in kind.jobs:
            assert len(numbers(kind.slug, mode)) > 2, (kind.slug, mode)


def test_an_axis_tells_what_was_asked_for_from_what_is_reached() -> None:
    told = {"varied": ["spec.impact_speed_m_s"], "results": ["impact_speed_m_s", "accuracy.estimated"], "points": []}
    words = _field_words(KINDS["impact-linkage"], "check", told)
    assert words["spec.impact_speed_m_s"] == "Speed of the tool at the blow (requested), m/s"
    assert (words["impact_speed_m_s"], words["accuracy.estimated"]) == ("impact speed, m/s", "estimated error")


def test_axes_of_the_map_are_named_as_in_the_form_and_in_its_language():
    point = [0, "id", "succeeded", True, "min_wall_mm"]
    told = {"varied": ["load.force_n"], "results": ["mass_g", "min_wall_mm"], "points": [point]}
    linkage = {"varied": [], "results": [], "points": [[*point[:4], "transmission_angle_deg.1"]]}
    words = _value_words(KINDS["impact-linkage"], linkage)
    assert words["transmission_angle_deg.1"] == "greatest transmission angle"
    with speaking("ru"):
        fields, values = _field_words(KINDS["pin-profile"], "check", told), _value_words(KINDS["pin-profile"], told)
    assert (fields["governed_by"], values["min_wall_mm"]) == ("что определяет", "наименьшая толщина стенки")
    assert fields["load.force_n"] == "Наибольшая сила на поршне, N"
    assert (fields["mass_g"], values["true"]) == ("масса, g", "да")
    # The criterion that governs may have the name of a result, whose axis has a unit.
    assert fields["min_wall_mm"].endswith(", mm")


def test_parts_of_a_quantity_have_its_name_and_unit_on_the_map():
    told = {"varied": [], "results": ["contact_pressures_mpa.small_end", "ring_stresses_mpa.inner_top"], "points": []}
    words = _field_words(KINDS["pin-profile"], "check", told)
    assert words["contact_pressures_mpa.small_end"] == "small end (contact pressures), MPa"
    assert words["ring_stresses_mpa.inner_top"] == "inside, under the load (ring stresses), MPa"
    steps = _field_words(KINDS["flexible-rod"], "design", {"varied": ["step_mm.b"], "results": [], "points": []})
    assert steps["step_mm.b"].endswith(", mm")


def test_results_of_one_name_are_told_apart_on_the_map():
    results = ["mean_torque_nm", "engine.mean_torque_nm", "engine.firing_interval_deg"]
    words = _field_words(KINDS["crank-dynamics"], "analysis", {"varied": [], "results": results, "points": []})
    assert words["mean_torque_nm"] == "mean torque, N·m"
    assert words["engine.mean_torque_nm"] == "mean torque (engine), N·m"
    assert "engine" not in words["engine.firing_interval_deg"]
