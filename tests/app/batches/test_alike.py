"""Rows read by a template of others give the same requests as rows read in full."""

import copy
import json

import pytest

from app.batches.alike import Alike
from app.designs.many import validated
from app.designs.registry import KINDS, job_of
from app.store.batch_inputs import Row, Source

EXAMPLES = {
    f"{slug}-{mode}: {title}": (job_of(kind, mode), body)
    for slug, kind in KINDS.items()
    for mode in kind.jobs
    if mode != "accuracy"
    for title, body in {"example": kind.example(mode), **kind.others(mode)}.items()
}
OTHER_VALUES = (-1.0, 0, 1, 2, 1e-9, 1e300, 12345678901234567890, 0.3)


def encoded(request):
    return request.__pydantic_serializer__.to_json(request, exclude={"name"})


def in_full(job, source, row):
    request, _ = validated(job, source.body(row))
    return None if request is None else (request, encoded(request))


def numbers(value, path=()):
    for name, inner in value.items():
        if isinstance(inner, dict):
            yield from numbers(inner, (*path, name))
        elif isinstance(inner, (int, float)) and not isinstance(inner, bool):
            yield (*path, name), inner


def changed(body, values):
    body = copy.deepcopy(body)
    for (*path, last), value in values.items():
        here = body
        for step in path:
            here = here[step]
        here[last] = value
    return body


def line(body):
    return Row(1, json.dumps(body).encode())


def learned(job, source, rows):
    """What reads rows like these, if all of them are valid."""
    alike = Alike(source, encoded)
    for row in rows:
        read = in_full(job, source, row)
        if read is None:
            return None
        alike.learn(row, read)
    return alike


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_number_that_varies_is_read_as_in_full(name):
    job, body = EXAMPLES[name]
    source, fitting = Source("ndjson"), 0
    for path, value in numbers(body):
        others = [value + 1e-3 * k * (abs(value) or 1.0) for k in range(1, 4)]
        alike = learned(job, source, [line(body), line(changed(body, {path: others[0]}))])
        for other in (*others, *OTHER_VALUES) if alike else ():
            row = line(changed(body, {path: other}))
            read, whole = alike.read(row), in_full(job, source, row)
            assert read is None or read == whole
            assert read is not None or whole is None or isinstance(value, int)
            fitting += read is not None
    assert fitting > 5 or not any(isinstance(value, float) for _, value in numbers(body))


def test_numbers_of_several_fields_in_every_form_of_rows():
    job, body = EXAMPLES["pin-profile-check: example"]
    paths = [path for path, value in numbers(body) if isinstance(value, float)][:3]
    columns = [".".join(path) for path in paths]
    values = [[changed_by * 1.01**k for changed_by in (1.0, 1.02, 0.99)] for k in range(6)]
    start = dict(numbers(body))
    rows = [[start[path] * factor for path, factor in zip(paths, factors, strict=True)] for factors in values]
    flat = {".".join(path): value for path, value in numbers(body)}
    texts = {k: v for k, v in body.items() if not isinstance(v, (dict, int, float))}
    forms = {
        "ndjson": (Source("ndjson"), [line(changed(body, dict(zip(paths, row, strict=True)))) for row in rows]),
        "cells": (
            Source("cells", tuple(columns), base=body, varied=tuple(columns)),
            [Row(None, json.dumps(row).encode()) for row in rows],
        ),
        "csv": (
            Source("csv", (*columns, *(n for n in flat if n not in columns)), base=texts, delimiter=";"),
            [
                Row(k, ";".join(map(repr, (*row, *(v for n, v in flat.items() if n not in columns)))).encode())
                for k, row in enumerate(rows)
            ],
        ),
    }
    for source, told in forms.values():
        alike = learned(job, source, told[:2])
        for row in told:
            assert alike.read(row) == in_full(job, source, row) is not None


def test_what_varies_may_grow():
    job, body = EXAMPLES["impact-linkage-check: example"]
    source = Source("ndjson")
    frequency, energy = ("blow_frequency_hz",), ("impact_energy_j",)
    rows = [line(changed(body, {frequency: 10.0 + k, energy: e})) for e in (1.5, 2.5) for k in range(4)]
    alike = learned(job, source, rows[:2])
    assert all(alike.read(row) for row in rows[:4]) and alike.read(rows[4]) is None
    alike.learn(rows[4], in_full(job, source, rows[4]))
    assert [alike.read(row) for row in rows] == [in_full(job, source, row) for row in rows]


@pytest.mark.parametrize(
    "texts",
    [
        ['{"name":"blow 1.5","a":1}', '{"name":"blow 2.5","a":1}'],
        ['{"name":"blow","restitution":[1.5]}', '{"name":"blow","restitution":[2.5]}'],
        ['{"name":"blow","unknown":1.5}', '{"name":"blow","unknown":2.5}'],
    ],
)
def test_texts_lists_and_unknown_fields_make_no_template(texts):
    job, body = EXAMPLES["impact-linkage-check: example"]
    request, _ = validated(job, body)
    alike = Alike(Source("ndjson"), encoded)
    for text in texts:
        alike.learn(Row(1, text.encode()), (request, encoded(request)))
    assert all(alike.read(Row(1, text.encode())) is None for text in texts)


def test_a_row_that_is_not_fit_or_fits_only_almost_is_left():
    job, body = EXAMPLES["impact-linkage-check: example"]
    source = Source("ndjson")
    texts = [json.dumps(changed(body, {("blow_frequency_hz",): f})) for f in (10.5, 11.5, 12.5)]
    alike = learned(job, source, [Row(1, text.encode()) for text in texts[:2]])
    assert alike.read(Row(1, texts[2].encode())) is not None
    assert alike.read(Row(1, texts[2].encode(), "is longer than 5 bytes")) is None
    for number in ("NaN", "Infinity", "012.5", "12.", ".5", "+12.5", "null", '"12.5"', "1e999", "12.5, 3", "true"):
        assert alike.read(Row(1, texts[2].replace("12.5", number).encode())) is None
