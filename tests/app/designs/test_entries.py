"""The list of kernel signatures is up to date; outdated entries would slow the first start."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from app.designs.entries import _type, compile_entry, units_of, word_of
from app.designs.rehearsals import PARTS
from app.designs.signatures import ENTRIES, TUPLES

ROOT = Path(__file__).parents[3]


def test_the_list_matches_the_rehearsals() -> None:
    code = "from scripts.kernel_signatures import FILE, written; assert FILE.read_text() == written()"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, "run python scripts/kernel_signatures.py\n" + done.stderr[-2000:]


def test_every_kernel_has_one_signature() -> None:
    names = [name for entries in ENTRIES.values() for name, _ in entries]
    assert len(names) == len(set(names))


def test_type_abbreviations_round_trip() -> None:
    words = {word for entries in ENTRIES.values() for _, types in entries for word in types.split()} | set(TUPLES)
    assert all(word_of(_type(word), {}) == word for word in words)


def test_units_contain_every_entry_once() -> None:
    for part in PARTS:
        bundled = [entry for entries, _ in units_of(part) for entry in entries]
        assert sorted(bundled) == sorted(ENTRIES.get(part, ()))


@pytest.mark.parametrize(
    "entry",
    [("solvers.pin.ring.ovalization.no_such_kernel", "f"), ("solvers.pin.ring.ovalization.ring", "f no.Such")],
)
def test_outdated_entries_are_skipped(entry: tuple[str, str]) -> None:
    assert not compile_entry(entry)


def test_no_unit_is_most_of_a_part() -> None:
    """Two processes share a part; only what calls each other is compiled by one of them."""
    for part in (("flexible-rod", "check"), ("flexible-rod", "design"), ("pin-profile", "design")):
        units = [kernels for _, kernels in units_of(part)]
        assert max(map(len, units)) <= 0.6 * len(frozenset().union(*units))


def test_the_largest_units_are_compiled_first() -> None:
    first = [kernels for _, kernels in units_of(("flexible-rod", "check"))][:4]
    for dear in ("influences.corrected.change_with_corrections", "cycle.field_results.field_results"):
        assert any(f"solvers.rod.{dear}" in kernels for kernels in first)


def test_kernels_that_an_entry_calls_are_compiled_with_it() -> None:
    for part in PARTS:
        for entries, kernels in units_of(part):
            assert {name for name, _ in entries} <= kernels
    whole = next(kernels for entries, kernels in units_of(("crank-dynamics", "analysis")) if "whole" in entries[0][0])
    assert "solvers.crank.cycle.forces.instant" in whole
