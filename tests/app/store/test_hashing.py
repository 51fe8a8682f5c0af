"""What each hash includes."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.store.hashing import canonical_json, canonical_spec, request_hash, row_hash, spec_hash


def test_the_spec_hash_ignores_only_formatting_order_and_name() -> None:
    reference = spec_hash("rod", "check", b'{"name":"a","x":1.50,"y":[1,2]}')
    assert reference == spec_hash("rod", "check", b'{ "y": [1, 2], "x": 1.5 }')
    others = [
        spec_hash("pin", "check", b'{"x":1.5,"y":[1,2]}'),
        spec_hash("rod", "design", b'{"x":1.5,"y":[1,2]}'),
        spec_hash("rod", "check", b'{"x":1.5,"y":[2,1]}'),
        spec_hash("rod", "check", b'{"x":1.5000000000000002,"y":[1,2]}'),
        spec_hash("rod", "check", b'{"x":1.5,"y":[1,2],"z":{"name":"b"}}'),
    ]
    assert len({reference, *others}) == 6


def test_a_canonical_spec_is_its_content_name_first_and_has_the_hash_of_its_json() -> None:
    content = {"x": 1e-7, "name": "ä", "a": {"z": -0.0, "b": [1, 2.5, None, True]}, "y": 10**20}
    spec, digest = canonical_spec("rod", "check", content)
    assert json.loads(spec) == content
    assert spec.startswith(b'{"name":')
    meaning = {name: value for name, value in content.items() if name != "name"}
    assert digest == hashlib.sha256(canonical_json(["rod", "check", meaning])).hexdigest()
    assert digest == spec_hash("rod", "check", spec)


def test_known_digests_do_not_change() -> None:
    """Stored hashes must remain valid: these digests are from sha256sum over the documented bytes."""
    assert spec_hash("rod", "check", b'{"x":1.5}') == "409a00edec9cb5d15b9723605db9d1171df6810b15ff8e03326c131c441c7c79"
    assert (
        row_hash("runs", {"id": "a", "cached": True, "result": None, "spec": b"{}"})
        == "d76911e3d92fbe99430993ba3519541edc75b68be9aa313766eadd5b7af37cc0"
    )


def test_bytes_that_move_between_parts_change_the_hash() -> None:
    assert request_hash("POST", "/a", b"bc") != request_hash("POST", "/ab", b"c")
    assert row_hash("t", {"a": "x", "b": "yz"}) != row_hash("t", {"a": "xy", "b": "z"})
    assert row_hash("t", {"a": "1"}) != row_hash("t", {"a": 1})
    assert row_hash("t", {"a": b"1"}) != row_hash("t", {"a": "1"})
    assert row_hash("t", {"a": "1"}) != row_hash("u", {"a": "1"})


def test_a_new_null_column_keeps_the_hash_and_a_cleared_one_does_not() -> None:
    row = {"a": "x", "time": datetime(2026, 1, 2, tzinfo=UTC)}
    assert row_hash("t", row) == row_hash("t", {**row, "later": None})
    assert row_hash("t", row) != row_hash("t", {**row, "a": None})


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {"a": [float("-inf")]}])
def test_values_without_json_are_refused(value: object) -> None:
    with pytest.raises(ValueError):
        canonical_json(value)


@settings(deadline=None, max_examples=50)
@given(
    st.dictionaries(st.sampled_from("abc"), st.text(max_size=4) | st.binary(max_size=4) | st.integers() | st.booleans())
)
def test_different_rows_have_different_hashes(row: dict) -> None:
    changed = {**row, "a": str(row.get("a")) + "!"}
    assert row_hash("t", row) != row_hash("t", changed)
