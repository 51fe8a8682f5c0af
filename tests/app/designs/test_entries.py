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
        bundled = [entry for unit in units_of(part) for entry in unit]
        assert sorted(bundled) == sorted(ENTRIES.get(part, ()))


@pytest.mark.parametrize(
    "entry",
    [("solvers.pin.ring.ovalization.no_such_kernel", "f"), ("solvers.pin.ring.ovalization.ring", "f no.Such")],
)
def test_outdated_entries_are_skipped(entry: tuple[str, str]) -> None:
    assert not compile_entry(entry)


def test_the_largest_units_are_compiled_first() -> None:
    first = units_of(("flexible-rod", "design"))[:3]
    rooms = [{name.rpartition(".")[0] for name, _ in unit} for unit in first]
    for dear in ("linear_check", "effect_bounds.corrected", "optimum.proof.branch_and_bound"):
        assert sum(f"solvers.rod.{dear}" in room for room in rooms) == 1


def test_modules_that_a_module_uses_are_compiled_with_it() -> None:
    units = [{name.rpartition(".")[0] for name, _ in unit} for unit in units_of(("crank-dynamics", "analysis"))]
    whole = next(unit for unit in units if "solvers.crank.whole_cycle" in unit)
    assert {"solvers.crank.cycle.worst_instants", "solvers.crank.cycle.forces"} <= whole
