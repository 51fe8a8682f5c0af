"""Parsers under bytes of any kind: a row is a request, a refusal, or unreadable; nothing else may come of it.

    python -m tests.reliability.fuzz ndjson 100000

Guided by coverage where atheris is installed (it is no dependency of this project), else by spoiling good examples.
"""

from __future__ import annotations

import csv
import importlib.util
import inspect
import io
import json
import random
import struct
import sys
from collections.abc import Callable, Iterator
from typing import Any

from app.batches.intake import Lines, header_of
from app.batches.service import Asked, table_source
from app.designs.kind import Detail, Mode
from app.designs.many import answer_many, validated
from app.designs.registry import KINDS, example_of, job_of
from app.errors import Problem
from app.store.batch_inputs import Row, Source, UnreadableRow, packed_rows, unpacked_rows
from tests.reliability.attacks import spoiled

PIN, CRANK = KINDS["pin-profile"], KINDS["crank-dynamics"]


def _rows(data: bytes, quotes: bool) -> list[Row]:
    """The rows of bytes, which are the same however the bytes are cut, and as they come back from a block."""
    whole, cut = Lines(quotes), Lines(quotes)
    rows = [*whole.feed(data), *filter(None, [whole.end()])]
    at = len(data) // 3
    again = [*cut.feed(data[:at]), *cut.feed(data[at:]), *filter(None, [cut.end()])]
    # A byte order mark is looked for in what comes first, so it must not be cut.
    assert rows == again or data.startswith(b"\xef")
    assert not rows or unpacked_rows(packed_rows(rows), 0, len(rows)) == rows
    return rows


def _judge(source: Source, rows: list[Row]) -> int:
    """How many of the rows are requests."""
    job, understood = job_of(PIN, Mode.CHECK), 0
    for row in rows:
        try:
            body = source.body(row)
        except (UnreadableRow, RecursionError):
            continue
        request, refused = validated(job, body)
        assert (request is None) != (refused is None)
        if refused is not None and refused.problem is not None:
            json.dumps(refused.problem, allow_nan=False)
        understood += request is not None
    return understood


def ndjson(data: bytes) -> int:
    """Lines of JSON."""
    return _judge(Source("ndjson"), _rows(data, quotes=False))


def table(data: bytes) -> int:
    """Records of CSV with their header."""
    rows = _rows(data, quotes=True)
    try:
        names = header_of(rows[0]) if rows and not rows[0].unfit else ()
        source = table_source(Asked(PIN.slug, "check"), names, "csv")
    except (ValueError, csv.Error, Problem):
        return 0
    return _judge(Source.from_json(source.to_json()), rows[1:])


def indicator(data: bytes) -> int:
    """Strokes of an indicator diagram: bytes taken for floats between the good ones."""
    body = json.loads(json.dumps(_DIAGRAM))
    body["pressure"]["repair"] = len(data) % 2 == 0
    strokes = body["pressure"]["strokes"]
    for place, value in struct.iter_unpack("<Bf", data[: len(data) // 5 * 5]):
        points = strokes[place % len(strokes)]["volume_cm3" if place & 64 else "pressure_mpa"]
        at = (place >> 1) % (len(points) + 1)
        points[at : at + (place >> 7)] = [value]
    (answer,) = answer_many(CRANK.slug, Mode.ANALYSIS, [body], Detail.SCALARS)
    assert answer.status in ("succeeded", "infeasible", "refused"), answer.problem
    return answer.status == "succeeded"


def _cells(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """The dotted names of a body's values, and what is written in their cells."""
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if children is None:
        yield name, value
        return
    for step, child in children:
        yield from _cells(child, f"{name}.{step}" if name else str(step))


def _example_table() -> bytes:
    text = io.StringIO()
    header, cells = zip(*_cells(example_of(PIN, Mode.CHECK) | {"name": 'a "pin",\n'}), strict=True)
    csv.writer(text).writerows([header, *[cells] * 8])
    return text.getvalue().encode()


_DIAGRAM = example_of(CRANK, Mode.ANALYSIS)
PARSERS: dict[str, tuple[Callable[[bytes], int], bytes]] = {
    "ndjson": (ndjson, b"\n".join([json.dumps(example_of(PIN, Mode.CHECK)).encode()] * 3)),
    "csv": (table, _example_table()),
    "indicator": (indicator, struct.pack("<BfBf", 3, 0.1, 80, 30.0)),
}
"""Each with an example to begin with."""


def spoil(name: str, number: int, seed: int = 1) -> int:
    """Put that many spoiled examples through a parser; how many requests were understood."""
    parser, example = PARSERS[name]
    rng = random.Random(seed)
    return sum(parser(spoiled(rng, example)) for _ in range(number))


def main() -> None:
    name, number = sys.argv[1], int(sys.argv[2])
    if importlib.util.find_spec("atheris") is None:
        print(f"{name}: {number} spoiled examples, {spoil(name, number)} requests understood")
        return
    import atheris

    parser, example = PARSERS[name]

    def one(data: bytes) -> Any:
        # Every other one beside a good example, so that what lies deep is reached.
        parser(data if len(data) % 2 else example[: len(data) * 7 % len(example)] + data)

    for owner in (Lines, Source):
        for function in filter(inspect.isfunction, vars(owner).values()):
            atheris.instrument_func(function)
    atheris.Setup([sys.argv[0], f"-runs={number}", "-max_len=4096", "-timeout=20"], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
