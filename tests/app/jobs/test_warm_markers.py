"""A marker is valid as long as the cache files it lists exist."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.jobs import warm_markers
from solvers.rod.strip.buckling import first_root

PART = ("pin-profile", "check")


@pytest.fixture(autouse=True)
def temporary_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_markers, "_directories", lambda: (tmp_path / "nowhere" / "here", tmp_path))


def test_a_marker_is_invalid_once_a_kernel_is_missing(tmp_path: Path) -> None:
    there = [tmp_path / "a.nbi", tmp_path / "a.1.nbc"]
    for file in there:
        file.touch()
    assert not warm_markers.exists(PART)
    warm_markers.write(PART, there)
    assert warm_markers.exists(PART)
    there[1].unlink()
    assert not warm_markers.exists(PART)
    assert not warm_markers.exists(("pin-profile", "design"))


def test_a_kernel_knows_its_files() -> None:
    first_root(0.4)
    assert {file.suffix for file in first_root.files} == {".nbi", ".nbc"}
    assert all(file.name.startswith("buckling.first_root-") for file in first_root.files)


ON_ANOTHER_PROCESSOR = """
import sys
from llvmlite import binding
if sys.argv[1:]:
    binding.get_host_cpu_name = lambda: sys.argv[1]
    binding.get_host_cpu_features = binding.FeatureMap
from app.jobs import warm_markers
from solvers.rod.piston.skirt import contact_load
contact_load(1.0, 1.0)
print(warm_markers._digest(), sum(contact_load.compiled.stats.cache_misses.values()))
"""


def test_what_was_compiled_for_any_processor_is_taken_on_another(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_CPU_NAME": "generic"}
    told = [
        subprocess.run(
            [sys.executable, "-c", ON_ANOTHER_PROCESSOR, *processor],
            env=environment, check=True, capture_output=True, text=True,
        ).stdout.split()
        for processor in ([], ["x86-64"])
    ]  # fmt: skip
    (here, compiled), (elsewhere, compiled_again) = told
    assert here == elsewhere
    assert (compiled, compiled_again) == ("1", "0")


def test_what_was_compiled_for_this_processor_is_not_taken_on_another(monkeypatch: pytest.MonkeyPatch) -> None:
    here = warm_markers._digest()
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")
    assert warm_markers._digest.__wrapped__() != here
