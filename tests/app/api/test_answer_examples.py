"""The example responses of the API reference match their schemas and current results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from app.api.contract import PATHS, document
from app.designs.registry import KINDS
from app.main import create_app
from scripts.answer_examples import answers


@pytest.fixture(scope="module")
def described() -> dict[str, Any]:
    return document(create_app())


def numbers(found: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """All numbers of a result with their paths."""
    if isinstance(found, dict | list):
        for key, value in found.items() if isinstance(found, dict) else enumerate(found):
            yield from numbers(value, f"{place}/{key}")
    elif isinstance(found, float):
        yield place, found


def test_every_example_matches_its_schema_and_the_current_result(described):
    components, fresh = {"components": described["components"]}, answers()
    for slug, kind in KINDS.items():
        for mode in kind.jobs:
            shown = described["paths"][f"/api/v1/{PATHS[mode]}/{slug}"]["post"]["responses"]["201"]["content"]
            schema, example = shown["application/json"]["schema"], shown["application/json"]["example"]
            assert not list(Draft202012Validator(schema | components).iter_errors(example))
            told, found = dict(numbers(example["result"])), dict(numbers(fresh[f"{slug} {mode}"]["result"]))
            assert told.keys() == found.keys() and len(told) > 5
            greatest = max(map(abs, told.values()))
            for place, value in found.items():
                assert told[place] == pytest.approx(value, rel=1e-3, abs=1e-6 * greatest), (slug, mode, place)
