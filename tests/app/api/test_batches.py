"""Batches over HTTP: every form of input, every form of output, hostile rows, cancelling, repeating."""

from __future__ import annotations

import csv
import datetime
import decimal
import io
import json
import math
import time
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest
from starlette.testclient import TestClient

from app.batches import results
from app.batches.splitting import LONGEST_ROW
from app.batches.sweep import Sweep
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.batch_inputs import Row, Source, UnreadableRow

PIN = {k: v for k, v in KINDS["pin-profile"].example(Mode.CHECK).items() if k != "name"}
AT = "/api/v1/batches"
OF_PINS = AT + "?kind=pin-profile&mode=check&name=night"


def pin(force_n: float) -> dict[str, Any]:
    return {**PIN, "load": {"force_n": force_n}}


def submit(client: TestClient, body: Any, form: str = "application/x-ndjson", at: str = OF_PINS, **headers: str) -> Any:
    content = json.dumps(body) if isinstance(body, dict) else body
    return client.post(at, content=content, headers={"Content-Type": form, **headers})


def ended(client: TestClient, response: Any) -> dict[str, Any]:
    assert response.status_code == 202, response.text
    end = time.monotonic() + 120
    while (batch := client.get(response.headers["Location"]).json())["status"] not in ("ended", "cancelled"):
        assert time.monotonic() < end, batch
        time.sleep(0.1)
    return batch


def rows_of(client: TestClient, batch: dict[str, Any], query: str = "") -> list[dict[str, Any]]:
    return [json.loads(line) for line in client.get(batch["links"]["results"] + query).text.splitlines()]


def test_lines_of_json_become_items_and_items_are_runs(client: TestClient) -> None:
    forces = [4001.0, 5001.0, 4001.0]  # asked for by no other test
    body = "\n\n".join(json.dumps({**pin(f), "name": f"F {f}"}) for f in forces)
    response = submit(client, body)
    assert response.json()["items"] == {
        "total": 3, "done": 0, "succeeded": 0, "infeasible": 0, "failed": 0, "refused": 0, "cancelled": 0
    }  # fmt: skip
    batch = ended(client, response)
    assert (batch["items"]["succeeded"], batch["name"], batch["ended_at"] is None) == (3, "night", False)
    rows = rows_of(client, batch)
    assert [(row["index"], row["line"], row["name"], row["load.force_n"]) for row in rows] == list(
        zip(range(3), (1, 3, 5), [f"F {force}" for force in forces], forces, strict=True)
    )
    for row, force in zip(rows, forces, strict=True):
        run = client.get(f"/api/v1/runs/{row['run_id']}").json()
        single = client.post("/api/v1/checks/pin-profile", json=pin(force)).json()
        assert run["batch_id"] == batch["id"] and run["name"] == f"F {force}"
        assert {**run["spec"], "name": ""} == {**single["spec"], "name": ""}
        assert run["verdict"]["holds"] == row["holds"] == single["verdict"]["holds"]
        assert run["result"]["mass_g"] == row["mass_g"] == pytest.approx(single["result"]["mass_g"], rel=1e-12)
    # Of two equal ones, which may be in chunks of their own, one was solved.
    cached = [client.get(f"/api/v1/runs/{row['run_id']}").json()["cached"] for row in rows]
    assert sorted((cached[0], cached[2])) == [False, True] and not cached[1]
    # Its curves were not stored, and are made again for its pictures and its page.
    first = client.get(f"/api/v1/runs/{rows[0]['run_id']}").json()
    assert "profile" not in first["result"]
    assert first["links"]["plots"]
    for place in (first["links"]["page"], *first["links"]["plots"].values()):
        assert client.get(place).status_code == 200, place
    listed = client.get("/api/v1/runs", params={"batch_id": batch["id"], "order": "oldest"}).json()["items"]
    assert [run["id"] for run in listed] == [row["run_id"] for row in rows]


def test_filters_and_orders_of_items_go_together(client: TestClient) -> None:
    bores = [10.0 + 0.01 * k for k in range(300)]
    named = ({**PIN, "bore_mm": bore, "name": "" if k % 10 else "needle"} for k, bore in enumerate(bores))
    batch = ended(client, submit(client, "\n".join(map(json.dumps, named))))
    for order in ("newest", "oldest", "least", "greatest"):
        for wanted in ({"name": "needle"}, {"text": "need", "status": "succeeded"}):
            asked = {"batch_id": batch["id"], "order": order, "limit": 20, **wanted}
            first = client.get("/api/v1/runs", params=asked).json()
            rest = client.get("/api/v1/runs", params={**asked, "cursor": first["next_cursor"]}).json()
            items = [*first["items"], *rest["items"]]
            assert ({run["name"] for run in items}, len(items), rest["next_cursor"]) == ({"needle"}, 30, None)


def test_items_have_no_order_by_name(client: TestClient) -> None:
    batch = ended(client, submit(client, json.dumps(pin(4321.0)).encode()))
    asked = {"batch_id": batch["id"], "order": "name"}
    answer = client.get("/api/v1/runs", params=asked)
    assert (answer.status_code, [error["pointer"] for error in answer.json()["errors"]]) == (422, ["/order"])
    assert client.get("/runs", params=asked).text.count("is no order of the items of a batch") == 1


def test_names_of_refused_rows_are_cleaned(client: TestClient) -> None:
    body = {**PIN, "bore_mm": 30.0, "name": "a\u202egnp\x1b[31m\0"}
    batch = ended(client, submit(client, json.dumps(body).encode()))
    [run] = client.get("/api/v1/runs", params={"batch_id": batch["id"]}).json()["items"]
    assert run["name"] == client.get(f"/api/v1/runs/{run['id']}").json()["spec"]["name"] == "agnp[31m"


HOSTILE = [
    (b'{"load": {"force_n": NaN}}', "NaN"),
    (b'{"load": 1e400}', "/load"),
    (b"[1, 2]", "no JSON object"),
    (b'"' + b"x" * 1000 + b'"', "no JSON object"),
    (b"\xff\xfe{}", "UTF-8"),
    (b"[" * 5000, ""),
    (b'{"a": 1, "a": 2}', "/a appears more than once"),
    (b'{"load": {"force_n": 1, "force_n": 2}}', "/load/force_n appears more than once"),
    (b'{"\\ud800": 1, "\\ud800": 2}', "more than once"),
    (b'{"name": "\\ud800"}', ""),
    (b'{"name": "' + b"y" * (LONGEST_ROW + 10) + b'"}', "longer"),
    (b"\x00\x00", "JSON"),
    (b'{"__proto__": {}, "geometry": []}', "/geometry"),
    (json.dumps({**pin(4000.0), "accuracy": True}).encode(), "/accuracy"),
]


def test_an_invalid_row_is_refused_alone(client: TestClient) -> None:
    good = json.dumps(pin(4321.0)).encode()
    body = b"\n".join([good, *(row for row, _ in HOSTILE), good])
    batch = ended(client, submit(client, body))
    assert (batch["items"]["succeeded"], batch["items"]["refused"]) == (2, len(HOSTILE))
    refused = rows_of(client, batch, "?status=refused")
    assert [row["line"] for row in refused] == list(range(2, 2 + len(HOSTILE)))
    for row, (sent, word) in zip(refused, HOSTILE, strict=True):
        assert word in row["problem"], sent[:60]
        run = client.get(f"/api/v1/runs/{row['run_id']}").json()
        assert (run["status"], run["problem"]["status"], run["result"]) == ("failed", 422, None)
        assert client.get(f"/runs/{row['run_id']}").status_code == 200


@pytest.mark.parametrize(("slug", "mode"), [(slug, mode) for slug, kind in KINDS.items() for mode in kind.jobs])
def test_an_item_is_a_run_like_one_of_its_own(client: TestClient, slug: str, mode: Mode) -> None:
    """Stored without its curves, it has the same plots, exports and page."""
    body = {**KINDS[slug].example(mode), "name": "an item"}
    own = {Mode.DESIGN: "designs", Mode.CHECK: "checks", Mode.ANALYSIS: "analyses"}[mode]
    alone = client.post(f"/api/v1/{own}/{slug}", json=body).json()
    batch = ended(client, submit(client, json.dumps(body).encode(), at=f"{AT}?kind={slug}&mode={mode}"))
    [row] = rows_of(client, batch)
    answer = client.get(f"/api/v1/runs/{row['run_id']}")
    assert answer.status_code == 200
    item = answer.json()
    assert (item["status"], item["verdict"]) == (alone["status"], alone["verdict"])
    for kind in ("plots", "exports"):
        assert list(item["links"][kind]) == list(alone["links"][kind])
    for name in ("csv", *({"svg", "dxf", "parameters"} & set(item["links"]["exports"]))):
        assert client.get(item["links"]["exports"][name]).status_code in (200, 202)
    for path in (item["links"]["page"], f"/runs/compare?a={item['id']}&b={alone['id']}"):
        assert client.get(path).status_code == 200


def test_the_front_of_an_item_is_stored_and_drawn(client: TestClient) -> None:
    """Made again, every point would be a design."""
    body = {**KINDS["impact-linkage"].example(Mode.DESIGN), "front": {"against": "longest_link", "points": 3}}
    batch = ended(client, submit(client, json.dumps(body).encode(), at=f"{AT}?kind=impact-linkage&mode=design"))
    [row] = rows_of(client, batch)
    item = client.get(f"/api/v1/runs/{row['run_id']}").json()
    assert len(item["result"]["front"]["points"]) == 3 and "transfer" not in item["result"]
    assert client.get(item["links"]["plots"]["front"]).status_code == 200


def test_csv_in_and_out(client: TestClient) -> None:
    text = io.StringIO()
    names = ["name", "load.force_n", *_dotted(PIN, skip="load")]
    table = csv.writer(text)
    table.writerow(names)
    cells = list(_dotted(PIN, skip="load").values())
    table.writerow(['a "pin",\nin two lines', "4500", *cells])
    table.writerow(["007", "1e4", *cells])
    table.writerow(["=cmd|x", "-5", *cells])
    table.writerow(["short", "4500"])
    batch = ended(client, submit(client, text.getvalue().encode(), "text/csv"))
    assert (batch["items"]["succeeded"], batch["items"]["refused"]) == (2, 2)
    found = list(csv.DictReader(io.StringIO(client.get(batch["links"]["results"] + "?format=csv").text)))
    assert [row["line"] for row in found] == ["2", "4", "5", "6"]
    assert [row["name"] for row in found[:3]] == ['a "pin", in two lines', "007", "'=cmd|x"]
    assert "/load/force_n" in found[2]["problem"] and "cells" in found[3]["problem"]
    lines = rows_of(client, batch)
    for row, line in zip(found, lines, strict=True):
        for name in ("mass_g", "deflection_um"):
            assert (float(row[name]) if row[name] else None) == line.get(name)
    chosen = client.get(batch["links"]["results"] + "?format=csv&fields=index,mass_g&status=succeeded").text
    assert chosen.splitlines() == ["index,mass_g", *(f"{row['index']},{row['mass_g']!r}" for row in lines[:2])]


@pytest.mark.parametrize(
    ("query", "pointer", "detail"),
    [
        ("fields=mass", "/fields", "has mass, which is no column; did you mean mass_g?"),
        ("fields=result.mass_g", "/fields", "has result.mass_g, which is no column; did you mean mass_g?"),
        ("fields=mass_g,verdict.summary", "/fields", "has verdict.summary, which is no column"),
        ("fields=profile." + 5000 * "9", "/fields", "has profile." + 92 * "9" + ", which is no column"),
        ("fields=profile.²", "/fields", "has profile.², which is no column; did you mean profile?"),
        ("status=suceeded", "/status", "has suceeded, which is no status; did you mean succeeded?"),
        ("field=mass_g", "/field", "is no parameter of this address; did you mean fields?"),
    ],
)
def test_a_column_that_no_batch_has_is_refused(client: TestClient, query: str, pointer: str, detail: str) -> None:
    batch = ended(client, submit(client, json.dumps(pin(4321.0)).encode()))
    answer = client.get(f"{batch['links']['results']}?{query}")
    assert answer.status_code == 422
    assert [(error["pointer"], error["detail"]) for error in answer.json()["errors"]] == [(pointer, detail)]


LINKAGE = b"""\
lengths_mm.base,lengths_mm.crank,lengths_mm.coupler,lengths_mm.rocker,restitution,blow_frequency_hz,impact_speed_m_s
60,20,50,30,0.2,25,8
"""


def test_what_was_asked_for_and_what_is_reached_are_columns_of_their_own(client: TestClient) -> None:
    batch = ended(client, submit(client, LINKAGE, "text/csv", f"{AT}?kind=impact-linkage&mode=check"))
    [row] = rows_of(client, batch)
    run = client.get(f"/api/v1/runs/{row['run_id']}").json()
    reached = run["result"]["impact_speed_m_s"]
    assert reached == pytest.approx(3.8124, rel=1e-4)
    both = {"impact_speed_m_s": reached, "spec.impact_speed_m_s": 8}
    assert both.items() <= row.items() and row["restitution"] == 0.2 and "spec.restitution" not in row
    assert (row["lengths_mm.base"], row["spec.lengths_mm.base"]) == (run["result"]["lengths_mm"]["base"], 60)
    assert rows_of(client, batch, "?fields=impact_speed_m_s,spec.impact_speed_m_s,spec.restitution") == [
        {**both, "spec.restitution": 0.2}
    ]
    place = batch["links"]["results"] + "?format="
    [of_csv] = csv.DictReader(io.StringIO(client.get(place + "csv").text))
    [of_parquet] = pyarrow.parquet.read_table(io.BytesIO(client.get(place + "parquet").content)).to_pylist()
    assert {name: float(of_csv[name]) for name in both} == {name: of_parquet[name] for name in both} == both
    told = client.get(f"{batch['links']['page']}/map?x=spec.impact_speed_m_s&y=impact_speed_m_s").json()
    assert told["points"][0][-2:] == [8, reached]
    assert "spec.impact_speed_m_s" in told["varied"] and "impact_speed_m_s" in told["results"]


def test_objects_and_arrays_of_a_result_are_json_text(client: TestClient) -> None:
    batch = ended(client, submit(client, LINKAGE, "text/csv", f"{AT}?kind=impact-linkage&mode=check"))
    [row] = rows_of(client, batch, "?fields=run_id,warnings,lengths_mm,ratios.lambda0")
    result = client.get(f"/api/v1/runs/{row['run_id']}").json()["result"]
    assert result["warnings"] and json.loads(row["warnings"]) == result["warnings"]
    assert json.loads(row["lengths_mm"]) == result["lengths_mm"]
    answer = client.get(batch["links"]["results"] + "?fields=transfer")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["detail"] == "has transfer, which is stored only with detail=full"


def test_a_table_shows_whether_the_accuracy_was_met(client: TestClient) -> None:
    bad = {**PIN, "bore_mm": -1.0}
    batch = ended(client, submit(client, "\n".join(map(json.dumps, (pin(4321.0), bad)))))
    good, refused = rows_of(client, batch)
    accuracy = client.get(f"/api/v1/runs/{good['run_id']}").json()["accuracy"]
    told = {"accuracy.met": accuracy["met"], "accuracy.estimated": accuracy["estimated"]}
    assert told.items() <= good.items() and refused["accuracy.met"] is None
    assert rows_of(client, batch, "?status=succeeded&fields=accuracy.met,accuracy.estimated,accuracy") == [
        {**told, "accuracy": accuracy["requested"]}
    ]


def test_every_column_can_be_asked_for(client: TestClient) -> None:
    batch = ended(client, submit(client, json.dumps(pin(4321.0)).encode()))
    [row] = rows_of(client, batch)
    names = [*row, "geometry.gap_mm", "material.density_kg_m3"]
    [chosen] = rows_of(client, batch, "?fields=" + ",".join(names))
    assert chosen == {**row, "geometry.gap_mm": PIN["geometry"]["gap_mm"], "material.density_kg_m3": 7850}


def test_numbers_of_a_table_as_programs_write_them() -> None:
    source = Source("csv", ("name", "load.force_n"), frozenset({"name"}))

    def force(cell: str) -> Any:
        return source.body(Row(1, f"05,{cell}".encode()))["load"]["force_n"]

    assert [force(cell) for cell in ("15000.", ".5", "05", "+1.e3", " 2 ")] == [15000.0, 0.5, 5.0, 1000.0, 2.0]
    assert [force(cell) for cell in ("1_000", "0x10", "1 000", "5 N", "NaN", ".")] == [
        "1_000", "0x10", "1 000", "5 N", "NaN", "."
    ]  # fmt: skip
    assert source.body(Row(1, b"05,"))["name"] == "05"


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_a_table_of_a_spreadsheet_with_decimal_commas(client: TestClient, delimiter: str) -> None:
    fields = {"name": "1,5", "load.force_n": "4500,5", **_dotted(PIN, skip="load"), "material.poisson": ",3"}
    cells = ("" if cell is None else str(cell).replace(".", ",") for cell in fields.values())
    lines = "\ufeff" + delimiter.join(fields) + "\r\n" + delimiter.join(cells)
    batch = ended(client, submit(client, lines.encode(), "text/csv"))
    [row] = rows_of(client, batch)
    spec = client.get(f"/api/v1/runs/{row['run_id']}").json()["spec"]
    assert (row["status"], spec["name"], spec["load"]["force_n"]) == ("succeeded", "1,5", 4500.5)


def test_a_faulty_row_of_csv_is_refused_alone(client: TestClient) -> None:
    given = {name: str(value) for name, value in _dotted(PIN).items() if value is not None}
    names, cells = ",".join(given), ",".join(given.values())
    rows = ["name," + names, "first," + cells, '"second,' + cells, "third," + cells, "Bügel," + cells, "few"]
    batch = ended(client, submit(client, "\r".join(rows).encode("latin-1"), "text/csv"))
    assert (batch["items"]["succeeded"], batch["items"]["refused"]) == (2, 3)
    problems = [row["problem"].partition(": ")[2] for row in rows_of(client, batch) if row["problem"]]
    assert problems == [
        "/ has a quotation mark at the start of a cell that is not closed (allowed: a table saved as CSV in UTF-8)",
        "/ is no UTF-8 (allowed: a table saved as CSV in UTF-8)",
        f"/ has 1 cells where the header has {len(given) + 1} (allowed: a cell for each column)",
    ]


@pytest.mark.parametrize(
    ("header", "detail", "allowed"),
    [
        ("", "has no header", "a first line of dotted field names"),
        (" , \n", "has no header", "a first line of dotted field names"),
        ('"name,bore_mm\na,1\n', "has a quotation mark at the start of a cell that is not closed", "a table saved as"),
        ("Länge\n1\n", "is no UTF-8", "a table saved as CSV in UTF-8"),
        (LONGEST_ROW * "x" + "\n1", "is longer than 1000000 bytes", "a table saved as CSV"),
    ],
)
def test_a_header_that_cannot_be_read_says_why(client: TestClient, header: str, detail: str, allowed: str) -> None:
    answer = submit(client, header.encode("latin-1"), "text/csv")
    [error] = answer.json()["errors"]
    assert (answer.status_code, error["detail"]) == (422, detail) and error["allowed"].startswith(allowed)


def test_null_in_a_sweep_replaces_what_its_base_has(client: TestClient) -> None:
    base = {**PIN, "limits": {"min_wall_mm": 3.0}}
    asked = sweep(base=base, vary={"limits.min_wall_mm": {"values": [None, 3.0, 4.0]}})
    rows = rows_of(client, ended(client, submit(client, asked, "application/json", AT)))
    specs = [client.get(f"/api/v1/runs/{row['run_id']}").json()["spec"] for row in rows]
    assert [spec["limits"]["min_wall_mm"] for spec in specs] == [None, 3.0, 4.0]
    assert [row["limits.min_wall_mm"] for row in rows] == [None, 3.0, 4.0]


@pytest.mark.parametrize(
    "text",
    ['{"a":1,"a":1}', '{"a":1,"a" :2}', '{"b":{"a":"x","a":"x"}}', '[{"a":[1,{"b":null,"b":null}]}]', '{"":1,"":2}'],
)
def test_a_name_that_appears_twice_is_refused(text: str) -> None:
    body = '{"outer":' + text + ',"other":"a: \\" {"}'
    for row in (body, body.replace('\\"', "")):
        with pytest.raises(UnreadableRow, match="more than once"):
            Source("ndjson").body(Row(1, row.encode()))


def test_columns_that_are_no_fields_get_a_suggestion(client: TestClient) -> None:
    answer = submit(client, b"force_n,outer_diameter_mm [mm]\n1,2\n", "text/csv")
    assert [error["detail"].partition("; ")[2] for error in answer.json()["errors"]] == [
        "did you mean load.force_n?", "did you mean geometry.outer_diameter_mm?"
    ]  # fmt: skip


def test_parquet_of_rows_with_wrong_types(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "_SAMPLE_SIZE", 1)  # the sample does not see every row
    names = {**_dotted(PIN), "load.force_n": None}
    text = io.StringIO()
    table = csv.DictWriter(text, names)
    table.writeheader()
    forces = ["4000", "12 kN", "true", "[1]", "5000.5", "1" + 400 * "0", "6000"]
    table.writerows({**_dotted(PIN), "load.force_n": force} for force in forces)
    batch = ended(client, submit(client, text.getvalue().encode(), "text/csv"))
    answer = client.get(batch["links"]["results"] + "?format=parquet")
    found = pyarrow.parquet.read_table(io.BytesIO(answer.content))
    assert found.schema.field("load.force_n").type == pyarrow.float64()
    assert found.column("load.force_n").to_pylist() == [4000.0, None, None, None, 5000.5, None, 6000.0]
    assert found.column("status").to_pylist().count("refused") == 4


def _dotted(value: Any, prefix: str = "", skip: str = "") -> dict[str, Any]:
    found = {}
    for name, inner in value.items():
        if isinstance(inner, dict):
            found |= _dotted(inner, f"{prefix}{name}.") if name != skip else {}
        elif name != skip:
            found[f"{prefix}{name}"] = json.dumps(inner) if isinstance(inner, list) else inner
    return found


def test_parquet_in_and_out(client: TestClient) -> None:
    flat = _dotted(PIN)
    table = pyarrow.Table.from_pylist([{**flat, "load.force_n": f} for f in (4000.0, 6000.0, math.nan)])
    file = io.BytesIO()
    pyarrow.parquet.write_table(table, file)
    batch = ended(client, submit(client, file.getvalue(), "application/vnd.apache.parquet"))
    assert (batch["items"]["succeeded"], batch["items"]["refused"]) == (2, 1)
    answer = client.get(batch["links"]["results"] + "?format=parquet")
    found = pyarrow.parquet.read_table(io.BytesIO(answer.content)).to_pylist()
    lines = rows_of(client, batch)
    assert [row["mass_g"] for row in found] == [row.get("mass_g") for row in lines]
    assert [row["load.force_n"] for row in found[:2]] == [4000.0, 6000.0]
    assert submit(client, b"PAR1 no", "application/vnd.apache.parquet").status_code == 400


def as_parquet(**columns: Any) -> bytes:
    """A file of two equal rows of the example, with the given columns."""
    flat = {name: [cell, cell] for name, cell in _dotted(PIN).items() if name not in columns}
    file = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table({**flat, **columns}), file)
    return file.getvalue()


@pytest.mark.parametrize("place", [30, 60, 200, 400, 800])
def test_a_damaged_parquet_file_is_refused(client: TestClient, place: int) -> None:
    content = bytearray(as_parquet(**{"load.force_n": [4000.0, 6000.0]}))
    content[place : place + 20] = bytes(each ^ 0xFF for each in content[place : place + 20])
    answer = submit(client, bytes(content), "application/vnd.apache.parquet")
    assert (answer.status_code, answer.json()["title"]) == (400, "No Parquet")


@pytest.mark.parametrize(
    ("cell", "detail"),
    [
        (math.nan, "/load/force_n"),
        (-math.inf, "/load/force_n"),
        (datetime.date(2026, 1, 31), "/load/force_n"),
        (datetime.timedelta(1), "/load/force_n"),
        (b"\xff\xfe", "/load/force_n"),
    ],
)
def test_a_cell_of_parquet_that_is_no_number_is_refused_at_its_field(
    client: TestClient, cell: Any, detail: str
) -> None:
    body = as_parquet(**{"load.force_n": [cell, cell]})
    rows = rows_of(client, ended(client, submit(client, body, "application/vnd.apache.parquet")))
    assert [row["status"] for row in rows] == 2 * ["refused"]
    assert all(detail in row["problem"] for row in rows)


def test_a_decimal_of_parquet_is_a_number(client: TestClient) -> None:
    forces = [decimal.Decimal("4000.5"), decimal.Decimal("6000.0")]
    body = as_parquet(**{"load.force_n": forces, "name": [b"a", "ä".encode()]})
    rows = rows_of(client, ended(client, submit(client, body, "application/vnd.apache.parquet")))
    assert [(row["load.force_n"], row["name"]) for row in rows] == [(4000.5, "a"), (6000.0, "ä")]


def sweep(**changes: Any) -> dict[str, Any]:
    vary = {
        "load.force_n": {"from": 2000.0, "to": 8000.0, "steps": 3},
        "criterion": {"values": ["fibre", "tresca_paper"]},
    }
    return {"kind": "pin-profile", "mode": "check", "base": PIN, "vary": vary, **changes}


def test_a_sweep_is_expanded_here(client: TestClient) -> None:
    batch = ended(client, submit(client, sweep(), "application/json", AT))
    rows = rows_of(client, batch)
    assert [(row["load.force_n"], row["criterion"]) for row in rows] == [
        (force, word) for force in (2000.0, 5000.0, 8000.0) for word in ("fibre", "tresca_paper")
    ]
    assert batch["items"]["succeeded"] == 6 and rows[0]["line"] is None


def test_samples_fill_the_space_and_repeat() -> None:
    ends = {"from": 1.0, "to": 100.0}
    for combine in ("sobol", "latin_hypercube"):
        asked = Sweep.model_validate(
            sweep(vary={"load.force_n": {**ends, "scale": "log"}, "x": ends}, combine=combine, samples=64, seed=3)
        )
        assert asked.contradictions() == []
        points = [json.loads(row.content) for row in asked.rows()]
        assert points == [json.loads(row.content) for row in asked.rows()]
        # One point in each of 64 equal parts of either side.
        assert sorted(int(64 * math.log(x, 100.0)) for x, _ in points) == list(range(64))
        assert sorted(int(64 * (y - 1) / 99) for _, y in points) == list(range(64))
    zipped = Sweep.model_validate(sweep(vary={"a": {"values": [1, 2]}, "b": {**ends, "steps": 2}}, combine="zip"))
    assert [json.loads(row.content) for row in zipped.rows()] == [[1, 1.0], [2, 100.0]]


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vary": {"load.force": {"values": [1]}}}, "/vary/load.force"),
        ({"vary": {"load.force_n": {"values": [1], "to": 2.0}}}, "/vary/load.force_n"),
        ({"vary": {"load.force_n": {"from": 0.0, "to": 2.0, "steps": 3, "scale": "log"}}}, "/vary/load.force_n"),
        ({"combine": "sobol"}, "/samples"),
        ({"vary": {"load.force_n": {"from": 0.0, "to": 1.0}}}, "/vary/load.force_n/steps"),
        ({"vary": {"load.force_n": {"values": [1]}, "load": {"values": [{"force_n": 2}]}}}, "/vary/load.force_n"),
        ({"kind": "pin"}, "/kind"),
        ({"mode": "analysis"}, "/mode"),
        ({"combine": "zip"}, "/vary"),
        ({"vary": {}}, "/vary"),
    ],
)
def test_an_invalid_sweep_is_refused(client: TestClient, changes: dict[str, Any], pointer: str) -> None:
    refusal = submit(client, sweep(**changes), "application/json", AT)
    assert refusal.status_code == 422
    assert pointer in [each["pointer"] for each in refusal.json()["errors"]]


def test_an_invalid_body_is_refused(client: TestClient) -> None:
    assert submit(client, b"", "text/plain").status_code == 415
    assert submit(client, b"\n\n").status_code == 422
    assert submit(client, b"nonsense\n1", "text/csv").json()["errors"][0]["pointer"] == "/nonsense"
    assert submit(client, b"name,name\n1,2", "text/csv").status_code == 422
    overlapping = submit(client, b"load.force_n,load\n1,{}", "text/csv").json()["errors"][0]
    assert (overlapping["pointer"], overlapping["detail"]) == ("/load.force_n", "is a part of the column load")
    big = sweep(vary={"load.force_n": {"from": 1.0, "to": 2.0, "steps": 1_000_000}, "x": {"values": [1] * 100}})
    assert submit(client, big, "application/json", AT).status_code in (413, 422)
    assert client.get(f"{AT}/nothing").status_code == 404
    assert client.get(f"{AT}/nothing/results").status_code == 404


def test_an_idempotency_key_is_honoured(client: TestClient) -> None:
    body = json.dumps(pin(7000.0))
    first = submit(client, body, **{"Idempotency-Key": "batch-1"})
    again = submit(client, body, **{"Idempotency-Key": "batch-1"})
    assert (again.status_code, again.content, again.headers["Location"]) == (
        202,
        first.content,
        first.headers["Location"],
    )
    assert submit(client, json.dumps(pin(7001.0)), **{"Idempotency-Key": "batch-1"}).status_code == 409
    asked = {"Idempotency-Key": "batch-2"}
    swept = [submit(client, sweep(), "application/json", AT, **asked) for _ in range(2)]
    assert swept[0].content == swept[1].content
    ended(client, first)


@pytest.mark.parametrize(
    ("own", "name", "detail"), [({}, "night", "full"), ({"name": "own", "detail": "scalars"}, "own", "scalars")]
)
def test_a_sweep_takes_name_and_detail_from_the_query_unless_it_has_its_own(
    client: TestClient, own: dict, name: str, detail: str
) -> None:
    body = {key: value for key, value in sweep().items() if key not in ("name", "detail")}
    batch = submit(client, {**body, **own}, "application/json", AT + "?name=night&detail=full").json()
    assert (batch["name"], batch["detail"]) == (name, detail)
    client.delete(batch["links"]["self"])


def test_a_sweeps_idempotency_key_stands_for_its_query_too(client: TestClient) -> None:
    places = AT, AT, AT + "?detail=full"
    answers = [submit(client, sweep(), "application/json", at, **{"Idempotency-Key": "swept"}) for at in places]
    assert [answer.status_code for answer in answers] == [202, 202, 409]
    client.delete(answers[0].json()["links"]["self"])


def test_a_lone_surrogate_is_refused_in_plain_words(client: TestClient) -> None:
    batch = ended(client, submit(client, json.dumps({**pin(7200.0), "name": "\ud800"})))
    (row,) = rows_of(client, batch)
    assert "/name is not valid Unicode (allowed: text of whole Unicode characters" in row["problem"]


@pytest.mark.parametrize("more", [{}, {"Prefer": "respond-async"}], ids=["now", "later"])
def test_a_batchs_idempotency_key_is_refused_to_a_single_request(client: TestClient, more: dict) -> None:
    keyed = {"Idempotency-Key": "batch-first"}
    first = submit(client, json.dumps(pin(7100.0)), **keyed)
    single = client.post("/api/v1/checks/pin-profile", json=pin(7101.0), headers={**keyed, **more})
    assert (single.status_code, single.json()["title"]) == (409, "The idempotency key is taken")
    assert submit(client, json.dumps(pin(7100.0)), **keyed).content == first.content
    ended(client, first)


def test_events_report_progress_and_the_end(client: TestClient) -> None:
    many = sweep(vary={"load.force_n": {"from": 2000.0, "to": 8000.0, "steps": 300}})
    batch = submit(client, many, "application/json", AT).json()
    with client.stream("GET", batch["links"]["events"]) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        told = [part.split("\n") for part in "".join(stream.iter_text()).strip().split("\n\n")]
    names = [lines[0].removeprefix("event: ") for lines in told]
    done = [json.loads(lines[1].removeprefix("data: "))["items"]["done"] for lines in told]
    assert names[-1] == "ended" and set(names[:-1]) <= {"progress"}
    assert done == sorted(done) and done[-1] == 300


def test_a_cancelled_batch_keeps_finished_items(client: TestClient) -> None:
    example = KINDS["flexible-rod"].example(Mode.DESIGN)
    vary = {"requirements.min_fatigue_safety": {"from": 1.0, "to": 1.5, "steps": 5000}}
    body = {"kind": "flexible-rod", "mode": "design", "base": example, "vary": vary}
    batch = submit(client, body, "application/json", AT).json()
    cancelled = client.delete(batch["links"]["self"])
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    items = cancelled.json()["items"]
    assert items["total"] == 5000
    assert items["done"] + items["cancelled"] == 5000 and items["cancelled"] > 4000
    assert client.delete(batch["links"]["self"]).status_code == 409
    last = client.get("/api/v1/runs", params={"batch_id": batch["id"], "limit": 1}).json()["items"][0]
    assert last["status"] == "cancelled"
    assert batch["id"] in [each["id"] for each in client.get(AT, params={"status": "cancelled"}).json()["items"]]
