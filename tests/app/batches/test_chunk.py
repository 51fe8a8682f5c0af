"""Chunk processing in a worker: equal items answered in other chunks are not solved again."""

from __future__ import annotations

import json
import pickle
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from app.batches import chunk as chunks
from app.batches.task import Needs, Task
from app.designs.many import answers_of
from app.designs.progress import ignore_progress
from app.designs.registry import KINDS
from app.store.batch_inputs import Row, Source, packed_rows
from app.store.batch_items import ITEM_COLUMNS, joined, parts_json, unpacked, unsealed
from app.store.batch_records import Item

SLUG, MODE, DICTIONARY = "pin-profile", "check", b"what items resemble"


def task(bodies: Sequence[dict[str, Any]]) -> Task:
    block = packed_rows([Row(k + 1, json.dumps(body).encode()) for k, body in enumerate(bodies)])
    return Task(1, Source("ndjson").to_json(), block, 0, len(bodies), 0, "scalars", DICTIONARY, 30.0, looks_up=True)


def solved(asked: Task) -> list[Item] | Needs:
    found = chunks.answer(SLUG, MODE, pickle.dumps(asked), ignore_progress)
    if isinstance(found, Needs):
        return found
    rows = [dict(zip(ITEM_COLUMNS, row, strict=True)) for row in unsealed(found.items)]
    return [Item(**{name: row[name] for name in Item._fields}) for row in rows]


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Number of requests solved per call, with the worker's cache disabled."""
    counted: list[int] = []

    def counting(slug: str, mode: Any, requests: Sequence[Any], detail: Any) -> Any:
        counted.append(len(requests))
        return answers_of(slug, mode, requests, detail)

    monkeypatch.setattr(chunks, "answers_of", counting)
    monkeypatch.setattr(chunks, "_MAX_CACHED_ANSWERS", 0)
    return counted


def test_answers_of_other_chunks_are_reused(solves: list[int]) -> None:
    body = KINDS[SLUG].example(MODE)
    other = {**body, "load": {"force_n": 1234.5}}
    first = task([body])
    asks = solved(first)
    assert isinstance(asks, Needs) and len(asks.asked) == 1 and solves == []
    told = solved(replace(first, known={}))
    assert isinstance(told, list) and {told[0].asked} == asks.asked

    later = task([{**body, "name": "again"}, other, {**other, "name": "twice"}])
    known = {told[0].asked: told[0]}
    again = solved(replace(later, known=known))
    assert isinstance(again, list) and solves == [1, 1]
    parts = [unpacked(item.content, DICTIONARY) for item in [*told, *again]]
    assert [part.get("cached", False) for part in parts] == [False, True, False, True]
    assert [part["spec"]["name"] for part in parts] == [body["name"], "again", body["name"], "twice"]
    assert [parts[1][name] for name in ("result", "verdict", "effects")] == [
        parts[0][name] for name in ("result", "verdict", "effects")
    ]
    assert again[0].figure == told[0].figure and again[0].holds == told[0].holds

    # A request number collision is not a match.
    mistaken = solved(replace(task([other]), known={again[1].asked: told[0]}))
    assert isinstance(mistaken, list) and solves == [1, 1, 1]
    stress = unpacked(mistaken[0].content, DICTIONARY)["result"]["equivalent_stress_max_mpa"]
    assert stress == parts[2]["result"]["equivalent_stress_max_mpa"] != parts[0]["result"]["equivalent_stress_max_mpa"]


def test_a_non_finite_number_fails_only_its_item(monkeypatch: pytest.MonkeyPatch) -> None:
    """The text NaN in a name is allowed."""

    def with_nan(slug: str, mode: Any, requests: Sequence[Any], detail: Any) -> Any:
        answers = list(answers_of(slug, mode, requests, detail))
        answers[0].result["mass_g"] = float("nan")
        answers[1].result["warnings"].append("NaN and Infinity are words")
        return answers

    monkeypatch.setattr(chunks, "answers_of", with_nan)
    monkeypatch.setattr(chunks, "_MAX_CACHED_ANSWERS", 0)
    body = KINDS[SLUG].example(MODE)
    bodies = [{**body, "load": {"force_n": 1000.0 + k}} for k in range(2)]
    told = solved(replace(task(bodies), known={}))
    assert isinstance(told, list) and [item.status for item in told] == ["failed", "succeeded"]


@pytest.mark.parametrize("spec", [None, b'{"x":1}'])
@pytest.mark.parametrize("parts", [{}, {"result": {"y": 2.5}}])
@pytest.mark.parametrize("cached", [False, True])
def test_the_json_of_an_item_is_joined_from_its_parts(spec: bytes | None, parts: dict[str, Any], cached: bool) -> None:
    found = json.loads(joined(spec, parts_json(parts), cached))
    assert found == {**({} if spec is None else {"spec": {"x": 1}}), **parts, **({"cached": True} if cached else {})}


def test_a_refused_row_keeps_its_cells_beside_a_number_that_is_not_finite() -> None:
    block = packed_rows([Row(2, b"a pin,1e999,9")])
    source = Source("csv", columns=("name", "load.force_n", "bore_mm"), texts=frozenset({"name"}))
    (item,) = solved(replace(task([]), source=source.to_json(), block=block, end=1))
    assert item.status == "refused"
    spec = unpacked(item.content, DICTIONARY)["spec"]
    assert spec == {"name": "a pin", "load": {"force_n": "Infinity"}, "bore_mm": 9}
