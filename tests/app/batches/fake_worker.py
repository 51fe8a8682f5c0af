"""Fake worker that imports no solver, so that many can be started cheaply.

A row selects the behaviour: {"do": "die"} kills the worker, "hang" blocks forever, "die once" kills it unless the row's
file exists; "count" appends a letter to the file, with lookup of equal items by the row's number.
"""

from __future__ import annotations

import json
import os
import pickle
import time
from pathlib import Path

from app.batches.task import Needs, Solved, Task
from app.store.batch_inputs import Source, unpacked_rows
from app.store.batch_items import encoded, packed, sealed
from app.store.batch_records import Item

ITEM_S = 6e-4
"""Time per item [s], so that a batch outlasts the kills."""


def load(_kind: str, _mode: str) -> None:
    """No warm-up needed."""


def answer(_kind: str, _mode: str, payload: bytes, _report: object) -> Solved | Needs:
    task: Task = pickle.loads(payload)
    source, items = Source.from_json(task.source), []
    bodies = [(row, source.body(row)) for row in unpacked_rows(task.block, task.start, task.end)]
    if task.looks_up and task.known is None:
        return Needs(frozenset(), frozenset(body["x"] for _, body in bodies if "file" in body and "x" in body))
    known = dict(task.known or {})
    for index, (row, body) in enumerate(bodies, task.first):
        number = None
        if body.get("do") == "count" and body["x"] not in known:
            number = body["x"]
            with open(body["file"], "a") as file:
                file.write("x")
        if body.get("do") == "die" or (body.get("do") == "die once" and not Path(body["file"]).exists()):
            if "file" in body:
                Path(body["file"]).touch()
            os._exit(3)
        if body.get("do") == "hang":
            time.sleep(1000)
        content = encoded(json.dumps(body).encode(), {"result": {"x": index}})
        items.append(Item(index, row.line, "succeeded", None, None, packed(content, task.dictionary), number))
        if number is not None:
            known[number] = items[-1]
    time.sleep(ITEM_S * len(items))
    return Solved(sealed(task.batch, items), ITEM_S * len(items), ITEM_S * len(items))
