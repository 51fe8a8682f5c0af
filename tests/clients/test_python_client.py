"""The Python client against the real service, and against an unreliable one."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from crankwright_client import AsyncClient, Client, NoAnswer, Problem, Retries, Run, RunFailed, wire
from starlette.testclient import TestClient

from app.designs.kind import Mode
from app.designs.registry import KINDS

ROOT = Path(__file__).parents[2]
QUICK = Retries(attempts=3, first_s=0.001, waiting_s=0.0)
BATCH = {"id": "1", "status": "running", "links": {"self": "/api/v1/batches/1", "results": "/api/v1/batches/1/results"}}
PIN = KINDS["pin-profile"].example(Mode.CHECK)


@pytest.fixture
def ours(client: TestClient) -> Client:
    return Client("http://testserver", transport=client._transport)


def answering(*answers: httpx.Response | Exception) -> tuple[httpx.MockTransport, list[httpx.Request]]:
    """A service that returns these responses in turn, and records requests."""
    left, asked = list(answers), []

    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        answer = left.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    return httpx.MockTransport(handle), asked


def run_json(status: str = "succeeded", **more: object) -> dict:
    return {"id": "1", "kind": "pin-profile", "mode": "check", "status": status, "holds": None, "problem": None, **more}


@pytest.mark.parametrize("mode", ["design", "check"])
@pytest.mark.parametrize("kind", ["flexible-rod", "pin-profile", "impact-linkage"])
def test_the_examples(ours, kind, mode):
    run = getattr(ours, mode)(kind, KINDS[kind].example(Mode(mode)))
    assert run.ended and run.holds is run.verdict["holds"]
    assert ours.run(run.id).result == run.result
    assert run.accuracy["met"]


def test_an_analysis_and_a_plot(ours):
    run = ours.analyse("crank-dynamics", KINDS["crank-dynamics"].example(Mode.ANALYSIS))
    assert run.verdict is None
    name = next(iter(run.links["plots"]))
    assert ours.plot(run, name).startswith(b"<")


def test_a_refusal_names_the_field(ours):
    with pytest.raises(Problem) as refused:
        ours.check("pin-profile", {**PIN, "load": {"force_n": -1}})
    assert refused.value.status == 422
    assert refused.value.errors[0]["pointer"] == "/load/force_n"
    assert "/load/force_n" in str(refused.value)


def test_an_infeasible_design_is_an_answer(ours):
    spec = KINDS["pin-profile"].example(Mode.DESIGN)
    run = ours.design("pin-profile", {**spec, "load": {"force_n": 1e6}})
    assert run.status == "infeasible" and run.result["diagnosis"]


def test_waiting_for_an_accepted_run(ours):
    run = ours.submit("designs", "pin-profile", KINDS["pin-profile"].example(Mode.DESIGN), later=True)
    assert run.status in ("queued", "running", "succeeded")
    seen = []
    assert ours.wait(run, timeout_s=60, progress=seen.append).status == "succeeded"


def test_the_same_key_is_the_same_run(ours):
    first, second = (ours.check("pin-profile", PIN, key="test: the same") for _ in range(2))
    assert first.id == second.id


def test_listings_go_through_all_pages(ours):
    made = {ours.check("pin-profile", {**PIN, "name": "sent by the client"}).id for _ in range(3)}
    assert {line["id"] for line in ours.runs(name="sent by the client", limit=2)} == made


def test_temporary_failures_are_retried_with_the_same_key():
    transport, asked = answering(
        httpx.ConnectError("no"),
        httpx.Response(503, headers={"Retry-After": "0"}),
        httpx.Response(201, json=run_json()),
    )
    with Client(transport=transport, retries=QUICK) as client:
        assert client.check("pin-profile", PIN).id == "1"
    assert len({request.headers["idempotency-key"] for request in asked}) == 1 and len(asked) == 3


@pytest.mark.parametrize("last", [httpx.ReadTimeout("late"), httpx.Response(503)])
def test_retries_are_limited(last):
    transport, asked = answering(httpx.Response(503), httpx.ConnectError("no"), last)
    with Client(transport=transport, retries=QUICK) as client, pytest.raises(NoAnswer, match="3 times"):
        client.check("pin-profile", PIN)
    assert len(asked) == 3


PATIENT = Retries(attempts=3, first_s=0.001, most_s=0.002, waiting_s=60.0)


def restarting(answer: dict) -> tuple[httpx.MockTransport, list[httpx.Request]]:
    """A service that restarts, then returns this answer."""
    away = [httpx.Response(502) if k % 2 else httpx.ConnectError("no") for k in range(8)]
    return answering(*away, httpx.Response(200, json=answer))


def test_waiting_outlasts_a_restart():
    transport, asked = restarting({**BATCH, "status": "ended"})
    with Client(transport=transport, retries=PATIENT) as client:
        assert client.wait_for_batch(BATCH)["status"] == "ended"
    assert len(asked) == 9

    async def waited() -> str:
        async with AsyncClient(transport=restarting(run_json())[0], retries=PATIENT) as client:
            return (await client.wait(Run(run_json("running")))).status

    assert asyncio.run(waited()) == "succeeded"


def test_results_outlast_a_restart():
    away = [httpx.RemoteProtocolError("incomplete body"), *5 * [httpx.ConnectError("no")]]

    def service() -> httpx.MockTransport:
        return answering(*away, httpx.Response(200, content=b'{"index": 0}\n'))[0]

    async def found() -> list[dict]:
        async with AsyncClient(transport=service(), retries=PATIENT) as client:
            return await client.results(BATCH)

    with Client(transport=service(), retries=PATIENT) as client:
        assert list(client.results(BATCH)) == asyncio.run(found()) == [{"index": 0}]


def test_waiting_ends_at_its_own_time():
    transport, asked = answering(*3 * [httpx.Response(503)])
    with Client(transport=transport, retries=PATIENT) as client, pytest.raises(NoAnswer, match="3 times"):
        client.wait_for_batch(BATCH, timeout_s=0.1)
    assert len(asked) == 3


def lost_once(status: str) -> httpx.MockTransport:
    """A service that loses its answer to the first DELETE of a run or a batch of this status at its end."""
    deleted = []

    def handle(request: httpx.Request) -> httpx.Response:
        if request.method == "GET":
            return httpx.Response(200, json={**BATCH, **run_json(status)})
        deleted.append(request)
        if len(deleted) == 1:
            raise httpx.ReadError("connection lost")
        return httpx.Response(409, json={"status": 409, "title": "It has ended", "detail": status})

    return httpx.MockTransport(handle)


def test_cancelling_survives_a_lost_answer():
    with Client(transport=lost_once("cancelled"), retries=QUICK) as client:
        assert client.cancel("1").status == "cancelled"
    with Client(transport=lost_once("cancelled"), retries=QUICK) as client:
        assert client.cancel_batch(BATCH)["status"] == "cancelled"
    with Client(transport=lost_once("succeeded"), retries=QUICK) as client, pytest.raises(Problem, match="409"):
        client.cancel("1")

    async def cancelled() -> tuple[str, str]:
        async with AsyncClient(transport=lost_once("cancelled"), retries=QUICK) as client:
            return (await client.cancel("1")).status, (await client.cancel_batch(BATCH))["status"]

    assert asyncio.run(cancelled()) == ("cancelled", "cancelled")


def test_rows_may_contain_any_line_separator_of_unicode():
    rows = [{"index": k, "problem": f"a{letter}b"} for k, letter in enumerate("\u2028\u2029\x85\x0b")]
    content = "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows).encode()

    def handle(_request: httpx.Request) -> httpx.Response:
        return httpx.Response(200, content=content, headers={"Content-Type": "application/x-ndjson"})

    async def found() -> list[dict]:
        async with AsyncClient(transport=httpx.MockTransport(handle)) as client:
            return await client.results(BATCH)

    with Client(transport=httpx.MockTransport(handle)) as client:
        assert list(client.results(BATCH)) == asyncio.run(found()) == rows


def test_what_cannot_be_sent_is_not_retried():
    transport, asked = answering(httpx.LocalProtocolError("Illegal header value"))
    with Client(transport=transport, retries=QUICK) as client, pytest.raises(httpx.LocalProtocolError):
        client.check("pin-profile", PIN)
    assert len(asked) == 1


def test_a_key_may_have_any_printable_characters(ours):
    first, second = (ours.check("pin-profile", PIN, key="деталь 17") for _ in range(2))
    assert first.id == second.id


@pytest.mark.parametrize("key", [" part 17 ", "a\nb", "a\tb", "\ud800"])
def test_a_key_that_no_header_can_carry_is_refused(key):
    transport, asked = answering()
    with Client(transport=transport, retries=QUICK) as client:
        for send in (client.check, lambda kind, spec, key: client.batch(kind, "check", [spec], key=key)):
            with pytest.raises(ValueError, match=r"^key: .* printable characters"):
                send("pin-profile", PIN, key=key)
    assert not asked


def test_a_redirect_is_no_answer(ours):
    with pytest.raises(Problem) as redirected:
        ours.run("")
    assert redirected.value.status == 307


def test_a_single_request_is_no_batch(tmp_path):
    transport, asked = answering()
    with Client(transport=transport) as client:
        with pytest.raises(TypeError, match="specs: is a single request"):
            client.batch("pin-profile", "check", PIN)
        with pytest.raises(ValueError, match=r"specs: .*\.csv"):
            client.batch("pin-profile", "check", tmp_path / "cases.txt")
    assert not asked


def test_a_listing_begins_at_a_cursor(ours):
    made = [ours.check("pin-profile", {**PIN, "name": "sent to be paged"}).id for _ in range(3)]
    at = ours._http.get("/api/v1/runs", params={"name": "sent to be paged", "limit": 1}).json()["next_cursor"]
    found = [line["id"] for line in ours.runs(name="sent to be paged", limit=1, cursor=at)]
    assert found == made[1::-1]


def test_a_timed_out_solve_is_not_retried():
    problem = {"status": 504, "title": "Took too long", "detail": "more than 30 s"}
    answer = httpx.Response(504, json=problem, headers={"Content-Type": "application/problem+json"})
    transport, asked = answering(answer)
    with Client(transport=transport, retries=QUICK) as client, pytest.raises(Problem, match="Took too long"):
        client.check("pin-profile", PIN)
    assert len(asked) == 1


def test_a_failed_run_is_raised():
    failed = run_json("failed", problem={"status": 500, "title": "It failed", "detail": "why"})
    transport, _ = answering(httpx.Response(200, json=failed))
    with Client(transport=transport) as client, pytest.raises(RunFailed, match="why") as raised:
        client.run("1")
    assert raised.value.run_id == "1"


def test_a_slow_export_is_waited_for(tmp_path):
    links = {"self": "", "page": "", "plots": {}, "exports": {"step": "/api/v1/runs/1/exports/step"}}
    transport, asked = answering(
        httpx.Response(200, json=run_json(links=links)),
        httpx.Response(202, headers={"Retry-After": "0"}),
        httpx.Response(200, content=b"ISO-10303-21;"),
    )
    with Client(transport=transport) as client:
        file = client.save(client.run("1"), "step", tmp_path / "pin.step", tolerance="fine")
    assert file.read_bytes() == b"ISO-10303-21;"
    assert asked[-1].url.params["tolerance"] == "fine"


def test_the_asynchronous_client_does_the_same(client):
    async def both() -> tuple[str, str, int]:
        async with AsyncClient("http://testserver", transport=httpx.ASGITransport(client.app)) as ours:
            design = KINDS["pin-profile"].example(Mode.DESIGN)
            runs = await asyncio.gather(ours.check("pin-profile", PIN), ours.design("pin-profile", design))
            listed = [line async for line in ours.runs(kind="pin-profile", limit=1, name=design.get("name"))]
            return runs[0].status, runs[1].status, len(listed)

    first, second, listed = client.portal.call(both)
    assert (first, second) == ("succeeded", "succeeded") and listed


def test_the_types_are_up_to_date():
    from scripts.client_types import FILE, types

    assert FILE.read_text(encoding="utf-8") == types(), "run python scripts/client_types.py"


def test_the_types_can_be_resolved():
    from typing import get_type_hints

    from crankwright_client import types

    assert get_type_hints(types.FlexibleRodDesignRequest)["mechanism"]


def test_the_readme_runs(ours, monkeypatch, capsys):
    text = (ROOT / "clients/python/README.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL).group(1)
    monkeypatch.setattr("crankwright_client.Client", lambda url: ours)
    exec(code, {})
    assert capsys.readouterr().out.startswith("It holds")


def test_it_does_not_import_the_service():
    script = (
        "import sys, crankwright_client; print({name.partition('.')[0] for name in sys.modules} & {'app', 'solvers'})"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'clients/python')!r}); {script}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "set()"


def test_a_batch_and_its_frame(ours, client, tmp_path):
    specs = [{**PIN, "load": {"force_n": force}} for force in (4000.0, 5000.0, -1.0)]
    batch = ours.wait_for_batch(ours.batch("pin-profile", "check", specs, name="three"), 60)
    assert (batch["status"], batch["items"]["refused"], batch["name"]) == ("ended", 1, "three")
    frame = ours.frame(batch, status="succeeded")
    assert list(frame["load.force_n"]) == [4000.0, 5000.0]
    assert [row["status"] for row in ours.results(batch)] == ["succeeded", "succeeded", "refused"]
    file = tmp_path / "cases.csv"
    file.write_text("name\nnothing else")
    assert ours.wait_for_batch(ours.batch("pin-profile", "check", file), 60)["items"]["refused"] == 1
    vary = {"load.force_n": {"values": [4000.0, 5000.0]}}
    told = {"kind": "pin-profile", "mode": "check", "base": PIN, "vary": vary}
    swept = ours.wait_for_batch(ours.sweep(told), 60)
    assert list(ours.frame(swept)["mass_g"]) == list(frame["mass_g"])
    with pytest.raises(Problem):
        ours.cancel_batch(swept)


@pytest.mark.parametrize("make", [Client, AsyncClient])
def test_a_key_may_have_white_space_around_and_is_never_shown(make):
    assert make(key=" cw_secret\r\n")._http.headers["authorization"] == "Bearer cw_secret"
    assert "authorization" not in make(key="\n")._http.headers
    for key in ("cw_sec\nret", "cw_sécret"):
        with pytest.raises(ValueError, match="allowed is printable ASCII") as refused:
            make(key=key)
        assert key not in str(refused.value)


@pytest.mark.parametrize(("value", "error"), [(float("nan"), ValueError), ({1.0}, TypeError)])
def test_a_request_that_json_cannot_carry_is_named(value, error):
    transport, asked = answering()
    with Client(transport=transport) as client, pytest.raises(error, match=r"^specs\[2\]: .* JSON"):
        client.batch("pin-profile", "check", [PIN, PIN, {**PIN, "bore_mm": value}])
    assert not asked


def test_a_file_of_another_type_is_no_batch(tmp_path):
    with Client() as client, pytest.raises(ValueError, match=r"x\.json is no batch: allowed .* sweep\(\)"):
        client.batch("pin-profile", "check", tmp_path / "x.json")


@pytest.mark.parametrize("fields", ["mass_g", ["mass_g"], ("mass_g",)])
def test_one_field_of_results_may_be_named_without_a_list(fields) -> None:
    assert wire.results({"links": {"results": "/r"}}, "ndjson", fields=fields).params["fields"] == "mass_g"
