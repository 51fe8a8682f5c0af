"""Fuzzing of the parsers: every row must yield a request, a refusal or an unreadable row, and nothing else.

    python -m tests.reliability.fuzz ndjson 100000

Coverage-guided if atheris is installed (not a dependency of this project), else by mutation of valid examples.
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

from app.batches.service import Asked, table_source
from app.batches.splitting import Lines, Records, header_of
from app.designs.kind import Detail, Mode
from app.designs.many import answer_many, validated
from app.designs.registry import KINDS, example_of, job_of
from app.errors import Problem
from app.store.batch_inputs import Row, Source, UnreadableRow, packed_rows, unpacked_rows
from tests.reliability.attacks import spoiled

PIN, CRANK = KINDS["pin-profile"], KINDS["crank-dynamics"]


def _rows(data: bytes, splitter: type[Lines]) -> list[Row]:
    """Split bytes into rows; asserts independence of chunking and a lossless round trip through a block."""
    whole, cut = splitter(), splitter()
    rows = [*whole.feed(data), *whole.end()]
    at = len(data) // 3
    again = [*cut.feed(data[:at]), *cut.feed(data[at:]), *cut.end()]
    assert rows == again
    assert not rows or unpacked_rows(packed_rows(rows), 0, len(rows)) == rows
    return rows


def _judge(source: Source, rows: list[Row]) -> int:
    """Validate the rows; returns the number of valid requests."""
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
    """Parse NDJSON."""
    return _judge(Source("ndjson"), _rows(data, Lines))


def table(data: bytes) -> int:
    """Parse CSV with its header."""
    rows = _rows(data, Records)
    try:
        names, delimiter = header_of(rows[0]) if rows else ((), ",")
        source = table_source(Asked(PIN.slug, "check"), names, delimiter)
    except (UnreadableRow, Problem):
        return 0
    return _judge(Source.from_json(source.to_json()), rows[1:])


def indicator(data: bytes) -> int:
    """Parse indicator diagrams with bytes inserted as floats between valid points."""
    body = json.loads(json.dumps(_DIAGRAM))
    body["pressure"]["repair"] = len(data) % 2 == 0
    strokes = body["pressure"]["strokes"]
    for position, value in struct.iter_unpack("<Bf", data[: len(data) // 5 * 5]):
        points = strokes[position % len(strokes)]["volume_cm3" if position & 64 else "pressure_mpa"]
        at = (position >> 1) % (len(points) + 1)
        points[at : at + (position >> 7)] = [value]
    (answer,) = answer_many(CRANK.slug, Mode.ANALYSIS, [body], Detail.SCALARS)
    assert answer.status in ("succeeded", "infeasible", "refused"), answer.problem
    return answer.status == "succeeded"


def _cells(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """The dotted names and values of all leaves of a body."""
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
"""Parsers with their seed inputs."""


def spoil(name: str, number: int, seed: int = 1) -> int:
    """Run a parser on ``number`` mutated examples; returns the number of valid requests."""
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
        # Every other input extends a prefix of a valid example, to reach deeper code.
        parser(data if len(data) % 2 else example[: len(data) * 7 % len(example)] + data)

    for owner in (Lines, Records, Source):
        for function in filter(inspect.isfunction, vars(owner).values()):
            atheris.instrument_func(function)
    atheris.Setup([sys.argv[0], f"-runs={number}", "-max_len=4096", "-timeout=20"], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
